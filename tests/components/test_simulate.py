"""One component in time: what is reported when, and that saving, restoring and resetting lose nothing."""

import json
import math

import numpy as np
import pytest
from railcosim.components import (
    ComfortCruise,
    Component,
    ComponentError,
    Input,
    Memory,
    Noise,
    Output,
    Parameter,
    PointMassTrain,
    Simulation,
    State,
    Tape,
    noise,
    simulate,
)


def running(component, **inputs):
    simulation = Simulation(component)
    simulation.initialize()
    for name, value in inputs.items():
        simulation.set(name, value)
    simulation.start()
    return simulation


def refusal(call):
    with pytest.raises(ComponentError) as caught:
        call()
    return str(caught.value)


# ---------------------------------------------------------------- integration


def test_arrays_integrate_as_their_equations_say(samples):
    """Analytic: two unit masses and a unit spring: stretch s0 cos(sqrt(2) t), momentum zero."""
    chain = samples.Chain(masses=2, position=[0.1, -0.1], max_step=0.01)
    result = simulate(chain, 5.0, 0.1)
    expected = 0.2 * np.cos(math.sqrt(2.0) * result["time"])
    assert result["tension"][:, 0] == pytest.approx(expected, abs=1e-9)
    assert result["momentum"] == pytest.approx(np.zeros(51), abs=1e-12)
    assert result["position"].shape == (51, 2)


class Clock(Component):
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
    assert simulate(Clock(max_step=0.0), 2.0, 2.0)["x"][-1] == pytest.approx(4.0, rel=1e-14)
    assert simulate(Clock(), 2.0, 0.5)["x"][-1] == pytest.approx(4.0, rel=1e-14)


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
    simulation = Simulation(Clock())
    simulation.initialize(1.0)
    simulation.start()
    simulation.step(1.0)
    assert simulation.get("x") == pytest.approx((2.0**4 - 1.0) / 4.0, rel=1e-14)
    assert simulation.time == 2.0


# ---------------------------------------------------------------- what is reported when


def test_a_continuous_block_reports_the_end_of_the_step():
    simulation = running(Clock(), u=1.0)
    simulation.step(1.0)
    assert simulation.get("y") == pytest.approx(1.25)
    simulation.set("u", 2.0)
    assert simulation.get("y") == pytest.approx(2.25)


def test_a_sampled_feedthrough_output_holds_its_sample_until_the_next_set(samples):
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


def test_an_own_sample_time_samples_within_a_longer_step(samples):
    simulation = running(samples.Counter(), u=2.0)
    simulation.step(0.5)
    assert simulation.get("count") == 5
    assert simulation.get("total") == 10.0
    assert simulation.get("last_time") == pytest.approx(0.4)
    assert simulation.get("last_step") == pytest.approx(0.1)
    assert simulation.get("through") == 10.0


def test_sample_time_zero_samples_once_per_step(samples):
    simulation = running(samples.Counter(sample_time=0.0), u=2.0)
    simulation.step(0.5)
    simulation.step(0.25)
    assert simulation.get("count") == 2
    assert simulation.get("last_step") == 0.25


def test_a_step_that_is_a_multiple_up_to_rounding_is_taken(samples):
    simulation = running(samples.Counter(sample_time=1.0 / 3.0))
    simulation.step(1.0)
    assert simulation.get("count") == 3


@pytest.mark.parametrize("length", [0.05, 0.15, 0.1001])
def test_a_step_off_the_sample_grid_is_refused(samples, length):
    text = refusal(lambda: running(samples.Counter()).step(length))
    assert text == f"Counter: the communication step {length} s is not a whole multiple of sample_time = 0.1 s"


def test_update_may_put_a_state_back(samples):
    """By hand: 2 m/s from 0; the trip changes at 0.3 s, so the sample there restarts from 3 m."""
    result = simulate(samples.Shuttle(), 0.5, 0.1, lambda t: {"trip": 1 if t < 0.25 else 2})
    assert result["position"].tolist() == pytest.approx([0.0, 0.2, 0.4, 0.6, 3.2, 3.4])
    assert result["seen"].tolist() == result["position"].tolist()


class Mixed(Component):
    """Update and outputs read the values at the start of the sample, whatever else changes in it."""

    x = State("1", 10.0, output=True)
    a = Memory("1", 1.0, output=True)
    b = Memory("1", 2.0, output=True)

    def derivatives(self):
        return {"x": self.a}

    def update(self):
        return {"a": self.b, "b": self.a, "x": self.x + self.a}


def test_all_of_update_reads_the_old_values():
    """By hand: swap; x restarts at 11 and then integrates the new a = 2 over 1 s."""
    simulation = running(Mixed())
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
def test_a_computed_start_value_cannot_be_set(samples, phase):
    simulation = Simulation(samples.Estimator())
    if phase == "initialization":
        simulation.initialize()
    assert refusal(lambda: simulation.set("estimate", 1.0)) == "Estimator.estimate is computed and cannot be set"


def test_a_computed_start_of_untraceable_equations_is_known_too():
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


def everything(samples, **values):
    return running(samples.Everything(sample_time=0.1, tape_duration=2.0, seed=3, tape_cutoff=1.0, **values))


def test_a_saved_state_is_complete(samples):
    """Same bits after restoring: in the same instance, and in a fresh one through JSON."""
    simulation = everything(samples)
    drive(simulation, 0, 21)
    state, serialized = simulation.save(), simulation.to_bytes()
    expected = drive(simulation, 21, 60)
    simulation.restore(state)
    assert drive(simulation, 21, 60) == expected
    other = Simulation(samples.Everything())
    other.restore(json.loads(serialized))
    assert other.get("echo") == "normal"
    assert drive(other, 21, 60) == expected


def test_a_restore_brings_back_the_held_outputs(samples):
    simulation = everything(samples)
    drive(simulation, 0, 5)
    state = json.loads(simulation.to_bytes())
    expected = simulation.get("y").tolist()
    simulation.set("u", [9.0, 9.0])
    assert simulation.get("y").tolist() != expected
    simulation.restore(state)
    assert simulation.get("y").tolist() == expected


def test_a_saved_state_does_not_change_with_the_run(samples):
    simulation = everything(samples)
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


def test_texts_in_arrays_survive(samples):
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


def test_reset_reruns_the_same_bits(samples):
    simulation = everything(samples)
    expected = drive(simulation, 0, 40)
    simulation.reset()
    assert simulation.time == 0.0
    assert simulation.get("n") == 0
    simulation.initialize()
    simulation.start()
    assert drive(simulation, 0, 40) == expected


def test_reset_returns_parameters_and_inputs(samples):
    simulation = running(samples.Types(gain=3.0), teeth=4)
    simulation.set("gain", 8.0)
    simulation.reset()
    assert simulation.get("gain") == 3.0
    assert simulation.get("teeth") == 0
    simulation.set("gear_ratio", 5)


def test_two_instances_do_not_share_anything(samples):
    a, b = everything(samples), everything(samples)
    expected = drive(a, 0, 10)
    drive(a, 10, 30)
    assert drive(b, 0, 10) == expected


def test_a_foreign_state_is_refused(samples):
    state = everything(samples).save()
    assert refusal(lambda: Simulation(samples.Counter()).restore(state)) == (
        "a saved state of Everything does not fit this Counter"
    )
    bigger = Simulation(samples.Everything(axes=3))
    assert refusal(lambda: bigger.restore(state)) == "a saved state of Everything does not fit this Everything"


# ---------------------------------------------------------------- values and messages


def test_all_types_pass_through(samples):
    simulation = running(samples.Types(), teeth=3, doors=[True, False], remark="leaves", offset=2.0)
    assert simulation.get("turned") == 6
    assert type(simulation.get("turned")) is int
    assert simulation.get("closed").tolist() == [False, True]
    assert simulation.get("may_go") is False
    assert simulation.get("text") == "door open"
    simulation.set("doors", False)
    assert simulation.get("text") == "train leaves"
    assert simulation.get("shift") == 3.0


def test_an_unconnected_optional_input_keeps_its_start(samples):
    assert running(samples.Types()).get("shift") == 0.0


def test_a_tunable_parameter_may_be_set_between_steps_and_keeps_its_bounds(samples):
    simulation = running(samples.Types(), offset=2.0)
    simulation.step(0.1)
    simulation.set("gain", 4.0)
    assert simulation.get("shift") == 8.0
    assert refusal(lambda: simulation.set("gain", -1.0)) == "Types.gain = -1.0 is outside [0.0, inf] 1"
    assert simulation.get("gain") == 4.0


def test_settable_only_before_the_run(samples):
    simulation = running(samples.Types())
    assert refusal(lambda: simulation.set("gear_ratio", 3)) == (
        "Types.gear_ratio is a fixed parameter; it can only be set before the run begins"
    )
    assert refusal(lambda: running(samples.Chain()).set("position", 1.0)) == (
        "Chain.position is a start value; it can only be set before the run begins"
    )


def test_never_settable(samples):
    assert refusal(lambda: Simulation(samples.Types()).set("turned", 1)) == "Types.turned is computed and cannot be set"
    assert refusal(lambda: Simulation(samples.Learner()).set("learned", 1.0)) == (
        "Learner.learned is computed and cannot be set"
    )


def test_unknown_variables_suggest_the_nearest():
    simulation = Simulation(ComfortCruise())
    expected = "ComfortCruise has no variable 'ahead_sped'; did you mean 'ahead_speed'?"
    assert refusal(lambda: simulation.get("ahead_sped")) == expected
    assert refusal(lambda: simulation.set("ahead_sped", 1.0)) == expected


def test_wrong_values_are_refused_and_change_nothing(samples):
    simulation = running(samples.Chain())
    assert "has shape (3,), but the value given has (2,)" in refusal(lambda: simulation.set("force", [1.0, 2.0]))
    assert "takes a finite number" in refusal(lambda: simulation.set("force", float("inf")))
    assert "takes a float" in refusal(lambda: simulation.set("force", "1"))
    assert simulation.get("force").tolist() == [0.0, 0.0, 0.0]


def test_parameters_out_of_bounds_are_told_at_the_start(samples):
    simulation = Simulation(samples.Types())
    simulation.initialize()
    simulation.set("gear_ratio", 12)
    assert refusal(simulation.start) == "Types.gear_ratio = 12 is outside [1, 9] 1"
    simulation = Simulation(samples.Chain(stiffness=[1.0, -1.0]))
    simulation.initialize()
    assert refusal(simulation.start) == "Chain.stiffness = [1.0, -1.0] is outside [0.0, inf] N/m"


def test_the_life_cycle_has_an_order(samples):
    simulation = Simulation(samples.Counter())
    assert refusal(simulation.start) == "Counter cannot start: its phase is 'instantiated', not 'initialization'"
    assert refusal(lambda: simulation.step(0.1)) == "Counter cannot step: its phase is 'instantiated', not 'running'"
    simulation.initialize()
    assert "cannot be initialized" in refusal(simulation.initialize)
    simulation.start()
    assert "cannot start" in refusal(simulation.start)
    simulation.terminate()
    assert refusal(lambda: simulation.step(0.1)) == "Counter cannot step: its phase is 'terminated', not 'running'"


@pytest.mark.parametrize("length", [0.0, -0.1, math.nan, math.inf])
def test_a_step_is_positive_and_finite(length):
    assert "must be positive" in refusal(lambda: running(Clock()).step(length))


def test_a_seed_fits_an_integer_of_fmi(samples):
    """FMI 2.0: fmi2Integer is a C int."""
    simulation = Simulation(samples.Dice(seed=2**31))
    simulation.initialize()
    assert refusal(simulation.start) == "Dice.seed = 2147483648 is outside [0, 2147483647] 1"


def test_noise_needs_a_positive_hold(samples):
    simulation = Simulation(samples.Dice(hold=0.0))
    simulation.initialize()
    assert refusal(simulation.start) == "Dice.hold must be positive: it holds 'normal'"


MISSING = object()


class Faulty(Component):
    """Returns what a test puts in."""

    u = Input("1", 0.0)
    x = State("1", 0.0)
    v = State("1", 0.0, shape=(2,))
    m = Memory("1", 0.0)
    n = Memory("1", 0, type=int)
    f = Memory("1", False)
    y = Output("1")
    t = Output("1", str)
    wrong: dict = {}  # noqa: RUF012

    def _give(self, method, good):
        wrong = self.wrong.get(method, {})
        return {k: v for k, v in {**good, **wrong}.items() if v is not MISSING} if isinstance(wrong, dict) else wrong

    def initial(self):
        return self._give("initial", {})

    def derivatives(self):
        return self._give("derivatives", {"x": 0.0, "v": [0.0, 0.0]})

    def outputs(self):
        return self._give("outputs", {"y": 0.0, "t": "fine"})

    def update(self):
        return self._give("update", {"m": 0.0, "n": 0, "f": False})


@pytest.mark.parametrize(
    ("method", "wrong", "expected"),
    [
        ("outputs", {"z": 1.0}, "Faulty.outputs returns ['z']; it may return ['t', 'y']"),
        ("outputs", {"y": MISSING}, "Faulty.outputs returns no value of ['y']"),
        ("outputs", {"y": np.nan}, "Faulty.outputs: 'y' is nan at t = 0.0 s; guard the arguments it comes from"),
        ("outputs", {"y": np.float64("inf")}, "Faulty.outputs: 'y' is inf at t = 0.0 s"),
        ("outputs", {"y": np.zeros(2)}, "Faulty.outputs: 'y' has shape (2,), declared ()"),
        ("outputs", {"y": True}, "Faulty.outputs: 'y' is declared float, not True"),
        ("outputs", {"t": 1.0}, "Faulty.outputs: 't' is declared str, not 1.0"),
        ("outputs", None, "Faulty.outputs returns None; it must return a dict"),
        ("outputs", [1.0], "Faulty.outputs returns [1.0]; it must return a dict"),
        ("initial", {"y": 1.0}, "Faulty.initial returns ['y']; it may return ['f', 'm', 'n', 'v', 'x']"),
        ("initial", {"v": [1.0]}, "Faulty.initial: 'v' has shape (1,), declared (2,)"),
        ("update", {"y": 1.0}, "Faulty.update returns ['y']; it may return ['f', 'm', 'n', 'v', 'x']"),
        ("update", {"m": MISSING}, "Faulty.update returns no value of ['m']"),
        ("update", {"n": 1.5}, "Faulty.update: 'n' is declared int, not 1.5"),
        ("update", {"n": True}, "Faulty.update: 'n' is declared int, not True"),
        ("update", {"n": math.inf}, "Faulty.update: 'n' is declared int, not inf"),
        ("update", {"f": 1.0}, "Faulty.update: 'f' is declared bool, not 1.0"),
        ("update", {"v": 1.0}, "Faulty.update: 'v' has shape (), declared (2,)"),
        ("update", {"v": [1.0, np.nan]}, "Faulty.update: 'v' is [1.0, nan] at t = 0.0 s"),
        ("update", None, "Faulty.update returns None; it must return a dict"),
        ("derivatives", {"x": MISSING}, "Faulty.derivatives returns no value of ['x']"),
        ("derivatives", {"m": 1.0}, "Faulty.derivatives returns ['m']; it may return ['v', 'x']"),
        ("derivatives", {"x": np.nan}, "Faulty.derivatives: 'x' is nan at t = 0.1 s"),
        ("derivatives", {"x": np.zeros(2)}, "Faulty.derivatives: 'x' has shape (2,), declared ()"),
        ("derivatives", {"v": 1.0}, "Faulty.derivatives: 'v' has shape (), declared (2,)"),
        ("derivatives", {"v": [1.0, 2.0, 3.0]}, "Faulty.derivatives: 'v' has shape (3,), declared (2,)"),
        ("derivatives", None, "Faulty.derivatives returns None; it must return a dict"),
    ],
)
def test_what_an_equation_returns_is_checked(monkeypatch, method, wrong, expected):
    def run():
        simulation = running(Faulty())
        simulation.get("y")
        monkeypatch.setattr(Faulty, "wrong", {method: wrong})
        simulation.reset()
        simulation.initialize()
        simulation.start()
        simulation.get("y")
        simulation.step(0.1)

    assert refusal(run).startswith(expected)


def test_a_whole_real_number_may_stand_for_an_integer(monkeypatch):
    monkeypatch.setattr(Faulty, "wrong", {"update": {"n": 2.0, "m": 3, "f": np.bool_(True)}})
    simulation = running(Faulty())
    simulation.step(0.1)
    assert (simulation.get("n"), simulation.get("m"), simulation.get("f")) == (2, 3.0, True)
    assert [type(simulation.get(k)) for k in "nmf"] == [int, float, bool]


class OffTape(Component):
    trip = Input("1", 1, type=int)
    trip_time = Input("s")
    row = Tape("1", 0.0, shape=(3,))
    given: object = None

    def update(self):
        return {} if self.given is None else {"row": self.given}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (None, "OffTape.update returns no value of ['row']"),
        (np.zeros(1), "OffTape.update: 'row' has shape (1,), declared (3,)"),
        (1.0, "OffTape.update: 'row' has shape (), declared (3,)"),
        ([0.0, 0.0, np.nan], "OffTape.update: 'row' is [0.0, 0.0, nan] at t = 0.0 s"),
    ],
)
def test_a_tape_row_is_checked_too(monkeypatch, given, expected):
    monkeypatch.setattr(OffTape, "given", given)
    assert refusal(lambda: running(OffTape(sample_time=0.1)).step(0.1)).startswith(expected)


def test_the_step_is_known_in_update_only():
    class Nosy(Component):
        m = Memory("s", 0.0)
        y = Output("s")

        def outputs(self):
            return {"y": self.step}

        def update(self):
            return {"m": self.step}

    assert refusal(lambda: running(Nosy()).step(0.1)) == "Nosy: self.step is known only inside update()"


def test_the_step_is_forgotten_after_update(samples):
    simulation = running(samples.Counter())
    simulation.step(0.1)
    assert refusal(lambda: simulation.component.step) == "Counter: self.step is known only inside update()"


def test_an_exception_in_an_equation_passes_with_its_own_line():
    class Divides(Component):
        u = Input("1", 0.0)
        y = Output("1")

        def outputs(self):
            return {"y": 1.0 / self.u}

    with pytest.raises(ZeroDivisionError) as caught:
        running(Divides()).get("y")
    assert caught.traceback[-1].path.name == "test_simulate.py"


def test_equations_that_take_plain_numbers_hold_all_their_outputs():
    class PlainNumbers(Component):
        """Cannot be traced; held outputs are the safe reading."""

        u = Input("1", 0.0)
        m = Memory("1", 0.0, output=True)
        y = Output("1")

        def outputs(self):
            return {"y": math.sin(self.m)}

        def update(self):
            return {"m": self.m + 1.0 if self.u > 0.0 else self.m}

    result = simulate(PlainNumbers(), 0.2, 0.1, {"u": 1.0})
    assert result["m"].tolist() == [0.0, 1.0, 2.0]
    assert result["y"].tolist() == [0.0, 0.0, math.sin(1.0)]


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
