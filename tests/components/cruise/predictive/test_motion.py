"""Motions over a horizon, against SciPy's integration of the same accelerations and jerks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.components.cruise.predictive.motion import extrapolated, planned, rolled
from scipy.integrate import cumulative_trapezoid, solve_ivp

PLAN = [0.1, -0.4, -0.8, -0.8, 0.2, 0.0, 0.3]


def integrated(position, speed, acceleration, times):
    """Position and speed at times from a function of time, finely enough for its kinks."""
    solution = solve_ivp(
        lambda t, y: [y[1], acceleration(t)], (0.0, max(times[-1], 1e-9)), [position, speed],
        t_eval=times, max_step=0.05, rtol=1e-10, atol=1e-10,
    )  # fmt: skip
    return solution.y


def test_jerks_give_the_motion_that_they_integrate_to():
    jerks = [0.3, -0.2, 0.5]
    found = rolled(10.0, 20.0, -0.4, jerks, 2.0)
    times = np.linspace(0.0, 6.0, 60_001)
    acceleration = -0.4 + cumulative_trapezoid([*np.repeat(jerks, 20_000), 0.5], times, initial=0.0)
    speed = 20.0 + cumulative_trapezoid(acceleration, times, initial=0.0)
    position = 10.0 + cumulative_trapezoid(speed, times, initial=0.0)
    for column, exact in zip(found, (position, speed, acceleration), strict=True):
        assert column == pytest.approx(exact[::20_000], abs=1e-3)


@settings(deadline=None, max_examples=30)
@given(st.floats(0.0, 15.0))
def test_a_plan_is_seen_later_by_its_age(age):
    """Beyond its end the acceleration fades within an interval; an age beyond the horizon counts as the horizon."""
    found = planned(500.0, 40.0, PLAN, age, 2.0)
    times = min(age, 12.0) + 2.0 * np.arange(len(PLAN))
    knots = 2.0 * np.arange(len(PLAN) + 2)
    position, speed = integrated(500.0, 40.0, lambda t: np.interp(t, knots, [*PLAN, 0.0, 0.0]), times)
    assert found.position == pytest.approx(position, abs=1e-4)
    assert found.speed == pytest.approx(speed, abs=1e-5)
    assert found.acceleration == pytest.approx(np.interp(times, knots, [*PLAN, 0.0, 0.0]), abs=1e-12)


@pytest.mark.parametrize(
    ("speed", "acceleration", "bounds"),
    [(20.0, -1.5, (0.0, 99.0)), (20.0, 0.4, (0.0, 23.0)), (30.0, 0.4, (0.0, 30.0)), (20.0, 0.0, (0.0, 99.0))],
)
def test_what_is_heard_goes_on_until_it_stands_or_is_as_fast_as_it_may_be(speed, acceleration, bounds):
    times = np.array([0.3, 4.0, 9.0, 25.0])
    found = extrapolated(100.0, speed, acceleration, 23.0, list(times))
    fine = np.linspace(0.0, 25.0, 250_001)
    speeds = np.clip(speed + acceleration * fine, *bounds)
    positions = 100.0 + cumulative_trapezoid(speeds, fine, initial=0.0)
    assert found.position == pytest.approx(np.interp(times, fine, positions), abs=1e-3)
    assert found.speed == pytest.approx(np.interp(times, fine, speeds), abs=1e-6)
    moving = np.interp(times, fine, np.gradient(speeds, fine))
    assert found.acceleration == pytest.approx(moving, abs=1e-6)


def test_backwards_counts_as_standing():
    assert extrapolated(5.0, -3.0, -1.0, 20.0, [0.0, 4.0]).position == [5.0, 5.0]
