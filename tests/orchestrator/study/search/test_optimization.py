"""Optimisation over functions whose optimum is known."""

import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.study.search.optimization import minimize, read_objectives


def test_objectives_are_metrics_or_expressions():
    system = System(metrics={"objective_2": "max(a.b)", "gap": "min(x[i].y)"})
    objectives, more = read_objectives(system, ["gap[2]", "max(c.d)", "objective_2"])
    assert list(objectives.values()) == ["gap[2]", "max(c.d)", "objective_2"]
    assert list(objectives) == ["gap[2]", "objective_2_", "objective_2"]
    assert more == {"objective_2_": "max(c.d)"}


def test_the_least_value_that_keeps_a_requirement(searched):
    """The value falls with x0; the requirement, that it is 0 or more, ends at x0 = 0.75."""
    space, evaluations, _ = searched(lambda x: 0.75 - float(x[0]))
    told = []
    found = minimize(
        space, evaluations, {"value": "value"}, ["held"], budget=60, seed=1, told=lambda *what: told.append(what)
    )
    (best,) = found.best
    assert 0.7 < best.changes["it.x0"] <= 0.75
    assert found.values(best) == [best.metrics["value"]]
    assert found.is_held(best)
    assert told[-1] == (60, 60)
    assert len(found.evaluations) == found.runs == 60


def test_a_front_of_two_objectives(searched, monkeypatch):
    """Of x0 and 1 - x0, that is of all x0, none is better than another."""
    space, evaluations, _ = searched(lambda x: float(x[0]), (0.5,))
    original = evaluations._evaluate

    def both(points):
        for point, row in original(points):
            row.metrics["other"] = 1.0 - row.metrics["value"]
            yield point, row

    monkeypatch.setattr(evaluations, "_evaluate", both)
    found = minimize(space, evaluations, {"value": "a", "other": "b"}, (), budget=21, seed=1)
    values = [found.values(best) for best in found.best]
    assert values == sorted(values)
    assert len(values) == 21
    found = minimize(space, evaluations, {"value": "a", "nothing": "b"}, (), budget=5)
    assert found.best == ()


@pytest.mark.parametrize("nominal_fails", [True, False])
def test_runs_that_failed_and_requirements_that_cannot_hold(searched, nominal_fails):
    def margin(x):
        if (x[0] == 0.5) == nominal_fails:
            raise ArithmeticError("failed")
        return -1.0

    space, evaluations, _ = searched(margin)
    found = minimize(space, evaluations, {"value": "value"}, ["held"], budget=10)
    assert found.best == ()
    assert found.failed == (1 if nominal_fails else 9)
    assert found.errors == ("failed",)
