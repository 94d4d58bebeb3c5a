"""A run from a system to results and files, and what is left of one that failed, was interrupted or was killed."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.errors import FmuError, RailcosimError, ScenarioError
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.run.recording import Results
from railcosim.orchestrator.system import System

BOTH = pytest.mark.parametrize("kind", ["python", "plain"])


def braking(**how):
    """A train that rolls out, and the wind."""
    system = System(**{"stop_time": 10.0, "step": 0.1} | how)
    system.add("train", "PointMassTrain", speed=20.0, force=-1e5)
    system.add("gust", "Gust", start_time=2.0, stop_time=4.0)
    system.connect("gust.acceleration", "train.disturbance")
    return system


def failing(mine, **how):
    system = System(**{"stop_time": 10.0, "step": 0.5} | how)
    system.add("bad", mine("Fails"))
    system.add("clock", "Gust", start_time=1.0)
    system.connect("clock.acceleration", "bad.u")
    return system


def record(directory):
    return json.loads((Path(directory) / "run.json").read_text())


# -------------------------------------------------------------------- the API


def test_in_memory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(braking(), kind="plain")
    assert result.status == "completed"
    assert sorted(result.names()) == [
        "gust.acceleration", "train.acceleration", "train.applied_force", "train.position", "train.speed",
    ]  # fmt: skip
    assert result["train.speed"].shape == result.time.shape == (101,)
    assert result["train.speed"][0] == 20.0
    assert (result.directory, result.figures, result.error) == (None, [], None)
    assert result.seconds["steps"] == 100
    assert min(result.seconds["setup"], result.seconds["stepping"]) > 0.0
    assert not list(tmp_path.iterdir())


@BOTH
def test_the_run_is_the_physics(kind):
    """Without resistance a train under a constant force, and a gust of 0.5 m/s2 for 2 s: by hand."""
    system = braking()
    system.instances["train"].start.update(c0=0.0, c1=0.0, c2=0.0)
    result = run(system, kind=kind)
    lost = 0.5 * np.clip(result.time - 2.0, 0.0, 2.0)
    assert result["train.speed"] == pytest.approx(20.0 - 0.25 * result.time - lost, abs=1e-9)


def test_overrides_do_not_touch_the_system_and_mark_the_run():
    system = braking()
    result = run(system, stop_time=2.0, step=0.5, algorithm="jacobi", kind="plain")
    assert list(result.time) == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert (
        result.system.stepping.algorithm,
        result.system.provenance.modified,
        result.system.provenance.rescaled_from,
    ) == ("jacobi", True, 0.1)
    assert (system.stepping.stop_time, system.stepping.step, system.stepping.algorithm, system.provenance.modified) == (
        10.0,
        0.1,
        "gauss-seidel",
        False,
    )
    same = run(system, stop_time=10.0, step=0.1, algorithm="gauss-seidel", kind="plain")
    assert same.system is system


def test_a_step_changed_twice_still_takes_the_sample_times_along(mine):
    """As `--step` with `--verify-step` does: the scenario's own step is what sample times are compared with."""
    system = System(stop_time=1.0, step=0.1)
    system.add("s", mine("Count"), sample_time=0.1)
    first = run(system, step=0.05, kind="plain")
    second = run(first.system, step=0.025, kind="plain")
    assert [r["s.n"][-1] for r in (first, second)] == [30.0, 50.0]


def test_a_system_that_cannot_run_leaves_no_directory(tmp_path):
    system = braking(step=0.3)
    with pytest.raises(ScenarioError, match="stop_time = 10 s is not a whole multiple of step"):
        run(system, kind="plain", output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_metrics_and_requirements_are_evaluated():
    system = braking()
    system.judged.requirements = {"slow": "always train.speed <= 20", "fast": "always train.speed >= 19"}
    system.judged.metrics = {"end": "final(train.speed)"}
    result = run(system, kind="plain")
    assert [v.verdict for v in result.requirements] == ["pass", "fail"]
    assert result.failed
    assert next(iter(result.metrics[0].values.values())) == result["train.speed"][-1]


# -------------------------------------------------------------------- recording


@pytest.mark.parametrize(
    ("every", "stop", "expected"),
    [
        (None, 1.0, [k * 0.1 for k in range(11)]),
        (0.1, 1.0, [k * 0.1 for k in range(11)]),
        (0.2, 1.0, [k * 0.1 for k in (0, 2, 4, 6, 8, 10)]),
        (0.3, 1.0, [k * 0.1 for k in (0, 3, 6, 9, 10)]),  # the last point always
        (5.0, 1.0, [0.0, 1.0]),
    ],
)
def test_recorded_points(every, stop, expected):
    result = run(braking(record=every, stop_time=stop), kind="plain")
    assert list(result.time) == expected
    full = run(braking(stop_time=stop), kind="plain")
    at = np.searchsorted(full.time, result.time - 1e-9)
    for name in full.names():
        assert np.array_equal(result[name], full[name][at])


@BOTH
def test_results_on_disk_are_those_in_memory(tmp_path, kind):
    result = run(braking(), kind=kind, output=tmp_path / "a" / "b")
    loaded = Results.load(tmp_path / "a" / "b")
    assert np.array_equal(loaded.time, result.time)
    assert list(loaded.names()) == list(result.names())
    for name in result.names():
        assert np.array_equal(loaded[name], result[name])
    assert loaded.completed
    assert (loaded.step, loaded.stop_time) == (0.1, 10.0)
    assert loaded.parameters == result.results.parameters
    assert loaded.units["train.speed"] == "m/s"
    assert {p.name for p in (tmp_path / "a" / "b").iterdir()} == {
        ".lock",
        "results.csv",
        "run.json",
        "metrics.json",
        "units.json",
    }


def test_files_of_both_kinds_are_equal(tmp_path, components):
    """Booleans, too: an FMU gives them as 0 and 1."""
    body = "class T(Base):\n    b = Output('1', bool)\n    i = Output('1', int)\n" \
           "    def outputs(self):\n        return {'b': self.time > 0.25, 'i': 3}\n"  # fmt: skip
    system = System(stop_time=0.5, step=0.1)
    system.add("t", components(body)("T"))
    for kind in ("python", "plain"):
        run(system, kind=kind, output=tmp_path / kind)
    texts = [(tmp_path / kind / "results.csv").read_text() for kind in ("python", "plain")]
    assert texts[0] == texts[1]
    assert list(Results.load(tmp_path / "plain")["t.b"]) == [0, 0, 0, 1, 1, 1]


def test_an_output_directory_that_cannot_be_made(tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(RailcosimError, match=f"the output directory {tmp_path}/taken cannot be used: File exists"):
        run(braking(), kind="plain", output=tmp_path / "taken")


def test_progress_reaches_the_end():
    seen = []
    run(braking(), kind="plain", progress=lambda now, end: seen.append((now, end)))
    assert seen[-1] == (10.0, 10.0)
    assert seen == sorted(seen)
    assert len(seen) >= 100


# -------------------------------------------------------------------- failure


@BOTH
def test_a_model_that_fails_in_the_middle(mine, tmp_path, kind):
    system = failing(mine)
    with pytest.raises(FmuError) as caught:
        run(system, kind=kind, output=tmp_path)
    error = caught.value
    assert (error.instance, error.time) == ("bad", 5.5)
    text = str(error)
    assert text.startswith(f"bad, t = 5.5 s, status {error.status}: ")
    source = Path(system.instances["bad"].model.rpartition(":")[0]).read_text().splitlines()
    line = next(k for k, text in enumerate(source, 1) if "maths.sqrt(self.until" in text)
    assert f"ValueError: math domain error [toys.py:{line}, in outputs]" in text

    partial = error.run
    assert (partial.status, partial.error) == ("failed", error)
    assert list(partial.time) == [0.5 * k for k in range(11)]
    assert partial.seconds["steps"] == 10
    loaded = Results.load(tmp_path)
    assert np.array_equal(loaded["bad.y"], partial["bad.y"])
    assert not loaded.completed
    assert record(tmp_path)["status"] == "failed"
    assert record(tmp_path)["error"] == text
    assert record(tmp_path)["time_reached"] == 5.0


def test_execute_gives_the_failure_instead_of_raising_it(mine):
    outcome = execute(failing(mine), kind="plain")
    assert (outcome.status, outcome.error.instance, len(outcome.time)) == ("failed", "bad", 11)


def test_any_exception_of_a_component_is_one_of_the_model_s(components, tmp_path):
    body = "class Odd(Base):\n    y = Output('1')\n    def outputs(self):\n" \
           "        return {'y': {}['k'] if type(self.time) is float else self.time}\n"  # fmt: skip
    system = System(stop_time=1.0, step=0.1)
    system.add("odd", components(body)("Odd"))
    with pytest.raises(FmuError, match=r"^odd, t = 0 s, status error: KeyError: 'k' \[mine\.py:\d+, in outputs\]"):
        run(system, kind="plain", output=tmp_path)
    assert record(tmp_path)["status"] == "failed"


def test_an_unfinished_run_passes_no_requirement(mine):
    system = failing(mine)
    system.judged.requirements = {"fine": "always bad.y >= -1"}
    assert [v.verdict for v in execute(system, kind="plain").requirements] != ["pass"]


def test_after_a_failure_no_instance_is_called_but_to_be_freed(tmp_path, foreign, xml):
    """Every call to a bystander is written down: after the step in which the other one failed there is none."""
    trace = tmp_path / "trace.txt"
    v = xml["variable"]
    system = System(stop_time=10.0, step=1.0)
    good = foreign([v("u", "input", start=0.0), v("y", "output")], name="good.fmu", trace=trace)
    body = "    def step(self, t, h, v):\n        self.note(1 / (3.0 - t))\n"
    bad = foreign([v("u", "input", start=0.0), v("y", "output")], body, name="bad.fmu", trace=trace)
    system.add("good", good)
    system.add("bad", bad)
    system.stepping.order = ["good", "bad"]
    with pytest.raises(FmuError, match=r"bad, t = 3 s, status fatal: fmi2DoStep failed\n(.|\n)*float division by zero"):
        run(system, kind="python")
    calls = trace.read_text().splitlines()
    assert calls[-1] == "bad step"
    assert not any(call.endswith("terminate") for call in calls)
    assert calls.count("good step") == 4
    run(system, kind="python", stop_time=2.0)
    assert trace.read_text().splitlines()[-2:] == ["good terminate", "bad terminate"]


def test_a_process_survives_many_failures(mine):
    """Each leaves an FMU behind that has said "fatal"."""
    for _ in range(3):
        assert execute(failing(mine), kind="python").status == "failed"
    assert run(braking(), kind="python").status == "completed"


def test_a_run_that_fails_at_the_start_leaves_a_record_and_nothing_of_the_last_one(mine, tmp_path):
    run(braking(), kind="plain", output=tmp_path)
    assert (tmp_path / "results.csv").exists()
    system = failing(mine, start_time=7.0, stop_time=8.0)
    with pytest.raises(FmuError, match="bad, t = 7 s"):
        run(system, kind="plain", output=tmp_path)
    assert record(tmp_path)["status"] == "failed"
    assert record(tmp_path)["time_reached"] is None
    with pytest.raises(ScenarioError, match="holds no run that can be read"):
        Results.load(tmp_path)


def test_initial_values_that_do_not_settle_leave_a_record(mine, tmp_path):
    system = failing(mine)
    system.connections = []
    system.add("up", "PointMassTrain")
    system.connect("up.applied_force", "up.force", offset=1.0)
    with pytest.raises(ScenarioError, match="algebraic loop"):
        run(system, kind="plain", output=tmp_path)
    assert record(tmp_path)["status"] == "failed"
    assert "algebraic loop" in record(tmp_path)["error"]


# -------------------------------------------------------------------- Ctrl-C and kill

ENDLESS = """
import sys
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

system = System(stop_time=3e3, step=1e-3)
system.add("train", "PointMassTrain", speed=20.0, force=0.0)
system.add("gust", "Gust")
system.connect("gust.acceleration", "train.disturbance")
print(run(system, kind=sys.argv[2], output=sys.argv[1]).status)
"""


@pytest.fixture
def endless(tmp_path):
    """A run in another process that has some points on the disk already."""
    processes = []

    def start(kind):
        path = tmp_path / "out"
        process = subprocess.Popen(
            [sys.executable, "-c", ENDLESS, str(path), kind], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        processes.append(process)
        deadline = time.monotonic() + 60.0
        while not (path / "results.bin").exists() or (path / "results.bin").stat().st_size < 5000:
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        return process, path

    yield start
    for process in processes:
        with process:
            process.kill()


def steady(loaded):
    """Whether what was read back is the run without a gap, from its beginning on."""
    return np.array_equal(loaded.time, np.arange(len(loaded.time)) * 1e-3) and loaded["train.speed"][0] == 20.0


@BOTH
def test_ctrl_c_stops_cleanly(endless, kind):
    process, path = endless(kind)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (out.strip(), err, process.returncode) == ("interrupted", "", 0)
    loaded = Results.load(path)
    assert steady(loaded)
    assert not loaded.completed
    assert record(path)["status"] == "interrupted"
    assert record(path)["time_reached"] == loaded.time[-1]
    assert record(path)["seconds"]["steps"] == len(loaded.time) - 1
    assert (path / "metrics.json").exists()


def test_a_killed_run_leaves_what_was_flushed(endless):
    process, path = endless("plain")
    process.kill()
    process.wait()
    loaded = Results.load(path)
    assert steady(loaded)
    assert len(loaded.time) > 50
    assert not loaded.completed
    assert record(path)["status"] == "running"


def test_ctrl_c_is_the_caller_s_again_after_a_run():
    before = signal.getsignal(signal.SIGINT)
    run(braking(), kind="plain")
    assert signal.getsignal(signal.SIGINT) is before


def test_a_second_ctrl_c_does_not_wait_for_the_step():
    """The first is looked at between steps; the second is Python's own, and what was recorded is kept all the same."""

    def twice(now, end):
        if now > 3.0:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)

    result = run(braking(), kind="plain", progress=twice)
    assert result.status == "interrupted"
    assert 3.0 <= result.time[-1] < 3.5


def test_a_run_in_another_thread():
    """Signals belong to the main thread; a run elsewhere leaves them alone."""
    outcome = []
    thread = threading.Thread(target=lambda: outcome.append(run(braking(), kind="plain")))
    thread.start()
    thread.join()
    assert outcome[0].status == "completed"
