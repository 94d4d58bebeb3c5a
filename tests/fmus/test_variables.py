"""variables.py: start values are parameters, and what may change in a run is tunable, in both kinds of FMU alike."""

import pytest
from railcosim.components import CATALOGUE
from railcosim.components.declarations import Parameter
from railcosim.components.simulate import Simulation
from railcosim.fmus.variables import scalar_variables

FIXED = {"mass", "sample_time", "max_step", "seed", "tape_file", "tape_duration", "tape_cutoff", "times", "hold"}
"""What a run is made of: it could not change without the run being another."""


def test_gains_and_limits_may_change_in_a_run_and_masses_may_not():
    tunable = {name: {s.name for s in cls().of(Parameter) if s.declaration.tunable} for name, cls in CATALOGUE.items()}
    assert all(names.isdisjoint(FIXED) for names in tunable.values())
    assert tunable["PointMassTrain"] == {"limit_force", "traction_limit", "braking_limit"}
    assert {"alpha", "beta", "gamma", "gap_min", "acceleration_limit"} <= tunable["ComfortCruise"]
    assert tunable["PidAto"] == {"alpha", "proportional_gain", "integral_gain", "derivative_gain"}
    assert tunable["Schedule"] == {"values"}
    still = {name for name, names in tunable.items() if not names}
    made_of_data = {
        "FreightTrain",
        "Line",
        "LineTimetable",
        "LineTrain",
        "ProfileTimetable",
        "ReferenceProfile",
        "ActuatorFaults",
        "Timetable",
    }
    assert still == made_of_data | {"TripMonitor", "LearningEnergy"}


def test_every_state_and_memory_that_nothing_computes_has_a_start_that_is_a_fixed_parameter():
    for cls in CATALOGUE.values():
        variables = scalar_variables(cls())
        kept = {v.name for v in variables if v.is_kept}
        for v in variables:
            if v.is_start:
                assert (v.causality, v.variability, v.is_parameter, v.is_kept) == ("parameter", "fixed", True, False)
                assert v.name.replace("_start", "", 1) in kept
                assert v.description.startswith(f"start value of {v.slot.name}")


def driven(kind, load, instantiate):
    """A PID controller behind one face: set, step, get."""
    if kind == "native":
        return load("PidAto").initialize(sample_time=0.1)
    if kind == "python":
        return instantiate("PidAto").initialize(sample_time=0.1)
    simulation = Simulation(CATALOGUE["PidAto"](sample_time=0.1))
    simulation.initialize()
    simulation.start()
    return simulation


@pytest.mark.parametrize("kind", ["plain", "python", "native"])
def test_a_gain_that_is_changed_on_the_way_acts_at_the_next_sample(kind, load, instantiate):
    """By hand: the integral gain is nought, and the speed error stays 0.5 m/s."""
    fmu = driven(kind, load, instantiate)

    def give(name, value):
        fmu.set({name: value}) if kind == "python" else fmu.set(name, value)

    def forces(*lengths):
        found = []
        for length in lengths:
            fmu.step(length)
            found.append(fmu.get("force"))
        return found

    for name, value in {
        "integral_gain": 0.0,
        "derivative_gain": 0.0,
        "proportional_gain": 1e5,
        "trip_time": 1.0,
    }.items():
        give(name, value)
    give("reference_speed", 0.5)
    before = forces(0.1, 0.04)
    give("proportional_gain", 2e5)
    between = forces(0.03, 0.03)
    after = forces(0.1)
    assert before == [before[0]] * 2 == between
    assert abs(before[0]) == pytest.approx(5e4)
    assert after[0] == pytest.approx(2.0 * before[0])


@pytest.mark.parametrize("kind", ["python", "native"])
def test_a_start_value_that_was_set_stays_to_be_read_while_the_state_goes_on(kind, load, instantiate):
    make = load if kind == "native" else instantiate
    fmu = make("PointMassTrain").initialize(speed=20.0, position=5.0)
    assert (fmu.get("position_start"), fmu.get("position"), fmu.get("speed")) == (5.0, 5.0, 20.0)
    fmu.step(1.0)
    assert (fmu.get("position_start"), fmu.get("speed_start")) == (5.0, 20.0)
    assert fmu.get("position") > 20.0
