"""Platoon reducers against values computed by hand."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.evaluation import FUNCTIONS, Judge
from railcosim.orchestrator.evaluation.reducers import PLATOON
from railcosim.orchestrator.run.recording import Results

pytestmark = pytest.mark.usefixtures("parts")

T = np.arange(0.0, 11.0)


def measured(table, run):
    return Judge(table, {}, [*run.names(), *run.parameters]).metrics(run)


def signals(**columns):
    named = {name.replace("_", "[", 1).replace("_", "].", 1): value for name, value in columns.items()}
    units = {name: "m/s" if name.endswith("speed") else "m" for name in named}
    return Results(named, T, units=units, parameters={}, step=1.0, stop_time=10.0, completed=True)


def value(text, **columns):
    (metric,) = measured({"m": text}, signals(**columns))
    if metric.problem:
        raise ExpressionError(metric.problem)
    (only,) = metric.values.values()
    return only


FALLING = {"train_1_speed": 70.0 + 5.0 * np.exp(-T), "train_2_speed": 70.0 - 8.0 * np.exp(-T / 2.0)}


def test_convergence_time_counts_from_the_begin_of_a_half_open_phase():
    """5 e^-t <= 1 from t = 2 on, 8 e^-t/2 <= 1 from t = 5 on (samples); no step at its end."""
    assert value("convergence_time(train[:].speed - 70, 1.0)", **FALLING) == 5.0
    assert value("convergence_time(train[1].speed - 70, 1.0)", **FALLING) == 2.0
    assert value("convergence_time(train[:].speed - 70, 1.0, after = 3)", **FALLING) == 2.0
    stepped = FALLING | {"target_1_value": np.where(T >= 8.0, 65.0, 70.0)}
    assert value("convergence_time(train[:].speed - target[1].value, 1.0, until = 8)", **stepped) == 5.0
    assert value("convergence_time(train[:].speed - target[1].value, 1.0)", **stepped) == math.inf
    assert value("convergence_time(train[:].speed - 70, 9.0)", **FALLING) == 0.0


def test_what_is_not_finite_has_not_converged():
    lost = np.where(T == 9.0, np.nan, 70.0)
    assert value("convergence_time(train[1].speed - 70)", train_1_speed=lost) == 10.0
    assert value("convergence_time(train[1].speed - 70, until = 9)", train_1_speed=lost) == 0.0
    assert value("convergence_time(train[1].speed - 70, until = 10)", train_1_speed=lost) == math.inf


def test_overshoots_and_peak():
    gaps = {"train_1_position": 100.0 + T, "train_2_position": 10.0 * np.sin(T)}
    assert value("speed_overshoot(train[:].speed - 70)", **FALLING) == 5.0
    assert value("speed_overshoot(train[2].speed - 70)", **FALLING) == pytest.approx(-8.0 * math.exp(-5.0))
    gap = gaps["train_1_position"] - gaps["train_2_position"]
    text = "gap_overshoot(train[1:1].position - train[2:2].position, 90, until = 7)"
    assert value(text, **gaps) == pytest.approx(gap[:7].max() - 90.0)
    assert value("peak_acceleration(train[:].speed - 70, after = 1)", **FALLING) == pytest.approx(8.0 * math.exp(-0.5))


def test_amplification_of_one_signal_over_another():
    text = "amplification(train[i].speed - 70, train[i-1].speed - 70)"
    assert value(text, **FALLING) == pytest.approx(8.0 / 5.0)
    still = {"train_1_speed": 70.0 + 0.0 * T, "train_2_speed": 71.0 + 0.0 * T}
    assert value(text, **still) == math.inf
    assert math.isnan(value(text, train_1_speed=70.0 + 0.0 * T, train_2_speed=70.0 + 0.0 * T))


def test_string_ratio_is_the_largest_over_the_row_before():
    swing = {f"train_{i}_speed": a * np.sin(T) for i, a in enumerate((4.0, 2.0, 3.0, 1.0), 1)}
    assert value("string_ratio(train[:].speed)", **swing) == pytest.approx(1.5)
    with pytest.raises(ExpressionError, match="give rows"):
        value("string_ratio(train[1].speed)", **swing)


def test_time_to_collision():
    columns = {"train_1_position": 100.0 + 0.0 * T, "train_2_position": 5.0 * T, "train_2_speed": 5.0 + 0.0 * T}
    gap = "train[1].position - train[2].position"
    assert value(f"time_to_collision({gap}, train[2].speed)", **columns) == pytest.approx(10.0)
    assert value(f"time_to_collision({gap}, -train[2].speed)", **columns) == math.inf
    assert value("time_to_collision(train[2].position - 20, -train[2].speed)", **columns) == 0.0
    assert value(f"time_to_collision({gap}, 0.1 + 0.2 - 0.3 + 0 * train[2].speed)", **columns) == math.inf  # rounding


def test_braking_margin():
    """100 - 10 - (20 * 0.5 + 400 / 2 - 100 / 4) = -95 m at the first point, the train ahead at 10 m/s."""
    columns = {"train_1_position": 100.0 + 50.0 * T, "train_1_speed": 10.0 + 0.0 * T, "train_2_speed": 20.0 + 0.0 * T}
    text = "braking_margin(train[1].position, train[2].speed, train[1].speed, 1.0, 2.0, 0.5, 10)"
    assert value(text, **columns) == pytest.approx(100.0 - 10.0 - (10.0 + 200.0 - 25.0))
    with pytest.raises(ExpressionError, match="greater than 0"):
        value("braking_margin(train[1].position, train[2].speed, train[1].speed, 0.0, 2.0)", **columns)


def test_headway_capacity():
    """Mean headways of 100 and 50 s: 36 trains an hour."""
    columns = {"gap_1_d": 2000.0 + 0.0 * T, "gap_2_d": 1000.0 + 0.0 * T, "train_1_speed": 20.0 + 0.0 * T}
    assert value("headway_capacity(gap[:].d, train[1].speed)", **columns) == pytest.approx(36.0)
    assert value("headway_capacity(gap[:].d, 0 * train[1].speed)", **columns) == 0.0
    assert value("headway_capacity(0, train[1].speed)", **columns) == math.inf


def test_the_units_that_are_shown():
    table = {
        "a": "convergence_time(train[:].speed - 70)",
        "b": "gap_overshoot(train[1].position, 7)",
        "c": "headway_capacity(train[1].position, train[1].speed)",
        "d": "braking_margin(train[1].position, train[1].speed, train[1].speed, 1, 1)",
    }
    found = measured(table, signals(**FALLING, train_1_position=T))
    assert [metric.unit for metric in found] == ["s", "m", "trains/h", "m"]


def test_a_phase_without_points_has_no_value():
    with pytest.raises(ExpressionError, match="until 20"):
        value("speed_overshoot(train[1].speed, until = 20)", **FALLING)
    with pytest.raises(ExpressionError, match="no recorded point"):
        value("speed_overshoot(train[1].speed, after = 3, until = 3)", **FALLING)


def test_they_are_registered():
    assert all(FUNCTIONS[name].reduces for name in PLATOON)
