"""Sensitivity against functions whose indices are known."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.study.analysis import Estimate, Influence, outputs_of, sensitivity

ISHIGAMI = {f"x{k}": "uniform(-3.141592653589793, 3.141592653589793)" for k in (1, 2, 3)}
FIRST = {"x1": 0.3139, "x2": 0.4424, "x3": 0.0}
TOTAL = {"x1": 0.5576, "x2": 0.4424, "x3": 0.2437}
"""Ishigami and Homma 1990, with a = 7 and b = 0.1."""


def ishigami(x1, x2, x3):
    return np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def test_sobol_indices_of_saltellis_blocks(studied):
    frame, plan = studied(ISHIGAMI, {"metric.y": ishigami}, 5 * 2048, "saltelli", failed=(7, 5000))
    made = sensitivity(frame, plan, "metric.y")
    assert made.method == "Saltelli, 2046 of 2048 blocks whole"
    assert [one.name for one in made.influences] == ["x1", "x2", "x3"]
    for one in made.influences:
        assert one.first.value == pytest.approx(FIRST[one.name], abs=0.03)
        assert one.total.value == pytest.approx(TOTAL[one.name], abs=0.03)
        assert one.first.low <= FIRST[one.name] <= one.first.high
        assert one.total.low <= TOTAL[one.name] <= one.total.high
        assert 0 < one.total.high - one.total.low < 0.2


@pytest.mark.parametrize("design", ["random", "latin-hypercube", "sobol"])
def test_first_order_indices_of_given_runs(studied, design):
    frame, plan = studied(ISHIGAMI, {"metric.y": ishigami}, 2048, design)
    made = sensitivity(frame, plan, "metric.y")
    assert made.method == "RBD-FAST"
    for one in made.influences:
        assert one.first.value == pytest.approx(FIRST[one.name], abs=0.05)
        assert one.first.low < one.first.value < one.first.high
        assert math.isnan(one.total.value)


@pytest.mark.parametrize("design", ["random", "saltelli"])
def test_values_alone_are_had_without_intervals(studied, design):
    frame, plan = studied(ISHIGAMI, {"metric.y": ishigami}, 500, design)
    known, quick = (sensitivity(frame, plan, "metric.y", sure=sure).influences for sure in (True, False))
    assert [(a.name, a.first.value) for a in known] == [(b.name, b.first.value) for b in quick]
    assert all(math.isnan(one.first.low) and math.isnan(one.total.low) for one in quick)


def test_of_very_many_runs_the_first_are_enough(studied, monkeypatch):
    monkeypatch.setattr("railcosim.orchestrator.study.analysis.influence.MOST", 200)
    frame, plan = studied(ISHIGAMI, {"metric.y": ishigami}, 500)
    made = sensitivity(frame, plan, "metric.y")
    assert made.method == "RBD-FAST of the first 200 runs"
    fewer = sensitivity(frame[:200], plan, "metric.y")
    assert {one.name: one.first for one in made.influences} == {one.name: one.first for one in fewer.influences}


def test_texts_and_switches_have_indices_too(studied):
    vary = {"c": ["A", "B", "C", "D"], "on": [True, False], "x": "0:1"}
    effect = {"A": 0.0, "B": 3.0, "C": -1.0, "D": 0.5}
    output = {"metric.y": lambda c, on, x: [effect[v] for v in c] + 2.0 * on + x}
    frame, plan = studied(vary, output, 4000, seed=3)
    made = {one.name: one for one in sensitivity(frame, plan, "metric.y").influences}
    assert sensitivity(frame, plan, "metric.y").method == "means over equal values, RBD-FAST"
    parts = {"c": np.var([*effect.values()]), "on": 1.0, "x": 1 / 12}
    for name, part in parts.items():
        assert made[name].first.value == pytest.approx(part / sum(parts.values()), abs=0.03)
        assert made[name].first.low <= part / sum(parts.values()) <= made[name].first.high
    assert math.isnan(made["c"].correlation.value)
    assert math.isnan(made["c"].regression.value)
    assert made["on"].correlation.value < -0.3


def test_a_grid_has_the_shares_of_its_lines(studied):
    vary = {"a.x": "0:4:5", "b.y": [0, 1, 2], "c": ["P", "Q"]}
    frame, plan = studied(vary, {"metric.y": lambda x, y, c: 2 * x + 3 * y}, 30, "grid")
    made = sensitivity(frame, plan, "metric.y")
    parts = {"a.x": 4 * 2.0, "b.y": 9 * 2 / 3, "c": 0.0}
    for one in made.influences:
        assert one.first.value == pytest.approx(parts[one.name] / 14)
    assert [one.name for one in made.influences] == ["a.x", "b.y", "c"]


def test_correlation_and_regression_of_ranks(studied):
    """A monotonous function of independent inputs: ranks explain it, and the coefficients are the correlations."""
    vary = {"a": "0:1", "b": "0:1", "n": "0:1"}
    frame, plan = studied(vary, {"metric.y": lambda a, b, n: np.exp(3 * a) - 0 * n}, 500)
    made = {one.name: one for one in sensitivity(frame, plan, "metric.y").influences}
    assert made["a"].correlation.value == pytest.approx(1.0)
    assert made["a"].regression.value == pytest.approx(1.0)
    for name in "bn":
        assert made[name].correlation.low < 0 < made[name].correlation.high
    assert sensitivity(frame, plan, "metric.y").explained == pytest.approx(1.0)


def test_spearmans_interval_covers_as_often_as_it_says(studied):
    """For normal inputs with a linear correlation of 0.6, Spearman's is 6/pi asin(0.3)."""
    vary = {"a": "normal(0, 1)", "b": "normal(0, 1)"}
    known, covered = 6 / math.pi * math.asin(0.3), 0
    for seed in range(50):
        frame, plan = studied(vary, {"metric.y": lambda a, b: 0.6 * a + 0.8 * b}, 80, seed=seed)
        made = {one.name: one for one in sensitivity(frame, plan, "metric.y").influences}["a"].correlation
        covered += made.low <= known <= made.high
    assert 44 <= covered <= 50


def test_one_run_astray_does_not_spoil_the_order(studied):
    vary = {"idle": "0:1", "a": "0:1"}
    frame, plan = studied(vary, {"metric.y": lambda i, a: np.where(np.arange(200) == 7, 1e9, a + 0.1 * i)}, 200)
    assert [one.name for one in sensitivity(frame, plan, "metric.y").influences] == ["a", "idle"]


def test_the_square_of_a_correlation_keeps_its_interval():
    for given, squared in (((0.5, 0.25, 0.75), (0.25, 0.0625, 0.5625)), ((-0.5, -0.75, 0.25), (0.25, 0.0, 0.5625))):
        assert Influence("a", Estimate(*given)).of_ranks == squared
    assert math.isnan(Influence("a").of_ranks.value)


def test_what_says_nothing_is_not_said(studied):
    frame, plan = studied({"a": "0:1", "b": [3]}, {"metric.y": lambda a, b: a, "metric.z": lambda a, b: b}, 20)
    few = sensitivity(frame, plan, "metric.y")
    assert (few.method, few.runs) == ("", 20)
    assert {one.name: math.isnan(one.first.value) for one in few.influences} == {"a": True, "b": True}
    assert [one.strength for one in few.influences] == [1.0, 0.0]
    same = sensitivity(frame, plan, "metric.z")
    assert math.isnan(same.explained)
    assert not any(one.strength for one in same.influences)
    assert sensitivity(*studied({}, {"metric.y": lambda: np.arange(9.0)}, 9), "metric.y").influences == ()
    broken, plan = studied({"a": "0:1"}, {"metric.y": lambda a: a}, 6, "saltelli", failed=(0, 4))
    assert sensitivity(broken, plan, "metric.y").method == ""


def test_outputs_are_what_came_out_and_differs(studied):
    outputs = {
        "metric.y": lambda a: a,
        "metric.same": lambda a: 0 * a,
        "margin.m": lambda a: a,
        "metric.never": lambda a: a / 0,
    }
    with np.errstate(divide="ignore"):
        frame, _ = studied({"a": "0:1"}, outputs, 20)
    assert outputs_of(frame) == ["margin.m", "metric.y"]
