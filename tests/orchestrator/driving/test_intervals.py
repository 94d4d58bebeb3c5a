"""How long a train takes over an interval, beside SciPy's integration."""

import numpy as np
import pytest
from railcosim.orchestrator.driving.intervals import DEGREE, POINTS, basis, pace
from scipy.integrate import solve_ivp


def test_each_polynomial_is_one_at_its_point_and_nothing_at_the_others():
    np.testing.assert_allclose(np.array(basis(POINTS)), np.eye(DEGREE), atol=1e-14)
    assert sum(basis(0.3)) == pytest.approx(1.0)


@pytest.mark.parametrize("acceleration", [0.49, -0.49, 0.0])
def test_a_constant_acceleration_is_exact_from_however_slow(acceleration):
    length, first = 3.0, 0.1 if acceleration > 0.0 else 2.0
    speeds = np.sqrt(first**2 + 2.0 * acceleration * length * np.append(POINTS, 1.0))
    for share, speed in zip((*POINTS, 1.0), speeds, strict=True):
        found = length * pace(share, first, speeds[-1], list(speeds[:-1]))
        assert found == pytest.approx(2.0 * share * length / (first + speed), rel=1e-12)  # the way over the mean speed


@pytest.mark.parametrize(("first", "length", "off"), [(1.0, 3.0, 2e-6), (1.0, 10.0, 5e-5), (10.0, 100.0, 2e-3)])
def test_under_a_power_it_is_as_scipy_integrates(first, length, off):
    def over_place(_, state):
        speed = np.sqrt(2.0 * state[0])
        return [min(0.5, 5.0 / speed) - 0.02 - 3e-5 * speed**2, 1.0 / speed]

    places = length * np.array([0.0, *POINTS, 1.0])
    run = solve_ivp(over_place, (0.0, length), [0.5 * first**2, 0.0], rtol=1e-11, atol=1e-13, t_eval=places)
    speeds = np.sqrt(2.0 * run.y[0])
    found = [length * pace(share, first, speeds[-1], speeds[1:-1]) for share in (*POINTS, 1.0)]
    assert found == pytest.approx(run.y[1][1:], abs=off)
