"""The constant time headway law: its formula by hand, and its string stability against a sweep of frequencies."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components import Simulation, TimeHeadwayCruise

BEHIND = {"speed": 50.0, "target_speed": 60.0, "has_ahead": True, "ahead_speed": 51.0, "standstill_gap": 200.0}


def demand(**values):
    return TimeHeadwayCruise(**(BEHIND | values)).outputs()["demand"]


def test_the_demand_by_hand():
    """d = 1250, s + h v = 1200: [1 + 0.1 * 50] / 20 = 0.3 m/s2."""
    out = TimeHeadwayCruise(**BEHIND, ahead_position=1250.0).outputs()
    assert out["demand"] == pytest.approx(0.3)
    assert out["desired_gap"] == 1200.0
    assert out["force"] == pytest.approx(400e3 * (0.3 + 0.01176 + 0.00077616 * 50.0 + 0.00016 * 50.0**2))
    assert out["range_violated"] is out["degraded"] is False


def test_far_behind_a_train_catches_up_slowly():
    assert demand(ahead_position=9e3) == pytest.approx(min(0.1 * (60.0 + 3.0 - 50.0), 0.8))
    assert demand(ahead_position=9e3, speed=62.0) == pytest.approx(0.1)


def test_the_first_train_keeps_the_target_speed():
    assert demand(has_ahead=False, speed=58.0) == pytest.approx(0.2)


def test_the_limit_bounds_the_law_where_it_is_set():
    assert demand(ahead_position=300.0) == -0.8
    assert demand(ahead_position=300.0, acceleration_limit=0.0) == pytest.approx((1.0 - 0.1 * 900.0) / 20.0)


def test_old_data_make_it_careful_and_a_met_train_is_told():
    out = TimeHeadwayCruise(**BEHIND, ahead_position=-150.0, ahead_age=2.0).outputs()
    assert (out["degraded"], out["range_violated"]) == (True, True)
    assert out["demand"] == -0.8


@given(st.floats(0.2, 40.0), st.floats(0.02, 5.0), st.floats(0.01, 2.0))
def test_string_stability_is_that_of_a_sweep(headway, lag, rate):
    """Speeds of successive trains with a drive of first order: T = (s + l) / (h t s^3 + h s^2 + (1 + l h) s + l)."""
    told = TimeHeadwayCruise(time_headway=headway, lag=lag).outputs()["string_stable"]
    s = 1j * np.geomspace(1e-4, 1e3, 4000) / lag
    t = (s + rate) / (headway * lag * s**3 + headway * s**2 + (1.0 + rate * headway) * s + rate)
    grows = np.abs(t).max() - 1.0
    if abs(headway / (2.0 * lag) - 1.0) > 0.02:
        assert told == (grows < 1e-9)


def test_a_platoon_settles_at_the_gap_it_is_asked_for():
    train = Simulation(TimeHeadwayCruise(target_speed=40.0, has_ahead=True, ahead_speed=40.0, time_headway=10.0))
    train.initialize()
    train.start()
    x, v, ahead = 0.0, 35.0, 900.0
    for _ in range(4000):
        for name, value in {"position": x, "speed": v, "ahead_position": ahead}.items():
            train.set(name, value)
        a = train.get("demand")
        x, v, ahead = x + 0.1 * v + 0.005 * a, v + 0.1 * a, ahead + 4.0
        train.step(0.1)
    assert (ahead - x, v) == pytest.approx((650.0, 40.0), abs=1e-6)
