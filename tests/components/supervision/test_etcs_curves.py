"""Brake deceleration curves against an independent integration, and the gradients under a train."""

import bisect
import random

import numpy as np
import pytest
from railcosim.components.supervision.etcs_curves import (
    Chain,
    braking,
    fixed,
    gradient_accelerations,
    lower_envelope,
)
from scipy.integrate import solve_ivp

TOLERANCE = 1e-4
"""m: of the 0.1 m asked for; the integration has 1e-10 relative, the closed form rounding errors of 1e-10 m."""


def integrated(steps, begins, accelerations, start, speeds):
    """Where the curve through ``start``, position and speed, had higher speeds: by time, backwards, jumps located."""
    x, v = start
    tops = [begin for begin, _ in steps if begin > v]
    found = []
    for goal in sorted({*speeds, *(t for t in tops if t < max(speeds))}):
        while v < goal - 1e-12:
            a = [value for begin, value in steps if begin <= v][-1]
            k = max(bisect.bisect_left(begins, x - 1e-9) - 1, 0)
            a += accelerations[k]
            edge = begins[k] if k > 0 else -np.inf

            def reaches_speed(_, y, goal=goal):
                return y[1] - goal

            def leaves_section(_, y, edge=edge):
                return y[0] - edge

            reaches_speed.terminal = leaves_section.terminal = True
            events = [reaches_speed] if edge == -np.inf else [reaches_speed, leaves_section]
            run = solve_ivp(
                lambda _, y, a=a: (-y[1], a), (0.0, 1e4), (x, v), events=events, rtol=1e-11, atol=1e-11, max_step=5.0
            )
            x, v = run.y[:, -1]
        v = goal
        if goal in speeds:
            found.append(x)
    return found


def drawn(seed):
    """A brake of some steps over some gradients, under a train of some length."""
    r = random.Random(seed)
    begins = [0.0, *sorted(r.uniform(50.0, 6000.0) for _ in range(r.randrange(1, 25)))]
    gradients = [r.uniform(-0.03, 0.03) for _ in begins]
    compensated = gradient_accelerations(begins, gradients, r.uniform(20.0, 700.0), 1.15, 1.02)
    steps = [(0.0, 0.9), *((begin, r.uniform(0.4, 0.9)) for begin in sorted(r.uniform(5.0, 50.0) for _ in range(4)))]
    return tuple(steps), *compensated, r


@pytest.mark.parametrize("seed", range(6))
def test_a_curve_is_the_integrated_one(seed):
    steps, begins, accelerations, r = drawn(seed)
    speeds = sorted(r.uniform(8.0, 55.0) for _ in range(6))
    brake = braking(steps, begins, accelerations)
    place, through = r.uniform(2000.0, 6000.0), r.choice([0.0, 7.0])
    curve = brake.curve(place, through, 0.0)
    expected = integrated(steps, begins, accelerations, (place, through), speeds)
    standing = fixed(curve, begins, 60.0)
    for speed, x in zip(speeds, expected, strict=True):
        assert curve.location(speed) == pytest.approx(x, abs=TOLERANCE)
        assert standing.location(speed) == pytest.approx(x, abs=TOLERANCE)
        assert curve.speed(x) == pytest.approx(speed, abs=1e-6)
        assert standing.speed(x) == pytest.approx(speed, abs=1e-6)
    # and forwards to its foot: from there the integration comes back to the place
    back = integrated(steps, begins, accelerations, (curve.knots[0], 0.0), [through or 8.0])
    assert (back[0] if through else curve.location(8.0)) == pytest.approx(place if through else back[0], abs=TOLERANCE)


def test_beyond_its_foot_a_curve_has_the_speed_of_the_foot():
    curve = braking(((0.0, 0.8),), [0.0], [0.0]).curve(1000.0, 22.0, 20.0)
    assert curve.knots[0] == pytest.approx(1000.0 + (22.0**2 - 20.0**2) / 1.6)
    standing = fixed(curve, [0.0], 50.0)
    for one in (curve, standing):
        assert one.speed(2000.0) == pytest.approx(20.0)
        assert one.location(5.0) == one.location(20.0) == pytest.approx(curve.knots[0])
        assert one.location(22.0) == pytest.approx(1000.0)


def test_a_brake_that_does_not_hold_is_refused():
    with pytest.raises(ValueError, match=r"0\.2 m/s2 does not slow the train down on the slope at 500 m"):
        braking(((0.0, 0.5), (20.0, 0.2)), [0.0, 500.0], [0.0, -0.25])


def test_the_lowest_gradient_under_the_train():
    """Figure 35 of SUBSET-026: a fall counts from where the front comes to it, a rise once the rear has."""
    begins, accelerations = gradient_accelerations([0.0, 1000.0, 2000.0], [0.0, -0.009, 0.012], 400.0, 1.15, 1.02)
    assert begins == [0.0, 1000.0, 2400.0]
    assert accelerations == pytest.approx([0.0, -0.0865, 9.81 * 0.012 / 1.15], abs=1e-4)
    # a hollow shorter than the train is one gradient longer
    hollow = gradient_accelerations([0.0, 1000.0, 1100.0], [0.01, -0.01, 0.01], 400.0, 1.0, 1.0)
    assert hollow[0] == [0.0, 1000.0, 1500.0]


def test_an_envelope_is_nowhere_above():
    r = random.Random(4)
    begins = [0.0, *sorted(r.uniform(10.0, 9000.0) for _ in range(60))]
    values = [r.uniform(-0.2, 0.2) for _ in begins]
    places, low = lower_envelope(begins, values, 12)
    assert len(places) == len(low) == 12
    for x in np.linspace(-10.0, 9500.0, 700):
        old = values[max(bisect.bisect_right(begins, x) - 1, 0)]
        assert low[max(bisect.bisect_right(places, x) - 1, 0)] <= old
    assert low[-1] == values[-1]
    assert lower_envelope(begins[:5], values[:5], 12) == (begins[:5], values[:5])


def test_a_chain_and_its_values():
    chain = Chain((1.0, 3.0), 2.0, (1.0, 2.0, -1.0))
    assert [chain.at(x) for x in (0.0, 1.0, 2.0, 3.0, 5.0)] == pytest.approx([1.0, 2.0, 4.0, 6.0, 4.0])
    assert chain.values() == (2.0, 6.0)
