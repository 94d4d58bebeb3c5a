"""A freight train against an implicit integrator with an error control, and by hand."""

import numpy as np
import pytest
from railcosim.components import FreightTrain, simulate
from scipy.integrate import solve_ivp

MASS = np.array([90e3, 80e3, 25e3])
VALUES = {"vehicles": 3, "vehicle_mass": list(MASS), "vehicle_speed": 20.0, "wave_speed": 100.0, "fill_time": 1.5}


def rates(t, state):
    """The same train, written anew for arrays."""
    y, v, pipe, cylinder = state.reshape(4, -1)
    stretch = y[:-1] - y[1:]
    travel = np.sign(stretch) * np.maximum(abs(stretch) - 0.015, 0.0)
    damper = 2e5 * np.minimum(abs(travel) / 0.01, 1.0) * (v[:-1] - v[1:])
    pull = np.concatenate([[0.0], 1e7 * travel + 2e9 * travel**3 + damper, [0.0]])
    davis = 0.01176 + 0.00077616 * v + 0.00016 * v * v
    ahead = np.concatenate([[1.0], pipe[:-1]])
    return np.concatenate(
        [
            v,
            (pull[:-1] - pull[1:]) / MASS - 0.7 * cylinder - davis,
            (ahead - pipe) / 0.14,
            np.clip((pipe - cylinder) / 0.3, -1 / 15.0, 1 / 1.5),
        ]
    )


def test_an_emergency_brake_at_the_default_step_is_that_of_an_implicit_integrator():
    """Radau to 1e-8. The coupler forces reach 100 kN; they agree within 0.1 % of that."""
    found = simulate(FreightTrain(**VALUES), 2.0, 0.05, {"emergency": True})
    start = np.concatenate([np.zeros(3), np.full(3, 20.0), np.zeros(6)])
    solved = solve_ivp(rates, (0.0, 2.0), start, method="Radau", rtol=1e-8, atol=1e-9, t_eval=found["time"])
    y, v = solved.y[:3], solved.y[3:6]
    for k in range(3):
        assert found["vehicle_speed"][:, k] == pytest.approx(v[k], abs=1e-5)
        assert found["vehicle_position"][:, k] == pytest.approx(y[k], abs=1e-5)
        assert found["brake_cylinder"][:, k] == pytest.approx(solved.y[9 + k], abs=1e-4)
    stretch = y[0] - y[1]
    travel = np.sign(stretch) * np.maximum(abs(stretch) - 0.015, 0.0)
    force = 1e7 * travel + 2e9 * travel**3 + 2e5 * np.minimum(abs(travel) / 0.01, 1.0) * (v[0] - v[1])
    assert abs(found["coupler_force"][:, 0] - force).max() < 1e-3 * abs(force).max()
    assert found["largest_compression"].max() > 20e3
    assert abs(found["energy_residual"]).max() < 1e-6 * 0.5 * MASS.sum() * 400.0


def test_the_wave_travels_along_the_pipe():
    """The pipe of vehicle k is at a half, the median of k lags, a little before k lags have passed."""
    found = simulate(FreightTrain(vehicles=6, wave_speed=28.0, max_step=0.1), 4.0, 0.1, {"emergency": True})
    for k in range(1, 7):
        half = np.interp(0.5, found["brake_pipe"][:, k - 1], found["time"])
        assert 0.5 * (k - 0.45) < half < 0.5 * k
    assert found["brake_cylinder"][15, 5] < 0.1 < found["brake_cylinder"][15, 0]
    wired = FreightTrain(vehicles=6, wave_speed=28.0, electric_control=True, max_step=0.1)
    pipes = simulate(wired, 1.0, 0.1, {"emergency": True})["brake_pipe"]
    assert pipes[:, 5] == pytest.approx(1.0 - np.exp(-0.1 * np.arange(11) / 0.5), abs=1e-5)


def test_a_service_brake_is_a_share_and_is_released():
    train = FreightTrain(
        vehicles=2, vehicle_speed=10.0, fill_time=1.0, release_time=1.0, wave_speed=500.0, max_step=0.02
    )
    half = -0.5 * 2 * 80e3 * 0.7
    found = simulate(train, 5.0, 0.1, lambda t: {"force": half if t < 3.0 else 0.0})
    assert found["brake_cylinder"][30, 1] == pytest.approx(0.5, abs=1e-3)
    assert found["brake_cylinder"][-1, 1] < 1e-3


def test_energy_closes_where_it_is_pulled_over_a_hump_with_a_curve_and_rolls_back():
    line = [{"position": 0.0, "gradient": 0.06}, {"position": 6.0, "gradient": 0.12, "radius": 400.0}]
    values = {"vehicles": 2, "line": line, "vehicle_speed": 0.3, "vehicle_position": 5.0}
    inputs = {"line_resistance": 0.01, "curve_resistance": 0.004, "disturbance": 0.002}
    found = simulate(FreightTrain(**values), 4.0, 0.05, lambda t: inputs | {"force": 100e3 if t < 1.0 else 0.0})
    assert found["speed"].min() < -0.2
    assert found["largest_tension"].max() > 10e3
    assert found["damping_energy"][-1] > 10.0
    # so little energy that the kinks of the slack show
    assert abs(found["energy_residual"]).max() < 5e-6 * found["traction_energy"][-1]
