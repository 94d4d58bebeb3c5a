"""Terms: expressions that are made ready together give what each gives alone, in one part or in many."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.evaluation import FUNCTIONS, Judge, parse, signals
from railcosim.orchestrator.evaluation.terms import Plan, Prepared
from railcosim.orchestrator.run.recording import Results

NUMBERS = np.arange(41.0)
COLUMNS = {
    "a[1].x": (NUMBERS * 37 % 101) / 7 - 5,
    "a[2].x": (NUMBERS * 53 % 89) / 11 - 3,
    "a[3].x": 60 / (NUMBERS + 3) - 4,
    "s.v": NUMBERS * NUMBERS / 100 - 3,
    "s.on": (NUMBERS % 7 > 3) * 1.0,
    "s.f": (NUMBERS * 29 % 31) * 1e3 - 14e3,
}
PARAMETERS = {"p.t": 1.5, "p.low": 0.7}
NAMES = [*COLUMNS, *PARAMETERS]
WINDOW = "after = 0.4, until = 3 + p.low, outside = [[p.t, p.t + 0.25], [2, 2.1]]"


def run(columns=COLUMNS, completed=True):
    time = np.arange(len(next(iter(columns.values())))) * 0.1
    return Results(columns, time, units={}, parameters=PARAMETERS, step=0.1, stop_time=time[-1], completed=completed)


# What the reducers gave when each was evaluated on its own.
VALUES = {
    "min(a[i].x)": {1: -5.0, 2: -3.0, 3: -2.604651162790698},
    f"min(a[i].x - s.v, {WINDOW})": {1: -12.245714285714286, 2: -13.417272727272728, 3: -13.19},
    "max(a[i].x)": {1: 9.285714285714286, 2: 4.909090909090909, 3: 16.0},
    f"max(a[i].x - s.v, {WINDOW})": {1: 10.788571428571428, 2: 7.659090909090909, 3: 7.411428571428571},
    "peak(a[i].x)": {1: 9.285714285714286, 2: 4.909090909090909, 3: 16.0},
    f"peak(a[i].x - s.v, {WINDOW})": {1: 12.245714285714286, 2: 13.417272727272728, 3: 13.19},
    "initial(a[i].x)": {1: -5.0, 2: -3.0, 3: 16.0},
    f"initial(a[i].x - s.v, {WINDOW})": {1: 4.554285714285714, 2: 2.9309090909090907, 3: 7.411428571428571},
    "final(a[i].x)": {1: 4.428571428571429, 2: 3.6363636363636367, 3: -2.604651162790698},
    "final(a[:].x)": {None: 4.428571428571429},
    f"final(a[i].x - s.v, {WINDOW})": {1: -7.6899999999999995, 2: -13.417272727272728, 3: -13.19},
    "mean(a[i].x)": {1: 2.239285714285714, 2: 1.0261363636363634, 3: 0.0075560704376246846},
    "mean(a[:].x)": {None: 1.0909927161199005},
    f"mean(a[i].x - s.v, {WINDOW})": {1: -0.1964285714285721, 2: -1.5218531468531467, 3: -3.3626911287093},
    "rms(a[i].x)": {1: 4.709304727919841, 2: 2.544175815173235, 3: 3.5200007890327334},
    "rms(a[:].x)": {None: 4.70930472791984},
    f"rms(a[i].x - s.v, {WINDOW})": {1: 6.0575720936964235, 2: 5.472606232543876, 3: 6.905358254553422},
    "integral(a[i].x)": {1: 8.957142857142856, 2: 4.104545454545454, 3: 0.030224281750498738},
    "integral(a[:].x)": {None: 13.091912593438806},
    f"integral(a[i].x - s.v, {WINDOW})": {1: -0.5107142857142876, 2: -3.956818181818182, 3: -8.742996934644182},
    "duration(a[i].x > 4)": {1: 1.45, 2: 0.4999999999999999, 3: 0.45},
    "duration(a[:].x > 4)": {None: 1.4499999999999997},
    f"duration(a[i].x - s.v > 4, {WINDOW})": {1: 0.6000000000000001, 2: 0.5, 3: 0.35000000000000003},
    "first_time(a[:].x > 4)": {None: 0.0},
    f"first_time(a[i].x - s.v > 4, {WINDOW})": {1: 0.4, 2: 0.5, 3: 0.4},
    "last_time(a[:].x > 4)": {None: 4.0},
    f"last_time(a[i].x - s.v > 4, {WINDOW})": {1: 1.9000000000000001, 2: 1.3, 3: 0.7000000000000001},
    "jerk(a[i].x)": {1: 91.42857142857174, 2: 48.18181818181836, 3: 50.0},
    f"jerk(a[i].x - s.v, {WINDOW})": {1: 98.52857142857134, 2: 47.281818181818196, 3: 11.614285714285712},
    "overshoot(a[i].x, p.low)": {1: 8.585714285714287, 2: 4.209090909090909, 3: 3.304651162790698},
    "overshoot(a[:].x, p.low)": {None: 8.585714285714287},
    f"overshoot(a[i].x - s.v, p.low, {WINDOW})": {1: 12.945714285714285, 2: 14.117272727272727, 3: 13.889999999999999},
    "spread(a[:].x, after = p.low)": {None: 11.467532467532468},
    "settling_time(a[i].x - a[3].x, 9, until = 3.5)": {1: math.inf, 2: 0.30000000000000004, 3: 0.0},
    "settling_time(a[2:3].x - s.v, 8)": {None: math.inf},
    "at(a[i].x, p.t + 0.03)": {1: 3.728571428571429, 2: 3.563636363636364, 3: -0.719298245614035},
    "mean_jerk(a[i].x, 0.35, outside = [1, 1.2])": {
        1: 29.591836734693917,
        2: 13.506493506493511,
        3: 30.612244897959183,
    },
    "traction_energy(s.f, s.v, after = 1)": {None: 65151.000000000015},
    "braking_energy(s.f, s.v)": {None: 50296.0},
    "convergence_time(a[:].x, 8, after = 0.5)": {None: 3.4000000000000004},
    "gap_overshoot(a[i-1].x - a[i].x, 2)": {2: 8.220779220779221, 3: 4.2410147991543345},
    "amplification(a[i].x, a[i-1].x)": {2: 0.5286713286713286, 3: 3.259259259259259},
    "string_ratio(a[:].x)": {None: 3.259259259259259},
    "time_to_collision(a[i-1].x + 20, a[i].x)": {2: 4.133540372670807, 3: 1.0625},
    "braking_margin(a[1].x + 30, s.v, a[2].x, 0.9, 1.1, 0.5, 2)": {None: -61.949799053104826},
    "headway_capacity(a[1:2].x + 90, a[2:3].x + 10)": {None: 365.99767098282433},
    "max(abs(a[i].x - final(a[i].x)), until = first_time(s.on > 0) + 2)": {
        1: 9.428571428571429,
        2: 6.636363636363637,
        3: 18.6046511627907,
    },
    "mean(at_sample(a[1].x) * s.v)": {None: 7.391107142857141},
    "max(a[1].x) > min(a[2].x) and duration(s.on) < 3": {None: 1.0},
    "duration(a[1].x < a[2].x <= s.v or s.on)": {None: 2.1},
}


@pytest.mark.parametrize("block", [8192, 40, 9])
def test_values_do_not_depend_on_the_parts_that_a_run_is_looked_at_in(monkeypatch, block):
    monkeypatch.setattr(signals, "BLOCK", block)
    for metric in Judge({text: text for text in VALUES}, {}, NAMES).metrics(run()):
        assert metric.problem == ""
        assert metric.values == pytest.approx(VALUES[metric.name], rel=1e-13, abs=1e-13), metric.name


def test_values_are_the_same_to_the_bit_alone_and_together():
    for metric in Judge({text: text for text in VALUES}, {}, NAMES).metrics(run()):
        assert {i: parse(metric.name, FUNCTIONS).evaluate(run(), i) for i in metric.values} == metric.values


def test_what_is_common_is_calculated_once():
    texts = ["max(a[i-1].x - a[i].x)", "min(a[i-1].x - a[i].x, after = 1)", "final(2 * (a[i-1].x - a[i].x))"]
    plan = Plan(NAMES)
    prepared = Prepared(plan, run())
    for text in texts:
        assert isinstance(parse(text, FUNCTIONS).evaluate(prepared, 2), float)
    counts = dict.fromkeys(texts, 1)
    looks = [reduction for level in plan.levels.values() for family in level.values() for reduction in family]
    assert len(looks) == len(counts)
    assert looks[0].varying["x"] is looks[1].varying["x"]


def mean(time, rows):
    return rows[:, 0] if len(time) == 1 else np.trapezoid(rows, time) / (time[-1] - time[0])


NAIVE = {  # the points that count are all from one to another
    "min": lambda t, x: x.min(),
    "max": lambda t, x: x.max(),
    "peak": lambda t, x: np.abs(x).max(),
    "final": lambda t, x: x[:, -1][np.abs(x[:, -1]).argmax()],
    "mean": lambda t, x: mean(t, x).mean(),
    "rms": lambda t, x: np.sqrt(mean(t, x * x).max()),
    "integral": lambda t, x: np.trapezoid(x, t).sum() if len(t) > 1 else 0.0,
    "duration": lambda t, x: np.trapezoid((x != 0) * 1.0, t).max() if len(t) > 1 else 0.0,
    "spread": lambda t, x: np.ptp(x, axis=0).max(),
    "first_time": lambda t, x: t[(x != 0).any(axis=0)].min(initial=np.inf),
}
LEAVES = {
    "a[i].x": lambda c, i: c[f"a[{i}].x"][None],
    "a[i-1].x": lambda c, i: c[f"a[{i - 1}].x"][None],
    "a[:].x": lambda c, i: np.array([c[f"a[{k}].x"] for k in (1, 2, 3)]),
    "s.v": lambda c, i: c["s.v"][None],
    "p.low": lambda c, i: np.full((1, 1), PARAMETERS["p.low"]),
    "2": lambda c, i: np.full((1, 1), 2.0),
}


def nan_of(result, *operands):
    return np.where(np.logical_or.reduce(np.broadcast_arrays(*map(np.isnan, operands))), np.nan, result)


PAIRS = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "<": lambda a, b: nan_of(a < b, a, b),
    ">=": lambda a, b: nan_of(a >= b, a, b),
    "and": lambda a, b: nan_of(np.logical_and(a, b), a, b),
}


def grown(inner):
    pair = st.tuples(inner, st.sampled_from(sorted(PAIRS)), inner)
    return st.one_of(
        pair.map(lambda p: (f"({p[0][0]} {p[1]} {p[2][0]})", lambda c, i: PAIRS[p[1]](p[0][1](c, i), p[2][1](c, i)))),
        inner.map(lambda x: (f"abs({x[0]})", lambda c, i: np.abs(x[1](c, i)))),
        inner.map(lambda x: (f"(-{x[0]})", lambda c, i: -x[1](c, i))),
    )


EXPRESSIONS = st.recursive(st.sampled_from(sorted(LEAVES.items())), grown, max_leaves=6)
METRICS = st.lists(
    st.tuples(
        st.sampled_from(sorted(NAIVE)), EXPRESSIONS, st.sampled_from([0.0, 0.25, 0.3]), st.sampled_from([0.7, 9])
    ),
    min_size=1,
    max_size=5,
)
SAMPLES = st.lists(st.sampled_from([0.0, 1.0, -1.0, 0.7, 2.5, -3.25, np.nan, np.inf]), min_size=32, max_size=32)


@settings(max_examples=20, deadline=None)
@given(METRICS, SAMPLES, st.integers(1, 9))
def test_any_metrics_are_what_numpy_makes_of_the_whole_run(metrics, samples, block):
    values = np.array(samples).reshape(4, 8)
    columns = dict(zip(["a[1].x", "a[2].x", "a[3].x", "s.v"], values, strict=True))
    outcome = run(columns)
    table = {}
    for number, (reducer, (text, _), after, until) in enumerate(metrics):
        table[str(number)] = f"{reducer}({text}, after = {after}, until = {min(until, 0.7)})"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(signals, "BLOCK", block)
        found = Judge(table, {}, [*columns, *PARAMETERS]).metrics(outcome)
    for metric, (reducer, (_, naive), after, _) in zip(found, metrics, strict=True):
        assert metric.problem == ""
        chosen = outcome.time >= after - 1e-9
        for i, value in metric.values.items():
            with np.errstate(all="ignore"):
                rows = np.broadcast_to(naive(columns, i), np.broadcast_shapes(naive(columns, i).shape, (1, 8)))
                rows = rows[:, chosen].astype(float)
                expected = np.nan if np.isnan(rows).any() else NAIVE[reducer](outcome.time[chosen], rows)
            assert value == pytest.approx(expected, rel=1e-12, abs=1e-12, nan_ok=True), metric
