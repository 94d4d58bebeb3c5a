"""A run that is resumed from its checkpoint is the run that was never interrupted, to the bit; or it is refused."""

import dataclasses
import json

import numpy as np
import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run import checkpoint
from railcosim.orchestrator.run.execution import resume, run
from railcosim.orchestrator.system import Event, System


def read(directory):
    """The two files that a run which was never interrupted must have left alike."""
    return (directory / "results.csv").read_bytes(), json.loads((directory / "metrics.json").read_text())


@pytest.fixture
def same(tmp_path):
    """Run as a whole, and with a checkpoint every ``every`` s and resumed from the last; the results are the same."""

    def go(system, every, kind="python", **how):
        whole, parts = tmp_path / "whole", tmp_path / "parts"
        one = run(system, kind=kind, output=whole, figures=False, **how)
        run(system, kind=kind, output=parts, checkpoint_every=every, figures=False, **how)
        assert read(parts) == read(whole), "checkpoints disturb nothing"
        point = checkpoint.read_checkpoint(parts)
        (parts / "metrics.json").unlink()
        again = resume(parts, figures=False, **how)
        assert again.seconds["steps"] > 0
        assert 0 < point.rows < len(one.time)
        assert read(parts) == read(whole)
        assert {name: again[name].tobytes() for name in again.names() if again[name].dtype != object} == {
            name: one[name].tobytes() for name in one.names() if one[name].dtype != object
        }
        assert again.coupling.get("events") == one.coupling.get("events")
        return one, point

    return go


def loop(mine, **how):
    """Two lags that follow each other, one of them delayed, with a metric."""
    system = System(**{"stop_time": 3.0, "step": 0.1} | how)
    system.judged.metrics = {"end": "final(a.x)", "mean": "mean(b.x)"}
    system.add("a", mine("LagWithSlope"), x=2.0)
    system.add("b", mine("LagWithSlope"), rate=0.5)
    system.add("wave", mine("Wave"))
    system.connect("a.x", "b.u")
    system.connect("b.slope", "a.u", offset=0.1)
    return system


EVENTS = [
    Event("a.x", "freeze", 1.05, duration=1.0),
    Event("b.u", "bias", 0.5, 1.5, duration=0.35, every=0.4),
    Event("wave.y", "ramp", 0.2, rate=0.3),
    Event("a.x", "override", 1.3, 7.0, duration=0.4),
    Event("b.rate", "set", 0.6, 1.25),
    Event("b.rate", "set", 1.9, 0.1),
]


# -------------------------------------------------------------------- to the bit


@pytest.mark.parametrize("kind", ["native", "python", "plain"])
@pytest.mark.parametrize("every", [0.1, 1.4])
def test_each_kind_of_model(same, mine, kind, every):
    _, point = same(loop(mine), every, kind)
    assert point.time == pytest.approx(every * (2.95 // every))


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi", "iterative", "adaptive"])
@pytest.mark.parametrize("eventful", [False, True])
def test_each_algorithm(same, mine, algorithm, eventful):
    """With events: a freeze acts across the checkpoint at 1.4 s, one of two, others begin and end after it."""
    system = loop(mine, algorithm=algorithm, events=EVENTS if eventful else [])
    one, point = same(system, 1.4, "plain")
    assert len(set(np.diff(one.time).round(9))) > 1 or algorithm != "adaptive"
    assert point.time == pytest.approx(2.8, abs=0.2 if algorithm == "adaptive" else 1e-9)


def test_threads(same, mine):
    same(loop(mine, algorithm="jacobi", events=EVENTS), 1.4, "native", threads=2)


def test_events_under_way_in_the_compiled_loop(same, mine):
    one, _ = same(loop(mine, events=EVENTS), 1.4)
    assert len(one.coupling["events"]) > 15


@pytest.mark.parametrize("at", [1.3, 1.5, 1.6, 1.9])
def test_events_across_every_point(mine, tmp_path, at):
    """Whatever acts, begins or ends there; the run then goes on from there alone, beyond the end it had known."""
    system = loop(mine, events=EVENTS)
    run(system, kind="native", output=tmp_path / "whole", figures=False)
    shorter = dataclasses.replace(system, stop_time=at + 0.1)
    run(shorter, kind="native", output=tmp_path / "parts", checkpoint_every=at, figures=False)
    assert checkpoint.read_checkpoint(tmp_path / "parts").time == pytest.approx(at)
    result = resume(tmp_path / "parts", stop_time=3.0, figures=False)
    assert result.system.provenance.modified
    assert (tmp_path / "parts/results.csv").read_bytes() == (tmp_path / "whole/results.csv").read_bytes()


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize(("every", "kind"), [(0.1, "plain"), (0.4, "python"), (0.5, "python")])
def test_longer_steps_delays_and_events_together(same, mine, algorithm, kind, every):
    """The checkpoint stands within intervals of a, which shows its former value and is ahead inside."""
    events = [
        Event("a.x", "bias", 0.35, 1.0, duration=0.5, every=0.7),
        Event("a.slope", "freeze", 0.45, duration=0.2),
        Event("b.u", "bias", 0.1, 1.0),
    ]
    system = loop(mine, algorithm=algorithm, events=events, record=0.2)
    system.instances["a"].step = 0.3
    system.connections[0].delay, system.connections[1].delay = 4, 1
    same(system, every, kind)


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi", "adaptive"])
@pytest.mark.parametrize("order", [1, 2])
def test_inputs_that_are_continued(same, mine, algorithm, order):
    """Native FMUs take derivatives of inputs; what the polynomials go through is part of the checkpoint."""
    one, _ = same(loop(mine, algorithm=algorithm, extrapolation=order), 0.7, "native")
    held = run(loop(mine, algorithm=algorithm), kind="native")
    assert one["a.x"][-1] != held["a.x"][-1]


def test_a_solved_loop(same, components):
    body = "class Half(Base):\n    u = Input('1')\n    y = Output('1')\n    def outputs(self):\n" \
           "        return {'y': 0.5 * self.u + self.time}\n"  # fmt: skip
    system = System(stop_time=2.0, step=0.1, algebraic_loops="solve")
    for name in "pq":
        system.add(name, components(body, "half.py")("Half"))
    system.connect("p.y", "q.u")
    system.connect("q.y", "p.u")
    one, _ = same(system, 0.7)
    assert one["p.y"][-1] == pytest.approx(4.0)


@pytest.mark.parametrize("kind", ["native", "python", "plain"])
def test_random_numbers_go_on(same, mine, kind):
    system = System(stop_time=3.0, step=0.1, seed=7)
    system.add("noisy", mine("Noisy"))
    one, _ = same(system, 1.3, kind)
    assert len(set(one["noisy.y"])) == 11


@pytest.mark.parametrize("kind", ["native", "python", "plain"])
def test_all_types_and_arrays(same, mine, kind):
    system = System(stop_time=2.0, step=0.1)
    system.add("it", mine("TypesAndRow"))
    system.connect("it.m", "it.n", delay=2)
    system.connect("it.off", "it.on")
    one, _ = same(system, 0.7, kind)
    assert len(set(one["it.m"])) > 3
    assert len(set(one["it.row[2]"])) == 21


@pytest.mark.parametrize("kind", ["python", "plain"])
def test_texts(same, mine, kind):
    """The file is text from the beginning; quotes, commas and whole numbers survive being read back."""
    system = System(stop_time=2.0, step=0.1, events=[Event("it.said", "freeze", 0.5, duration=0.8)])
    system.add("it", mine("Said"))
    system.connect("it.said", "it.word")
    one, _ = same(system, 0.9, kind)
    assert one["it.said"][-1].count('"') > 4


@pytest.mark.parametrize(
    ("every", "kind"), [(0.6, "native"), (1.3, "native"), (3.1, "native"), (3.1, "python"), (1.3, "plain")]
)
def test_what_was_learned_on_former_trips(same, mine, kind, every):
    """The checkpoint stands within the first, the second or the third trip; what the tape holds goes on growing."""
    system = System(stop_time=5.0, step=0.05)
    system.add("trips", mine("Trips"))
    system.add("learner", mine("Repeater"))
    system.connect("trips.trip", "learner.trip")
    system.connect("trips.trip_time", "learner.trip_time")
    one, _ = same(dataclasses.replace(system, stop_time=2 * every - 0.05 if every == 3.1 else 5.0), every, kind)
    y = one["learner.y"][np.isclose(np.mod(one.time, 1.25), 0.75)]
    assert (np.diff(y) > 0.1).all(), y


def test_isolated_instances(same, mine):
    system = loop(mine)
    system.instances["a"].isolate = True
    same(system, 1.4)


def test_rows_that_are_rarer_than_steps(same, mine):
    one, _ = same(loop(mine, record=0.7), 1.2)
    assert one.time == pytest.approx([0, 0.7, 1.4, 2.1, 2.8, 3.0])


def test_a_late_start(same, mine):
    _, point = same(loop(mine, start_time=-1.7, stop_time=1.3), 1.4)
    assert point.time == pytest.approx(1.1)


def test_resumed_again_and_again(mine, tmp_path):
    """Each time from the last checkpoint of the one before, further each time."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    system = loop(mine, stop_time=9.0, events=EVENTS)
    run(system, kind="python", output=whole, figures=False)
    run(dataclasses.replace(system, stop_time=2.0), kind="python", output=parts, checkpoint_every=0.7, figures=False)
    times = []
    for stop in (3.0, 5.5, 9.0):
        times.append(checkpoint.read_checkpoint(parts).time)
        result = resume(parts, stop_time=stop, figures=False)
        assert (result.status, result.time[-1]) == ("completed", stop)
    assert times == pytest.approx([1.4, 2.8, 4.9])
    assert (parts / "results.csv").read_bytes() == (whole / "results.csv").read_bytes()


def test_a_resumed_run_may_be_resumed_from_the_same_point(mine, tmp_path):
    run(loop(mine), kind="plain", output=tmp_path, checkpoint_every=2.0, figures=False)
    wanted = read(tmp_path)
    for _ in range(2):
        resume(tmp_path, checkpoint_every=100.0, figures=False)
        assert read(tmp_path) == wanted
        assert checkpoint.read_checkpoint(tmp_path).time == 2.0


def test_a_model_that_fails_does_so_again(mine, tmp_path):
    system = System(stop_time=9.0, step=0.1)
    system.add("lag", mine("Lag"))
    system.add("bad", mine("Fails"), until=4.0)
    system.connect("lag.x", "bad.u")
    errors, files = [], []
    for go in (lambda: run(system, output=tmp_path, checkpoint_every=1.5), lambda: resume(tmp_path)):
        with pytest.raises(FmuError) as caught:
            go()
        errors.append(str(caught.value))
        files.append((tmp_path / "results.csv").read_bytes())
        assert json.loads((tmp_path / "run.json").read_text())["status"] == "failed"
    assert errors[0] == errors[1]
    assert errors[0].startswith("bad, t = 4")
    assert files[0] == files[1]


def test_a_resumed_run_goes_on_with_checkpoints_at_the_same_points(mine, tmp_path, monkeypatch):
    written = []
    write = checkpoint.Checkpoint.write
    monkeypatch.setattr(checkpoint.Checkpoint, "write", lambda self, d: written.append(self.time) or write(self, d))
    run(loop(mine, stop_time=1.5), kind="plain", output=tmp_path, checkpoint_every=0.4)
    resume(tmp_path, stop_time=3.0)
    assert written == pytest.approx([0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8])


def test_the_kernel_steps_resumed_runs_too(mine, tmp_path, monkeypatch):
    if compiled.kernel is None:
        pytest.skip("installed without the compiled step loop")
    run(loop(mine), kind="python", output=tmp_path, checkpoint_every=2.0, figures=False)
    steps = []
    take = compiled.CompiledLoop.run
    monkeypatch.setattr(
        compiled.CompiledLoop,
        "run",
        lambda self, *given, table: steps.append(given[2]) or take(self, *given, table=table),
    )
    resume(tmp_path)
    assert steps == [(20, 30, 30)]
