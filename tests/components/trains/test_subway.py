"""The subway train with prescribed couplers: the specification's numbers, trips, limits and in-train forces."""

import math

import numpy as np
import pytest
from railcosim.components import ComponentError, Simulation, SubwayTrain, simulate

LEVEL = [{"position": 0.0}]
MASS = 194295.0


def driven(train, seconds, force, step=0.01, trip_time=0.0):
    """A run from departure under a constant force, or one over trip time."""

    def inputs(t):
        return {"trip_time": trip_time + t, "force": force(t) if callable(force) else force}

    return simulate(train, seconds, step, inputs)


@pytest.mark.parametrize(
    ("time", "r1", "r2", "r3", "coupling"),
    [
        (0.0, 2439.631, 48.00255, 0.5709489, -34.3698),
        (50.0, 2517.503, 48.68219, 0.5841160, -26.2740),
        (100.0, 2593.126, 49.34220, 0.5969029, -16.3373),
        (190.0, 2716.727, 50.42061, 0.6178059, -28.4876),
    ],
)
def test_resistance_parameters(time, r1, r2, r3, coupling):
    """`docs/models/cailc_ato.md`, section 2: R1 without line and F_K, R2, R3, and F_K."""
    found = SubwayTrain(line=LEVEL, time=time).outputs()["resistance_parameters"]
    assert found[0] - coupling == pytest.approx(r1, abs=6e-4)
    assert found[1] == pytest.approx(r2, rel=2e-7)
    assert found[2] == pytest.approx(r3, rel=2e-7)
    # With all deformations zero F_K is gone, and with it nothing else at standstill but products of tiny speeds.
    still = SubwayTrain(line=LEVEL, time=time, couplers=[{}]).outputs()["resistance_parameters"]
    assert found[0] - still[0] == pytest.approx(coupling, abs=0.05)


@pytest.mark.parametrize(
    ("position", "force"),
    [
        (0, 4956.5), (50, 1462.2), (100, -3571.4), (500, -104.8), (1000, 2277.7), (1400, 3230.7), (1800, 2096.6),
        (2300, -2859.1), (2800, -1658.3), (3200, 3106.8), (3512, 3106.8),
    ],
)  # fmt: skip
def test_additional_force_of_the_line(position, force):
    """`docs/models/cailc_ato.md`, section 2.1, whole train."""
    there, level = SubwayTrain(position=float(position)), SubwayTrain(line=LEVEL)
    assert there.outputs()["resistance"] - level.outputs()["resistance"] == pytest.approx(force, abs=0.06)


def test_total_resistance_at_departure_is_the_force_that_explains_the_printed_maxima():
    assert SubwayTrain().outputs()["resistance"] == pytest.approx(7361.7, abs=0.1)


def test_resistance_is_that_of_its_parameters():
    train = SubwayTrain(position=700.0, speed=18.0, time=40.0)
    out = train.outputs()
    r1, r2, r3 = out["resistance_parameters"]
    assert out["resistance"] == pytest.approx(r1 + r2 * 18.0 + r3 * 18.0**2, rel=1e-12)
    assert out["acceleration"] == pytest.approx(-out["resistance"] / MASS, rel=1e-12)


def test_constant_force_without_resistance_is_a_parabola():
    """Analytic: x = F t^2 / (2 M)."""
    train = SubwayTrain(line=LEVEL, davis_a=0.0, davis_b=0.0, davis_c=0.0, swing=0.0, couplers=[{}])
    found = driven(train, 3.0, 100e3)
    t = found["time"]
    assert found["position"] == pytest.approx(0.5 * 100e3 / MASS * t * t, rel=1e-11, abs=1e-12)
    assert found["traction_energy"][-1] == pytest.approx(100e3 * found["position"][-1], rel=1e-9)
    assert found["braking_energy"][-1] == 0.0


def test_the_train_stands_while_waiting_and_starts_anew_at_each_departure():
    """Waits from -2 s, runs for 3 s, and is put back at the next wait, whatever the force is."""

    def inputs(t):
        return {"trip": 1 + (t >= 5.0 - 1e-9), "trip_time": t - 2.0 if t < 5.0 - 1e-9 else t - 7.0, "force": 150e3}

    found = simulate(SubwayTrain(start_offset=0.5, max_step=0.05), 9.0, 0.1, inputs)
    t, x, v = found["time"], found["position"], found["speed"]
    waiting = (t < 2.01) & (t > 0.05) | (t > 5.05) & (t < 7.01)
    assert (x[waiting] == 0.5).all()
    assert (v[waiting] == 0.0).all()
    assert x[t < 5.01].max() > 3.0
    first, second = x[(t > 2.0 - 1e-9) & (t < 4.05)], x[(t > 7.0 - 1e-9) & (t < 9.05)]
    assert second == pytest.approx(first, rel=1e-12)
    assert found["traction_energy"][np.searchsorted(t, 6.0)] == 0.0


def test_resistance_at_standstill_and_stiction():
    """What a start must overcome; with stiction the Davis part vanishes at standstill."""
    assert SubwayTrain(line=LEVEL, couplers=[{}]).outputs()["resistance"] == pytest.approx(2439.6, abs=0.1)
    assert SubwayTrain(line=LEVEL, couplers=[{}], stiction=True).outputs()["resistance"] == 0.0
    fast = SubwayTrain(line=LEVEL, couplers=[{}], stiction=True, speed=5.0).outputs()["resistance"]
    assert fast == SubwayTrain(line=LEVEL, couplers=[{}], speed=5.0).outputs()["resistance"]


@pytest.mark.parametrize(
    ("values", "force", "speed", "expected"),
    [
        ({}, 900e3, 10.0, 900e3),
        ({"limit_force": True}, 900e3, 10.0, 400e3),
        ({"limit_force": True}, -900e3, 10.0, -400e3),
        ({"limit_power": True, "traction_power": 3e6}, 900e3, 20.0, 150e3),
        ({"limit_power": True, "braking_power": 3e6}, -900e3, 20.0, -150e3),
        ({"limit_power": True}, 100e3, 20.0, 100e3),
        ({"limit_power": True}, 900e3, 0.0, 900e3),
        ({"limit_adhesion": True, "adhesion": 0.1}, 900e3, 0.0, 0.1 * 9.81 * (32957 + 34050 + 33785)),
        ({"limit_adhesion": True, "adhesion": 0.1}, -900e3, 5.0, -0.1 * 9.81 * MASS),
        ({"actuator_lag": 0.5}, 900e3, 0.0, 0.0),
    ],
)
def test_limits(values, force, speed, expected):
    out = SubwayTrain(force=force, speed=speed, **values).outputs()
    assert out["applied_force"] == pytest.approx(expected, rel=1e-12)
    weights = np.array([1, 0.5, 0.4, 0.6, 1, 0.5])
    assert weights @ out["vehicle_force"] == pytest.approx(expected, rel=1e-12)


def test_a_lagging_drive_follows_an_exponential():
    """Analytic: F = u (1 - exp(-t/T))."""
    found = driven(SubwayTrain(actuator_lag=0.4), 0.6, 100e3)
    # A force that depends on the inputs is that of the begin of the step it is held over.
    t = found["time"][1:] - 0.01
    assert found["applied_force"][1:] == pytest.approx(100e3 * (1.0 - np.exp(-t / 0.4)), rel=1e-7, abs=1e-6)


def test_in_train_forces_carry_what_lies_ahead_of_them():
    """Eq. 1 for each vehicle, summed from the rear instead of the front: the last coupler pulls the last vehicle."""
    train = SubwayTrain(force=120e3, speed=12.0, position=900.0, time=33.0, disturbance=0.03)
    out = train.outputs()
    motion = train._deformation()
    drive = np.array([1, 0.5, 0.4, 0.6, 1, 0.5]) * out["vehicle_force"]
    resistance = np.array([r.forward for r in train._balance(0.0).vehicles])
    masses = np.array([32939, 32957, 27090, 34050, 33785, 33474])
    inertia = masses * (out["acceleration"] - 0.03 + np.array(motion.acceleration))
    behind = np.cumsum((drive - resistance - inertia)[::-1])[::-1]
    assert -behind[1:] == pytest.approx(out["coupler_force"], abs=1e-6)


def test_random_disturbance_is_reproducible_bounded_and_new_at_each_sample():
    def accelerations(seed):
        train = SubwayTrain(disturbance_size=0.01, seed=seed, line=LEVEL, couplers=[{}], force=50e3)
        return driven(train, 1.0, 50e3)["acceleration"][1:]

    quiet = driven(SubwayTrain(line=LEVEL, couplers=[{}]), 1.0, 50e3)["acceleration"][1:]
    drawn = accelerations(3)
    difference = drawn - quiet
    assert np.abs(difference).max() < 0.0101
    assert np.ptp(difference) > 0.018
    assert len(np.unique(difference.round(8))) > 95
    assert (accelerations(3) == drawn).all()
    assert (accelerations(4) != drawn).any()


def test_a_heavier_train():
    light, heavy = SubwayTrain(force=100e3), SubwayTrain(force=100e3, load_factor=1.25)
    assert heavy.outputs()["resistance"] == pytest.approx(1.25 * light.outputs()["resistance"], rel=1e-12)
    assert heavy.outputs()["acceleration"] == pytest.approx(
        light.outputs()["acceleration"] - 100e3 / MASS * 0.2, rel=1e-12
    )


def test_another_number_of_vehicles_repeats_the_table():
    train = SubwayTrain(vehicles=8, force=100e3)
    assert len(train.outputs()["coupler_force"]) == 7
    assert sum(train._masses()) == pytest.approx(MASS + 32939 + 32957)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        ({"couplers": [{"sin": 1.0}]}, "coupler 1: a coupler has no 'sin'; did you mean 'sine'"),
        ({"couplers": []}, "couplers are"),
        ({"couplers": [{"sine": "x"}]}, "coupler 1: 'sine' must be a number in m"),
        ({"line": []}, "sections are a list of at least one"),
        ({"vehicles": 1}, "at least 2"),
    ],
)
def test_unusable_build_arguments(build, message):
    with pytest.raises(ComponentError, match=message):
        SubwayTrain(**build)


@pytest.mark.long
def test_integration_is_converged_at_the_default_step():
    """One departure at 0.9 m/s2: a step five times shorter changes the position by nothing that counts."""

    def force(t):
        return 182e3 + 1e3 * math.sin(t)

    coarse = driven(SubwayTrain(), 8.0, force, step=0.05)
    fine = driven(SubwayTrain(max_step=0.002), 8.0, force, step=0.05)
    assert coarse["position"][-1] == pytest.approx(fine["position"][-1], abs=1e-4)


def test_a_run_can_be_saved_and_resumed():
    first = Simulation(SubwayTrain(disturbance_size=0.01))
    first.set("force", 1e5)
    first.initialize()
    first.start()
    for _ in range(5):
        first.step(0.01)
    second = Simulation(SubwayTrain(disturbance_size=0.01))
    second.restore(first.save())
    for simulation in (first, second):
        simulation.step(0.01)
    assert first.get("position") == second.get("position")
