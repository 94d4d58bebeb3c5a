"""sampling.py: samples are those of the block's own clock, in whatever steps time goes by."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.components import Component, Input, Memory, State
from railcosim.components.simulate import Simulation

PERIOD = 0.1
WHOLE = 6
"""Samples of a run."""
START = {"Everything": {"trip_time": -1.0, "u": [0.25, -0.5]}, "Counter": {"u": 2.0}, "Estimator": {"measured": 2.0}}
BLOCKS = ["Counter", "Shuttle", "Dice", "Estimator", "Everything"]


def begun(samples, name, start=0.0):
    component = getattr(samples, name)(sample_time=PERIOD, **START.get(name, {}))
    if "max_step" in component.slots:
        component.present_values["max_step"] = 0.03
    simulation = Simulation(component)
    simulation.initialize(start)
    simulation.start()
    return simulation


def shown(simulation):
    return [np.asarray(simulation.get(slot.name)).tolist() for slot in simulation.component.output_slots]


def rows(simulation, points):
    """What is shown at communication points, by point."""
    found = {}
    for begin, end in itertools.pairwise(points):
        simulation.step(end - begin)
        found[end] = shown(simulation)
    return found


def grid():
    return [k * PERIOD for k in range(WHOLE + 1)]


@pytest.mark.parametrize("name", BLOCKS)
@settings(max_examples=12, deadline=None, derandomize=True)
@given(between=st.sets(st.floats(0.0, WHOLE * PERIOD, exclude_min=True, exclude_max=True), max_size=12))
def test_any_partition_of_time_gives_the_same_samples_to_the_bit(samples, name, between):
    expected = rows(begun(samples, name), grid())
    points = sorted({*grid(), *between})
    points = [a for a, b in itertools.pairwise(points) if b - a > 1e-9] + points[-1:]
    found = rows(begun(samples, name), points)
    for k, at in enumerate(grid()[1:]):
        near = min(found, key=lambda time, at=at: abs(time - at))
        if abs(near - at) < 1e-12:
            assert found[near] == expected[at], (k, at)


@pytest.mark.parametrize("name", BLOCKS)
@pytest.mark.parametrize("parts", [2, 3, 7, 1 / 2, 1 / 3])
def test_steps_that_divide_a_sample_or_are_several_give_the_same_bits(samples, name, parts):
    step = PERIOD / parts
    summed = list(itertools.accumulate(itertools.repeat(step, round(WHOLE * parts)), initial=0.0))
    for points in (summed, [k * step for k in range(len(summed))]):
        expected = rows(begun(samples, name), grid())
        found = rows(begun(samples, name), points)
        met = [(expected[a], found[b]) for a in expected for b in found if abs(a - b) < 1e-9]
        assert len(met) == min(WHOLE, len(points) - 1)
        assert all(a == b for a, b in met)


@pytest.mark.parametrize("start", [0.0, 17.3, 1e5])
def test_a_tape_is_read_and_recorded_at_its_samples_in_any_steps(samples, start):
    """On the second trip, so that what the first has recorded is read; the steps of 1/3 sample lie between its rows."""

    def learned(step):
        simulation = begun(samples, "Learner", start)
        count = round(PERIOD / step)
        commands = []
        for k in range(22 * count):
            trip, place = divmod(k, 11 * count)
            simulation.set("trip", trip + 1)
            simulation.set("trip_time", (place - count) * step)
            simulation.set("error", float(place // count))
            simulation.step(step)
            if (k + 1) % count == 0:
                commands.append(simulation.get("command"))
        return commands

    whole = learned(PERIOD)
    assert len(set(whole)) > 5
    assert learned(PERIOD / 3) == learned(PERIOD / 4) == whole


@pytest.mark.parametrize("name", BLOCKS)
def test_a_sliver_of_time_changes_nothing(samples, name):
    """OMSimulator leaves one where the times that it has summed up end before the stop time."""
    expected = begun(samples, name)
    other = begun(samples, name)
    for k in range(4):
        expected.step(PERIOD)
        other.step(PERIOD - 1e-11)
        before = shown(other)
        other.step(1e-11)
        assert shown(other) == before == shown(expected), k
        assert other.time == pytest.approx(expected.time, abs=1e-14)


def test_a_sample_that_comes_before_its_time_by_rounding_is_followed_by_time_that_stands(samples):
    """The states are where they belong at the sample; a shorter step that does not reach it leaves them there."""
    simulation = begun(samples, "Shuttle")
    simulation.step(PERIOD * (1 - 5e-4))
    assert simulation.get("position") == 0.2
    simulation.step(1e-6)
    assert simulation.get("position") == 0.2
    simulation.step(0.5 * PERIOD)
    assert simulation.get("position") == pytest.approx(2.0 * (1.5 * PERIOD - 5e-5 + 1e-6))


def test_between_samples_everything_but_the_states_is_held(samples):
    simulation = begun(samples, "Counter")
    simulation.set("u", 1.0)
    simulation.step(0.04)
    assert simulation.get("count") == 1
    simulation.set("u", 5.0)
    simulation.step(0.04)
    assert (simulation.get("count"), simulation.get("total"), simulation.get("last_time")) == (1, 1.0, 0.0)
    simulation.step(0.04)  # the second sample falls into it, and reads the input that holds there
    assert (simulation.get("count"), simulation.get("total")) == (2, 6.0)
    assert (simulation.get("last_time"), simulation.get("last_step")) == (PERIOD, PERIOD)


class Cart(Component):
    """A state between samples, moved by an input."""

    speed = Input("m/s", 2.0)
    position = State("m", 0.0, output=True)
    seen = Memory("m", 0.0, output=True)

    def derivatives(self):
        return {"position": self.speed}

    def update(self):
        return {"seen": self.position}


def test_what_is_set_between_samples_moves_the_states_from_then_on(running):
    """By hand: 0.14 s at 2 m/s, then at 10 m/s; the second sample is that of 0.1 s, the third that of 0.2 s."""
    simulation = running(Cart(sample_time=PERIOD))
    simulation.step(0.14)
    assert simulation.get("position") == pytest.approx(0.28)
    simulation.set("speed", 10.0)
    simulation.step(0.03)
    assert simulation.get("position") == pytest.approx(0.58)
    assert simulation.get("seen") == pytest.approx(0.2)
    simulation.step(0.04)
    assert simulation.get("position") == pytest.approx(0.98)
    assert simulation.get("seen") == pytest.approx(0.88)


@pytest.mark.parametrize("name", BLOCKS)
def test_a_state_that_is_saved_between_samples_goes_on_to_the_same_bits(samples, name):
    points = [0.0, 0.1, 0.13, 0.17, 0.2, 0.31, 0.36, 0.4]
    simulation = begun(samples, name)
    rows(simulation, points[:4])
    saved = json.loads(simulation.to_bytes())
    expected = rows(simulation, points[3:])
    rows(simulation, [0.4, 0.7])
    simulation.restore(saved)
    assert rows(simulation, points[3:]) == expected
    other = begun(samples, name)
    other.restore(saved)
    assert rows(other, points[3:]) == expected


@pytest.mark.parametrize("period", [1e-300, 1e-12])
def test_more_samples_than_can_be_counted_are_refused(samples, period, refusal, running):
    simulation = running(samples.Counter(sample_time=period))
    assert refusal(lambda: simulation.step(1.0)) == (
        f"Counter: sample_time = {period!r} s is too short for a communication step of 1.0 s"
    )
