"""The timetable: its clock, its trips, and the mean acceleration of a coming sample."""

import numpy as np
import pytest
from railcosim.components import ComponentError, Timetable, simulate


def at(trip_time, **values):
    """Outputs at a trip time of the first trip, on the grid of 10 ms."""
    return Timetable(sample=round((trip_time + 10.0) / 0.01), **values).outputs()


def test_clock_and_trips():
    """Section 9: a cycle is the wait, the run and one sample, and the trip number changes at the wait's start."""
    step = 0.4
    found = simulate(Timetable(sample_time=step, wait=1.0), 400.0, step)
    trip, tau = found["trip"], found["trip_time"]
    cycle = 3 + 475 + 1  # the wait rounded up to whole samples, the run, and one sample
    n = np.arange(len(trip))
    assert (trip == 1 + n // cycle).all()
    assert tau == pytest.approx((n % cycle - 3) * step, abs=1e-9)
    # Exactly on the grid, at every sample: a controller counts with it.
    assert (tau == np.round(tau / step) * step).all()
    assert tau[1:][np.diff(trip) > 0] == pytest.approx([-1.2] * 2)
    assert (found["trip_number"] == trip).all()


def test_the_wait_is_at_least_two_samples():
    found = simulate(Timetable(wait=0.0), 0.1, 0.01)
    assert found["trip_time"][:4] == pytest.approx([-0.02, -0.01, 0.0, 0.01], abs=1e-15)


def test_first_trip():
    assert at(5.0, first_trip=0)["trip"] == 0


def test_waiting_and_arrived_it_is_at_rest():
    for trip_time, position in ((-10.0, 0.0), (-0.01, 0.0), (0.0, 0.0), (190.0, 3512.0)):
        out = at(trip_time)
        assert (out["reference_position"], out["reference_speed"]) == (position, 0.0)
    assert at(190.0)["reference_acceleration"] == 0.0


@pytest.mark.parametrize("preview", [0, 1, 2])
def test_acceleration_is_the_mean_over_the_sample_in_which_it_acts(preview):
    """Reference: the plan's speed, by hand."""
    profile = Timetable().plan.profile
    for trip_time in (0.0, 0.6, 22.0, 95.0, 189.5):
        begin = trip_time + preview * 0.01
        mean = (profile.at(begin + 0.01).speed - profile.at(begin).speed) / 0.01
        assert at(trip_time, preview=preview)["reference_acceleration"] == pytest.approx(mean, abs=1e-10)
    assert at(0.6, mean_acceleration=False)["reference_acceleration"] == pytest.approx(0.45)
    assert at(-0.01, preview=1)["reference_acceleration"] == pytest.approx(0.75 * 0.005)


def test_limit_and_smallest_margin():
    """Section 3: 0.1556 m/s, on the first cruise."""
    table = Timetable()
    times = np.arange(0.0, 190.001, 0.05)
    margins = [table.limits.at(t) - table.plan.profile.at(t).speed for t in times]
    assert min(margins) == pytest.approx(0.1556, abs=5e-5)
    assert 22.8 <= times[int(np.argmin(margins))] <= 26.0
    out = at(24.0)
    assert out["speed_limit"] - out["reference_speed"] == pytest.approx(0.1556, abs=5e-5)


def test_unusable_plan():
    with pytest.raises(ComponentError, match="Timetable: build argument 'plan' is unusable"):
        Timetable(plan={"duration": 1.0})
