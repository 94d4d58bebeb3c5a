"""`Judge`: one that is made once says of every run what the run alone says."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.evaluation import FUNCTIONS, Expression, Judge, parse, unit_of
from railcosim.orchestrator.evaluation.terms import Plan, Prepared
from railcosim.orchestrator.run.recording import Results

pytestmark = pytest.mark.usefixtures("parts")

METRICS = {"top": "max(s.x)", "gap_min": "min(a[i-1].x - a[i].x)"}
NAMES = ["s.x", "a[1].x", "a[2].x", "a[3].x", "s.limit"]


def run(x, limit=5.0, completed=True):
    columns = {"s.x": np.asarray(x, float), **{f"a[{i}].x": -float(i * i) + np.asarray(x, float) for i in (1, 2, 3)}}
    parameters = {"s.limit": limit}
    time = 0.5 * np.arange(len(x))
    return Results(
        columns, time, units={"s.x": "m"}, parameters=parameters, step=0.5, stop_time=time[-1], completed=completed
    )


def test_one_judge_judges_many_runs():
    judge = Judge(METRICS, {"low": "always s.x < s.limit"}, NAMES, {"s.limit"})
    assert judge.metric_problems == judge.requirement_problems == []
    assert judge.value_names == ("top", "gap_min[2]", "gap_min[3]")
    assert judge.requirement_names == ("low",)
    assert judge.needed_signals == set(NAMES)
    for top in (1.0, 2.0, 6.0):
        signals = run([0.0, 1.0, top])
        metric, gap = judge.metrics(signals)
        assert metric.values == {None: top}
        assert metric.unit == "m"
        assert gap.values == {2: 3.0, 3: 5.0}
        assert judge.values(signals) == {"top": top, "gap_min[2]": 3.0, "gap_min[3]": 5.0}
        (verdict,) = judge.verdicts(signals)
        assert (verdict.verdict, verdict.margin) == ("pass" if top < 5.0 else "fail", 5.0 - top)
    (verdict,) = judge.verdicts(run([0.0, 1.0, 2.0], limit=1.5))
    assert verdict.margin == -0.5


def test_the_culprit_of_what_is_infinite_is_found_without_a_warning():
    judge = Judge({}, {"equal": "always (0 < s.x <= s.x)"}, NAMES)
    (verdict,) = judge.verdicts(run([math.inf]))  # inf - inf is no number
    assert (verdict.verdict, verdict.blame) == ("pass", ("s.x",))


def test_conditions_within_a_choice():
    """By hand: at 1 it is 1 above 0; below 3 both count, then neither may hold, of which one is missed by 2."""
    text = "always ((0 < s.x and s.x < s.limit) if s.x < 3 else not (s.x < 2 or s.x > 9))"
    (verdict,) = Judge({}, {"r": text}, NAMES, {"s.limit"}).verdicts(run([1.0, 2.0, 4.0]))
    assert (verdict.verdict, verdict.margin, verdict.time) == ("pass", 1.0, 0.0)
    (verdict,) = Judge({}, {"r": text}, NAMES, {"s.limit"}).verdicts(run([2.5, 4.0, 8.5]))
    assert (verdict.verdict, verdict.margin, verdict.time) == ("pass", 0.5, 1.0)


def test_a_run_that_lacks_a_value_has_nan_by_its_name():
    judge = Judge({"late": "max(s.x, until = 9)", **METRICS}, {}, NAMES)
    values = judge.values(run([1.0, 2.0, 3.0]))
    assert math.isnan(values.pop("late"))
    assert values == {"top": 3.0, "gap_min[2]": 3.0, "gap_min[3]": 5.0}


def test_problems_are_told_apart():
    judge = Judge({"top": "max(s.y)"}, {"low": "s.x < 1"}, NAMES)
    assert [problem.place for problem in judge.metric_problems] == ["metric 'top': 'max(s.y)', column 5"]
    assert [problem.place for problem in judge.requirement_problems] == ["requirement 'low'"]


def test_a_run_without_a_signal_has_no_value_and_says_so():
    judge = Judge({"top": "max(s.x)", "other": "max(s.y)"}, {}, [*NAMES, "s.y"])
    top, other = judge.metrics(run([1.0, 2.0]))
    assert top.values == {None: 2.0}
    assert other.problem == "'max(s.y)': the run has no 's.y'"


def test_a_table_that_cannot_be_read_is_told_after_the_run_too():
    judge = Judge({"torn": "max(", **METRICS}, {"low": "s.x < 1"}, NAMES)
    torn, top, _ = judge.metrics(run([1.0, 2.0]))
    assert "was never closed" in torn.problem
    assert math.isnan(torn.values[None])
    assert top.values == {None: 2.0}
    with pytest.raises(ExpressionError, match="does not say when"):
        judge.verdicts(run([1.0]))


def test_a_metric_that_fails_late_leaves_the_others_whole():
    """At a part of a long run where the others have seen the parts before."""
    signals = run([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    signals.time[-1] += 0.1
    table = {"late": "max(at_sample(s.x))", **METRICS, "mean": "mean(s.x)"}
    late, top, gap, mean = Judge(table, {}, NAMES).metrics(signals)
    assert "at_sample needs steps of one length" in late.problem
    assert top.values == {None: 7.0}
    assert gap.values == {2: 3.0, 3: 5.0}
    assert mean.values[None] == pytest.approx((0.5 * 5 * 3.5 + 0.6 * 6.5) / 3.1, rel=1e-15)


def test_a_number_of_points_that_is_not_that_of_the_run_is_refused():
    with pytest.raises(ExpressionError, match="its parts differ in their number of rows"):
        parse("max(d)", FUNCTIONS).evaluate(run([1.0, 2.0, 3.0]), None, d=np.ones(2))


def test_a_run_without_a_point_has_no_values():
    empty = Results(
        {name: np.empty(0) for name in NAMES[:-1]},
        np.empty(0),
        units={},
        parameters={"s.limit": 5.0},
        step=0.5,
        stop_time=1.0,
        completed=False,
    )
    for metric in Judge(METRICS, {}, NAMES).metrics(empty):
        assert "no recorded point lies in the window" in metric.problem
        assert all(map(math.isnan, metric.values.values()))


def test_units_are_those_of_the_run_and_of_the_expression_itself():
    judge = Judge({"top": "max(s.x)"}, {}, NAMES)
    first, second = run([1.0, 2.0]), run([1.0, 2.0])
    second.units = {"s.x": "km"}
    assert [judge.metrics(signals)[0].unit for signals in (first, second, first)] == ["m", "km", "m"]
    prepared = Prepared(Plan(NAMES), second)
    whole = parse("s.x - s.limit")
    assert unit_of(Expression(whole.text, whole.references[0]), prepared) == "km"
    assert unit_of(Expression(whole.text, whole.references[1]), prepared) == ""  # of another part of the same text
