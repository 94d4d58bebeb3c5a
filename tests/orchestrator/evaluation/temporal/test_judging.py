"""Verdicts of formulas: what decides them and where, whatever the blocks are in which a run is looked at."""

import re

import numpy as np
import pytest
from railcosim.orchestrator.evaluation import parse_requirement, requirements, robustness, signals


def judge(text, run, **how):
    return parse_requirement("r", text).evaluate(run, **how)


def test_a_verdict_is_what_the_values_say(case, logic):
    formula, text, run = case
    low, high = np.array(logic.direct(formula, run)).T
    for word, least, most in (
        ("always", low.min(), high.min()),
        ("eventually", low.max(), high.max()),
        ("finally", low[-1], high[-1]),
        ("always[0, 0]", low[0], high[0]),
    ):
        found = judge(f"{word} {text}", run)
        assert found.verdict != "pass" or (least >= 0 and run.completed)
        assert found.verdict != "fail" or most <= 0
        assert found.verdict != "inconclusive" or least <= 0 <= most or not run.completed
        assert found.margin in (least, most) or found.margin is None
        assert found.robustness == found.margin
        if found.margin is None:
            continue
        (name,) = found.blame  # whose value at that time is so far from what it is compared with
        value = run[name][np.flatnonzero(run.time == found.time)[0]]
        assert min(abs(abs(value - limit) - abs(found.margin)) for limit in limits(formula)) < 1e-9


def limits(formula):
    if formula[0] == "signal":
        return [formula[2]]
    return [limit for part in formula[1:] if isinstance(part[0], str) for limit in limits(part)]


@pytest.fixture(params=[3, 8192], ids=["parts", "whole"])
def cars(request, monkeypatch, logic):
    """Two cars, the first at full speed from 10 s on; the gap grows to 20 m at 20 s and then falls to 5 m."""
    monkeypatch.setattr(signals, "BLOCK", request.param)
    time = np.arange(81) * 0.5
    gap = np.where(time <= 20, time, np.maximum(40 - time, 5))
    columns = {"car[1].x": 100 + gap, "car[2].x": 100.0, "car[1].v": np.where(time < 10, 0, 3), "car[2].v": 1.0}
    units = {"car[1].x": "m", "car[2].x": "m", "car[1].v": "m/s", "car[2].v": "m/s", "car[1].on": ""}
    columns["car[1].on"] = time >= 10
    return logic.made(time, columns, units=units, parameters={"car[1].late": 5.0, "car[2].late": 10.0})


@pytest.mark.parametrize(
    ("text", "verdict", "margin", "time", "blame", "scaled"),
    [
        ("always[0, 30] eventually[0, 10] (car[1].x - car[2].x >= 9)", "pass", 1, 10, "xx", 0.1),
        ("always[0, 30] eventually[0, 10] (car[1].x - car[2].x >= 11)", "fail", -1, 10, "xx", -0.1),
        ("always rise(car[1].v > 2) implies eventually[0, 10] (car[1].x - car[2].x > 15)", "pass", 1, 23.5, "v", 0.5),
        ("(car[1].v < 2) until[0, 12] (car[1].x - car[2].x >= 9)", "pass", 1, 10, "xx", 0.1),
        ("(car[1].v < 2) until[0, 12] (car[1].x - car[2].x >= 11)", "fail", -1, 10, "xx", -0.1),
        ("finally (car[1].v > 2) since[0, 50] (car[1].x - car[2].x > 19)", "pass", 1, 20, "xx", 0.1),
        ("always[0, car[i].late] (car[1].x - car[i].x < 8 or i == 1)", "fail", -1, 9, "xx", -0.2),
        ("finally (historically (car[1].x - car[2].x >= -1)) and once fall(car[1].v < 1)", "pass", 1, 0, "xx", 0.1),
        ("(car[1].v < 2) until[0, 30] (car[1].x - car[2].x >= 19.9)", "fail", -1, 10, "v", -0.99),
        ("finally historically[0, 5] (car[:].x >= 90)", "pass", 10, 35, "2", 1),
        ("always not eventually[0, 5] (car[1].v > 4) until 35", "pass", 1, 10, "v", 1),
    ],
)
def test_the_signal_and_the_instant_that_decide(cars, text, verdict, margin, time, blame, scaled):  # noqa: PLR0917
    names = {"xx": ("car[1].x", "car[2].x"), "v": ("car[1].v",), "2": ("car[2].x",)}
    found = judge(text, cars)
    assert (found.verdict, found.margin, found.time, found.blame) == (verdict, margin, time, names[blame])
    assert found.robustness == pytest.approx(scaled)
    assert judge(text, cars, scaled=True).margin == pytest.approx(scaled)


def test_margins_of_unlike_signals_compare(cars):
    """4 m/s is 4 clear margins, 5 m half of one: what decides the margin in plain numbers is another."""
    found = judge("always car[1].v < 7 and car[1].x - car[2].x > -5", cars)
    assert (found.margin, found.blame, found.robustness) == (4.0, ("car[1].v",), 0.5)
    found = judge("always car[1].v < 7 and car[1].x - car[2].x > -5", cars, scaled=True)
    assert (found.margin, found.blame, found.robustness) == (0.5, ("car[1].x", "car[2].x"), 0.5)
    assert judge("always car[1].on or car[1].v < 1", cars).robustness == 1.0
    assert judge("finally car[1].on", cars).robustness is None
    assert judge("finally car[1].on", cars).blame == ("car[1].on",)
    assert judge("always (car[1].v < 1 if car[1].on else car[1].v > 1) or once car[1].on", cars).blame == ("car[1].v",)
    assert judge("finally (once car[1].v > 2) if car[1].on else (once car[1].v > 9)", cars).margin == 1.0
    assert judge("finally car[2].late > 3", cars).blame == ("car[2].late",)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "always eventually[0, 5] (car[1].v < 1)",
            "it looks 5 s ahead, and the run ends at 40 s; write until 35 behind it, or let the run go on",
        ),
        (
            "always[0, 60] (car[1].v < 9)",
            "it looks 60 s ahead, and the run ends at 40 s; let the run last until 60 s",
        ),
        ("always[0.1, 0.2] (car[1].v < 9)", "no point lies in some window of always[0.1, 0.2]; widen it, or take"),
        ("finally once[0.1, 0.2] (car[1].v < 9)", "no point lies in some window of once[0.1, 0.2]"),
        ("always[0, car[1].v] (car[1].v < 9)", "'always[0, car[1].v] (car[1].v < 9)': a bound of always must be one"),
    ],
)
def test_what_a_run_does_not_tell_is_inconclusive(cars, text, reason):
    if "eventually" in text:
        cars = _until_ten(cars)
    found = judge(text, cars)
    assert (found.verdict, found.reason[: len(reason)]) == ("inconclusive", reason)


def _until_ten(cars):
    changed = dict(cars)
    changed["car[1].v"] = np.where(cars.time < 36, 0.0, 3.0)
    return type(cars)(
        changed, cars.time, units=cars.units, parameters=cars.parameters, step=0.5, stop_time=40.0, completed=True
    )


def test_robustness_at_every_instant(cars):
    gap = cars["car[1].x"] - cars["car[2].x"]
    assert np.array_equal(robustness("car[1].x - car[2].x > 3", cars, scaled=False), gap - 3)
    assert np.array_equal(robustness("car[1].x - car[2].x > 3", cars), (gap - 3) / 10)
    ahead = robustness("always[0, 5] (car[1].x - car[2].x > 3)", cars, scaled=False)
    assert ahead[0] == -3.0
    assert np.isnan(ahead[-10:]).all()
    assert not np.isnan(ahead[:-10]).any()
    for text in (
        "always car[i].v < 7 from 5 until 20",
        "eventually car[1].x - car[2].x > 30",
        "finally car[1].v > 1",
        "always[0, 10] (car[1].v < 7)",
    ):
        assert robustness(text, cars)[0] == judge(text, cars).robustness
    assert robustness("always car[i].v < 7", cars, index=2)[0] == 6.0


def value(verdict):
    """What decided, where a boolean did an infinite one."""
    if verdict.margin is None:
        return np.inf if verdict.verdict == "pass" else -np.inf
    return verdict.margin


@pytest.mark.parametrize("most", [1, 1 << 15], ids=["one by one", "in rows"])
@pytest.mark.parametrize(
    "condition",
    [
        "abs(car[i].v) <= 2 - 0.25 * i",
        "car[i].low < car[1].v - car[i].v < 1.5",
        "car[i].on or not car[i].v > 1.5",
        "(car[i].v <= 1.75 if car[i].on else car[i].v >= car[1].v) and i != 7",
        "at_sample(car[i].v) != 1.25",
    ],
)
def test_what_is_judged_in_rows_is_judged_index_by_index(logic, monkeypatch, condition, most):
    """The first index, and the first time of it, whose value is the least; a value that is no number before all."""
    monkeypatch.setattr(requirements, "_MOST_VALUES", most)
    source, clauses = np.random.default_rng(7), "from 2 until 7.5 outside [4, 5]"
    units, time = {"car[1].v": "km/h", "car[2].v": "m/s", "car[3].v": "m/s"}, np.arange(17) * 0.5
    for trial in range(6):
        monkeypatch.setattr(signals, "BLOCK", [3, 8192][trial % 2])
        columns = {f"car[{i}].v": source.integers(-8, 9, 17) / 4 for i in (1, 2, 3)}
        columns |= {f"car[{i}].on": source.integers(0, 2, 17) for i in (1, 2, 3)}
        for name in source.choice([*units], trial % 3, replace=False):
            columns[name][source.integers(17)] = np.nan
        run = logic.made(time, columns, units=units, parameters={f"car[{i}].low": -i / 2 for i in (1, 2, 3)})
        for word in ("always", "finally"):
            found = judge(f"{word} {condition} {clauses}", run)
            texts = [re.sub(r"\bi\b", str(i), condition) for i in (1, 2, 3)]
            alone = [judge(f"{word} {text} {clauses}", run) for text in texts]
            worst = min(alone, key=lambda one: (not np.isnan(value(one)), value(one)))
            for part in ("verdict", "margin", "time", "points", "reason", "blame"):
                assert str(getattr(found, part)) == str(getattr(worst, part)), (word, part)
            assert found.index == 1 + alone.index(worst)
            known = [one.robustness for one in alone if one.robustness is not None]
            least = np.nan if np.isnan(known).any() else min(known, default=None)
            assert str(found.robustness) == str(None if value(worst) == -np.inf else least)
