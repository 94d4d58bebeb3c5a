"""The train of carriages against closed formulas: couplers, actuators, resistance, balance of momentum."""

import math

import numpy as np
import pytest
from railcosim.components import ComponentError, Consist, Simulation, simulate


def free(carriages, **values):
    """A train without resistance."""
    return Consist(carriages=carriages, c0=0.0, c1=0.0, c2=0.0, **values)


def test_an_actuator_follows_its_command_with_its_lag():
    """F(t) = (u + f) (1 - exp(-t/tau)); RK4 at 10 ms errs by 1e-9."""
    found = simulate(free(1, actuator_lag=0.4), 2.0, 0.01, {"force": [1e4], "fault": [-2e3]})
    expected = 8e3 * (1.0 - np.exp(-found["time"] / 0.4))
    assert found["actuator_force"][:, 0] == pytest.approx(expected, abs=1e-5)


def test_two_carriages_swing_at_the_frequency_of_their_coupler():
    """Relative motion of two equal masses without damping: frequency sqrt(2 k / M)."""
    train = free(2, coupler_damping=0.0, position=[25.1, 0.0], mass=80e3, coupler_stiffness=8e4)
    found = simulate(train, 10.0, 0.01)
    stretch = found["position"][:, 0] - found["position"][:, 1] - 25.0
    assert stretch == pytest.approx(0.1 * np.cos(math.sqrt(2.0) * found["time"]), abs=1e-8)


def test_different_masses_swing_about_their_common_centre():
    """Reduced mass: frequency sqrt(k (1/M1 + 1/M2)); the centre of mass rests."""
    train = free(2, coupler_damping=0.0, position=[25.1, 0.0], mass=[60e3, 90e3])
    found = simulate(train, 5.0, 0.01)
    stretch = found["position"][:, 0] - found["position"][:, 1] - 25.0
    frequency = math.sqrt(8e4 * (1.0 / 60e3 + 1.0 / 90e3))
    assert stretch == pytest.approx(0.1 * np.cos(frequency * found["time"]), abs=1e-8)
    assert found["position"] @ [60e3, 90e3] == pytest.approx(60e3 * 25.1, rel=1e-12)


def test_couplers_change_no_momentum():
    """The sum of M a is the sum of the actuators' forces, of resistances and of disturbances."""
    rng = np.random.default_rng(1)
    mass, speed, force = rng.uniform(5e4, 9e4, 5), rng.uniform(20.0, 60.0, 5), rng.uniform(-1e5, 1e5, 5)
    train = Consist(
        carriages=5,
        mass=mass,
        speed=speed,
        actuator_force=force,
        position=-25.0 * np.arange(5) + rng.uniform(-0.3, 0.3, 5),
        disturbance=rng.uniform(-0.1, 0.1, 5),
    )
    resistance = 0.01176 + 0.00077616 * speed + 1.6e-5 * speed**2
    expected = np.sum(force - mass * resistance + mass * train.disturbance)
    assert np.dot(mass, train.outputs()["acceleration"]) == pytest.approx(expected, rel=1e-12)


def test_it_starts_in_balance():
    """Slack couplers and equal speeds: every actuator carries its own resistance, and nothing accelerates."""
    train = Consist(carriages=4, speed=60.0, position=[75.0, 50.0, 25.0, 0.0], mass=[7e4, 8e4, 8e4, 9e4])
    simulation = Simulation(train)
    simulation.initialize()
    assert simulation.get("acceleration") == pytest.approx(np.zeros(4), abs=1e-16)
    assert simulation.get("actuator_force") == pytest.approx(np.array([7e4, 8e4, 8e4, 9e4]) * (0.01176 + 60.0 * (
        0.00077616 + 60.0 * 1.6e-5)))  # fmt: skip


def test_the_tail_is_the_last_carriage():
    found = Consist(carriages=3, position=[50.0, 25.0, 0.5], speed=[3.0, 2.0, 1.0]).outputs()
    assert (found["tail_position"], found["tail_speed"]) == (0.5, 1.0)


@pytest.mark.parametrize(("limited", "expected"), [(False, 3e5), (True, 1e5)])
def test_the_force_limit_cuts_commands_and_not_faults(limited, expected):
    train = free(1, limit_force=limited, force_limit=1e5, force=[3e5], fault=[5e4], actuator_lag=1.0)
    assert train.derivatives()["actuator_force"] == [expected + 5e4]


def test_a_train_has_at_least_one_carriage():
    with pytest.raises(ComponentError, match="at least 1"):
        Consist(carriages=0)
