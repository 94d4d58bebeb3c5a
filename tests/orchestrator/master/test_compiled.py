"""The compiled step loop gives the bits of the loop in Python, fails as that does, and survives what it is given."""

import json
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from railcosim.fmus.build import native_problem, resolve
from railcosim.orchestrator import load
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.fmi.slave import STATUS
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.compiled import CompiledLoop
from railcosim.orchestrator.master.loop import Master
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.run.results import Results
from railcosim.orchestrator.system import Event, System

MASTER = Path(__file__).parents[3] / "orchestrator" / "master"
FOREIGN = Path(__file__).parents[1] / "foreign"
GCC = shutil.which("gcc")
pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(GCC is None, reason="FMUs by hand need gcc"),
]
ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture
def used(monkeypatch):
    """How many blocks the kernel took."""
    kernel, calls = compiled.kernel, []

    def counted(*arguments):
        calls.append(arguments)
        return kernel.run(*arguments)

    monkeypatch.setattr(compiled, "kernel", SimpleNamespace(run=counted, HAS_THREADS=compiled.kernel.HAS_THREADS))
    return calls


@pytest.fixture
def both(monkeypatch, used):
    """Run a system twice, compiled and in Python; gives the first result when the two are the same to the bit."""

    def go(system, **how):
        fast = attempt(system, **how)
        assert used, "the kernel was not used"
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            slow = attempt(system, **how)
        assert described(fast.error) == described(slow.error)
        assert fast.status == slow.status
        assert contents(fast) == contents(slow)
        return fast

    return go


def attempt(system, **how):
    try:
        return run(system, **how)
    except FmuError as error:
        return error.run


def described(error):
    return error and (str(error), error.instance, error.time, error.status, error.log)


def contents(result):
    return [("time", result.time.tobytes()), *((name, result[name].tobytes()) for name in result.names())]


def ring(model, count, stop=10.0, **how):
    """Instances in a ring, in every type an FMU of odd.c has."""
    system = System(**{"stop_time": stop, "step": 0.25, "algorithm": "jacobi"} | how)
    for k in range(count):
        system.add(f"odd[{k}]", model)
    for k in range(count):
        before, own = f"odd[{k - 1 if k else count - 1}]", f"odd[{k}]"
        system.connect(f"{before}.x", f"{own}.u", offset=1.0 + 0.1 * k)
        system.connect(f"{before}.n", f"{own}.m", delay=1)
        system.connect(f"{before}.off", f"{own}.on")
    return system


# -------------------------------------------------------------------- the same bits


def native():
    problem = native_problem(resolve("PointMassTrain"))
    return pytest.param("native", marks=pytest.mark.skipif(bool(problem), reason=problem or "never"))


@ALGORITHMS
@pytest.mark.parametrize("kind", [native(), pytest.param("python", marks=pytest.mark.long)])
def test_a_whole_scenario(both, used, algorithm, kind):
    """350 s of the comfort scenario: real inputs one by one and side by side, a schedule, a gust, booleans."""
    result = both(load("comfort_cruise"), kind=kind, algorithm=algorithm)
    assert result.status == "completed"
    assert len(result.time) == 3501
    assert len(used) > 1


@ALGORITHMS
@pytest.mark.parametrize("delay", [0, 1, 2, 3, 7])
def test_delays_and_conversions(both, mine, odd, algorithm, delay):
    """Of feed-through and other outputs; and past the end of the run, where the first value is all there is."""
    system = System(stop_time=2.0, step=0.25, algorithm=algorithm)
    system.add("a", odd, u=3.0, v=1.0)
    system.add("b", odd, m=5, on=True)
    system.add("lag", mine("Lag"))
    system.connect("a.x", "b.u", delay=delay, scale=-0.1, offset=1 / 3)
    system.connect("a.y", "b.v", delay=delay)
    system.connect("b.n", "a.m", delay=delay)
    system.connect("b.off", "a.on", delay=delay)
    system.connect("a.off", "b.on", delay=1)
    system.connect("b.x", "a.u", scale=1e-3)
    system.connect("b.n", "a.v", delay=2 * delay, offset=0.1)
    system.connect("b.y", "lag.u", delay=delay, offset=-0.7)
    result = both(system, kind="python")
    assert len(set(result["a.x"])) > 5
    assert set(result["b.off"]) == {0.0, 1.0}


@ALGORITHMS
def test_whole_numbers_and_truths(both, odd, algorithm):
    result = both(ring(odd, 5, algorithm=algorithm))
    assert result["odd[2].n"][-1] >= 20
    assert set(result["odd[2].off"]) == {0.0, 1.0}
    assert result["odd[2].n"].dtype == np.float64


@ALGORITHMS
def test_units(both, components, algorithm):
    body = "class Far(Base):\n    d = Memory('km', 2.1, output=True)\n    t = Memory('degC', 20.3, output=True)\n"
    body += "    def update(self):\n        return {'d': 1.1 * self.d, 't': 0.9 * self.t}\n\n\n"
    body += "class Near(Base):\n    d = Input('m')\n    t = Input('K')\n    y = Output('m')\n"
    body += "    def outputs(self):\n        return {'y': self.d + self.t}\n"
    reference = components(body, "units.py")
    system = System(stop_time=5.0, step=0.1, algorithm=algorithm)
    system.add("far", reference("Far"))
    system.add("near", reference("Near"))
    system.connect("far.d", "near.d", scale=0.3, offset=-0.2)
    system.connect("far.t", "near.t")
    result = both(system, kind="python")
    assert result["near.y"][0] == pytest.approx(0.3 * 2100.0 - 0.2 + 293.45)


@pytest.mark.parametrize("record", [0.25, 0.75, 1.0, 3.0, 100.0])
@pytest.mark.parametrize("stop", [10.0, 0.25])
def test_recorded_points(both, odd, record, stop, monkeypatch):
    """Every so many, and the last; also where a block may hold one row only."""
    monkeypatch.setattr(compiled, "_MOST_VALUES", 1)
    result = both(ring(odd, 2, stop, record=record if record <= stop else stop))
    every = round(min(record, stop) / 0.25)
    assert list(result.time) == [
        k * 0.25 for k in sorted({*range(0, round(stop / 0.25) + 1, every), round(stop / 0.25)})
    ]


def test_native_and_python_models_together(both, mine, odd):
    """A Python FMU takes the interpreter's lock again inside the loop; it does so hundreds of thousands of times."""
    system = System(stop_time=300.0, step=0.01, record=100.0)
    system.add("odd", odd, v=1.0)
    system.add("lag", mine("Lag"))
    system.connect("lag.x", "odd.u")
    system.connect("odd.y", "lag.u")
    result = both(system, kind="python")
    assert result.status == "completed"
    assert result.seconds["stepping"] < 20.0


@pytest.mark.parametrize("start", [0.0, -3.7, 1e6])
def test_time(both, odd, start):
    system = ring(odd, 2)
    system.start_time, system.stop_time = start, start + 10.0
    result = both(system)
    assert np.array_equal(result.time, start + np.arange(41) * 0.25)


def test_many_instances_share_one_library(both, odd):
    """More than the file descriptors a process has; each with values of its own."""
    result = both(ring(odd, 1500, 1.0))
    assert len({result[f"odd[{k}].x"][-1] for k in range(1500)}) > 1400


def test_an_fmu_without_variables(both, compile_c, xml, tmp_path):
    files = {
        "modelDescription.xml": xml["description"]([], identifier="Odd"),
        f"binaries/{fmpy.platform}/Odd{fmpy.sharedLibraryExtension}": compile_c("odd.c"),
    }
    system = System(stop_time=1.0, step=0.25)
    system.add("mute", str(xml["write_archive"](tmp_path / "mute.fmu", files)))
    assert list(both(system).time) == [0.0, 0.25, 0.5, 0.75, 1.0]


# -------------------------------------------------------------------- who takes which loop


def test_texts_are_for_python(used, mine):
    system = System(stop_time=1.0, step=0.1)
    system.add("worded", mine("Types"))
    assert run(system, kind="python")["worded.said"][-1] == "b"
    assert not used


def test_components_in_this_process_are_for_python(used, mine):
    system = System(stop_time=1.0, step=0.1)
    system.add("lag", mine("Lag"))
    run(system, kind="plain")
    assert not used


WITHOUT = """
import hashlib, os, sys
if sys.argv[2] == "without":
    sys.modules["railcosim.orchestrator.master.kernel"] = None
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Event, System
assert (compiled.kernel is None) == (sys.argv[2] == "without")
system = System(stop_time=9.0, step=0.25)
system.add("a", sys.argv[1], u=1.5)
system.add("b", sys.argv[1], v=0.5)
system.connect("a.y", "b.u")
system.connect("b.y", "a.u")
result = run(system)
print(hashlib.sha256(b"".join(result[name].tobytes() for name in result.names())).hexdigest())
"""


def test_without_the_extension_the_results_are_the_same(odd):
    found = {
        subprocess.run([sys.executable, "-c", WITHOUT, odd, how], check=True, capture_output=True).stdout
        for how in ("with", "without")
    }
    assert len(found) == 1
    assert len(found.pop().strip()) == 64


# -------------------------------------------------------------------- failures


def failing(model, mode, algorithm):
    system = ring(model, 3, algorithm=algorithm)
    system.instances["odd[1]"].start["mode"] = mode
    return system


@ALGORITHMS
@pytest.mark.parametrize("status", [2, 3, 4, 5, 9])
@pytest.mark.parametrize("call", ["step", "get", "set"])
def test_a_failing_call(both, odd, algorithm, status, call):
    """Instance, time, status, what the FMU said and what was recorded are those of the loop in Python."""
    mode = {"step": 0, "get": 20, "set": 30}[call] + status
    result = both(failing(odd, mode, algorithm))
    error = result.error
    assert (result.status, error.instance) == ("failed", "odd[1]")
    assert error.time == 5.0
    shown = -1 if (status, call) == (9, "step") else status
    assert error.status == (STATUS[shown] if 0 <= shown < len(STATUS) else f"{shown} (unknown)")
    assert [line.partition("] ")[2] for line in error.log] == [f"odd[1] does as it was told: {shown}"]
    assert list(result.time) == [k * 0.25 for k in range(20 if call == "get" else 21)]


def test_a_warning_is_no_failure(both, odd):
    for mode in (1, 21, 31):
        assert both(failing(odd, mode, "jacobi")).status == "completed"


@ALGORITHMS
@pytest.mark.parametrize(("mode", "name"), [(10, "nan"), (11, "inf"), (12, "-inf")])
def test_a_value_that_is_no_number(both, odd, algorithm, mode, name):
    """A row that holds one is never recorded, and nobody else is given it."""
    result = both(failing(odd, mode, algorithm))
    assert str(result.error) == f"odd[1], t = 5 s: output 'y' is {name}"
    assert result.time[-1] == 4.75


@pytest.mark.parametrize("kind", [native(), "python"])
@ALGORITHMS
def test_a_component_that_fails(both, mine, kind, algorithm):
    system = System(stop_time=10.0, step=0.1, algorithm=algorithm)
    system.add("lag", mine("Lag"))
    system.add("bad", mine("Fails"))
    system.connect("lag.x", "bad.u")
    system.connect("bad.y", "lag.u")
    result = both(system, kind=kind)
    assert result.error.instance == "bad"
    assert 4.9 <= result.error.time <= 5.1
    assert result.error.status in ("fatal" if kind == "python" else "error",)
    assert len(result.error.log) > 0


def test_after_a_run_every_instance_knows_the_time(workspace, odd):
    """A model that fails when it is terminated does so at the time reached."""
    master = instantiated(ring(odd, 2, 1.0), workspace)
    assert master.run(0.0, 0.25, 4, 1, lambda *_: True)
    assert [slave.time for slave in master.slaves.values()] == [1.0, 1.0]


# -------------------------------------------------------------------- blocks


def instantiated(system, workspace):
    checked = check(system, workspace)
    slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
    master = Master(slaves, checked.order.sequence, checked.wiring.links, checked.wiring.starts, system.algorithm)
    master.initialize(system.start_time, 1e9)
    return master


def test_an_observer_ends_a_run_between_blocks(workspace, odd):
    master, seen = instantiated(ring(odd, 2), workspace), []
    assert not master.run(0.0, 0.25, 10_000_000, 1, lambda k, rows: seen.append((k, len(rows))) or len(seen) < 4)
    assert seen[0] == (1, 1)
    assert sum(count for _, count in seen) == seen[-1][0] == master.steps < 10_000_000
    assert not master.run(0.0, 0.25, 1, 1, lambda *_: False), "not even at the last step"


def test_blocks_are_short_in_time(workspace, odd):
    """So that a progress bar moves and Ctrl-C is heeded; and long enough that Python costs nothing."""
    master, ends = instantiated(ring(odd, 100), workspace), [time.perf_counter()]
    master.run(0.0, 0.25, 10_000_000, 10, lambda *_: ends.append(time.perf_counter()) or ends[-1] - ends[0] < 1.0)
    lengths = np.diff(ends)
    assert lengths.max() < 0.5
    assert np.median(lengths[3:]) > 0.01


ENDLESS = """
import sys
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Event, System
system = System(stop_time=1e9, step=0.25, record=25.0)
system.add("a", sys.argv[1], u=1.5)
system.add("b", sys.argv[1], v=0.5)
system.connect("a.y", "b.u")
print(run(system, output=sys.argv[2]).status)
"""


def test_ctrl_c_and_kill(odd, tmp_path):
    """Ctrl-C ends the run at a recorded point; after a kill the rows are there up to about a second before."""
    for ending in (signal.SIGINT, signal.SIGKILL):
        out = tmp_path / ending.name
        with subprocess.Popen([sys.executable, "-c", ENDLESS, odd, out], stdout=subprocess.PIPE, text=True) as process:
            while not (out / "results.bin").exists() or (out / "results.bin").stat().st_size < 5000:
                assert process.poll() is None
                time.sleep(0.02)
            process.send_signal(ending)
            said, _ = process.communicate(timeout=60)
        assert said.strip() == ("interrupted" if ending == signal.SIGINT else "")
        loaded = Results.load(out)
        assert not loaded.completed
        assert len(loaded) > 100
        whole = loaded.time[:-1] if ending == signal.SIGINT else loaded.time
        assert np.array_equal(whole, np.arange(len(whole)) * 25.0)
        assert (out / "results.csv").exists() == (ending == signal.SIGINT)
        if ending == signal.SIGINT:
            assert json.loads((out / "run.json").read_text())["time_reached"] == loaded.time[-1]


# -------------------------------------------------------------------- threads


THREADS = pytest.mark.skipif(not getattr(compiled.kernel, "HAS_THREADS", 0), reason="no threads here")


@THREADS
@pytest.mark.parametrize("threads", [2, 3, 5, 64])
def test_threads_give_the_same_bits(both, used, odd, threads):
    """Also with instances that step at their own rate, delays, and events; more threads than instances are not had."""
    system = ring(odd, 7, algorithm="jacobi")
    system.instances["odd[3]"].step = 0.5
    system.instances["odd[4]"].step = 2.5
    system.events = [
        Event("odd[2].x", "bias", at=2.0, value=0.5, duration=3.0),
        Event("odd[5].u", "ramp", at=1.0, rate=0.1),
        Event("odd[1].off", "override", at=4.0, value=True),
    ]
    alone = contents(run(system))
    used.clear()
    assert contents(both(system, threads=threads)) == alone
    parts = [len(arguments[1]) for arguments in used]
    assert set(parts) == {2 * min(threads, 7)}


@THREADS
@pytest.mark.parametrize("mode", [3, 4, 10, 23, 33])
def test_of_several_threads_that_fail_the_first_is_told(both, odd, mode):
    """As it would be without threads: the first instance of those whose call comes first."""
    system = ring(odd, 6, algorithm="jacobi")
    for k in (2, 3, 5):
        system.instances[f"odd[{k}]"].start["mode"] = mode
    assert both(system, threads=3).error.instance == "odd[2]"
    system.instances["odd[5]"].start["mode"] = 33  # it is set before anyone is stepped, a step after others are read
    assert both(system, threads=3).error.instance == ("odd[5]" if mode in (3, 4) else "odd[2]")


@THREADS
def test_gauss_seidel_has_nothing_to_share(both, used, odd):
    both(ring(odd, 4, algorithm="gauss-seidel"), threads=2)
    assert {len(arguments[1]) for arguments in used} == {1}


# -------------------------------------------------------------------- what the kernel is given


NAMES = (
    "operations parts channels instances entries references changes values history newest rows every start step first "
    "count last begin"
)


@pytest.fixture
def arguments(workspace, odd):
    """What the kernel is called with for a ring, by name."""
    master = instantiated(ring(odd, 3), workspace)
    plan = [array.copy() for array in CompiledLoop(master)._plan]
    values = np.array(master.values)
    changes = np.zeros(1, compiled._CHANGES)
    rows = np.empty((8, len(values) + 1))
    given = [*plan, changes, values, np.tile(values, (2, 1)), 1, rows, 1, 0.0, 0.25, 0, 4, 4, 0]
    yield dict(zip(NAMES.split(), given, strict=True))
    for slave in master.slaves.values():
        slave.free()


def call(arguments, **changed):
    return compiled.kernel.run(*(arguments | changed).values())


def test_a_sound_plan(arguments):
    assert call(arguments) == (4, 4, -1, 0, 1)
    assert list(arguments["rows"][:4, 0]) == [0.25, 0.5, 0.75, 1.0]
    assert call(arguments, count=0) == (0, 0, -1, 0, 1)


def test_a_block_ends_where_there_is_no_room_for_a_row(arguments):
    assert call(arguments, rows=arguments["rows"][:2])[:2] == (2, 2)
    assert call(arguments, rows=arguments["rows"][:0])[:2] == (0, 0)
    assert call(arguments, rows=arguments["rows"][:1], every=3, last=100)[:2] == (4, 1)
    assert call(arguments, rows=arguments["rows"][:1], every=3, last=100, count=9)[:2] == (5, 1)
    assert call(arguments, rows=arguments["rows"][:0], every=100, last=100)[:2] == (4, 0)


def changed(array, field, value, at=0):
    result = array.copy()
    result[field][at] = value
    return result


WRONG = {
    "a place beyond the values": lambda a: {"entries": changed(a["entries"], "place", 10**6)},
    "a negative place": lambda a: {"entries": changed(a["entries"], "place", -1)},
    "outputs that are not side by side": lambda a: {"entries": changed(a["entries"], "place", 0, 10)},
    "an age beyond the history": lambda a: {"entries": changed(a["entries"], "age", 2)},
    "a huge age": lambda a: {"entries": changed(a["entries"], "age", 2**62)},
    "a negative age": lambda a: {"entries": changed(a["entries"], "age", -2)},
    "a history that is not there": lambda a: {"history": np.empty((0, len(a["values"]))), "newest": 0},
    "half a row of history": lambda a: {"history": a["history"].ravel()[:-1]},
    "a newest row beyond the history": lambda a: {"newest": 2},
    "a negative newest row": lambda a: {"newest": -1},
    "a channel that begins nowhere": lambda a: {"channels": changed(a["channels"], "begin", -1)},
    "a channel that begins too late": lambda a: {"channels": changed(a["channels"], "begin", 10**6)},
    "a channel that is too long": lambda a: {"channels": changed(a["channels"], "count", 2**62)},
    "a channel of negative length": lambda a: {"channels": changed(a["channels"], "count", -1)},
    "a channel without function": lambda a: {"channels": changed(a["channels"], "function", 0)},
    "a step without function": lambda a: {"instances": changed(a["instances"], "function", 0)},
    "an unknown operation": lambda a: {"operations": changed(a["operations"], "kind", 4)},
    "an unknown change": lambda a: {"entries": changed(a["entries"], "change", 1)},
    "a negative change": lambda a: {"entries": changed(a["entries"], "change", -2)},
    "a change beyond the changes": lambda a: {
        "operations": changed(changed(a["operations"], "kind", 3), "index", 1),
    },
    "a change of no value": lambda a: {
        "operations": changed(changed(a["operations"], "kind", 3), "index", 0),
        "changes": changed(a["changes"], "place", 10**6),
    },
    "an operation that is never due": lambda a: {"operations": changed(a["operations"], "period", 0)},
    "a phase beyond the period": lambda a: {"operations": changed(a["operations"], "phase", 1)},
    "a negative phase": lambda a: {"operations": changed(a["operations"], "phase", -1)},
    "no parts": lambda a: {"parts": a["parts"][:0]},
    "parts that do not end with the operations": lambda a: {"parts": a["parts"] - 1},
    "parts that go back": lambda a: {"parts": np.array([3, 2, 3, len(a["operations"])])},
    "an odd number of parts": lambda a: {"parts": np.array([1, 2, len(a["operations"])])},
    "a negative part": lambda a: {"parts": np.array([-1, 2, 3, len(a["operations"])])},
    "a begin before the first operation": lambda a: {"begin": -1},
    "a negative operation": lambda a: {"operations": changed(a["operations"], "kind", -1)},
    "an unknown channel": lambda a: {"operations": changed(a["operations"], "index", 10**6)},
    "a negative channel": lambda a: {"operations": changed(a["operations"], "index", -1)},
    "fewer references than entries": lambda a: {"references": a["references"][:-1]},
    "half an entry": lambda a: {"entries": np.frombuffer(a["entries"].tobytes()[:-8], np.uint8)},
    "values that are not aligned": lambda a: {"values": np.zeros(801, np.uint8)[1:]},
    "rows of nothing": lambda a: {"every": 0},
    "a negative number of rows": lambda a: {"every": -1},
    "a negative step number": lambda a: {"first": -1},
    "a negative number of steps": lambda a: {"count": -1},
    "steps beyond all numbers": lambda a: {"first": 2**62, "count": 2**63 - 1},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_plan_that_is_not_sound_is_refused(arguments, wrong):
    with pytest.raises(ValueError, match=r"^kernel: "):
        call(arguments, **WRONG[wrong](arguments))


def test_what_is_not_an_array_is_refused(arguments):
    frozen = arguments["values"].copy()
    frozen.flags.writeable = False
    for wrong in (None, [1.0], "now", b"12345678", frozen, np.zeros(200)[::2]):
        with pytest.raises(TypeError):
            call(arguments, values=wrong)
    with pytest.raises(TypeError):
        call(arguments, start="now")
    with pytest.raises(OverflowError):
        call(arguments, count=2**64)


# -------------------------------------------------------------------- the compiler's and the sanitizers' word


def compile_kernel(target, *flags):
    command = [GCC, "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-ffp-contract=off", "-shared", "-fPIC"]
    sources = [MASTER / name for name in ("kernel.c", "stepping.c", "team.c")]
    command += [f"-I{sysconfig.get_paths()['include']}", *flags, *sources, "-o", target]
    subprocess.run(command, check=True)
    return target


@pytest.mark.parametrize("flags", [["-O2"], ["-O3", "-std=c11"]])
def test_the_compiler_has_nothing_to_say(tmp_path, flags):
    compile_kernel(tmp_path / "kernel.so", *flags)


SANITIZERS = {
    ("address", "undefined"): (
        "not sanitized and not compiler and not ctrl_c and not without_the_extension and not short_in_time"
    ),
    ("thread",): "threads_give or several_threads",
}
"""Which of this file's tests run under which sanitizers."""


@pytest.mark.long
@pytest.mark.parametrize("sanitizers", SANITIZERS, ids="+".join)
def test_sanitized(tmp_path, sanitizers):
    """This file's tests under the compiler's sanitizers, the FMU by hand included."""
    flags = "-g", "-O1", f"-fsanitize={','.join(sanitizers)}", "-fno-sanitize-recover"
    library = compile_kernel(tmp_path / "kernel.so", *flags)
    (tmp_path / "sanitized.py").write_text(SANITIZED)
    preload = [
        subprocess.run(
            [GCC, f"-print-file-name=lib{name}.so"], check=True, capture_output=True, text=True
        ).stdout.strip()
        for name in (f"{sanitizer[0] if sanitizer != 'undefined' else 'ub'}san" for sanitizer in sanitizers)
    ]
    chosen = SANITIZERS[sanitizers]
    command = [sys.executable, "-m", "pytest", "-p", "sanitized", "-p", "no:cacheprovider", "-n", "0", "-k", chosen]
    environment = os.environ | {
        "KERNEL": str(library),
        "PYTHONPATH": str(tmp_path),
        "LD_PRELOAD": ":".join(preload),
        "ASAN_OPTIONS": "detect_leaks=0",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "PYTHONMALLOC": "malloc",
    }
    done = subprocess.run(
        [*command, Path(__file__).resolve()],
        env=environment,
        check=False,
        capture_output=True,
        text=True,
        cwd=FOREIGN.parents[2],
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert "passed" in done.stdout
    assert "WARNING: ThreadSanitizer" not in done.stderr + done.stdout
    assert "runtime error" not in done.stderr + done.stdout


SANITIZED = """
import importlib.util, os, sys
spec = importlib.util.spec_from_file_location("railcosim.orchestrator.master.kernel", os.environ["KERNEL"])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
sys.modules["railcosim.orchestrator.master.kernel"] = module


def pytest_sessionfinish():
    from railcosim.orchestrator.master import compiled
    assert compiled.kernel is module
"""
