"""Runs of a batch are single runs: the same numbers, to the bit, and the same messages."""

import signal
from dataclasses import replace

import numpy as np
import pytest
from railcosim.orchestrator import Batch, System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.scenario import changed, load, shipped

CHANGES = [
    {},
    {"lag.rate": 2.0},
    {"simulation.seed": 6},
    {"events[1].at": 0.2, "events[1].value": 3.0},
    {"lag[2].rate": "i * 3", "lag.gain": [1.0, -2.0]},
    {"lag.u": 3.0},
    {},
]


def single(system, changes, **options):
    return execute(changed(system, changes), **options)


def agree(row, run):
    """Whether a row is that of a single run."""
    assert (row.status, row.error) == (run.status, str(run.error or ""))
    values = {(m.name if k is None else f"{m.name}[{k}]"): x for m in run.metrics for k, x in m.values.items()}
    # A metric that cannot be evaluated is one NaN of a single run, and one for each of its values of a row.
    assert values.keys() <= {*row.metrics, *(name.partition("[")[0] for name in row.metrics)}
    np.testing.assert_array_equal([values.get(name, np.nan) for name in row.metrics], list(row.metrics.values()))
    assert row.verdicts == {one.name: one.verdict for one in run.requirements}
    margins = [np.nan if one.margin is None else one.margin for one in run.requirements]
    np.testing.assert_array_equal(list(row.margins.values()), margins)
    scaled = [np.nan if one.robustness is None else one.robustness for one in run.requirements]
    np.testing.assert_array_equal(list(row.scaled.values()), scaled)
    assert row.steps == run.seconds["steps"]
    for name, values in (row.series or {}).items():
        np.testing.assert_array_equal(values, run.time if name == "time" else run[name])


@pytest.mark.parametrize("kind", ["plain", "native"])
def test_a_row_is_a_single_run_in_any_order(system, kind):
    singles = [single(system, changes, kind=kind) for changes in CHANGES]
    with Batch(system, kind=kind, record=["lag.x", "ramp.x"]) as batch:
        assert batch.metrics == ("end[1]", "end[2]", "most")
        assert batch.requirements == ("low",)
        for k in (*range(len(CHANGES)), *reversed(range(len(CHANGES)))):
            row = batch.run(CHANGES[k])
            assert list(row.series) == ["time", "lag[1].x", "lag[2].x", "ramp.x"]
            agree(row, singles[k])


def test_changes_that_cannot_be_run_are_rows_that_say_why(system):
    with Batch(system, kind="plain") as batch:
        found = batch.run_all([{"lag.rate": 1.0}, {"lag.rate": "no"}, {"lag.rte": 1.0}, {"lag.count": 3}, {}])
    assert list(found.status) == ["completed", "refused", "refused", "refused", "completed"]
    for k, changes in ((1, {"lag.rate": "no"}), (2, {"lag.rte": 1.0}), (3, {"lag.count": 3})):
        with pytest.raises(ScenarioError) as caught:
            single(system, changes, kind="plain")
        assert found.error[k] == str(caught.value)
    assert len(found) == 5
    np.testing.assert_array_equal(np.isnan(found.metrics["end[1]"]), [False, True, True, True, False])
    assert list(found.verdicts["low"]) == ["pass", "", "", "", "pass"]
    np.testing.assert_array_equal(np.isnan(found.margins["low"]), [False, True, True, True, False])
    assert [row.passed for row in found.rows] == [True, False, False, False, True]


def test_nothing_is_evaluated_or_recorded_that_is_not_asked_for(system):
    with Batch(system, kind="plain", evaluate=False) as batch:
        row = batch.run()
    assert (batch.metrics, batch.requirements) == ((), ())
    assert (row.status, row.metrics, row.verdicts, row.margins, row.series) == ("completed", {}, {}, {}, None)
    assert row.passed


def test_a_signal_to_be_recorded_has_to_be_there(system):
    with pytest.raises(ScenarioError, match=r"^record: there is no signal 'lag\[3\].x'; did you mean"):
        Batch(system, kind="plain", record=["lag[3].x"])


def test_an_interruption_ends_the_run_and_leaves_the_batch_as_it_was(system):
    def runs():
        yield {}
        signal.raise_signal(signal.SIGINT)
        yield {}
        yield {}

    with Batch(system, kind="plain", record=["lag.x"]) as batch:
        before = batch.run()
        with pytest.raises(KeyboardInterrupt):
            batch.run_all(runs())
        after = batch.run()
    np.testing.assert_array_equal(before.series["lag[1].x"], after.series["lag[1].x"])


def test_a_system_that_cannot_run_is_an_error(system):
    system.connect("lag[1].y", "lag[2].u")
    with pytest.raises(ScenarioError):
        Batch(system, kind="plain")


def test_values_that_do_not_settle_are_told(mine):
    system = System(step=0.25, stop_time=1.0, algebraic_loops="solve")
    for name in ("a", "b"):
        system.add(name, mine("Affine"), gain=0.5)
    system.connect("a.y", "b.u")
    system.connect("b.y", "a.u")
    with Batch(system, kind="plain", record=["a.y"]) as batch:
        agree(batch.run(), single(system, {}, kind="plain"))
        row = batch.run({"a.gain": 2.0, "a.w": 1.0})
    assert (row.status, bool(row.error)) in {("refused", True), ("failed", True)}


def test_values_that_decide_about_connections_have_instances_of_their_own(components):
    """An input beside a connected one is connected too, unless a value holds it."""
    body = """
class Line(Component):
    slope = Output("1")
    curve = Output("1")

    def outputs(self):
        return {"slope": 1.0 + self.time, "curve": 2.0 + self.time}


class Car(Component):
    slope = Input("1")
    curve = Input("1", beside=slope, optional=True)
    x = State("1", 0.0, output=True)

    def derivatives(self):
        return {"x": self.slope + self.curve}
"""
    mine = components(body)
    system = System(step=0.25, stop_time=1.0)
    system.add("line", mine("Line"))
    system.add("car", mine("Car"))
    system.connect("line.slope", "car.slope")
    runs = [{}, {"car.curve": 5.0}, {}, {"car.curve": 6.0}]
    with Batch(system, kind="plain", record=["car.x"]) as batch:
        rows = [batch.run(changes) for changes in runs]
    for changes, row in zip(runs, rows, strict=True):
        agree(row, single(system, changes, kind="plain"))
    assert len({row.series["car.x"][-1] for row in rows}) == 3


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name, _ in shipped()])
def test_rows_of_every_shipped_scenario_are_single_runs(name):
    stepping = load(name).stepping
    span = max(60 * stepping.step, 2 * (stepping.record or 0.0))
    span = round(span / (stepping.record or stepping.step)) * (stepping.record or stepping.step)
    system = load(name, stop_time=min(stepping.stop_time, stepping.start_time + span))
    instance, key, value = next(
        (one.name, key, value)
        for one in system.instances.values()
        for key, value in one.start.items()
        if isinstance(value, float) and value
    )
    runs = [{}, {f"{instance}.{key}": value * 1.0001}, {"simulation.seed": 3}, {}]
    singles = [single(system, changes) for changes in runs]
    with Batch(system, record=list(singles[0].names())) as batch:
        for k in (0, 1, 2, 3, 2, 1, 0):
            agree(batch.run(runs[k]), singles[k])


@pytest.mark.parametrize("delay", [0, 2])
def test_what_is_made_for_a_run_is_kept_for_the_next(system, delay):
    """Where nothing happens on the way, and until instances have failed."""
    links = [replace(each, delay=delay) for each in system.connections]
    calm, runs = system.changed(events=[], connections=links), ({"lag.rate": 2.0}, {"lag.u": 3.0})
    singles = [single(calm, changes, kind="native") for changes in runs]
    with Batch(calm, kind="native", record=["lag.x", "ramp.x"]) as batch:
        for k in (0, 1, 0, None, 1, 0):
            row = batch.run({"lag.rate": -1e300} if k is None else runs[k])
            if k is None:
                assert row.status == "failed"
            else:
                agree(row, singles[k])
