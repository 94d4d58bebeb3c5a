"""A simulation saved, restored and reset is the one that was never interrupted."""

import json
import math

import numpy as np
import pytest
from railcosim.components import (
    Component,
    Input,
    Output,
    Simulation,
)

# ---------------------------------------------------------------- save, restore, reset


def drive(simulation, first, last):
    """Steps of two samples each with moving inputs, across trips; gives every output of every step as bytes."""
    rows = []
    for k in range(first, last):
        phase = k % 8
        simulation.set("u", [math.sin(k), math.cos(k)])
        simulation.set("trip", 1 + k // 8)
        simulation.set("trip_time", (phase - 2) * 0.2)
        simulation.step(0.2)
        rows.append([np.asarray(simulation.get(s.name)).tolist() for s in simulation.component.output_slots])
    return json.dumps(rows)


@pytest.fixture
def everything(samples, running):
    """Starts simulations of a component with everything that can be declared."""
    return lambda: running(samples.Everything(sample_time=0.1, tape_duration=2.0, seed=3, tape_cutoff=1.0))


def test_a_saved_state_is_complete(samples, everything):
    """Same bits after restoring: in the same instance, and in a fresh one through JSON."""
    simulation = everything()
    drive(simulation, 0, 21)
    state, serialized = simulation.save(), simulation.to_bytes()
    expected = drive(simulation, 21, 60)
    simulation.restore(state)
    assert drive(simulation, 21, 60) == expected
    other = Simulation(samples.Everything())
    other.restore(json.loads(serialized))
    assert other.get("echo") == "normal"
    assert drive(other, 21, 60) == expected


def test_a_restore_brings_back_the_held_outputs(samples, everything):
    simulation = everything()
    drive(simulation, 0, 5)
    state = json.loads(simulation.to_bytes())
    expected = simulation.get("y").tolist()
    simulation.set("u", [9.0, 9.0])
    assert simulation.get("y").tolist() != expected
    simulation.restore(state)
    assert simulation.get("y").tolist() == expected


def test_a_saved_state_does_not_change_with_the_run(samples, everything):
    simulation = everything()
    drive(simulation, 0, 5)
    state = simulation.save()
    before = json.dumps(state)
    drive(simulation, 5, 9)
    assert json.dumps(state) == before


def test_a_state_of_initialization_can_be_restored(samples):
    simulation = Simulation(samples.Estimator())
    simulation.initialize()
    simulation.set("measured", 5.0)
    state = json.loads(simulation.to_bytes())
    simulation.set("measured", 8.0)
    simulation.start()
    simulation.restore(state)
    assert simulation.phase == "initialization"
    assert simulation.get("estimate") == 4.75


def test_texts_in_arrays_survive(samples, running):
    class Labels(Component):
        names = Input("1", "", shape=(2,))
        y = Output("1", str, shape=(2,))

        def outputs(self):
            return {"y": self.names}

    simulation = running(Labels(), names=["a", "längerer Text"])
    state = json.loads(simulation.to_bytes())
    simulation.set("names", "x")
    simulation.restore(state)
    assert simulation.get("y").tolist() == ["a", "längerer Text"]
    simulation.set("names", ["a much longer text than before", "b"])
    assert simulation.get("y").tolist() == ["a much longer text than before", "b"]


def test_reset_reruns_the_same_bits(samples, everything):
    simulation = everything()
    expected = drive(simulation, 0, 40)
    simulation.reset()
    assert simulation.time == 0.0
    assert simulation.get("n") == 0
    simulation.initialize()
    simulation.start()
    assert drive(simulation, 0, 40) == expected


def test_reset_returns_parameters_and_inputs(samples, running):
    simulation = running(samples.Types(gain=3.0), teeth=4)
    simulation.set("gain", 8.0)
    simulation.reset()
    assert simulation.get("gain") == 3.0
    assert simulation.get("teeth") == 0
    simulation.set("gear_ratio", 5)


def test_two_instances_do_not_share_anything(samples, everything):
    a, b = everything(), everything()
    expected = drive(a, 0, 10)
    drive(a, 10, 30)
    assert drive(b, 0, 10) == expected


def test_a_foreign_state_is_refused(samples, refusal, everything):
    state = everything().save()
    assert refusal(lambda: Simulation(samples.Counter()).restore(state)) == (
        "a saved state of Everything does not fit this Counter"
    )
    bigger = Simulation(samples.Everything(axes=3))
    assert refusal(lambda: bigger.restore(state)) == "a saved state of Everything does not fit this Everything"
