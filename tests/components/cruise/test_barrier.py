"""The error transformation: its properties P1 to P3, and its derivatives against finite differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components.cruise.barrier import Range, outside, push, share, transform, usable

sides = st.floats(0.5, 800.0)
inside = st.floats(-0.999, 0.999)
GRID = np.linspace(-0.9999, 0.9999, 4001)


def place(fraction, limits):
    return fraction * (limits.low if fraction < 0.0 else limits.high)


@pytest.mark.parametrize("limits", [Range(640.0, 500.0), Range(3.0, 3.04), Range(1.0, 50.0)])
def test_p2_on_a_grid(limits):
    """mu >= 16 a2 b2 / (a + b)^4, |s| >= 4 a b |y| / (a + b)^2, s mu y >= 4 a b s^2 / (a + b)^2."""
    a, b = limits
    y = np.where(GRID < 0.0, GRID * a, GRID * b)
    t = transform(y, limits, 1.0)
    ratio = 4.0 * a * b / (a + b) ** 2
    assert (t.mu >= ratio**2 * (1.0 - 1e-12)).all()
    assert (np.abs(t.s) >= ratio * np.abs(y) * (1.0 - 1e-12)).all()
    assert (t.s * t.mu * y >= ratio * t.s**2 * (1.0 - 1e-12)).all()


@pytest.mark.parametrize("limits", [Range(640.0, 500.0), Range(3.0, 3.04)])
def test_p1_and_p3(limits):
    """s runs to infinity at the ends, grows everywhere, has the sign of y, and is y near 0."""
    y = np.where(GRID < 0.0, GRID * limits.low, GRID * limits.high)
    t = transform(y, limits, 1.0)
    assert (np.sign(t.s) == np.sign(y)).all()
    assert (np.diff(t.s) > 0.0).all()
    assert abs(t.s[[0, -1]]).min() > 1e3 * min(limits)
    near = transform(1e-9, limits, 1.0)
    assert (near.s, near.mu) == pytest.approx((1e-9, 1.0))


@given(sides, sides, st.floats(-0.95, 0.95))
def test_derivatives_against_differences(a, b, fraction):
    """Central differences of s, mu, h and g."""
    limits = Range(a, b)
    y, d = place(fraction, limits), 1e-5 * min(a, b)

    def values(x):
        t = transform(x, limits, 0.9999)
        return np.array([t.s, t.mu, push(t)[0], share(t, limits)[0]])

    slope = (values(y + d) - values(y - d)) / (2.0 * d)
    t = transform(y, limits, 0.9999)
    assert slope == pytest.approx([t.mu, t.mu_slope, push(t)[1], share(t, limits)[1]], rel=1e-4, abs=1e-6)


@given(sides, sides, inside.filter(lambda f: abs(f) > 1e-6))
def test_h_and_g_are_what_they_are_named_for(a, b, fraction):
    limits = Range(a, b)
    y = place(fraction, limits)
    t = transform(y, limits, 0.9999)
    assert push(t)[0] == pytest.approx(t.s * t.mu)
    assert share(t, limits)[0] == pytest.approx(y / (t.s * t.mu), rel=1e-9)


def test_g_has_no_gap_at_zero():
    assert share(transform(0.0, Range(3.0, 3.04), 0.9), Range(3.0, 3.04))[0] == pytest.approx(1.0)


@pytest.mark.parametrize("y", [-1e9, -3.0, -2.71, 2.74, 3.04, 1e9])
def test_beyond_the_clip_everything_is_constant_and_finite(y):
    limits = Range(3.0, 3.04)
    t, edge = transform(y, limits, 0.9), transform(np.sign(y) * 0.9 * (3.0 if y < 0 else 3.04), limits, 0.9)
    assert t.clipped
    assert not edge.clipped
    assert (t.s, t.mu) == (edge.s, edge.mu)
    assert (push(t)[1], share(t, limits)[1]) == (0.0, 0.0)
    assert np.isfinite([t.s, t.mu, t.mu_slope, *push(t), *share(t, limits)]).all()


def test_the_bounds_are_outside():
    assert [bool(outside(y, Range(3.0, 3.04))) for y in (-3.0, -2.99, 3.03, 3.04)] == [True, False, False, True]


def test_a_range_turned_around_stays_finite():
    assert usable(Range(-5.0, 2.0)) == (1e-3, 2.0)
