"""Reducers: every value against a hand computation or an analytic answer."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.errors import ExpressionError, WindowError
from railcosim.orchestrator.evaluation import Judge
from railcosim.orchestrator.evaluation.expressions import parse
from railcosim.orchestrator.evaluation.metrics import (
    COMFORT_SCALE,
    COMFORT_TITLE,
    FUNCTIONS,
    Metric,
    MetricChange,
    comfort_levels,
    compare_metrics,
    unit_of,
)

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


def measured(table, run):
    return Judge(table, {}, [*run.names(), *run.parameters]).metrics(run)


def problems_of(table, names, steady=True, parameters=None):
    return Judge(table, {}, names, parameters, steady=steady).metric_problems


def ramp():
    """x = t, y = 10 - 2 t, both over 0 ... 10 s at every 0.5 s; two rows a[1] = t, a[2] = -2 t."""
    run = Run()
    t = run.time
    run.put("s.x", t, "m").put("s.y", 10 - 2 * t, "m").put("s.pull", t, "N")
    return run.put("a[1].v", t, "m/s").put("a[2].v", -2 * t, "m/s").put("s.nan", np.where(t == 3, np.nan, t))


def value(text, run=None):
    return parse(text, FUNCTIONS).evaluate(run or ramp())


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("min(s.y)", -10.0),
        ("max(s.y)", 10.0),
        ("max(s.x, until = 4)", 4.0),
        ("min(s.x, after = 4)", 4.0),
        ("max(s.x, outside = [6, 10])", 5.5),  # the excluded interval is closed
        ("max(s.x, outside = [[6, 7], [7.5, 10]])", 5.5),
        ("max(s.x, outside = [])", 10.0),
        ("peak(s.y, after = 6)", 10.0),
        ("initial(s.y)", 10.0),
        ("initial(s.x, after = 2)", 2.0),
        ("final(s.y)", -10.0),
        ("final(s.x, until = 4.2)", 4.0),
        ("at(s.x, 3.25)", 3.25),  # linear between recorded points
        ("mean(s.x)", 5.0),
        ("mean(s.x, after = 2, until = 4)", 3.0),
        ("mean(s.x, after = 2, until = 2)", 2.0),
        ("integral(s.x)", 50.0),
        ("integral(s.x, after = 2, until = 4)", 6.0),
        ("integral(1 + 0 * s.x, outside = [4.1, 4.2])", 9.5),  # the interval around it is left out whole
        ("integral(3)", 30.0),  # a number is a constant signal
        ("rms(3)", 3.0),
        ("spread(s.x)", 0.0),
        ("spread(a[:].v)", 30.0),
        ("duration(s.x > 4)", 5.75),  # 5.5 s between the points that hold, and half the interval on the way there
        ("duration(s.x > 4, until = 6)", 1.75),
        ("duration(s.x < 0)", 0.0),
        ("first_time(s.x > 4)", 4.5),
        ("first_time(s.x > 40)", math.inf),
        ("last_time(s.y > 0)", 4.5),
        ("last_time(s.y > 40)", math.inf),
        ("jerk(s.y)", 2.0),
        ("mean_jerk(s.y)", 2.0),
        ("mean_jerk(s.y, 2.25)", 2.0),
        ("max(s.y) - 1", 9.0),
        ("final(s.x) < 11", True),
        # several rows: one number for the whole
        ("min(a[:].v)", -20.0),
        ("max(a[:].v)", 10.0),
        ("peak(a[:].v)", 20.0),
        ("final(a[:].v)", -20.0),  # the row of largest magnitude, with its sign
        ("at(a[:].v, 1)", -2.0),
        ("mean(a[:].v)", -2.5),
        ("integral(a[:].v)", -50.0),
        ("duration(a[:].v > 4)", 5.75),
        ("first_time(a[:].v < -4)", 2.5),
        ("jerk(a[:].v)", 2.0),
    ],
)
def test_reducers(text, expected):
    assert value(text) == pytest.approx(expected, abs=1e-12)


def test_rms_of_a_sine_is_its_amplitude_over_root_two():
    run = Run(20.0, record=0.01)
    run.put("s.x", 3 * np.sin(2 * np.pi * run.time))
    assert value("rms(s.x)", run) == pytest.approx(3 / np.sqrt(2), rel=1e-9)
    run.put("b[1].x", run["s.x"]).put("b[2].x", 2 * run["s.x"])
    assert value("rms(b[:].x)", run) == pytest.approx(6 / np.sqrt(2), rel=1e-9)


def test_settling_time_of_an_exponential():
    """80 exp(-t/tau) stays within 1 from tau ln 80 on; the answer is the recorded point at or after it."""
    run = Run(100.0, record=0.5)
    for i, tau in ((1, 5.0), (2, 10.0)):
        run.put(f"e[{i}].x", 80 * np.exp(-run.time / tau))
    exact = 10 * np.log(80)
    assert value("settling_time(e[:].x, 1)", run) == 0.5 * math.ceil(exact / 0.5)  # the last train counts
    assert value("settling_time(e[1].x, band = 1.0)", run) == 0.5 * math.ceil(exact / 2 / 0.5)
    assert value("settling_time(e[2].x, 1, until = 40)", run) == math.inf
    assert value("settling_time(e[2].x, 1, after = 60)", run) == 60.0  # within the band from the start
    assert value("settling_time(e[2].x, 80)", run) == 0.0  # the band includes its ends


def test_settling_counts_from_the_last_excursion_and_windows_forget_later_ones():
    run = Run()
    x = np.zeros(21)
    x[[4, 15]] = 2.0  # at 2 s and 7.5 s
    run.put("s.x", x)
    assert value("settling_time(s.x, 1)", run) == 8.0
    assert value("settling_time(s.x, 1, until = 6)", run) == 2.5
    assert value("settling_time(s.x, 1, outside = [7, 8])", run) == 2.5
    x[-1] = 2.0
    assert value("settling_time(s.x, 1)", run.put("s.x", x)) == math.inf


def test_overshoot_is_measured_on_the_far_side_of_the_reference():
    run = Run(20.0, record=0.01)
    t = run.time
    run.put("s.up", 1 - np.exp(-t) * np.cos(np.pi * t)).put("s.down", -run["s.up"]).put("s.slow", 1 - np.exp(-t))
    run.put("s.on", 1 + 0.2 * np.sin(t))
    peak = np.exp(-t) * -np.cos(np.pi * t)
    assert value("overshoot(s.up, 1)", run) == pytest.approx(peak.max())
    assert value("overshoot(s.down, -1)", run) == pytest.approx(peak.max())
    assert value("overshoot(s.slow, 1)", run) == 0.0
    assert value("overshoot(s.on, 1)", run) == pytest.approx(0.2, rel=1e-4)  # starts on it: both sides are over


def test_jerk_leaves_out_every_difference_that_touches_an_excluded_window():
    """A gust step of 0.5 m/s2 over 0.5 s is a finite difference of 1 m/s3 that says nothing about comfort."""
    run = Run()
    run.put("s.a", 0.01 * run.time - 0.5 * ((run.time >= 4) & (run.time < 6)))
    assert value("jerk(s.a)", run) == pytest.approx(1.01)
    assert value("jerk(s.a, outside = [4, 6])", run) == pytest.approx(0.01)
    assert value("mean_jerk(s.a)", run) == pytest.approx(0.51)
    assert value("mean_jerk(s.a, outside = [4, 6])", run) == pytest.approx(0.01)
    assert value("mean_jerk(s.a, window = 2, outside = [[4, 6]])", run) == pytest.approx(0.01)
    assert value("jerk(s.a, until = 3.5)", run) == pytest.approx(0.01)


def test_traction_and_braking_energy():
    """400 t, 1 m/s2 for 5 s from rest, then -1 m/s2 for 5 s: m v^2 / 2 = 5 MJ each way."""
    run = Run(10.0, record=0.001)
    t = run.time
    force, speed = np.where(t < 5, 4e5, -4e5), np.where(t < 5, t, 10 - t)
    run.put("train[1].force", force).put("train[1].speed", speed)
    run.put("train[2].force", force).put("train[2].speed", speed)
    assert value("traction_energy(train[1].force, train[1].speed)", run) == pytest.approx(5e6, rel=1e-3)
    assert value("braking_energy(train[1].force, train[1].speed)", run) == pytest.approx(5e6, rel=1e-3)
    assert value("traction_energy(train[:].force, train[:].speed)", run) == pytest.approx(10e6, rel=1e-3)
    assert value("traction_energy(train[1].force, train[1].speed, until = 2)", run) == pytest.approx(0.8e6, rel=1e-3)


def test_at_sample_moves_an_output_back_to_the_state_it_was_computed_from():
    run = Run(2.0)
    run.put("c.y", [0, 0, 1, 2, 3]).put("c[1].z", [0, 0, 1, 2, 3]).put("c[2].z", [5, 5, 6, 7, 8])
    np.testing.assert_array_equal(value("at_sample(c.y)", run), [0, 1, 2, 3, 3])
    np.testing.assert_array_equal(value("at_sample(c[:].z)", run), [[0, 1, 2, 3, 3], [5, 6, 7, 8, 8]])
    assert value("at_sample(3)", run) == 3.0
    coarse = Run(2.0, step=0.1).put("c.y", 0)
    with pytest.raises(ExpressionError, match="steps of one length; take an algorithm that keeps the step"):
        value("at_sample(c.y)", coarse)


def test_nan_in_the_window_gives_nan_and_outside_it_does_not():
    for name in ("min", "max", "peak", "comfort", "mean", "rms", "integral", "jerk", "mean_jerk", "spread"):
        assert np.isnan(value(f"{name}(s.nan)")), name
        assert np.isfinite(value(f"{name}(s.nan, after = 4)")), name
        assert np.isfinite(value(f"{name}(s.nan, outside = [2.9, 3.1])")), name
    for text in (
        "duration(s.nan > 1)",
        "first_time(s.nan > 1)",
        "last_time(s.nan > 1)",
        "settling_time(s.nan, 1)",
        "overshoot(s.nan, 1)",
        "at(s.nan, 2.75)",
        "traction_energy(s.nan, s.x)",
        "braking_energy(s.nan, s.x)",
        "final(s.nan, until = 3)",
        "initial(s.nan, after = 3)",
        "max(a[:].v * s.nan)",
    ):
        assert np.isnan(value(text)), text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max(s.x, until = 11)", "the window lasts until 11 s but the recorded points end at 10 s"),
        ("max(s.x, after = 11)", "no recorded point lies in the window; widen it, or record more often"),
        ("max(s.x, after = 4.1, until = 4.2)", "no recorded point lies in the window"),
        ("at(s.x, 11)", "no recorded points around t = 11 s"),
        ("jerk(s.x, after = 10)", "jerk needs two neighbouring recorded points in the window"),
        ("mean_jerk(s.x, 20)", "mean_jerk needs recorded points 20 s apart in the window"),
    ],
)
def test_a_window_the_run_does_not_cover_has_no_value(text, message):
    with pytest.raises(WindowError, match=message):
        value(text)
    metric = measured({"m": text}, ramp())[0]
    assert np.isnan(metric.values[None])
    assert message in metric.problem


def test_windows_forgive_rounding_of_the_time_grid():
    run = Run(1.0, record=0.1, step=0.1).put("s.x", np.arange(11))
    assert run.time[3] > 0.3
    assert value("max(s.x, until = 0.3)", run) == 3.0
    assert value("max(s.x, until = 1)", run) == 10.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max(s.x, outside = 3)", "outside takes a window [from, to] or a list of them"),
        ("max(s.x, outside = [3])", "outside takes a window [from, to] or a list of them"),
        ("max(s.x, outside = [4, 3])", "outside = [4, 3] ends before it starts; swap the two"),
        ("max([1, 2])", "max: x takes a signal or a number, not a list"),
        ("settling_time(s.x, s.y)", "the band of settling_time must be one number"),
        ("max(s.x, after = s.x)", "after must be one number, not a list or a signal that varies"),
        ("mean_jerk(s.x, 0)", "the window of mean_jerk must be longer than 0 s"),
    ],
)
def test_wrong_arguments(text, message):
    with pytest.raises(ExpressionError) as caught:
        value(text)
    assert message in str(caught.value)
    assert f"'{text}'" in str(caught.value)


@pytest.mark.parametrize(
    ("acceleration", "levels"),
    [
        # measured peaks and RMS values with their levels, as the source's scale gives them
        (4.799, (6,)), (0.697, (3,)), (1.68, (5,)), (0.066, (1,)), (1.0, (3, 4)), (0.432, (2,)), (0.964, (3, 4)),
        (1.399, (4, 5)), (0.376, (2,)), (0.846, (3, 4)), (0.885, (3, 4)), (0.337, (2,)), (0.709, (3,)),
        # the ends of the bands
        (0.0, (1,)), (0.315, (2,)), (0.5, (2, 3)), (0.63, (2, 3)), (0.8, (3, 4)), (1.25, (4, 5)), (1.6, (4, 5)),
        (2.0, (5,)), (2.01, (5, 6)), (2.5, (5, 6)), (2.51, (6,)), (-1.0, (3, 4)), (math.nan, ()), (math.inf, (6,)),
    ],
)  # fmt: skip
def test_all_levels_of_the_reaction_scale_are_reported(acceleration, levels):
    assert comfort_levels(acceleration) == levels


def test_comfort_prints_its_levels_and_claims_no_standard():
    run = Run().put("train[1].acceleration", 1.0, "m/s2").put("train[2].acceleration", -0.4, "m/s2")
    peak, rms = measured(
        {"peak": "comfort(train[i].acceleration)", "rms": "comfort(rms(train[i].acceleration, until = 5))"}, run
    )
    assert peak.comfort
    assert peak.text(1) == "1.000 m/s2 (levels 3, 4)"
    assert peak.text(2) == "0.400 m/s2 (level 2)"
    assert rms.text(1) == "1.000 m/s2 (levels 3, 4)"
    assert "as in the source" in COMFORT_TITLE
    assert "compliant" not in COMFORT_TITLE


def test_a_metric_with_a_free_index_has_a_value_for_each():
    run = Run()
    for i in range(1, 5):
        run.put(f"train[{i}].position", -1000.0 * i**2, "m")
    table = {"gap": "final(train[i-1].position - train[i].position)", "all": "max(train[:].position)"}
    gap, together = measured(table, run)
    assert gap.values == {2: 3000.0, 3: 5000.0, 4: 7000.0}
    assert gap.unit == "m"
    assert gap.text(3) == "5000 m"
    assert together.values == {None: -1000.0}
    assert Judge(table, {}, list(run.names())).indices == {"gap": (2, 3, 4), "all": (None,)}


def test_metrics_may_use_parameters():
    run = Run(parameters={"cruise[1].gap_min": 2.0, "cruise[2].gap_min": 4.0}).put("train[1].gap", 5.0)
    table = {"margin": "min(train[1].gap) - cruise[1].gap_min", "widest": "max(cruise[:].gap_min)"}
    assert [metric.values for metric in measured(table, run)] == [{None: 3.0}, {None: 4.0}]


def test_one_bad_metric_does_not_hide_the_others():
    bad, signal, good = measured({"bad": "max(s.z)", "signal": "s.x", "good": "max(s.x)"}, ramp())
    assert np.isnan(bad.values[None])
    assert "there is no signal or parameter 's.z'" in bad.problem
    assert "'s.x' is a signal, not a number; reduce it, as in max(s.x)" in signal.problem
    assert good.values == {None: 10.0}


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("max(s.x)", "m"),
        ("final(s.x - s.y) + 1", "m"),
        ("max(abs(a[:].v))", "m/s"),
        ("settling_time(a[:].v, 1)", "s"),
        ("jerk(a[1].v)", "m/s2"),
        ("jerk(1)", ""),
        ("traction_energy(s.x, a[1].v)", "J"),
        ("overshoot(s.x, 3)", "m"),
        ("overshoot(s.x, 3, until = first_time(s.x > 4))", "m"),
        ("max(minimum(s.x, 3))", "m"),
        ("final(s.x) * 2", ""),
        ("final(s.x) - final(a[1].v)", ""),
        ("max(s.x * a[1].v)", ""),
        ("max(s.pull * a[1].v)", "W"),
        ("max(abs(s.x) * s.pull)", "J"),
        ("max(s.pull * s.pull)", ""),
        ("max(2 * s.pull)", ""),
        ("max(3)", ""),
        ("-max(s.x)", "m"),
    ],
)
def test_units_are_told_only_where_they_are_certain(text, unit):
    assert unit_of(parse(text, FUNCTIONS), ramp()) == unit


def test_a_condition_is_true_or_false():
    (metric, *_) = measured({"kept": "max(s.x) < 1e9", "number": "max(s.x)"}, ramp())
    assert (metric.truth, metric.text()) == (True, "true")
    (metric,) = measured({"kept": "max(s.x) < -1e9"}, ramp())
    assert (metric.values, metric.text()) == ({None: 0.0}, "false")


def test_values_are_printed_for_people():
    assert Metric("m", "", {None: 138.5}, "s").text() == "138.5 s"
    assert Metric("m", "", {None: math.inf}, "s").text() == "never"
    assert Metric("m", "", {None: math.inf}).text() == "inf"
    assert Metric("m", "", {None: math.nan}, "m").text() == "nan m"
    assert Metric("m", "", {None: math.nan}, "m/s2", comfort=True).text() == "nan m/s2"


def test_check_tells_every_problem_of_the_table():
    names = list(ramp().names())
    problems = problems_of(
        {
            "typo": "maxx(s.x)",
            "syntax": "max(s.x",
            "band": "settling_time(s.x)",
            "word": "max(s.x, utnil = 3)",
            "two": "min(s.x, s.y)",
            "late": "max(s.x, until = 400)",
            "shift": "max(at_sample(s.x))",
            "pair": "max(s.x, outside = [5, 4])",
        },
        names,
        steady=False,
    )
    assert len(problems) == 7
    for problem, (name, message) in zip(
        problems,
        [
            ("typo", "unknown function 'maxx'; did you mean 'max'?"),
            ("syntax", "'(' was never closed"),
            ("band", "missing a required argument: 'band'"),
            ("word", "max has no argument 'utnil'; did you mean 'until'?"),
            ("two", "min(x, after, until, outside): too many positional arguments"),
            ("shift", "take an algorithm that keeps the step"),
            ("pair", "ends before it starts"),
        ],
        strict=True,
    ):
        assert problem.place.startswith(f"metric '{name}'")
        assert message in str(problem)
    assert problems_of({"shift": "max(at_sample(s.x))"}, names) == []


def test_a_metric_that_is_a_signal_is_found_before_the_run():
    names = [*ramp().names(), "c.limit"]
    fine = {"a": "max(s.x) - c.limit", "b": "c.limit", "c": "max(s.x - s.y)", "d": "abs(final(a[i].v))"}
    assert problems_of(fine, names, parameters=["c.limit"]) == []
    assert problems_of({"gap": "s.x - s.y"}, names) == []  # not told apart from parameters
    (problem,) = problems_of({"gap": "s.x - s.y"}, names, parameters=["c.limit"])
    assert problem.place == "metric 'gap'"
    assert problem.message == "'s.x - s.y' is a signal, not a number"
    assert problem.remedy == "reduce it, as in max(s.x - s.y)"


def test_compare_sets_two_runs_side_by_side():
    first = [
        Metric("gap", "", {2: 1.0, 3: 2.0}, "m"),
        Metric("t", "", {None: math.inf}, "s"),
        Metric("x", "", {1: 0.0}),
    ]
    second = [Metric("t", "", {None: math.inf}, "s"), Metric("gap", "", {2: 1.5, 4: 0.0}, "m")]
    assert compare_metrics(first, second) == [
        MetricChange("gap", 2, 1.0, 1.5, "m"),
        MetricChange("t", None, math.inf, math.inf, "s"),
    ]
    assert [row.difference for row in compare_metrics(first, second)] == [0.5, 0.0]


def test_a_run_of_a_single_point_has_no_intervals_but_values():
    run = Run(0.0).put("s.x", 3.0)
    assert value("max(s.x) + mean(s.x) + rms(s.x) + integral(s.x)", run) == 9.0


def test_every_function_is_documented():
    page = (Path(__file__).parents[3] / "docs" / "metrics.md").read_text(encoding="utf-8")
    words = set(re.findall(r"\w+", page))
    assert set(FUNCTIONS) <= words


def test_the_scale_of_the_documentation_is_the_scale_of_the_code():
    page = (Path(__file__).parents[3] / "docs" / "metrics.md").read_text(encoding="utf-8")
    for level, low, high, wording in COMFORT_SCALE:
        band = f"< {high:g}" if level == 1 else f"> {low:g}" if level == 6 else f"{low:g} to {high:g}"
        assert f"| {level} | {band} | {wording} |" in page
    assert COMFORT_TITLE in " ".join(page.split())
