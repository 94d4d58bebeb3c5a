"""simulation.c: steps, their limits, and numbers that are none."""

import itertools
import math
from ctypes import c_double, c_int, c_size_t, c_uint
from pathlib import Path

import pytest

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
OWN = Path(__file__).parent / "samples.py"
BREAKS, SPOILS = (f"{OWN}:{name}" for name in ("Breaks", "Spoils"))
OTHERS = Path(__file__).parents[2] / "components" / "samples.py"
COUNTER = f"{OTHERS}:Counter"
OK = 0
ERROR = 3
STEP = 0.25


# ---------------------------------------------------------------- steps


@pytest.mark.parametrize("length", [0.0, -STEP, math.nan, math.inf, -math.inf])
def test_steps_that_go_nowhere_are_refused(load, length):
    fmu = load("PointMassTrain").initialize()
    assert fmu.step(length) == ERROR
    assert "must be positive" in fmu.said
    assert fmu.step() == OK


@pytest.mark.parametrize("at", [STEP / 2, -STEP, 2 * STEP, 0.0, math.nan, math.inf])
def test_a_step_must_continue_the_last_one(load, at):
    fmu = load("PointMassTrain").initialize()
    assert fmu.step() == OK
    assert fmu.step(at=at) == ERROR
    assert "does not continue" in fmu.said
    assert fmu.step() == OK


@pytest.mark.parametrize(("start", "step"), [(0.0, 0.1), (1e6, 1e-4), (0.0, 1.0 / 3.0), (-5.0, 0.01)])
def test_rounding_of_the_communication_point_is_forgiven(load, start, step):
    for summed in (True, False):
        fmu = load("PointMassTrain").initialize(start)
        at = start
        for k in range(200):
            assert fmu.step(step, at=at) == OK, fmu.said
            at = at + step if summed else start + (k + 1) * step
        assert fmu.last_successful_time() == pytest.approx(at, abs=1e-9)


def test_the_stop_time_ends_the_run(load):
    fmu = load("PointMassTrain").initialize(stop=1.0)
    for _ in range(4):
        assert fmu.step() == OK
    assert fmu.step() == ERROR
    assert "stop time" in fmu.said
    free = load("PointMassTrain").initialize()
    for _ in range(5):
        assert free.step() == OK
    assert load("PointMassTrain").initialize(stop=1.0).step(1.01) == ERROR


def test_a_million_summed_steps_reach_the_stop_time(load):
    """0.1 added up 10^6 times is 1e5 + 1.3e-6: five orders of magnitude more than a rounding of the last step."""
    end = sum(itertools.repeat(0.1, 1_000_000))
    assert end - 1e5 > 1e-6
    fmu = load("Gust").initialize(start=end - 0.1, stop=1e5)
    assert fmu.step(0.1) == OK


@pytest.mark.parametrize("stop", [-1.0, math.nan])
def test_an_experiment_that_ends_before_it_starts_is_refused(load, stop):
    fmu = load("Gust")
    assert fmu.SetupExperiment(0, c_double(0), c_double(0), 1, c_double(stop)) == ERROR
    assert fmu.SetupExperiment(0, c_double(0), c_double(math.inf), 0, c_double(0)) == ERROR
    assert fmu.SetupExperiment(0, c_double(0), c_double(1), 1, c_double(1)) == OK


def test_hopeless_step_limits_are_errors_not_hours(load):
    fmu = load("PointMassTrain").initialize(max_step=1e-300)
    assert fmu.step() == ERROR
    assert "max_step" in fmu.said
    fmu = load(MIXED).initialize()
    fmu.Reset()
    fmu.enter()
    fmu.set("hold", 1e-3)
    assert fmu.ExitInitializationMode() == OK


# ---------------------------------------------------------------- errors


def test_a_result_that_is_not_finite_is_an_error_that_names_it(load):
    fmu = load(BREAKS).initialize()
    assert fmu.set("u", 0.0) == OK
    assert fmu.status_of_get("y") == ERROR
    assert "outputs: 'y' is inf at t = 0 s" in fmu.said
    assert fmu.step() == ERROR
    assert "'y'" in fmu.said
    assert fmu.last_successful_time() == 0.0
    assert fmu.get("u") == 0.0  # for whoever looks for the cause
    assert fmu.step() == ERROR
    assert "in error" in fmu.said


def test_a_state_that_runs_away_is_an_error_that_names_it(load):
    fmu = load(BREAKS).initialize(x=1e200, rate=1e200)
    assert fmu.status_of_get("der(x)") == ERROR
    assert "der(x)" in fmu.said
    assert fmu.step() == ERROR
    assert "derivatives: 'x' is" in fmu.said


@pytest.mark.parametrize("u", [0.75, 2e9])
def test_an_integer_that_is_none_is_an_error_that_names_it(load, u):
    fmu = load(BREAKS).initialize()
    assert fmu.set("u", u) == OK
    assert fmu.step() == ERROR
    assert "'whole'" in fmu.said
    assert "32-bit integer" in fmu.said


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("for_memory", "update: 'm' is inf at t = 0"),
        ("for_tape", "update: column 1 of the tape is inf at t = 0"),
        ("for_state", "update: 'x' is inf at t = 0"),
    ],
)
def test_what_is_kept_must_be_finite(load, name, said):
    fmu = load(SPOILS).initialize(sample_time=0.1, tape_duration=1.0)
    assert fmu.step(0.1) == OK
    assert (fmu.get("m"), fmu.get("x")) == (1.0, 1.0)
    assert fmu.set(name, 0.0) == OK
    assert fmu.set("trip_time", 0.1) == OK
    assert fmu.step(0.1) == ERROR
    assert said.replace("t = 0", "t = 0.1") in fmu.said


def test_what_is_asked_after_a_bad_value_was_set_is_an_error(load):
    """Values, rates and derivatives alike: all of them are of outputs that are infinite."""
    for ask in (
        lambda f: f.status_of_get("y"),
        lambda f: f.directional(["y"], ["u"], [1.0]),
    ):
        fmu = load(BREAKS).initialize()
        assert fmu.set("u", 0.0) == OK
        assert ask(fmu) == ERROR
        assert "'y' is inf" in fmu.said


@pytest.mark.parametrize(
    ("u", "said"),
    [
        (3.0, "'whole' is 3000000000 at t = 0 s, which is no 32-bit integer"),
        (-3.0, "'whole' is -3000000000 at t = 0 s, which is no 32-bit integer"),
        (-1.0, "'door' is -0.5 at t = 0 s, which is no boolean"),
    ],
)
def test_what_a_variable_cannot_hold_is_an_error_that_names_it(load, u, said):
    fmu = load(f"{OWN}:Misfits").initialize()
    assert (fmu.get("whole"), fmu.get("door")) == (10**9, 1)
    assert fmu.set("u", 0.0) == OK
    assert (fmu.get("whole"), fmu.get("door")) == (0, 0)
    assert fmu.set("u", u) == OK
    assert fmu.GetInteger(*integer(fmu, "whole")) == ERROR
    assert said in fmu.said


def integer(fmu, name):
    return (c_uint * 1)(fmu.references[name]), c_size_t(1), (c_int * 1)()


def test_a_start_that_is_no_number_is_an_error_that_names_it(load):
    fmu = load(f"{OWN}:Begins").enter()
    assert fmu.set("u", 0.0) == OK
    assert fmu.ExitInitializationMode() == ERROR
    assert "initial: 'x' is inf at t = 0 s" in fmu.said


def test_what_goes_wrong_after_the_last_sample_of_a_step_is_an_error(load):
    """Outputs of the new memory; and a random number of a parameter that was changed on the way."""
    fmu = load(f"{OWN}:Late").initialize()
    assert fmu.get("y") == 1.0
    assert fmu.step(1.0) == ERROR
    assert "outputs: 'y' is inf at t = 1 s" in fmu.said
    fmu = load(f"{OWN}:Late").initialize()
    assert fmu.set("hold", 0.0) == OK
    assert fmu.step(1.0) == ERROR
    assert "hold must be positive" in fmu.said
