"""Systems with instances in processes of their own: the same numbers, and a crash ends no more than the run."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from railcosim.orchestrator import Results, System, run
from railcosim.orchestrator.errors import FmuError, ScenarioError
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.isolation.choice import instantiate, isolate
from railcosim.orchestrator.isolation.proxy import IsolatedSlave
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import execute, resume
from railcosim.orchestrator.scenario.loading import load
from railcosim.orchestrator.system import Event

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]
COMMAND = [sys.executable, "-c", "from railcosim.orchestrator.cli.app import main; main()"]
ONCE = "canBeInstantiatedOnlyOncePerProcess"


def loop(path, isolated=(), deed="", **how):
    """Three instances in a ring of positions, which hand on values of every other type as well."""
    system = System(**{"stop_time": 5.0, "step": 0.25} | how)
    for k in range(3):
        system.add(f"odd[{k + 1}]", path).isolate = k in isolated
    for k in range(3):
        before, own = f"odd[{(k - 1) % 3 + 1}]", f"odd[{k + 1}]"
        system.connect(f"{before}.x", f"{own}.u", scale=-0.7, offset=(k + 1) / 3.0)
        if k:
            system.connect(f"{before}.y", f"{own}.v")
            system.connect(f"{before}.n", f"{own}.m", delay=int(how.get("algorithm") != "adaptive"))
            system.connect(f"{before}.off", f"{own}.on")
            system.connect(f"{before}.said", f"{own}.word")
    system.instances["odd[1]"].start["word"] = "ab"
    if deed:
        system.instances["odd[2]"].start["deed"] = deed
    return system


def contents(result):
    """What was recorded, to the bit; not in which process."""
    columns = {name: result[name] for name in result.names() if not name.endswith(".pid")}
    return {"time": result.time.tobytes()} | {
        name: list(column) if column.dtype == object else column.tobytes() for name, column in columns.items()
    }


# -------------------------------------------------------------------- the same numbers


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("algorithm", "extrapolation"),
    [
        ("gauss-seidel", 0),
        ("jacobi", 1),
        ("iterative", 0),
        ("adaptive", 1),
        *(
            pytest.param(algorithm, extrapolation, marks=pytest.mark.long)
            for algorithm, extrapolation in (("gauss-seidel", 1), ("jacobi", 0), ("iterative", 1), ("adaptive", 0))
        ),
    ],
)
def test_two_isolated_and_one_other_close_a_loop(hostile, algorithm, extrapolation):
    how = {"algorithm": algorithm, "tolerances": {f"odd[{k}].calls": [0.0, 1e9] for k in (1, 2, 3)}, "tolerance": 1e-2}
    systems = [loop(hostile(), isolated, extrapolation=extrapolation, **how) for isolated in ((), (0, 2))]
    for system in systems:
        system.events.append(Event("odd[1].u", "bias", at=2.0, value=0.125, duration=1.0))
        if algorithm in ("gauss-seidel", "jacobi"):
            system.instances["odd[3]"].step = 0.5
    whole, apart = map(run, systems)
    assert contents(apart) == contents(whole)
    assert len(set(apart["odd[3].x"])) > 10
    processes = {int(apart[f"odd[{k}].pid"][-1]) for k in (1, 2, 3)}
    assert len(processes) == 3
    assert os.getpid() in processes


def test_a_checkpoint_is_taken_and_resumed(hostile, tmp_path):
    whole = run(loop(hostile()))
    run(loop(hostile(), (0, 1)), stop_time=3.0, output=tmp_path / "out", checkpoint_every=1.0)
    assert contents(resume(tmp_path / "out", stop_time=5.0)) == contents(whole)


@pytest.mark.parametrize("kind", ["native", pytest.param("python", marks=pytest.mark.long)])
def test_a_whole_scenario(kind):
    system = load("comfort_cruise", stop_time=20.0)
    whole = run(system, kind=kind)
    apart = run(isolate(system, ["train", "cruise[2]"]), kind=kind)
    assert contents(apart) == contents(whole)


def test_the_compiled_loop_is_left_to_others(hostile, workspace):
    system = loop(hostile(), (1,))
    checked = check(system, workspace)
    slaves = [slave for _, slave in instantiate(checked.models, system.instances)]
    try:
        assert [type(slave) for slave in slaves] == [FmuSlave, IsolatedSlave, FmuSlave]
    finally:
        for slave in slaves:
            slave.free()


def test_an_fmu_for_one_instance_per_process(hostile):
    path = hostile("instantiate once", simulation=ONCE)
    apart = run(loop(path, (0, 1)))
    assert len({int(apart[f"odd[{k}].pid"][-1]) for k in (1, 2, 3)}) == 3
    with pytest.raises(ScenarioError) as caught:
        run(loop(path, (1,)))
    assert str(caught.value) == (
        "odd[1], odd[3]: this FMU can be instantiated only once per process; give all but one of them a process of its "
        "own by isolate = true"
    )


def test_components_in_this_process_stay_there_with_a_note():
    system = System(stop_time=1.0, step=0.5)
    system.add("train", "PointMassTrain", force=0.0).isolate = True
    result = run(system, kind="plain")
    assert "not isolated, because plain components run in this process: train" in result.checked.notes


# -------------------------------------------------------------------- a run that ends early


@pytest.mark.sample(3)
@pytest.mark.parametrize("algorithm", ["gauss-seidel", pytest.param("jacobi", marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("deed", "end"),
    [
        ("step null 2.5", (11, "odd[2], t = 2.5 s: its process crashed in fmi2DoStep (SIGSEGV)")),
        ("step cry 2.5", (11, "odd[2], t = 2.5 s: its process crashed in fmi2DoStep (SIGSEGV)")),
        ("get abort 2.5", (10, "odd[2], t = 2.5 s: its process crashed in fmi2GetReal (SIGABRT)")),
        ("step exit 2.5", (11, "odd[2], t = 2.5 s: its process ended in fmi2DoStep (exit code 7)")),
        ("step error 2.5", (11, "odd[2], t = 2.5 s, status error: fmi2DoStep failed")),
        ("step nan 2.5", (11, "odd[2], t = 2.75 s: output 'x' is nan")),
        ("terminate null", (21, "odd[2], t = 5 s: its process crashed in fmi2Terminate (SIGSEGV)")),
        ("enter null", (0, "odd[2], t = 0 s: its process crashed in fmi2EnterInitializationMode (SIGSEGV)")),
    ],
)
def test_what_was_computed_until_then_is_kept(hostile, tmp_path, algorithm, deed, end):
    rows, message = end
    whole = run(loop(hostile(), algorithm=algorithm))
    with pytest.raises(FmuError) as caught:
        run(loop(hostile(), (0, 1), deed, algorithm=algorithm), output=tmp_path / "out")
    assert str(caught.value).partition("\n")[0] == message
    if rows:
        kept = Results.load(tmp_path / "out")
        assert np.array_equal(kept.time, whole.time[:rows])
        assert all(np.array_equal(kept[f"odd[{k}].x"], whole[f"odd[{k}].x"][:rows]) for k in (1, 2, 3))
        assert not kept.completed
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["status"] == "failed"
    assert record["error"].startswith(message)
    assert [record["instances"][f"odd[{k}]"]["isolated"] for k in (1, 2, 3)] == [True, True, False]


def test_an_instance_without_outputs_is_not_a_step_late(compile_c, xml, tmp_path):
    """A step whose outputs nobody reads is waited for at once."""
    import fmpy

    deed = xml["variable"]("deed", "parameter", "String", "step null 0.5", variability="fixed")
    text = xml["description"]([deed], identifier="Hostile").replace('valueReference="0"', 'valueReference="10"')
    library = f"binaries/{fmpy.platform}/Hostile{fmpy.sharedLibraryExtension}"
    files = {"modelDescription.xml": text, library: compile_c("hostile.c"), "resources/deed.txt": "step null 0.5"}
    system = System(stop_time=2.0, step=0.25)
    system.add("mute", str(xml["write_archive"](tmp_path / "mute.fmu", files))).isolate = True
    outcome = execute(system)
    assert outcome.error.time == 0.5
    assert list(outcome.time) == [0.0, 0.25, 0.5]


def test_a_crash_in_the_end_is_no_failure(hostile, caplog):
    assert run(loop(hostile(), (1,), "free null")).status == "completed"
    assert "odd[2]: its process crashed in fmi2FreeInstance (SIGSEGV)" in caplog.text


# -------------------------------------------------------------------- what is said of isolation


def test_timeouts_and_limits_need_isolation(hostile, workspace):
    system = loop(hostile(), (0,))
    system.instances["odd[1]"].step_timeout = -1.0
    system.instances["odd[2]"].memory_limit = 100.0
    system.instances["odd[3]"].memory_limit = 100.0
    system.provenance.origins |= {
        "instances.odd[2].memory_limit": "x.toml:7",
        "instances.odd[3].memory_limit": "x.toml:7",
    }
    with pytest.raises(ScenarioError) as caught:
        check(system, workspace)
    assert str(caught.value).splitlines() == [
        "odd[1]: step_timeout takes a number greater than 0, not -1.0",
        "x.toml:7: odd[2], odd[3]: memory_limit is for an instance in a process of its own; set isolate = true, or run "
        "with --isolate odd",
    ]


def test_names_of_instances_groups_and_all():
    system = load("comfort_cruise")

    def chosen(*names):
        return [name for name, x in isolate(system, names).instances.items() if x.isolate]

    assert chosen() == []
    assert chosen("train[2]", "gust") == ["train[2]", "gust"]
    assert chosen("train") == [f"train[{k}]" for k in (1, 2, 3, 4)]
    assert chosen("all") == list(system.instances)
    assert not any(x.isolate for x in system.instances.values()), "the system itself is not changed"
    with pytest.raises(ScenarioError) as caught:
        isolate(system, ["trian", "gust", "train[9]"])
    assert str(caught.value).splitlines() == [
        "isolate 'trian': the system has no such instance; did you mean 'train'?",
        "isolate 'train[9]': the system has no such instance; did you mean 'train[4]'?",
    ]


# -------------------------------------------------------------------- the command line


@pytest.fixture
def scenario(hostile, tmp_path):
    """Write a scenario of the loop; gives what runs it."""

    def write(deed, *, timeout=60.0, stop=5.0):
        lines = [f"[simulation]\nstop_time = {stop}\nstep = 0.25\nalgorithm = 'jacobi'"]
        for k, name in enumerate("abc"):
            lines.append(f"[instances.{name}]\nfmu = '{hostile()}'")
            if k == 1:
                lines.append(f"isolate = true\nstep_timeout = {timeout}\nstart = {{ deed = '{deed}' }}")
        lines.append("[connections]\n" + "\n".join(f"'{b}.u' = '{a}.x'" for a, b in ("ba", "cb", "ac")))
        (tmp_path / "loop.toml").write_text("\n".join(lines))

        def start(*options):
            return subprocess.Popen(
                [*COMMAND, "run", "loop.toml", "-o", "out", "--no-figures", *options],
                cwd=tmp_path,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                start_new_session=True,
            )

        return start

    return write


@pytest.mark.parametrize(
    ("deed", "message"),
    [
        ("step null 2.5", "error: an FMU failed: b, t = 2.5 s: its process crashed in fmi2DoStep (SIGSEGV)\n"),
        (
            "step hang 2.5",
            "error: an FMU failed: b, t = 2.5 s: did not return from fmi2DoStep within 1 s; its process ",
        ),
    ],
)
def test_a_lost_process_has_exit_code_3(scenario, tmp_path, deed, message):
    with scenario(deed, timeout=1.0)() as process:
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 3, stderr
    assert message in stderr
    assert "Traceback" not in stderr
    results = Results.load(tmp_path / "out")
    assert list(results.time) == [0.25 * k for k in range(11)]
    assert not results.completed
    assert (tmp_path / "out" / "results.csv").read_text().count("\n") == 12
    assert json.loads((tmp_path / "out" / "run.json").read_text())["status"] == "failed"
    assert not session_of(process.pid)


@pytest.mark.long
def test_the_option(scenario, tmp_path):
    for options, expected in ((("--isolate", "c"), [False, True, True]), (("--isolate", "all"), [True] * 3)):
        with scenario("nothing")(*options) as process:
            _, stderr = process.communicate(timeout=60)
        assert process.returncode == 0, stderr
        record = json.loads((tmp_path / "out" / "run.json").read_text())
        assert [x["isolated"] for x in record["instances"].values()] == expected
    with scenario("nothing")("--isolate", "d") as process:
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "isolate 'd': the system has no such instance" in stderr


def test_an_interruption_ends_the_run_not_the_process_of_an_instance(scenario, tmp_path):
    """As a terminal does it: to the whole group of processes."""
    with scenario("step slow 1.0", stop=10.0)() as process:
        assert any("%" in line for line in process.stderr)
        os.killpg(process.pid, signal.SIGINT)
        _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert json.loads((tmp_path / "out" / "run.json").read_text())["status"] == "interrupted"
    assert Results.load(tmp_path / "out").time[-1] >= 1.0
    assert not session_of(process.pid)


def session_of(master):
    """Processes of isolated instances whose parent was this one, or is nobody any more."""
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        found = []
        for place in os.listdir("/proc"):
            if place.isdigit():
                with (
                    contextlib.suppress(OSError),
                    open(f"/proc/{place}/cmdline") as line,
                    open(f"/proc/{place}/stat") as stat,
                ):
                    parent = int(stat.read().rpartition(")")[2].split()[1])
                    if parent in (1, master) and "isolation.host" in line.read().split("\0"):
                        found.append(place)
        if not found:
            return []
        time.sleep(0.1)
    return found
