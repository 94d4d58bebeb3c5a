"""Simulation of a single component: integration, what is reported when, initialization, and `simulate`."""

import math

import numpy as np
import pytest
from railcosim.components import (
    Component,
    Input,
    Memory,
    Noise,
    Output,
    Parameter,
    PointMassTrain,
    Simulation,
    State,
    noise,
    simulate,
)

# ---------------------------------------------------------------- integration


def test_arrays_integrate_as_their_equations_say(samples):
    """Analytic: two unit masses and a unit spring: stretch s0 cos(sqrt(2) t), momentum zero."""
    chain = samples.Chain(masses=2, position=[0.1, -0.1], max_step=0.01)
    result = simulate(chain, 5.0, 0.1)
    expected = 0.2 * np.cos(math.sqrt(2.0) * result["time"])
    assert result["tension"][:, 0] == pytest.approx(expected, abs=1e-9)
    assert result["momentum"] == pytest.approx(np.zeros(51), abs=1e-12)
    assert result["position"].shape == (51, 2)


class Cubic(Component):
    """dx/dt = t^3, y = x + u: the time inside a step, and feed-through of a continuous block."""

    u = Input("1", 0.0)
    x = State("1", 0.0, output=True)
    y = Output("1")

    def derivatives(self):
        return {"x": self.time * self.time * self.time}

    def outputs(self):
        return {"y": self.x + self.u}


def test_time_runs_inside_a_step():
    """Analytic: t^4/4; the classical Runge-Kutta rule is exact for a cubic in time, whatever the step."""
    assert simulate(Cubic(max_step=0.0), 2.0, 2.0)["x"][-1] == pytest.approx(4.0, rel=1e-14)
    assert simulate(Cubic(), 2.0, 0.5)["x"][-1] == pytest.approx(4.0, rel=1e-14)


class Decay(Component):
    x = State("1", 1.0, output=True)
    calls: list = []  # noqa: RUF012

    def derivatives(self):
        self.calls.append(self.time)
        return {"x": -self.x}


def test_sub_steps_are_no_longer_than_max_step():
    """2.1 s in steps of at most 0.3 s: seven with four evaluations each, though 2.1 / 0.3 rounds to above 7."""
    Decay.calls.clear()
    result = simulate(Decay(max_step=0.3), 2.1, 2.1)["x"][-1]
    assert len(Decay.calls) == 28
    h = 0.3
    growth = 1 - h + h**2 / 2 - h**3 / 6 + h**4 / 24
    assert result == pytest.approx(growth**7, rel=1e-14)
    Decay.calls.clear()
    simulate(Decay(max_step=0.1), 0.25, 0.25)
    assert len(Decay.calls) == 12
    Decay.calls.clear()
    simulate(Decay(max_step=0.0), 0.3, 0.3)
    assert len(Decay.calls) == 4


def test_a_start_time_other_than_zero():
    simulation = Simulation(Cubic())
    simulation.initialize(1.0)
    simulation.start()
    simulation.step(1.0)
    assert simulation.get("x") == pytest.approx((2.0**4 - 1.0) / 4.0, rel=1e-14)
    assert simulation.time == 2.0


# ---------------------------------------------------------------- what is reported when


def test_a_continuous_block_reports_the_end_of_the_step(running):
    simulation = running(Cubic(), u=1.0)
    simulation.step(1.0)
    assert simulation.get("y") == pytest.approx(1.25)
    simulation.set("u", 2.0)
    assert simulation.get("y") == pytest.approx(2.25)


def test_a_sampled_feedthrough_output_holds_its_sample_until_the_next_set(samples, running):
    """By hand: y_0 = 0 + 3; after the step y is still 3 though the total is 3; fresh, it is total + input."""
    simulation = running(samples.Counter(), u=3.0)
    assert simulation.get("through") == 3.0
    simulation.step(0.1)
    assert simulation.get("through") == 3.0
    assert simulation.get("total") == 3.0
    assert simulation.get("count") == 1
    simulation.set("u", 3.0)
    assert simulation.get("through") == 6.0


def test_a_sampled_output_without_feedthrough_is_that_of_the_end(samples):
    result = simulate(samples.Counter(), 0.3, 0.1, {"u": 1.0})
    assert result["count"].tolist() == [0, 1, 2, 3]
    assert result["total"].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert result["through"].tolist() == [1.0, 1.0, 2.0, 3.0]


def test_a_state_of_a_sampled_block_feeds_an_output_at_the_end(samples):
    """Analytic: the innovation is held, so the estimate moves by rate * innovation * h in every sample."""
    result = simulate(samples.Estimator(), 0.2, 0.1, lambda t: {"measured": 1.0 if t == 0.0 else 2.0})
    assert result["estimate"].tolist() == pytest.approx([0.75, 0.75, 0.75 + 2.0 * 1.0 * 0.1])
    assert result["error"].tolist() == pytest.approx([0.0, 0.0, 1.0])


def test_an_own_sample_time_samples_within_a_longer_step(samples, running):
    simulation = running(samples.Counter(), u=2.0)
    simulation.step(0.5)
    assert simulation.get("count") == 5
    assert simulation.get("total") == 10.0
    assert simulation.get("last_time") == pytest.approx(0.4)
    assert simulation.get("last_step") == pytest.approx(0.1)
    assert simulation.get("through") == 10.0


def test_sample_time_zero_samples_once_per_step(samples, running):
    simulation = running(samples.Counter(sample_time=0.0), u=2.0)
    simulation.step(0.5)
    simulation.step(0.25)
    assert simulation.get("count") == 2
    assert simulation.get("last_step") == 0.25


def test_a_step_that_is_a_multiple_up_to_rounding_is_taken(samples, running):
    simulation = running(samples.Counter(sample_time=1.0 / 3.0))
    simulation.step(1.0)
    assert simulation.get("count") == 3


def test_update_may_put_a_state_back(samples):
    """By hand: 2 m/s from 0; the trip changes at 0.3 s, so the sample there restarts from 3 m."""
    result = simulate(samples.Shuttle(), 0.5, 0.1, lambda t: {"trip": 1 if t < 0.25 else 2})
    assert result["position"].tolist() == pytest.approx([0.0, 0.2, 0.4, 0.6, 3.2, 3.4])
    assert result["seen"].tolist() == result["position"].tolist()


class Swaps(Component):
    """Update and outputs read the values at the start of the sample, whatever else changes in it."""

    x = State("1", 10.0, output=True)
    a = Memory("1", 1.0, output=True)
    b = Memory("1", 2.0, output=True)

    def derivatives(self):
        return {"x": self.a}

    def update(self):
        return {"a": self.b, "b": self.a, "x": self.x + self.a}


def test_all_of_update_reads_the_old_values(running):
    """By hand: swap; x restarts at 11 and then integrates the new a = 2 over 1 s."""
    simulation = running(Swaps())
    simulation.step(1.0)
    assert (simulation.get("a"), simulation.get("b"), simulation.get("x")) == (2.0, 1.0, pytest.approx(13.0))


def test_noise_is_that_of_seed_stream_and_time(samples):
    """Reference: `noise.normal` and `noise.uniform` by hand; one lasts from a multiple of hold to the next."""
    result = simulate(samples.Dice(seed=9, deviation=2.0), 1.2, 0.1, {"u": 5.0})
    expected = [2.0 * noise.normal(9, 0, k) for k in range(13)]
    assert result["alone"].tolist() == expected
    assert result["noisy"].tolist() == [5.0 + expected[0], *(5.0 + e for e in expected[:-1])]
    for k in range(13):
        assert result["pair_seen"][k].tolist() == [noise.uniform(9, 1 + (j << 32), k // 4) for j in (0, 1)]


def test_seeds_differ(samples):
    a, b = (simulate(samples.Dice(seed=s), 1.0, 0.1)["alone"] for s in (1, 2))
    assert not np.isin(a, b).any()


# ---------------------------------------------------------------- initialization


def test_initial_follows_parameters_and_inputs_until_the_start(samples):
    simulation = Simulation(samples.Estimator())
    simulation.initialize()
    simulation.set("measured", 5.0)
    assert simulation.get("estimate") == 4.75
    simulation.set("bias", 1.0)
    assert simulation.get("estimate") == 4.0
    simulation.set("measured", 7.0)
    assert simulation.get("error") == 0.0
    simulation.start()
    simulation.set("measured", 9.0)
    assert simulation.get("estimate") == 6.0


class Nudge(Component):
    """An initial value that follows from its own declared start."""

    shift = Parameter("m", 1.0)
    x = State("m", 3.0, output=True)

    def initial(self):
        return {"x": self.x + self.shift}

    def derivatives(self):
        return {"x": 0.0}


def test_initial_counts_once_however_often_values_are_read():
    simulation = Simulation(Nudge())
    simulation.initialize()
    assert [simulation.get("x") for _ in range(3)] == [4.0] * 3
    simulation.set("shift", 2.0)
    assert simulation.get("x") == 5.0
    simulation.start()
    assert simulation.get("x") == 5.0


@pytest.mark.parametrize("phase", ["instantiated", "initialization"])
def test_a_computed_start_value_cannot_be_set(samples, phase, refusal):
    simulation = Simulation(samples.Estimator())
    if phase == "initialization":
        simulation.initialize()
    assert refusal(lambda: simulation.set("estimate", 1.0)) == "Estimator.estimate is computed and cannot be set"


def test_a_computed_start_of_untraceable_equations_is_known_too(refusal):
    class PlainNumbers(Component):
        m = Memory("1", 0.0)
        y = Output("1")

        def initial(self):
            return {"m": float(self.time)}

        def outputs(self):
            return {"y": math.sin(self.m)}

        def update(self):
            return {"m": self.m}

    assert "computed" in refusal(lambda: Simulation(PlainNumbers()).set("m", 1.0))


# ---------------------------------------------------------------- simulate()


def test_simulate_takes_a_dict_or_a_function_and_counts_its_steps():
    """Analytic: without resistance v = F t / m."""
    free = {"c0": 0.0, "c1": 0.0, "c2": 0.0, "mass": 2.0}
    by_dict = simulate(PointMassTrain(**free), 1.0, 0.1, {"force": 4.0})
    by_function = simulate(PointMassTrain(**free), 1.0, 0.1, lambda t: {"force": 4.0})
    assert (by_dict["speed"] == by_function["speed"]).all()
    assert by_dict["speed"] == pytest.approx(2.0 * by_dict["time"])
    assert by_dict["time"][7] == 7 * 0.1
    assert len(by_dict["time"]) == 11
    assert set(by_dict) == {"time", "position", "speed", "acceleration", "applied_force"}


def test_simulate_reads_and_writes_the_tape_file(samples, tmp_path):
    path = tmp_path / "learned.tape"
    values = {"sample_time": 0.1, "tape_duration": 1.0, "tape_file": str(path)}
    inputs = lambda t: {"trip_time": t, "error": 1.0}  # noqa: E731
    first = simulate(samples.Learner(**values), 0.5, 0.1, inputs)
    assert (first["command"] == 0.0).all()
    second = simulate(samples.Learner(**values), 0.5, 0.1, inputs)
    assert (second["command"] == 0.5).all()


def test_noise_of_the_held_state_stays_within_the_step(samples):
    """By hand: a random number drives the state over the sample it belongs to, not the next one."""

    class Walk(Component):
        hold = Parameter("s", 0.1)
        push = Noise(hold)
        x = State("1", 0.0, output=True)

        def derivatives(self):
            return {"x": self.push}

    result = simulate(Walk(seed=4), 0.4, 0.1)
    pushes = [noise.normal(4, 0, k) for k in range(4)]
    assert result["x"] == pytest.approx([0.0, *np.cumsum(pushes) * 0.1], abs=1e-15)
