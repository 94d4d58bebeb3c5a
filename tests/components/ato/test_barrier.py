"""The barrier function, its straight continuation, and the stability of the sampled loop."""

import math

import numpy as np
import pytest
from railcosim.components.ato.barrier import Loop, chi, is_stable, slope, stretch_begin

CORRECTED, AS_STATED = (5e5, 0.01, 0.01), (100.0, 0.01, 0.01)


def loop(step, gain, delay, speed=22.2):
    return Loop(step, 8.0, 1.1e5, gain[0] + gain[1] * speed**2 + gain[2] * speed**4, 194295.0, delay)


@pytest.mark.parametrize(
    ("error", "expected"), [(0.01, 0.01000247), (0.05, 0.0585786), (0.09, 1.0409473), (0.098, 25.3604), (0.0, 0.0)]
)
def test_values_of_the_specification(error, expected):
    """`docs/models/cailc_ato.md`, section 5, v_b = 0.1."""
    assert chi(error, 0.1, 0.999) == pytest.approx(expected, rel=2e-6)
    assert chi(-error, 0.1, 0.999) == -chi(error, 0.1, 0.999)


def test_slope_is_the_derivative():
    for kappa in (0.0, 0.3, 0.7, 0.95):
        h = 1e-6
        difference = (chi(0.1 * kappa + h, 0.1, 0.999) - chi(0.1 * kappa - h, 0.1, 0.999)) / (2 * h)
        assert slope(kappa) == pytest.approx(difference, rel=1e-5)


def test_beyond_its_part_the_barrier_is_a_straight_line_and_not_periodic():
    edge = 0.085
    for error in (0.0851, 0.1, 0.12, 0.1732, 5.0):
        expected = chi(edge, 0.1, 0.85) + slope(0.85) * (error - edge)
        assert chi(error, 0.1, 0.85) == pytest.approx(expected, rel=1e-12)
    # What the printed formula says there: less than inside the band, and 2.3e6 at 0.1732.
    printed = [d / math.cos(math.pi * d * d / 0.02) ** 2 for d in (0.12, 0.15, 0.17, 0.2)]
    assert printed == pytest.approx([0.295, 0.176, 5.75, 0.2], rel=4e-3)


@pytest.mark.parametrize(
    ("step", "corrected", "as_stated"),
    [
        (0.005, (0.878, 0.849), (0.979, 0.974)),
        (0.01, (0.845, 0.805), (0.973, 0.967)),
        (0.02, (0.800, 0.743), (0.966, 0.956)),
        (0.05, (0.707, 0.573), (0.950, 0.929)),
        (0.1, (0.549, 0.5), (0.926, 0.5)),
    ],
)
def test_kappa(step, corrected, as_stated):
    """The table of section 5, without delay and with one sample of it."""
    for gain, expected in ((CORRECTED, corrected), (AS_STATED, as_stated)):
        found = [stretch_begin(loop(step, gain, delay)) for delay in (0, 1)]
        assert found == pytest.approx(expected, abs=6e-4)


def test_kappa_reaches_its_end_where_sampling_is_fast():
    assert stretch_begin(loop(1e-9, CORRECTED, 0)) == 0.999


@pytest.mark.parametrize(("gain", "limits"), [(AS_STATED, (0.233, 0.113, 0.069)), (CORRECTED, (0.179, 0.079, 0.048))])
def test_stability_limits(gain, limits):
    """The table of section 7: the longest stable sample, to a millisecond."""
    for delay, limit in enumerate(limits):
        assert is_stable(loop(limit - 0.001, gain, delay, speed=0.0))
        assert not is_stable(loop(limit + 0.001, gain, delay, speed=0.0))


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_stability_against_the_roots(delay):
    """Reference: NumPy's roots of the characteristic polynomial, for random gains and samples."""
    rng = np.random.default_rng(delay)
    seen = set()
    for _ in range(300):
        case = Loop(*(10.0 ** rng.uniform(*bounds) for bounds in ((-3, 0), (-1, 1.5), (4, 6), (2, 6))), 194295.0, delay)
        p = 0.5 * case.step**2 * case.alpha * (case.beta + case.gain) / case.mass
        q = case.step * (case.alpha + (case.beta + case.gain) / case.mass)
        polynomial = np.zeros(delay + 3)
        polynomial[:3] += (1.0, -2.0, 1.0)
        polynomial[-2:] += (p + q, p - q)
        stable = bool(np.abs(np.roots(polynomial)).max() < 1.0)
        assert is_stable(case) == stable
        seen.add(stable)
    assert seen == {True, False}
