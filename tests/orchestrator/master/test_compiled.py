"""The compiled step loop: the same bits as the one in Python, who takes which, and what fails."""

import shutil
import subprocess
import sys

import fmpy
import numpy as np
import pytest
from railcosim.fmus.build import native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import load
from railcosim.orchestrator.fmi.slave import STATUS
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Connection, Event, System

GCC = shutil.which("gcc")
pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(GCC is None, reason="FMUs by hand need gcc"),
]
ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


# -------------------------------------------------------------------- the same bits


def native():
    problem = native_problem(resolve("PointMassTrain"))
    return pytest.param("native", marks=pytest.mark.skipif(bool(problem), reason=problem or "never"))


@ALGORITHMS
@pytest.mark.parametrize("kind", [native(), pytest.param("python", marks=pytest.mark.long)])
def test_a_whole_scenario(both, used, algorithm, kind):
    """The comfort scenario in short: real inputs one by one and side by side, a schedule, a gust, booleans."""
    gust = ["gust.start_time=40", "gust.stop_time=60"]
    result = both(load("comfort_cruise", stop_time=100.0, settings=gust), kind=kind, algorithm=algorithm)
    assert result.status == "completed"
    assert len(result.time) == 1001
    assert len(used) > 1


@ALGORITHMS
@pytest.mark.parametrize("delay", [0, 2])
def test_types_that_change_on_the_way(both, odd, mine, algorithm, delay):
    """Each type to each other, scaled and with events on the way; against the same by NumPy."""
    system = System(stop_time=4.0, step=0.25, algorithm=algorithm)
    system.add("wave", mine("Wave"))
    for name in ("a", "b", "c"):
        system.add(name, odd)
    system.connect("wave.y", "a.m", scale=5.0, offset=0.2, threshold=0.5)
    system.connect("wave.y", "a.on", threshold=0.25)
    system.connect("a.off", "b.u", delay=delay)
    system.connect("a.off", "b.v", scale=-2.0, offset=0.3, delay=delay)
    system.connect("a.off", "b.m", scale=7.0, threshold=0.0, delay=delay)
    system.connect("a.n", "b.on", threshold=1.0, delay=delay)
    system.connect("a.n", "c.u", scale=0.5)
    system.connect("b.off", "c.m", delay=delay)
    system.connect("b.off", "c.v")
    system.events = [Event("a.on", "override", 2.0, value=True, duration=0.5), Event("b.v", "bias", 1.0, value=4.0)]
    result = both(system)
    wave = 5.0 * np.sin(3.0 * result.time[:-1]) + 0.2
    assert list(result["a.n"][1:]) == list(np.rint(wave) + 1)
    assert set(result["a.off"][1:]) == {0, 1}
    assert set(result["b.n"][1:]) == {1, 8}
    assert set(result["c.n"][1:]) == {1, 2}


@ALGORITHMS
@pytest.mark.parametrize(("scale", "number"), [(1e9, 2250000000), (-1e9, -2250000000)])
def test_a_number_that_no_whole_one_holds(both, odd, mine, algorithm, *, scale, number):
    """An error in both, by the input's name."""
    system = System(stop_time=4.0, step=0.25, algorithm=algorithm)
    system.add("course", mine("Course"), a=0.0, b=1.0)
    system.add("a", odd)
    system.connect("course.y", "a.m", scale=scale, threshold=0.5)
    result = both(system)
    assert result.status == "failed"
    assert f"'m' cannot become {number}: its type Integer holds -2147483648 to 2147483647" in str(result.error)
    assert result.error.instance == "a"
    assert result.time[-1] == 2.25


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
def test_whole_numbers_and_truths(both, odd, algorithm, ring):
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
def test_recorded_points(both, odd, ring, monkeypatch, *, record, stop):
    """Every so many, and the last; also where a block may hold one row only."""
    monkeypatch.setattr(compiled, "MOST_VALUES", 1)
    result = both(ring(odd, 2, stop, record=record if record <= stop else stop))
    every = round(min(record, stop) / 0.25)
    assert list(result.time) == [
        k * 0.25 for k in sorted({*range(0, round(stop / 0.25) + 1, every), round(stop / 0.25)})
    ]


def test_native_and_python_models_together(both, mine, odd):
    """A Python FMU takes the interpreter's lock again inside the loop; it does so tens of thousands of times."""
    system = System(stop_time=100.0, step=0.01, record=50.0)
    system.add("odd", odd, v=1.0)
    system.add("lag", mine("Lag"))
    system.connect("lag.x", "odd.u")
    system.connect("odd.y", "lag.u")
    result = both(system, kind="python")
    assert result.status == "completed"
    assert result.seconds["stepping"] < 20.0


@pytest.mark.parametrize("start", [0.0, -3.7, 1e6])
def test_time(both, odd, start, ring):
    system = ring(odd, 2)
    system.stepping.start_time, system.stepping.stop_time = start, start + 10.0
    result = both(system)
    assert np.array_equal(result.time, start + np.arange(41) * 0.25)


@pytest.mark.long
def test_many_instances_share_one_library(both, odd, ring):
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
from railcosim.orchestrator.system import Connection, Event, System
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


@pytest.fixture
def failing(odd, ring):
    """Makes rings in whose midst one does as its mode says."""

    def make(mode, algorithm):
        system = ring(odd, 3, algorithm=algorithm)
        system.instances["odd[1]"].start["mode"] = mode
        return system

    return make


@ALGORITHMS
@pytest.mark.parametrize("status", [2, 3, 4, 5, 9])
@pytest.mark.parametrize("call", ["step", "get", "set"])
def test_a_failing_call(both, algorithm, status, call, failing):
    """Instance, time, status, what the FMU said and what was recorded are those of the loop in Python."""
    mode = {"step": 0, "get": 20, "set": 30}[call] + status
    result = both(failing(mode, algorithm))
    error = result.error
    assert (result.status, error.instance) == ("failed", "odd[1]")
    assert error.time == 5.0
    shown = -1 if (status, call) == (9, "step") else status
    assert error.status == (STATUS[shown] if 0 <= shown < len(STATUS) else f"{shown} (unknown)")
    assert [line.partition("] ")[2] for line in error.log] == [f"odd[1] does as it was told: {shown}"]
    assert list(result.time) == [k * 0.25 for k in range(20 if call == "get" else 21)]


def test_a_warning_is_no_failure(both, failing):
    for mode in (1, 21, 31):
        assert both(failing(mode, "jacobi")).status == "completed"


@ALGORITHMS
@pytest.mark.parametrize(("mode", "name"), [(10, "nan"), (11, "inf"), (12, "-inf")])
def test_a_value_that_is_no_number(both, algorithm, mode, name, failing):
    """A row that holds one is never recorded, and nobody else is given it."""
    result = both(failing(mode, algorithm))
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


def test_after_a_run_every_instance_knows_the_time(workspace, odd, ring, instantiated):
    """A model that fails when it is terminated does so at the time reached."""
    master = instantiated(ring(odd, 2, 1.0))
    assert master.run(0.0, 0.25, 4, 1, lambda *_: True)
    assert [slave.time for slave in master.slaves.values()] == [1.0, 1.0]


def test_maps_are_left_to_python(odd, mine, used):
    """The whole number 2 becomes 7 and others stay, truth its opposite: each a step after it was there."""
    system = System(stop_time=2.0, step=0.25)
    system.add("wave", mine("Wave"))
    for name in ("a", "b"):
        system.add(name, odd)
    system.connect("wave.y", "a.m", scale=1.4, threshold=0.5)
    system.connect("wave.y", "a.on", threshold=0.25)
    system.connections.append(Connection("a.n", "b.m", map={"2": 7}))
    system.connections.append(Connection("a.off", "b.on", map={"true": False, "false": True}))
    result = run(system)
    assert not used
    assert {1, 2} <= set(result["a.n"])
    assert list(result["b.n"][1:]) == [8 if n == 2 else n + 1 for n in result["a.n"][:-1]]
    assert set(result["a.off"]) == {0, 1}
    assert list(result["b.off"][1:]) == list(result["a.off"][:-1])
