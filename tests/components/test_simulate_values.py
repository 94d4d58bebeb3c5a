"""What may be set in a simulation, when, and what is said of the rest."""

import math

import pytest
from railcosim.components import (
    ComfortCruise,
    PointMassTrain,
    Simulation,
)

# ---------------------------------------------------------------- values and messages


def test_all_types_pass_through(samples, running):
    simulation = running(samples.Types(), teeth=3, doors=[True, False], remark="leaves", offset=2.0)
    assert simulation.get("turned") == 6
    assert type(simulation.get("turned")) is int
    assert simulation.get("closed").tolist() == [False, True]
    assert simulation.get("may_go") is False
    assert simulation.get("text") == "door open"
    simulation.set("doors", False)
    assert simulation.get("text") == "train leaves"
    assert simulation.get("shift") == 3.0


def test_an_unconnected_optional_input_keeps_its_start(samples, running):
    assert running(samples.Types()).get("shift") == 0.0


def test_a_tunable_parameter_may_be_set_between_steps_and_keeps_its_bounds(samples, running, refusal):
    simulation = running(samples.Types(), offset=2.0)
    simulation.step(0.1)
    simulation.set("gain", 4.0)
    assert simulation.get("shift") == 8.0
    assert refusal(lambda: simulation.set("gain", -1.0)) == "Types.gain = -1.0 is outside [0.0, inf] 1"
    assert simulation.get("gain") == 4.0


def test_settable_only_before_the_run(samples, running, refusal):
    simulation = running(samples.Types())
    assert refusal(lambda: simulation.set("gear_ratio", 3)) == (
        "Types.gear_ratio is a fixed parameter; it can only be set before the run begins"
    )
    assert refusal(lambda: running(samples.Chain()).set("position", 1.0)) == (
        "Chain.position is a start value; it can only be set before the run begins"
    )


def test_never_settable(samples, refusal):
    assert refusal(lambda: Simulation(samples.Types()).set("turned", 1)) == "Types.turned is computed and cannot be set"
    assert refusal(lambda: Simulation(samples.Learner()).set("learned", 1.0)) == (
        "Learner.learned is computed and cannot be set"
    )


def test_unknown_variables_suggest_the_nearest(refusal):
    simulation = Simulation(ComfortCruise())
    expected = "ComfortCruise has no variable 'ahead_sped'; did you mean 'ahead_speed'?"
    assert refusal(lambda: simulation.get("ahead_sped")) == expected
    assert refusal(lambda: simulation.set("ahead_sped", 1.0)) == expected


def test_wrong_values_are_refused_and_change_nothing(samples, running, refusal):
    simulation = running(samples.Chain())
    assert "has shape (3,), but the value given has (2,)" in refusal(lambda: simulation.set("force", [1.0, 2.0]))
    assert "takes a finite number" in refusal(lambda: simulation.set("force", float("inf")))
    assert "takes a float" in refusal(lambda: simulation.set("force", "1"))
    assert simulation.get("force").tolist() == [0.0, 0.0, 0.0]


def test_parameters_out_of_bounds_are_told_at_the_start(samples, refusal):
    simulation = Simulation(samples.Types())
    simulation.initialize()
    simulation.set("gear_ratio", 12)
    assert refusal(simulation.start) == "Types.gear_ratio = 12 is outside [1, 9] 1"
    simulation = Simulation(samples.Chain(stiffness=[1.0, -1.0]))
    simulation.initialize()
    assert refusal(simulation.start) == "Chain.stiffness = [1.0, -1.0] is outside [0.0, inf] N/m"


def test_the_life_cycle_has_an_order(samples, refusal):
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
def test_a_step_is_positive_and_finite(length, running, refusal):
    assert "must be positive" in refusal(lambda: running(PointMassTrain()).step(length))


def test_a_seed_fits_an_integer_of_fmi(samples, refusal):
    """FMI 2.0: fmi2Integer is a C int."""
    simulation = Simulation(samples.Dice(seed=2**31))
    simulation.initialize()
    assert refusal(simulation.start) == "Dice.seed = 2147483648 is outside [0, 2147483647] 1"


def test_noise_needs_a_positive_hold(samples, refusal):
    simulation = Simulation(samples.Dice(hold=0.0))
    simulation.initialize()
    assert refusal(simulation.start) == "Dice.hold must be positive: it holds 'normal'"
