"""Requirements: verdict, margin, worst time and index against hand computation; every message read."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.evaluation import Judge
from railcosim.orchestrator.evaluation.requirements import parse_requirement

pytestmark = pytest.mark.usefixtures("parts")


class Run:
    """A recorded run made of plain arrays."""

    def __init__(self, end=10.0, *, record=0.5, step=0.5, stop_time=None, completed=True, parameters=None, **columns):
        self.time = np.arange(round(end / record) + 1) * record
        self.step, self.completed, self.stop_time = step, completed, end if stop_time is None else stop_time
        self.columns = {name.replace("__", "."): np.asarray(x, float) for name, x in columns.items()}
        self.units, self.parameters = {}, parameters or {}

    def put(self, name, values, unit=""):
        self.columns[name] = np.broadcast_to(np.asarray(values, float), self.time.shape)
        self.units[name] = unit
        return self

    def names(self):
        return self.columns.keys()

    @property
    def points(self):
        return len(self.time)

    def part(self, first, last):
        return {name: values[first:last] for name, values in {"time": self.time, **self.columns}.items()}

    def __getitem__(self, name):
        return self.columns[name]


def run(end=100.0, **more):
    """a[1].x = t and a[2].x = t / 2 - 10 up to `end`; b.ok is true after 50 s; b.nan is NaN at 30 s."""
    signals = Run(end, **more)
    t = signals.time
    signals.put("a[1].x", t).put("a[2].x", t / 2 - 10)
    return signals.put("b.ok", t > 50).put("b.nan", np.where(t == 30, np.nan, 0.0))


def judge(text, signals=None):
    return parse_requirement("name", text).evaluate(signals or run())


def problems_of(table, names, steady=True, parameters=None):
    return Judge({}, table, names, parameters, steady=steady).requirement_problems


@pytest.mark.parametrize(
    ("text", "verdict", "margin", "time", "index"),
    [
        ("always a[i].x <= 101", "pass", 1.0, 100.0, 1),
        ("always a[i].x < 60", "fail", -40.0, 100.0, 1),
        ("always a[i].x < 60 until 50", "pass", 10.0, 50.0, 1),
        ("always a[i].x >= -11 from 10", "pass", 6.0, 10.0, 2),
        ("always a[i].x < 60 outside [60, 100]", "pass", 0.5, 59.5, 1),  # a closed interval
        ("always a[1].x < 20 or a[1].x > 80 outside [20, 50] outside [50, 80]", "pass", 0.5, 19.5, None),
        ("always -20 < a[i-1].x - a[i].x < 70", "pass", 10.0, 100.0, 2),
        ("always a[:].x < 60", "fail", -40.0, 100.0, 1),  # rows are told by number, too
        ("always a[2:].x < 60", "pass", 20.0, 100.0, 2),
        ("always abs(a[1].x - 50) <= 50", "pass", 0.0, 0.0, None),
        ("always a[1].x != 200", "pass", 100.0, 100.0, None),
        ("always a[1].x == time", "pass", 0.0, 0.0, None),
        ("always not a[1].x > 60", "fail", -40.0, 100.0, None),
        ("always a[1].x > -1 and a[1].x < 101", "pass", 1.0, 0.0, None),
        ("always (a[1].x < 5 if time < 5 else a[1].x < 200) from 1", "pass", 0.5, 4.5, None),
        ("eventually a[1].x > 90", "pass", 10.0, 100.0, None),
        ("eventually a[i].x > 39", "pass", 1.0, 100.0, 2),
        ("eventually a[i].x > 41", "fail", -1.0, 100.0, 2),
        ("eventually a[i].x > 39 until 50", "fail", -24.0, 50.0, 2),
        ("finally a[i].x > 39.5", "pass", 0.5, 100.0, 2),
        ("finally a[i].x < 50", "fail", -50.0, 100.0, 1),
        ("finally a[1].x < 50 until 49.9", "pass", 0.5, 49.5, None),
        ("finally a[1].x < 50 outside [45, 100]", "pass", 5.5, 44.5, None),
        ("finally max(a[:].x) <= 100", "pass", 0.0, 100.0, None),
    ],
)
def test_verdicts(text, verdict, margin, time, index):
    result = judge(text)
    assert (result.verdict, result.margin, result.time, result.index) == (verdict, margin, time, index)
    assert result.name == "name"
    assert result.text == text


def test_strictness_decides_at_margin_zero():
    strict, loose = judge("always a[1].x < 100"), judge("always a[1].x <= 100")
    assert (strict.verdict, strict.margin) == ("fail", 0.0)
    assert (loose.verdict, loose.margin) == ("pass", 0.0)
    assert judge("always not a[1].x >= 100").verdict == "fail"
    assert judge("always not a[1].x > 100").verdict == "pass"


def test_eventually_asks_the_rows_of_a_slice_at_one_moment_and_each_index_by_itself():
    """a[1] is below 5 only before 5 s, a[2] above 5 only after 30 s."""
    each = "eventually (a[i].x < 5 if {k} else a[i].x > 5)"
    assert judge("eventually a[1].x < 5 or a[2].x > 5").verdict == "pass"
    assert judge("eventually a[1].x < 5 and a[2].x > 5").verdict == "fail"
    assert judge(each.format(k="i == 1")).verdict == "pass"
    crossing = run().put("c[1].x", run()["a[1].x"]).put("c[2].x", 100 - run()["a[1].x"])
    assert judge("eventually c[i].x > 60", crossing).verdict == "pass"
    together = judge("eventually c[:].x > 60", crossing)
    assert (together.verdict, together.margin, together.time) == ("fail", -10.0, 50.0)
    assert judge("eventually c[:].x >= 50", crossing).verdict == "pass"


def test_a_boolean_has_no_margin():
    assert (judge("always b.ok from 51").verdict, judge("always b.ok from 51").margin) == ("pass", None)
    failed = judge("always not b.ok")
    assert (failed.verdict, failed.margin, failed.time) == ("fail", None, 50.5)
    assert judge("eventually b.ok").verdict == "pass"
    assert judge("finally b.ok").verdict == "pass"
    mixed = judge("always b.ok and a[1].x < 101 from 51")
    assert (mixed.verdict, mixed.margin) == ("pass", 1.0)
    assert judge("always true").verdict == "pass"


def test_nan_fails_whatever_the_quantifier_and_however_it_is_wrapped():
    for text in (
        "always b.nan < 1",
        "always not b.nan > 1",
        "always b.nan < 1 or a[1].x >= 0",
        "always b.nan < 1 and a[1].x >= 0",
        "always b.nan != 3",
        "always (true if b.nan < 1 else true)",
        "always not b.nan",
        "eventually b.nan < 1",
        "finally b.nan < 1 until 30",
    ):
        verdict = judge(text)
        assert verdict.verdict == "fail", text
        assert math.isnan(verdict.margin), text
        assert verdict.time == 30.0, text
        assert verdict.reason == "a value is not a number (NaN)"
    assert judge("always b.nan < 1 outside [30, 30]").verdict == "pass"
    assert judge("finally b.nan < 1").verdict == "pass"


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        ("always a[1].x <= 200", "inconclusive"),
        ("always a[1].x <= 20", "fail"),  # it has already failed
        ("always a[1].x <= 200 until 40", "inconclusive"),  # an unfinished run never passes
        ("eventually a[1].x > 20", "inconclusive"),
        ("eventually a[1].x > 90", "inconclusive"),
        ("eventually a[1].x > 90 until 40", "fail"),  # its window is over
        ("finally a[1].x > 0", "inconclusive"),
        ("finally a[1].x > 90 until 40", "fail"),
        ("always settling_time(a[1].x - 50, 1) < 40", "inconclusive"),  # not final before the run is
    ],
)
def test_an_unfinished_run_never_passes(text, verdict):
    result = judge(text, run(60.0, stop_time=100.0, completed=False))
    assert result.verdict == verdict
    if verdict == "inconclusive":
        assert result.reason == "the run ended at 60 s, before its stop time 100 s"


@pytest.mark.parametrize("quantifier", ["always", "eventually", "finally"])
def test_a_window_past_the_end_is_inconclusive(quantifier):
    late = judge(f"{quantifier} a[1].x < 1000 until 200")
    assert (late.verdict, late.reason) == ("inconclusive", "its window lasts until 200 s, the run only until 100 s")
    never = judge(f"{quantifier} a[1].x < 1000 from 200")
    assert (never.verdict, never.points) == ("inconclusive", 0)
    assert never.reason == "no recorded point lies in its window"
    assert judge(f"{quantifier} a[1].x < 1000 outside [0, 100]").verdict == "inconclusive"
    reducer = judge(f"{quantifier} max(a[1].x, until = 200) < 1000")
    assert reducer.verdict == "inconclusive"
    assert "the window lasts until 200 s but the recorded points end at 100 s" in reducer.reason


def test_a_violation_before_the_end_of_a_late_window_fails_always():
    assert judge("always a[1].x < 10 until 200").verdict == "fail"


def test_no_matching_index_is_never_a_pass():
    assert judge("always a[i-5].x - a[i].x < 3").verdict == "inconclusive"


def test_points_are_counted():
    assert judge("always a[1].x < 200").points == 201
    assert judge("always a[1].x < 200 from 10 until 20").points == 21
    assert judge("finally a[1].x < 200").points == 1


def test_the_last_point_of_the_worst_is_the_first_of_equals():
    flat = run().put("c.x", 1.0)
    assert judge("always c.x < 2", flat).time == 0.0


def test_words_inside_brackets_quotes_and_names_are_not_clauses():
    signals = run().put("odd until 3", 1.0).put("b.until", 2.0)
    assert judge('always signal("odd until 3") < 2 until 50', signals).points == 101
    assert judge("always b.until < 3 until 50", signals).points == 101
    assert judge("always max(a[1].x, until = 30) <= 30 from 40 until 50", signals).points == 21


def test_times_may_be_computed():
    assert judge("always a[1].x < 200 from 2 * 30").points == 81


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a[1].x < 3", "'a[1].x < 3' does not say when; write always, eventually or finally, then a condition"),
        ("alway a[1].x < 3", "does not say when; did you mean 'always'?"),
        ("always", "an expression is empty"),
        ("always a[1].x <", "invalid syntax"),
        ("always a[1].x < 3 until", "'until' needs a time in seconds, as in until 210"),
        ("always a[1].x < 3 from 1 from 2", "'from' stands twice; keep one"),
        ("always a[1].x < 3 from 5 until 4", "'from 5 until 4' ends before it starts; swap the two"),
        ("always a[1].x < 3 outside 3", "'outside 3' is not a time window; write outside [210, 240]"),
        ("always a[1].x < 3 outside [1, 2, 3]", "is not a time window"),
        ("always a[1].x < 3 outside [5, 4]", "'outside [5, 4]' ends before it starts; swap the two"),
    ],
)
def test_refused_with_the_remedy(text, message):
    with pytest.raises(ExpressionError) as caught:
        parse_requirement("comfort", text)
    assert message in str(caught.value)
    assert problems_of({"comfort": text}, ["a[1].x"]) == caught.value.at("requirement 'comfort'")


def test_bounds_and_windows_are_read_from_parameters():
    late = {"gust.start_time": 60.0, "gust.stop_time": 100.0, "law[1].limit": 60.0, "law[2].limit": 30.0}
    text = "always a[i].x < law[i].limit outside [gust.start_time, gust.stop_time]"
    verdict = judge(text, run(parameters=late))
    assert (verdict.verdict, verdict.margin, verdict.time, verdict.index) == ("pass", 0.5, 59.5, 1)
    assert judge(text, run(parameters={**late, "gust.start_time": 70.0})).verdict == "fail"
    assert judge(text, run(parameters={**late, "law[2].limit": 10.0})).index == 2
    rows = judge("always a[1:2].x < law[1:2].limit until gust.start_time / 2", run(parameters=late))
    assert (rows.verdict, rows.margin, rows.index) == ("pass", 25.0, 2)
    assert judge("always a[1].x < 200 from gust.start_time until 60", run(parameters=late)).points == 1


def test_a_window_is_of_times_that_stand_still():
    names, parameters = ["a[1].x", "a[2].x", "gust.start_time", "gust.stop_time"], ["gust.start_time", "gust.stop_time"]

    def problems(text):
        return [str(problem) for problem in problems_of({"r": text}, names, True, parameters)]

    assert problems("always a[1].x < 3 outside [gust.start_time, gust.stop_time + 1]") == []
    place = "requirement 'r': 'a[1].x': "
    assert problems("always a[1].x < 3 from a[1].x") == [f"{place}a time is a number or a parameter, not a signal"]
    (near,) = problems("always a[1].x < 3 until gust.start_tim")
    assert "did you mean 'gust.start_time'?" in near
    (one,) = problems("always a[i].x < 3 until a[i].x")
    assert "a time is one for all i" in one
    backwards = run(parameters={"gust.start_time": 9.0, "gust.stop_time": 3.0})
    verdict = judge("always a[1].x < 200 outside [gust.start_time, gust.stop_time]", backwards)
    assert (verdict.verdict, verdict.reason) == ("inconclusive", "'outside [9, 3]' ends before it starts; swap the two")


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        ("always x.bit <= 0.3", "pass"),  # 0.1 + 0.2
        ("always x.bit < 0.3", "fail"),
        ("always 0.3 >= x.bit", "pass"),
        ("always x.bit == 0.3", "pass"),
        ("always x.bit != 0.3", "fail"),
        ("always not x.bit > 0.3", "pass"),
        ("always abs(x.far - x.near) <= 1000.1", "pass"),  # 50000.1 + 1000.1 - 50000.1, an ulp of 50 km beyond
        ("always x.near - x.far + 1000.1 >= 0", "pass"),
        ("always minimum(x.far - x.near, 1e9) <= 1000.1", "pass"),
        ("always x.bit <= 0.3 - 1e-14", "fail"),  # that is more than rounding
        ("always abs(x.far - x.near) <= 1000.1 - 1e-9", "fail"),
    ],
)
def test_numbers_that_differ_by_rounding_are_equal(text, verdict):
    signals = run().put("x.bit", 0.1 + 0.2).put("x.near", 50000.1).put("x.far", 50000.1 + 1000.1)
    found = judge(text, signals)
    assert found.verdict == verdict
    assert found.margin == 0.0 or found.margin < -1e-15


def test_all_problems_of_one_text_are_told():
    with pytest.raises(ExpressionError) as caught:
        parse_requirement("r", "always a[1].x < from x until outside 3")
    assert len(caught.value.problems) == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("always a[i].y < 3", "there is no signal or parameter 'a[i].y'; did you mean 'a[i].x'?"),
        ("always abs(a[i].x)", "'abs(a[i].x)' is a number, not a condition; compare it, as in abs(x) <= 1"),
        ("always a[1].x + 1", "is a number, not a condition"),
        ("always b.ok and 3", "is a number, not a condition"),
        ("always not (a[1].x - 1)", "is a number, not a condition"),
        ("always pi", "is a number, not a condition"),
        ("always at_sample(a[1].x) < 3", "take an algorithm that keeps the step"),
        ("always", "an expression is empty"),
    ],
)
def test_check_finds_it_before_the_run(text, message):
    problems = problems_of({"comfort": text}, list(run().names()), steady=False)
    assert len(problems) == 1
    assert message in str(problems[0])
    assert problems[0].place.startswith("requirement 'comfort'")


def test_a_table_is_checked_and_judged_in_its_order():
    table = {"one": "always a[i].x < 200", "two": "eventually b.ok", "three": "always at_sample(a[1].x) < 200"}
    assert problems_of(table, list(run().names())) == []
    assert [verdict.name for verdict in Judge({}, table, list(run().names())).verdicts(run())] == [
        "one",
        "two",
        "three",
    ]
    assert {verdict.verdict for verdict in Judge({}, table, list(run().names())).verdicts(run())} == {"pass"}


def test_no_recorded_points_at_all():
    empty = Run(0.0).put("a[1].x", 0.0)
    empty.time, empty.columns = np.empty(0), {"a[1].x": np.empty(0)}
    assert judge("always a[1].x < 3", empty).verdict == "inconclusive"


WORDS = 'always eventually finally from until outside [1,2] [ ] ( ) a[i].x a[:].x b.ok < <= and not 3 "q" , if else nan'


@settings(max_examples=500, deadline=None)
@given(st.lists(st.sampled_from(WORDS.split(" ")), max_size=12).map(" ".join) | st.text(max_size=40))
def test_any_text_is_judged_or_refused(text):
    try:
        requirement = parse_requirement("r", text)
        if not requirement.check(list(run().names())):
            requirement.evaluate(run())
    except ExpressionError:
        pass


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-5, 5) | st.just(math.nan), min_size=3, max_size=3), st.floats(-5, 5))
def test_pass_means_every_point_holds(values, limit):
    """The margin's sign agrees with a plain loop, for both operators and their negations."""
    signals = Run(1.0).put("s.x", values)
    for text, holds in (
        (f"always s.x < {limit!r}", all(x < limit for x in values)),
        (f"always s.x <= {limit!r}", all(x <= limit for x in values)),
        (f"always not s.x > {limit!r}", all(x <= limit for x in values)),
        (f"eventually s.x >= {limit!r}", any(x >= limit for x in values) and not any(map(math.isnan, values))),
    ):
        verdict = judge(text, signals)
        assert (verdict.verdict == "pass") == holds
        if not math.isnan(verdict.margin):
            assert verdict.margin >= 0 if holds else verdict.margin <= 0
