"""Gains against characteristic polynomials, residuals and noise against closed forms, settling as specified."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from railcosim.components.cruise.observers import fault_gains, intermediate_gains, polynomial, runge_kutta
from scipy.linalg import expm, solve_continuous_lyapunov

poles = st.floats(0.3, 6.0)


def error_matrix(gains, lag, omega):
    """Error of (v, p, q0, q1, q2) under the state-fault observer."""
    matrix = np.zeros((5, 5))
    matrix[0, 1] = 1.0
    matrix[1] = [0.0, -1.0 / lag, 1.0 / lag, 1.0 / lag, 0.0]
    matrix[3, 4], matrix[4, 3] = omega, -omega
    matrix[:, 0] -= gains
    return matrix


def intermediate_matrix(gains, lag):
    """Error of (v, p, f/M) under the intermediate estimator, the fault constant."""
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, -1.0 / lag, 1.0 / lag], [0.0, 0.0, 0.0]])
    matrix[:, 0] -= [gains.speed, gains.force, gains.mu / lag * gains.force]
    return matrix


@given(st.lists(poles, min_size=5, max_size=5), st.floats(0.1, 1.0), st.floats(0.1, 2.0))
def test_fault_gains_place_the_poles(placed, lag, omega):
    found = np.poly(error_matrix(fault_gains(placed, lag, omega), lag, omega))
    assert found == pytest.approx(np.poly([-p for p in placed]), rel=1e-6, abs=1e-6)


@given(st.lists(poles, min_size=3, max_size=3), st.floats(0.1, 1.0))
def test_intermediate_gains_place_the_poles(placed, lag):
    gains = intermediate_gains(placed, lag)
    assume(abs(gains.force) > 1e-3)
    assert np.poly(intermediate_matrix(gains, lag)) == pytest.approx(np.poly([-p for p in placed]), rel=1e-8, abs=1e-8)


def test_poles_apart_can_make_a_gain_vanish_and_nothing_infinite():
    """l2 = a1 - (a2 - 1/tau)/tau = 0 for tau = 1 and poles 1, 1, x: 1 + 2 x - (x + 1) = x, at x = 0."""
    assert np.isfinite(intermediate_gains([1.0, 1.0, 0.0], 1.0)).all()


def test_the_specified_gains():
    gains = fault_gains([2.0] * 5, 0.4, 0.5)
    assert gains == pytest.approx((7.5, 21.0, 51.2, -20.2, 56.05), abs=1e-12)


@given(st.lists(poles, min_size=1, max_size=6))
def test_polynomial(roots):
    assert [1.0, *reversed(polynomial(roots))] == pytest.approx(np.poly([-r for r in roots]))


@pytest.mark.parametrize(("pole", "expected"), [(2.0, 0.692), (6.0, 0.248), (10.0, 0.150)])
def test_residual_of_the_intermediate_estimator(pole, expected):
    """|f~|/|f| at omega = 0.5, from the state space of its gains and from the closed form; to the digits printed."""
    lag, s = 0.4, 0.5j
    gains = intermediate_gains([pole] * 3, lag)
    matrix = intermediate_matrix(gains, lag)
    # With f~ for a state, the fault's own rate j omega f drives the error.
    error = np.linalg.solve(s * np.eye(3) - matrix, [0.0, 0.0, s])[2]
    closed = s * ((s + gains.speed) * (s + 1.0 / lag) + gains.force) / (s + pole) ** 3
    assert abs(error) == pytest.approx(abs(closed), rel=1e-12)
    assert abs(closed) == pytest.approx(expected, abs=5e-4)


def test_settling_after_a_step_of_a_constant_fault():
    """Below 5, 1, 0.1, 0.01 % after 5.1, 6.5, 8.2, 9.7 s; largest acceleration error 0.41 of it after 0.34 s."""
    matrix = error_matrix(fault_gains([2.0] * 5, 0.4, 0.5), 0.4, 0.5)
    t = np.arange(0.0, 15.0, 0.01)
    advance, x, rows = expm(matrix * 0.01), np.array([0.0, 0.0, 1.0, 0.0, 0.0]), []
    for _ in t:
        rows.append(x)
        x = advance @ x
    rows = np.array(rows)
    fault = np.abs(rows[:, 2] + rows[:, 3])
    for share, after in ((0.05, 5.1), (0.01, 6.5), (0.001, 8.2), (0.0001, 9.7)):
        assert t[fault > share][-1] == pytest.approx(after, abs=0.06)
    peak = np.argmax(np.abs(rows[:, 1]))
    assert (abs(rows[peak, 1]), t[peak]) == (pytest.approx(0.41, abs=0.005), pytest.approx(0.34, abs=0.015))


@pytest.mark.parametrize(("pole", "newtons"), [(1.0, 163), (1.5, 258), (2.0, 352), (3.0, 563), (4.0, 812)])
def test_noise_of_the_fault_estimate(pole, newtons):
    """Standard deviation under (0.02 m/s2)^2 held 10 ms on 80 t, white noise of the same power: Lyapunov's equation."""
    matrix = error_matrix(fault_gains([pole] * 5, 0.4, 0.5), 0.4, 0.5)
    power = np.zeros((5, 5))
    power[0, 0] = 4e-4 * 0.01
    covariance = solve_continuous_lyapunov(matrix, -power)
    read = np.array([0.0, 0.0, 1.0, 1.0, 0.0])
    assert 80e3 * np.sqrt(read @ covariance @ read) == pytest.approx(newtons, rel=0.02)


def test_runge_kutta_is_of_fourth_order():
    """x' = -x: one step of h errs by h^5/120."""
    found = runge_kutta(lambda x: [-x[0]], [1.0], 0.1)[0]
    assert found - np.exp(-0.1) == pytest.approx(0.1**5 / 120.0, rel=0.02)
