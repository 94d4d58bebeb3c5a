"""The consist port: conditions for the design, force limit, late exchange, information pattern."""

import pytest
from railcosim.components import FaultTolerantCruise, FaultTolerantCruiseIntermediate, Simulation
from railcosim.components.tracing import feedthrough

AT_REST = {"position": [50.0, 25.0, 0.0], "speed": 60.0, "ahead_position": 3250.0, "ahead_speed": 60.0}


def started(component=FaultTolerantCruise, **values):
    simulation = Simulation(component(**AT_REST | values))
    simulation.initialize()
    return simulation


@pytest.mark.parametrize(
    ("values", "failed"),
    [
        ({}, 0),
        ({"rho": 0.0187}, 0),
        ({"rho": 0.0188}, 1),
        ({"opening_limit": 5.0}, 1),
        ({"service_distance": 2500.0}, 1),
        ({"rho": 0.0106}, 0),
        ({"rho": 0.0105}, 2),
        ({"ahead_position": 3751.0}, 3),
        ({"ahead_speed": 63.1}, 3),
        ({"observer_poles": [2.0, 2.0, 2.0, 2.0, 49.0]}, 0),
        ({"observer_poles": [2.0, 2.0, 2.0, 2.0, 51.0]}, 4),
    ],
)
def test_the_first_condition_that_fails_is_named(values, failed):
    """rho between 0.01053 and 0.01875 1/s, start in range, pole times sample below 0.5."""
    simulation = started(sample_time=0.01, **values)
    assert simulation.get("failed_condition") == failed
    assert simulation.get("conditions_met") == (failed == 0)


def test_a_start_out_of_range_is_remembered():
    simulation = started(ahead_position=3751.0)
    simulation.start()
    simulation.set("ahead_position", 3250.0)
    simulation.step(0.01)
    assert simulation.get("failed_condition") == 3
    assert not simulation.get("barrier_violated")


def test_a_long_sample_is_noticed_after_the_first_one():
    simulation = started(FaultTolerantCruiseIntermediate, observer_poles=10.0)
    assert simulation.get("conditions_met")
    simulation.start()
    simulation.step(0.06)
    assert simulation.get("failed_condition") == 4


def test_the_command_is_cut_off_and_the_observer_is_told():
    """After a step with a limited command the estimated force has moved towards the limit, not towards the demand."""
    values = {"ahead_position": 3450.0, "limit_force": True, "force_limit": 20e3}
    limited, free = started(**values), started(**values | {"limit_force": False})
    assert limited.get("force")[0] == 20e3
    assert limited.get("force_limited")
    assert free.get("force")[0] > 50e3
    assert not free.get("force_limited")
    before = limited.get("actuator_force_estimate")[0]
    for simulation in (limited, free):
        simulation.start()
        simulation.step(0.01)
    # p' = (u/M - p)/tau over 10 ms of a lag of 0.4 s; second order in between
    gained = limited.get("actuator_force_estimate")[0] - before
    assert gained == pytest.approx((20e3 - before) * 0.01 / 0.4, rel=0.02)
    assert free.get("actuator_force_estimate")[0] - before > 2.0 * gained


@pytest.mark.parametrize("limit", [20e3, 1e6])
def test_the_train_behind_hears_the_jerk_that_the_limited_command_gives(limit):
    """J = (u/M - p)/tau - dn/dt with the limited u: one carriage at rest with its resistance, so dn/dt = 0, p = R."""
    one = {"carriages": 1, "position": [0.0], "ahead_position": 3400.0, "c0": 0.02, "c1": 0.0, "c2": 0.0}
    simulation = started(**one, limit_force=True, force_limit=limit)
    expected = (simulation.get("force")[0] / 80e3 - 0.02) / 0.4
    assert simulation.get("force_limited") == (limit < 1e5)
    assert simulation.get("tail_jerk") == pytest.approx(expected, rel=1e-12)


def test_a_late_command_is_what_the_observer_expects():
    """Told that commands act a sample late, it advances with the last one and not with the one it now gives."""
    punctual, late = started(ahead_position=3260.0), started(ahead_position=3260.0, late_action=True)
    first = punctual.get("force")
    for simulation in (punctual, late):
        simulation.start()
        simulation.step(0.01)
        simulation.set("ahead_position", 3450.0)
        simulation.step(0.01)
    # The second command is larger; only the punctual one's observer counts on it already.
    assert punctual.get("force")[0] > first[0] + 1e4
    difference = punctual.get("actuator_force_estimate")[0] - late.get("actuator_force_estimate")[0]
    assert difference == pytest.approx((punctual.get("force")[0] - first[0]) * 0.01 / 0.4, rel=0.05)


def test_the_information_pattern():
    """What an output depends on directly: estimates on nothing of another train, no tail on a carriage behind it."""
    direct = feedthrough(FaultTolerantCruise(carriages=3))
    radio = {"ahead_position", "ahead_speed", "ahead_acceleration", "ahead_jerk"}
    for j in (1, 2, 3):
        assert not direct[f"fault_estimate[{j}]"]
        assert not direct[f"actuator_force_estimate[{j}]"]
    assert radio <= direct["force[1]"]
    assert direct["acceleration_estimate[1]"] == {"position[1]", "position[2]", "speed[1]", "speed[2]"}
