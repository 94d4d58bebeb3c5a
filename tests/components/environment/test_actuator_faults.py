"""The fault schedule: means in closed form against quadrature, and what is active when."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components import ActuatorFaults, ComponentError, Simulation
from scipy.integrate import quad

TWO = [
    {"carriage": 1, "constant": -16e3, "from": 10.0, "until": 30.0},
    {"carriage": 1, "amplitude": 10e3, "phase": 1.0, "from": 20.003, "until": 40.007},
]


def force(t):
    constant = -16e3 if 10.0 <= t < 30.0 else 0.0
    return constant + (10e3 * math.sin(0.5 * (t - 20.003) + 1.0) if 20.003 <= t < 40.007 else 0.0)


def faults(t, interval=0.01, **values):
    return ActuatorFaults(
        **{"carriages": 2, "schedule": TWO, "omega": 0.5} | values, time=t, interval=interval
    ).outputs()


@given(st.floats(0.0, 50.0), st.floats(1e-3, 3.0))
def test_the_mean_is_the_mean(t, interval):
    """Against adaptive quadrature with the switching instants as breakpoints, also where they are off the grid."""
    instants = [i for i in (10.0, 30.0, 20.003, 40.007) if t < i < t + interval]
    edges = [t, *sorted(instants), t + interval]
    impulse = sum(quad(force, a, b)[0] for a, b in pairwise(edges))
    assert faults(t, interval)["fault"][0] == pytest.approx(impulse / interval, abs=1e-2)


def test_the_mean_of_a_short_sample_loses_no_digits():
    """f + f' T/2 + f'' T^2/6 at T = 1 ms, to 1e-9 N: as a difference of cosines it would lose five digits."""
    t, dt = 35.0, 1e-3
    angle = 0.5 * (t - 20.003) + 1.0
    expected = 10e3 * (math.sin(angle) + 0.5 * math.cos(angle) * dt / 2 - 0.25 * math.sin(angle) * dt**2 / 6)
    assert faults(t, dt)["fault"][0] == pytest.approx(expected, abs=1e-6)


@given(st.floats(0.0, 50.0))
def test_the_present_value(t):
    assert faults(t)["fault_now"][0] == pytest.approx(force(t + 1e-9), abs=1e-4)


def test_a_fault_that_begins_at_a_grid_point_begins_there_whatever_the_rounding():
    assert faults(10.0 - 1e-12)["fault_now"][0] == pytest.approx(-16e3)
    assert faults(30.0 - 1e-12)["fault_size"][0] == pytest.approx(10e3)


def test_size_and_time_to_change():
    assert faults(25.0)["fault_size"] == [26e3, 0.0]
    assert faults(25.0)["time_to_change"] == pytest.approx([5.0, 1e6])
    assert faults(0.0)["time_to_change"][0] == pytest.approx(10.0)
    assert faults(45.0)["time_to_change"][0] == 1e6
    assert faults(45.0)["fault"] == [0.0, 0.0]


def test_without_a_sample_time_the_sample_is_as_long_as_the_last():
    simulation = Simulation(ActuatorFaults(carriages=1, schedule=TWO))
    simulation.initialize(24.5)
    assert simulation.get("fault")[0] == pytest.approx(force(24.5))
    simulation.start()
    simulation.step(0.5)
    assert simulation.get("fault")[0] == pytest.approx(quad(force, 25.0, 25.5)[0] / 0.5)


@pytest.mark.parametrize(
    ("schedule", "said"),
    [
        ("faults.json", "faults are a list, each a table of carriage"),
        ([{"carriage": 1, "constant": 1.0, "from": 3.0, "until": 2.0}], "fault 1: 'until' must exceed 'from', 3"),
        ([{"carriage": 0, "from": 1.0, "until": 2.0}], "'carriage' must be a positive whole number, not 0"),
        ([{"carriage": 1, "constant": 1.0, "from": 1.0, "to": 2.0}], "fault 1: a fault has no 'to'"),
        ([{"carriage": 1, "constant": 1.0, "until": 2.0}], "'from' must be a number"),
        ([{"carriage": 1, "constant": "big", "from": 1.0, "until": 2.0}], "'constant' must be a number"),
    ],
)
def test_an_unusable_schedule_is_refused(schedule, said):
    with pytest.raises(ComponentError, match=said):
        ActuatorFaults(schedule=schedule)


def test_a_carriage_that_does_not_exist_is_refused():
    with pytest.raises(ComponentError, match="names carriage 3 of a train of 2"):
        ActuatorFaults(carriages=2, schedule=[{"carriage": 3, "constant": 1.0, "from": 1.0, "until": 2.0}]).outputs()
