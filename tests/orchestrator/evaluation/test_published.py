"""Known values, published and own: what is judged, what is not and why; every message read."""

import math

import pytest
from railcosim.orchestrator.evaluation.metrics import Metric
from railcosim.orchestrator.evaluation.published import check_values, count_values, judge_values, split_metric

METRICS = [
    Metric("settling", "", {None: 138.5}, "s"),
    Metric("gap", "", {2: 17484.2, 3: 16709.0, 4: 18859.1}, "m"),
    Metric("late", "", {None: math.inf}, "s"),
    Metric("lost", "", {None: math.nan}, "m", problem="no recorded point lies in the window"),
    Metric("nan", "", {None: math.nan}, "m"),
    Metric("order", "", {None: 1.0}),
]
INDICES = {metric.name: tuple(metric.values) for metric in METRICS}
PRESETS = ("figure-consistent", "as-stated")


def entry(metric="settling", value=138.6, tolerance=1.0, origin="stated", **more):
    every = {"metric": metric, "value": value, "tolerance": tolerance, "origin": origin, **more}
    return {key: x for key, x in every.items() if x is not None}


def row(made, preset=None, modified=False, **more):
    (only,) = judge_values([made], METRICS, preset, modified, default_preset="figure-consistent", **more)
    return only


def test_a_row_carries_everything_the_table_shows():
    made = entry(where="own measurement", claim="settles later", preset="figure-consistent", origin="fitted")
    shown = row(made)
    assert (shown.metric, shown.index, shown.preset) == ("settling", None, "figure-consistent")
    assert (shown.value, shown.measured, shown.tolerance, shown.unit) == (138.6, 138.5, 1.0, "s")
    assert (shown.where, shown.claim, shown.origin) == ("own measurement", "settles later", "fitted")
    assert (shown.verdict, shown.reason) == ("reproduced", "")


@pytest.mark.parametrize(
    ("made", "verdict", "reason"),
    [
        (entry(), "reproduced", ""),
        (entry(value=139.6), "missed", ""),
        (entry(value=139.5), "reproduced", ""),  # the tolerance includes its ends
        (entry(value=138.4, tolerance=0.1), "reproduced", ""),  # although 138.5 - 138.4 > 0.1 in binary
        (entry("gap[3]", 16709, 0), "reproduced", ""),
        (entry("gap[2]", 17484, 3), "reproduced", ""),
        (entry("order", True, None), "reproduced", ""),
        (entry("order", False, None), "missed", ""),
        (entry(value=139.5, tolerance={"rounding": 0.5, "sampling": 0.5}), "reproduced", ""),
        (entry(value=139.5, tolerance={"rounding": 0.5}), "missed", ""),
        (entry(value=150.0, departs="fitted badly"), "departs", "fitted badly"),
        (
            entry(departs="fitted badly"),
            "departs no more",
            "the entry says that it departs (fitted badly); mend the entry",
        ),
        (entry("late", 363.0, 5, departs="never settles"), "departs", "never settles"),
        (entry("order", False, None, departs="the proof is wrong"), "departs", "the proof is wrong"),
        (entry("nan", departs="x"), "missed", "the measured value is not a number (NaN)"),
        (entry("late", math.inf, None), "reproduced", ""),
        (entry("late", 363.0, 5), "missed", ""),
        (entry("settling", math.inf, None), "missed", ""),
        (entry("late", -math.inf, None), "missed", ""),
        (entry("nan"), "missed", "the measured value is not a number (NaN)"),
        (entry("lost"), "missed", "no recorded point lies in the window"),
        (entry(origin="misprint"), "not judged", "a misprint is printed, never judged"),
        (entry(value=None, claim="settles later"), "not judged", "no number is stated"),
        (entry(tolerance=None), "not judged", "no tolerance is given"),
    ],
)
def test_verdicts(made, verdict, reason):
    assert (row(made).verdict, row(made).reason) == (verdict, reason)


def test_only_the_unmodified_scenario_is_judged():
    assert row(entry(), modified=True).verdict == "not judged"
    assert row(entry(), modified=True).reason == "the scenario was modified"


def test_what_is_not_printed_by_a_source_is_a_reference():
    own = {key: value for key, value in entry().items() if key != "origin"}
    assert row(own).origin == "reference"
    assert row(entry(value=True, tolerance=None, metric="order")).judges_truth
    parts = row(entry(tolerance={"rounding": 0.5, "noise": 2}))
    assert (parts.allowances, parts.tolerance) == ({"rounding": 0.5, "noise": 2.0}, 2.5)


def test_values_are_counted_apart_by_origin():
    made = [entry(), entry(value=1.0), entry(origin="misprint"), entry(origin="fitted", value=1.0, departs="why")]
    own = {key: value for key, value in entry().items() if key != "origin"}
    assert count_values(judge_values([own, *made], METRICS, None, False)) == {
        "stated": {"reproduced": 1, "missed": 1},
        "fitted": {"departs": 1},
        "misprint": {"not judged": 1},
        "reference": {"reproduced": 1},
    }


def test_an_unfinished_run_never_reproduces():
    assert row(entry(), completed=False).verdict == "not judged"
    assert row(entry(), completed=False).reason == "the run did not reach its stop time"


def test_entries_belong_to_one_preset():
    entries = [entry(value=1.0), entry(value=2.0, preset="figure-consistent"), entry(value=3.0, preset="as-stated")]

    def published(preset, default="figure-consistent"):
        return [r.value for r in judge_values(entries, METRICS, preset, False, default_preset=default)]

    assert published(None) == [1.0, 2.0]
    assert published("figure-consistent") == [1.0, 2.0]
    assert published("as-stated") == [3.0]
    assert published(None, default=None) == [1.0]


def test_a_metric_that_is_missing_is_missed():
    assert judge_values([entry("gone")], METRICS, None, False)[0].verdict == "missed"


def test_metric_names_may_carry_an_index():
    assert split_metric("gap[3]") == ("gap", 3)
    assert split_metric("gap") == ("gap", None)
    assert split_metric("gap[x]") == ("gap[x]", None)
    assert split_metric("gap[" + "9" * 5000 + "]")[1] is None


def test_right_entries_have_no_problems():
    right = [entry(), entry("gap[4]", where="section 8"), entry("late", math.inf, None), entry(value=None, claim="x")]
    right += [entry(tolerance={"rounding": 0.5, "sampling": 1}), entry(departs="the fit is coarse")]
    own = [{key: value for key, value in made.items() if key != "origin"} for made in right]
    assert check_values([*right, entry(preset="as-stated")], own, INDICES, PRESETS) == []


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (entry(tolerence=3), "unknown key 'tolerence'; did you mean 'tolerance'?"),
        (entry(zzz=3), "unknown key 'zzz'; there are claim, departs, metric, origin, preset"),
        (entry("setling"), "unknown metric 'setling'; did you mean 'settling'?"),
        (entry("zzz"), "unknown metric 'zzz'; there are gap, late"),
        (entry(None), "metric is missing; name the metric that measures this value"),
        (entry(7), "metric must be text, not 7"),
        (entry("gap"), "metric 'gap' has one value for each i; write one of gap[2], gap[3], gap[4]"),
        (entry("gap[1]"), "metric 'gap' has one value for each i; write one of gap[2], gap[3], gap[4]"),
        (entry("settling[1]"), "metric 'settling' has a single value; leave out [1]"),
        (
            entry(origin="statd"),
            "origin must be one of stated, fitted, reconstructed, misprint; did you mean 'stated'?",
        ),
        (
            entry(origin=None),
            "misprint; a value that no source printed stands under [[references]]",
        ),
        (entry(origin="reference"), "a value that no source printed stands under [[references]]"),
        (
            entry(status="measured"),
            "unknown key 'status'; origin = one of stated, fitted, reconstructed, misprint says",
        ),
        (entry(departs=""), "departs must be text, not ''"),
        (entry(departs=True), "departs must be text, not True"),
        (entry(value=None, claim="x", departs="y"), "only a value that is judged can depart; leave departs out"),
        (entry(origin="misprint", departs="y"), "only a value that is judged can depart; leave departs out"),
        (entry(tolerance={"roundin": 1}), "unknown part 'roundin' of the tolerance; did you mean 'rounding'?"),
        (entry(tolerance={"rounding": -1}), "rounding must be a number >= 0, not -1"),
        (entry(preset="as-statd"), "unknown preset 'as-statd'; did you mean 'as-stated'?"),
        (entry(preset="zzz"), "unknown preset 'zzz'; there are as-stated, figure-consistent"),
        (entry(value="about 100"), "value must be a number, inf or a boolean, not 'about 100'; put words into claim"),
        (entry(value=math.nan), "value must be a number"),
        (entry(value=None), "give a value, or a claim in words"),
        (entry(tolerance=-1), "tolerance must be a number >= 0, absolute and in the unit of the metric, not -1"),
        (entry(tolerance="1 %"), "tolerance must be a number >= 0"),
        (entry(tolerance=True), "tolerance must be a number >= 0"),
        (entry(where=3), "where must be text, not 3"),
    ],
)
def test_problems_name_the_entry_and_the_remedy(made, message):
    problems = check_values([entry(), made], [], INDICES, PRESETS)
    assert len(problems) == 1
    assert message in str(problems[0])
    assert problems[0].place.startswith("[[published]] entry 2 (")


def test_a_scenario_without_metrics_says_so():
    problem = check_values([entry()], [], {}, ())[0]
    assert (problem.message, problem.remedy) == ("unknown metric 'settling'", "there are none")


def test_a_reference_has_no_origin():
    (problem,) = check_values([], [entry()], INDICES, PRESETS)
    assert str(problem) == (
        "[[references]] entry 1 (settling): unknown key 'origin'; a value of one's own has none; "
        "what a source printed stands under [[published]]"
    )
