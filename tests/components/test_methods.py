"""Integration onto a standstill: located in steps of any length, for each element of an array, and never for ever."""

import numpy as np
import pytest
from railcosim.components import Component, Input, State, simulate
from railcosim.components.maths import where


class Sliders(Component):
    """Blocks under dry friction, driven by a force per mass that acts from a given time on."""

    force = Input("m/s2", 0.0)
    grip = Input("m/s2", 1.0)
    x = State("m", 0.0, shape=(3,), output=True)
    v = State("m/s", (1.0, -2.0, 0.0), shape=(3,), output=True, standstill=True)

    def derivatives(self):
        held = where(abs(self.force) > self.grip, self.force - where(self.force > 0.0, self.grip, -self.grip), 0.0)
        moving = self.force - where(self.v > 0.0, self.grip, -self.grip)
        return {"x": self.v, "v": where(self.v == 0.0, held, moving)}


@pytest.mark.parametrize("step", [0.01, 0.3, 5.0])
def test_each_element_stops_by_itself_in_a_step_of_any_length(step):
    """Analytic: v0^2 / (2 grip) and v0 / grip; Runge-Kutta is exact for parabolas."""
    found = simulate(Sliders(max_step=step), 15.0, step)
    t = found["time"]
    assert found["x"][-1] == pytest.approx([0.5, -2.0, 0.0], abs=1e-11)
    assert (found["v"][t > 1.0 + 1e-9, 0] == 0.0).all()
    assert (found["v"][t > 2.0 + 1e-9, 1] == 0.0).all()
    assert (found["v"][:, 2] == 0.0).all()
    assert found["v"][t < 2.0 - 1e-9, 1] == pytest.approx(t[t < 2.0 - 1e-9] - 2.0, abs=1e-12)


def test_it_sets_off_again_within_the_step_it_turns_in():
    """Analytic: from -2 m/s under 3 - (-1) m/s2 it stands after 0.5 s, and is at 1 m/s after 1 s, with 3 - 1."""
    found = simulate(Sliders(max_step=1.0), 1.0, 1.0, {"force": 3.0})
    assert found["v"][-1] == pytest.approx([3.0, 1.0, 2.0], abs=1e-11)
    assert found["x"][-1] == pytest.approx([2.0, -0.5 + 0.25, 1.0], abs=1e-11)


class Timed(Component):
    """A block that stops under a force of time."""

    x = State("m", 0.0, output=True)
    v = State("m/s", 1.0, output=True, standstill=True)

    def derivatives(self):
        return {"x": self.v, "v": where(self.v > 0.0, -3.0 * self.time * self.time, 0.0)}


def test_time_runs_on_in_the_parts_of_a_step():
    """Analytic: v = 1 - t^3, at rest at 1 s and 0.75 m."""
    found = simulate(Timed(max_step=4.0), 4.0, 4.0)
    assert found["v"][-1] == 0.0
    assert found["x"][-1] == pytest.approx(0.75, abs=1e-11)


class Bouncing(Component):
    """What turns round at every standstill, wherever it is put: dry friction with the wrong sign, twice."""

    v = State("m/s", (1e-3, -1e-3), shape=(2,), output=True, standstill=True)

    def derivatives(self):
        return {"v": where(self.v > 0.0, -1.0, where(self.v < 0.0, 1.0, where(self.v[::-1] > 0.0, 1.0, -1.0)))}


def test_states_that_keep_one_another_moving_come_to_an_end():
    found = simulate(Bouncing(max_step=1.0), 3.0, 1.0)
    assert np.isfinite(found["v"]).all()
    assert np.abs(found["v"]).max() <= 1e-3


class Wild(Component):
    """What is no number passes no standstill, and is said."""

    v = State("m/s", 1.0, output=True, standstill=True)

    def derivatives(self):
        return {"v": where(self.v < 2.0, 1e308 * 1e308 * 0.0, 0.0)}


def test_no_number_is_no_standstill():
    with pytest.raises(ValueError, match="'v' is nan"):
        simulate(Wild(), 0.2, 0.1)


class Decaying(Component):
    """Stiff enough for a stage of a step to be beyond zero, though the motion never reaches it."""

    v = State("m/s", 1.0, output=True, standstill=True)

    def derivatives(self):
        return {"v": -1.5 * self.v}


def test_a_stage_beyond_zero_is_no_standstill():
    found = simulate(Decaying(max_step=1.0), 5.0, 1.0)["v"]
    assert (found > 0.0).all()
    assert (np.diff(found) < 0.0).all()
