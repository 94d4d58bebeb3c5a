"""The point-mass train against SciPy, against closed formulas, and at its force limits."""

import math

import numpy as np
import pytest
from railcosim.components import PointMassTrain, simulate
from scipy.integrate import solve_ivp

C0, C1, C2 = 0.01176, 0.00077616, 0.00016


def test_against_scipy_over_350_s():
    """Reference: DOP853 at rtol 1e-12, restarted at every edge of a stepwise force and of the gust; 1e-8 relative."""
    edges = [0.0, 50.0, 120.0, 210.0, 240.0, 300.0, 350.0]
    forces = [400e3, 150e3, 493.6e3, 493.6e3, -200e3, 560e3]
    gusts = [0.0, 0.0, 0.0, -0.5, 0.0, 0.0]

    def piece(t):
        return max(k for k, edge in enumerate(edges[:-1]) if t >= edge - 1e-9)

    state, expected = np.array([1e3, 5.0]), [np.array([1e3, 5.0])]
    for begin, end, force, gust in zip(edges, edges[1:], forces, gusts, strict=False):
        times = np.arange(round(begin * 10) + 1, round(end * 10) + 1) * 0.1

        def rates(_, y, force=force, gust=gust):
            return [y[1], force / 400e3 - (C0 + C1 * y[1] + C2 * y[1] ** 2) + gust]

        solution = solve_ivp(rates, (begin, times[-1]), state, "DOP853", times, rtol=1e-12, atol=1e-12)
        expected += list(solution.y.T)
        state = solution.y[:, -1]
    expected = np.array(expected)

    result = simulate(
        PointMassTrain(position=1e3, speed=5.0),
        350.0,
        0.1,
        lambda t: {"force": forces[piece(t)], "disturbance": gusts[piece(t)]},
    )
    assert np.abs(result["position"] / expected[:, 0] - 1.0).max() < 1e-8
    assert np.abs(result["speed"] / expected[:, 1] - 1.0).max() < 1e-8
    assert np.ptp(result["speed"]) > 30.0


def test_constant_resistance_is_a_parabola():
    """Analytic, c1 = c2 = 0: a = F/m - c0 - r + d; Runge-Kutta is exact up to rounding."""
    train = PointMassTrain(c0=0.02, c1=0.0, c2=0.0, mass=300e3, position=100.0, speed=10.0)
    result = simulate(train, 60.0, 0.5, {"force": 90e3, "line_resistance": 0.05, "disturbance": 0.01})
    a, t = 90e3 / 300e3 - 0.02 - 0.05 + 0.01, result["time"]
    assert result["acceleration"] == pytest.approx(np.full(len(t), a), rel=1e-14)
    assert result["speed"] == pytest.approx(10.0 + a * t, rel=1e-12)
    assert result["position"] == pytest.approx(100.0 + 10.0 * t + 0.5 * a * t * t, rel=1e-12)


def test_linear_resistance_is_an_exponential():
    """Analytic, c0 = c2 = 0: v = v0 exp(-c1 t)."""
    result = simulate(PointMassTrain(c0=0.0, c1=0.05, c2=0.0, speed=30.0), 40.0, 0.1)
    assert result["speed"] == pytest.approx(30.0 * np.exp(-0.05 * result["time"]), rel=1e-10)


def test_quadratic_resistance_coasts_as_a_hyperbola():
    """Analytic, c0 = c1 = 0: v = v0 / (1 + c2 v0 t)."""
    result = simulate(PointMassTrain(c0=0.0, c1=0.0, c2=1e-3, speed=80.0), 100.0, 0.1)
    assert result["speed"] == pytest.approx(80.0 / (1.0 + 1e-3 * 80.0 * result["time"]), rel=1e-10)


def test_resistance_at_the_speeds_of_the_source():
    """By hand, `docs/models/comfort_cruise.md` section 1: R(85) = 1.234, R(5) = 0.0196 N/kg; 493 kN balance 85 m/s."""
    assert -PointMassTrain(speed=85.0).outputs()["acceleration"] == pytest.approx(1.234, abs=5e-4)
    assert -PointMassTrain(speed=5.0).outputs()["acceleration"] == pytest.approx(0.0196, abs=5e-5)
    assert PointMassTrain(speed=85.0, force=493.5e3).outputs()["acceleration"] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("force", "limited", "expected"),
    [
        (700e3, True, 600e3),
        (599e3, True, 599e3),
        (-500e3, True, -450e3),
        (-449e3, True, -449e3),
        (700e3, False, 700e3),
        (-5e6, False, -5e6),
    ],
)
def test_force_limits(force, limited, expected):
    train = PointMassTrain(speed=1e-9, force=force, limit_force=limited, traction_limit=600e3, braking_limit=450e3)
    out = train.outputs()
    assert out["applied_force"] == expected
    assert out["acceleration"] == pytest.approx(expected / 400e3 - C0, rel=1e-9)
    assert train.derivatives() == {"position": 1e-9, "speed": out["acceleration"]}


def test_limits_act_in_time():
    result = simulate(PointMassTrain(limit_force=True, c0=0.0, c1=0.0, c2=0.0), 10.0, 0.1, {"force": 1e9})
    assert result["speed"][-1] == pytest.approx(10.0 * 600e3 / 400e3)
    assert math.isclose(result["applied_force"][-1], 600e3)
