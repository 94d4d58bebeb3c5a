"""What is kept of a run: every point for what is judged, the rest where it belongs, and no more memory than that."""

import errno
import json
import subprocess
import sys

import numpy as np
import pytest
from railcosim.orchestrator import Batch, Results, System, world
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import RecordError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import execute, resume, run
from railcosim.orchestrator.run.recording import recorder
from railcosim.orchestrator.system import Event


def swinging(mine, **how):
    """A lag behind a wave of 1 rad/s, with what is judged of it."""
    system = System(**{"stop_time": 20.0, "step": 0.1} | how)
    system.add("wave", mine("Wave"))
    system.add("lag", mine("Lag"), x=0.3)
    system.connect("wave.y", "lag.u")
    system.judged.metrics = {
        "peak": "peak(lag.x)",
        "mean": "mean(lag.x - wave.y, after = 1.05, outside = [3.0, 4.0])",
        "jerk": "mean_jerk(lag.x, 0.5)",
        "at": "at(lag.x, 7.123)",
        "per": "max(wave.y) / count",
    }
    system.judged.requirements = {
        "low": "always lag.x < 0.9 from 0.25",
        "again": "eventually lag.x > 0.5 and time > 5",
        "end": "finally lag.x < 2",
    }
    system.judged.figures = [{"title": "Lag", "y": ["lag.x"]}]
    return system


def judged(outcome):
    return [metric.values for metric in outcome.metrics], outcome.requirements


@pytest.mark.parametrize("kind", ["native", "plain"])
@pytest.mark.parametrize("output", [True, False])
def test_every_point_is_judged_whatever_is_recorded(mine, tmp_path, kind, output):
    whole = run(swinging(mine), kind=kind)
    rare = run(swinging(mine, record=2.5), kind=kind, output=tmp_path if output else None)
    assert (len(whole.time), len(rare.time)) == (201, 9)
    assert judged(rare) == judged(whole)
    assert {verdict.points for verdict in rare.requirements} == {199 - 1, 201, 1}
    assert not list(tmp_path.glob("*.bin"))


def test_every_point_of_steps_of_varying_length_is_judged(mine):
    system = swinging(mine, algorithm="adaptive", tolerance=1e-5)
    system.judged.requirements |= {"seen": "always lag.x < 1e9"}
    whole, rare = run(system, kind="native"), run(system.changed(record=5.0), kind="native")
    assert len(rare.time) == 5
    points = {outcome.requirements[-1].points for outcome in (whole, rare)}
    assert min(points) > 20


@pytest.mark.parametrize("every", [None, 0.3])
@pytest.mark.parametrize("seen", ["once", "more often"])
def test_what_a_batch_keeps_is_what_a_run_records(mine, monkeypatch, every, seen):
    """Also of the point at which an event strikes; whoever takes the steps, and in blocks of any length."""
    events = [Event("lag.x", "bias", at=0.6, value=2.0)]
    system = swinging(mine, record=every, stop_time=1.5, events=events)
    system.judged.requirements.clear()
    system.judged.metrics.clear()
    whole = run(system, kind="native")
    if seen == "more often":
        monkeypatch.setattr(compiled, "_BLOCK_SECONDS", 0.0)
    with Batch(system, kind="native", record=["lag.x"]) as batch:
        for row in batch.run_all([{}, {}]).rows:
            assert row.series is not None
            assert row.series["time"].tobytes() == whole.time.tobytes()
            assert row.series["lag.x"].tobytes() == whole["lag.x"].tobytes()


def test_what_is_in_memory_is_there_once(mine):
    """The columns stand where the steps were written."""
    outcome = run(swinging(mine), kind="native")
    bases = [outcome[name].base for name in outcome]
    assert all(base is outcome.time.base for base in bases)
    assert all(outcome[name].flags.c_contiguous for name in outcome)


@pytest.fixture
def large(monkeypatch):
    """Results that are none too large to be held count as large."""
    monkeypatch.setattr(recorder, "_SMALL", 0)
    monkeypatch.setattr(recorder, "_FLUSH_BYTES", 64)


@pytest.mark.parametrize("record", [None, 0.5])
def test_large_results_stay_in_their_file(mine, tmp_path, large, record):
    """And are the same as if they did not; their arrays are read even when the file is gone."""
    held = run(swinging(mine, record=record), kind="native")
    filed = run(swinging(mine, record=record), kind="native", output=tmp_path)
    assert judged(filed) == judged(held)
    assert repr(filed.results) == repr(held.results)
    assert not (tmp_path / "results.bin").exists()
    assert filed.time_reached == 20.0
    loaded = Results.load(tmp_path)
    for results in (filed.results, loaded):
        assert list(results) == list(held)
        assert all(np.array_equal(results[name], held[name]) for name in held)
        assert np.array_equal(results.time, held.time)
        part = results.part(1, 3)
        assert (len(part), sorted(part)) == (3, ["lag.x", "time", "wave.y"])
        assert list(part["lag.x"]) == list(held["lag.x"][1:3])
    assert [path.name for path in filed.figures] == ["lag.png"]


def no_room(monkeypatch, name, room):
    """The disk is full when a file of that name has so many bytes."""
    opened = world.open

    class Full:
        def __init__(self, stream):
            self.stream = stream

        def write(self, data):
            if self.stream.tell() + len(data) > room:
                raise OSError(errno.ENOSPC, "No space left on device")
            return self.stream.write(data)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.stream.close()

        def __getattr__(self, asked):
            return getattr(self.stream, asked)

    def open_full(path, mode="r", *rest, **how):
        stream = opened(path, mode, *rest, **how)
        return Full(stream) if path.name.startswith(name) and "w" in mode else stream

    monkeypatch.setattr(world, "open", open_full)


def test_a_disk_that_is_full_while_the_run_goes(mine, tmp_path, monkeypatch, large):
    no_room(monkeypatch, "results.bin", 1000)
    outcome = execute(swinging(mine), kind="plain", output=tmp_path)
    assert (outcome.status, type(outcome.error)) == ("failed", RecordError)
    assert str(outcome.error).startswith(f"results.bin in {tmp_path} cannot be written beyond 0.00")
    assert "No space left on device; make room there or name another directory, or record less" in str(outcome.error)
    record = json.loads((tmp_path / "run.json").read_text())
    assert (record["status"], record["error"]) == ("failed", str(outcome.error))
    loaded = Results.load(tmp_path)
    assert 20 < len(loaded.time) < 42
    np.testing.assert_array_equal(loaded["lag.x"], run(swinging(mine), kind="plain")["lag.x"][: len(loaded.time)])


def test_a_disk_that_is_full_before_the_first_row(mine, tmp_path, monkeypatch):
    no_room(monkeypatch, "results.bin", 0)
    outcome = execute(swinging(mine), kind="plain", output=tmp_path)
    assert (outcome.status, type(outcome.error)) == ("failed", RecordError)
    assert json.loads((tmp_path / "run.json").read_text())["error"] == str(outcome.error)


def test_a_disk_that_has_no_room_for_the_text(mine, tmp_path, monkeypatch):
    """The verdicts and the rows are there; the text is made when there is room."""
    out = tmp_path / "out"
    with monkeypatch.context() as full:
        no_room(full, "results.csv", 1000)
        outcome = execute(swinging(mine), kind="plain", output=out)
    assert (outcome.status, type(outcome.error)) == ("failed", RecordError)
    assert f"{out / 'results.csv'} cannot be written: No space left on device, after " in str(outcome.error)
    assert f"make room, then 'orchestrate plot {out}' writes the text" in str(outcome.error)
    assert json.loads((out / "run.json").read_text())["status"] == "failed"
    assert len(json.loads((out / "metrics.json").read_text())["requirements"]) == 3
    assert sorted(path.name for path in out.glob("results*")) == ["results.bin"]
    assert cli.call(["plot", str(out)]) == 0
    assert len((out / "results.csv").read_text().splitlines()) == 202


@pytest.mark.parametrize("room", [1000, 2300])
def test_a_disk_that_is_full_when_a_run_goes_on(mine, tmp_path, monkeypatch, large, room):
    """Before the rows of the checkpoint are there again, or after: what there was can be read, and nothing is open."""
    run(swinging(mine, record=0.2), kind="plain", output=tmp_path, checkpoint_every=15.0)
    before = Results.load(tmp_path)
    with monkeypatch.context() as full:
        no_room(full, "results.bin", room)
        with pytest.raises(RecordError, match="cannot be written beyond"):
            resume(tmp_path)
    after = Results.load(tmp_path)
    assert after.time[-1] == before.time[-1]
    assert all(np.array_equal(after[name], before[name]) for name in before.names())
    assert cli.call(["plot", str(tmp_path)]) == 0
    assert resume(tmp_path).status == "completed"


def test_how_far_the_text_is_written_is_told(mine, tmp_path):
    told = []
    execute(swinging(mine), kind="plain", output=tmp_path, writing=lambda done, rows: told.append((done, rows)))
    assert told[-1] == (201, 201)


MEMORY = """
import sys
from railcosim.orchestrator import System, run
system = System(stop_time=float(sys.argv[1]), step=0.01, record=float(sys.argv[4]))
system.add("lag", sys.argv[2], u=1.0)
system.add("wave", sys.argv[2], u=2.0)
system.judged.metrics = {"mean": "mean(lag.x - wave.x)", "jerk": "mean_jerk(lag.x)"}
system.judged.requirements = {"low": "always lag.x < 2", "end": "eventually wave.x > 1"}
outcome = run(system, kind="native", output=sys.argv[3])
assert [verdict.verdict for verdict in outcome.requirements] == ["pass", "pass"]
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
@pytest.mark.parametrize("record", [0.01, 0.1])
def test_memory_does_not_grow_with_the_number_of_steps(mine, tmp_path, record):
    """With a file: 0.4 and 4 million steps, of which the larger run's rows would take 96 MB, and at its end twice that.

    Results of less than 16 MB are read back into memory, where parts of them stand three times for a while.
    """
    model, peaks = mine("Lag"), []
    for stop in (4e3, 4e4):
        command = [sys.executable, "-c", MEMORY, str(stop), model, str(tmp_path / "out"), str(record)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        peaks.append(int(done.stdout.split()[-1]) / 1024)
    assert peaks[1] - peaks[0] < 64.0, peaks
