"""Model exchange: choices that wait for events, samples when they are due, exact standstill, who may call what."""

import itertools
import math
from ctypes import byref, c_double, c_int, c_size_t

import pytest
from fmpy.fmi2 import fmi2EventInfo

OK, DISCARD, ERROR = 0, 2, 3
NULL = None


@pytest.fixture
def choices(exchanged):
    fmu = exchanged("Choices").initialize()
    fmu.event()
    return fmu


# ---------------------------------------------------------------- choices


def test_a_choice_waits_for_the_event_that_its_indicator_tells(choices):
    first = choices.numbers("EventIndicators")
    assert len(first) == choices.description.numberOfEventIndicators
    assert 0.0 not in first
    for x, under in ((1.9, 1), (2.1, 1)):
        assert choices.put(x) == OK
        assert choices.get("under") == under
    passed = [a > 0.0 > b or a < 0.0 < b for a, b in zip(first, choices.numbers("EventIndicators"), strict=True)]
    assert any(passed)
    choices.event(0.1)
    assert choices.get("under") == 0
    assert 0.0 not in choices.numbers("EventIndicators")


def test_each_indicator_is_of_one_choice(choices):
    """x < level, x <= 1, floor, stair, x > 3, x > 1 and what depends on it; none for time, kinks and whole inputs."""
    assert choices.description.numberOfEventIndicators == 7
    choices.put(1.5)
    choices.event(0.2)
    assert [choices.get(name) for name in ("up_to", "whole", "stair", "either", "bounded")] == [0, 1, 2.0, 1.0, 1.5]
    choices.put(4.5)
    assert [choices.get(name) for name in ("up_to", "whole", "stair", "either", "bounded")] == [0, 1, 2.0, 1.0, 4.5]
    choices.event(0.3, u=0.1)
    assert [choices.get(name) for name in ("up_to", "whole", "stair", "either")] == [0, 4, 3.0, -1.0]


def test_at_rest_of_a_comparison_its_indicator_is_a_hair_away_on_the_side_where_it_holds(exchanged):
    fmu = exchanged("Close").initialize()
    fmu.event()
    for x, sign in ((1.0, 1), (1.0 + 1e-9, -1)):  # x <= 1
        fmu.put(x)
        fmu.event(0.1)
        (indicator,) = fmu.numbers("EventIndicators")
        assert math.copysign(1, indicator) == sign
        assert 0.0 < abs(indicator) < 1e-8


def test_what_is_compared_with_infinity_is_as_far_as_can_be(exchanged):
    fmu = exchanged("Unbounded").initialize()
    fmu.event()
    assert fmu.numbers("EventIndicators") == [pytest.approx(1.0)]
    assert fmu.get("before") == 1


def test_indicators_are_in_the_order_of_one(choices):
    choices.event(0.1, level=1e9)
    assert 0.9 < max(map(abs, choices.numbers("EventIndicators"))) < 2.0


def test_time_events_are_told_ahead_and_are_exact(exchanged):
    fmu = exchanged("Choices").initialize()
    found = []
    time = NULL
    while True:
        _, following = fmu.event(time)
        found.append((time, fmu.get("early"), fmu.get("late"), fmu.get("clock")))
        if following is NULL:
            break
        time = following
    assert found == [(NULL, 1, 0, 1.0), (1.0, 0, 0, 2.0), (1.5, 0, 0, 3.0), (2.0, 0, 1, 3.0)]


@pytest.mark.parametrize("after", [3.7, 0.3, -1.1, 1000.1])
def test_at_a_time_event_a_piece_is_behind_whatever_the_rounding(exchanged, after):
    fmu = exchanged("Stairs").initialize(start=after, after=after)
    found = []
    _, time = fmu.event()
    while time < after + 4.05:
        _, following = fmu.event(time)
        found.append((time, fmu.get("stair"), fmu.get("whole")))
        time = following
    expected = [(after + 0.1 * k, float(k), k // 10) for k in range(2, 41)]  # the first has no beginning
    assert found == [(pytest.approx(time, abs=1e-9), stair, whole) for time, stair, whole in expected]


def test_an_importer_whose_times_are_rounded_comes_to_a_time_event_and_goes_on(exchanged):
    fmu = exchanged("Stairs").initialize(start=2.0, after=100.0)
    assert fmu.event()[1] == 2.1
    assert fmu.get("begun") == 0
    assert 3 * 0.7 < 2.1
    assert fmu.event(3 * 0.7)[1] == 3.0
    assert fmu.get("begun") == 1


def test_a_frozen_branch_without_a_value_gives_way_to_the_equations_as_they_stand(choices):
    choices.put(5.0)
    choices.event(0.1)
    assert choices.get("safe") == math.log(2.0)
    choices.put(2.0)  # the solver looks back beyond the event
    assert choices.get("safe") == 0.0
    assert choices.numbers("Derivatives") == [0.5]
    assert choices.get("whole") == 2


def test_inputs_may_jump_at_an_event_and_are_seen_before_it_is_over(choices):
    assert choices.EnterEventMode() == OK
    assert choices.set("on", True) == OK
    assert choices.get("chosen") == 2.0
    assert choices.numbers("Derivatives") == [-0.5]
    assert choices.set("level", 0.1) == OK
    assert choices.get("under") == 0
    assert choices.event(integrate=False)[0] is False
    assert choices.get("chosen") == 0.1


def test_parameters_change_at_events_alone(choices):
    assert choices.set("level", 3.0) == ERROR
    assert choices.said == "Choices: fmi2SetReal: level is set at events only; enter event mode"
    assert choices.set("u", 0.75) == OK
    assert choices.set("on", True) == OK  # FMPy sets all inputs whenever it looks for events
    assert choices.numbers("Derivatives") == [-0.75]
    assert choices.set("whole", 1) == ERROR


def test_in_initialization_mode_all_is_as_it_stands(exchanged):
    fmu = exchanged("Choices").enter()
    assert fmu.set("x_start", 2.5) == OK
    assert fmu.get("whole") == 2
    assert fmu.numbers("Derivatives") == [0.5]
    assert fmu.numbers("ContinuousStates") == [2.5]
    assert 0.0 not in fmu.numbers("EventIndicators")
    assert fmu.numbers("NominalsOfContinuousStates") == [1.0]


def test_a_rate_without_a_value_is_discarded_and_an_output_without_one_is_an_error(exchanged):
    fmu = exchanged("Breaks").initialize()
    fmu.event()
    assert fmu.put(1e200) == OK
    assert fmu.numbers("Derivatives") == DISCARD
    assert "der(x)" in fmu.said
    assert fmu.set("u", 0.0) == OK
    assert fmu.numbers("ContinuousStates") == [1e200]  # what is held is held
    assert fmu.SetTime(c_double(1.0)) == OK
    assert fmu.EnterEventMode() == OK
    assert fmu.NewDiscreteStates(byref(fmi2EventInfo())) == ERROR
    assert "'y' is inf" in fmu.said


def test_an_output_without_a_value_stops_no_integration(exchanged):
    fmu = exchanged("Inverse").initialize()
    fmu.event()
    assert fmu.put(0.0) == OK
    assert fmu.status_of_get("y") == ERROR
    assert "'y' is inf" in fmu.said
    assert fmu.numbers("Derivatives") == [-1.0]
    assert fmu.numbers("ContinuousStates") == [0.0]
    assert fmu.set("w", -1.0) == OK
    assert fmu.numbers("EventIndicators") == DISCARD
    assert "event indicator 2 is" in fmu.said


def test_when_a_sample_is_due_modes_are_of_the_inputs_that_it_sees(exchanged):
    fmu = exchanged("Inverse").initialize(u=2.0)
    assert fmu.numbers("Derivatives") == [-1.0]
    assert fmu.set("u", 0.5) == OK
    assert fmu.numbers("Derivatives") == [1.0]
    assert fmu.set("u", 2.0) == OK
    assert fmu.get("der(x)") == -1.0


def test_when_a_sample_is_due_nothing_is_read_that_it_cannot_be_taken_with(exchanged):
    fmu = exchanged("Inverse").initialize(x=0.0)
    assert fmu.status_of_get("y") == ERROR
    assert fmu.numbers("Derivatives") == ERROR
    assert "'y' is inf" in fmu.said


def test_before_the_initial_state_has_a_value_none_is_read(exchanged):
    fmu = exchanged("Begins").enter()
    assert fmu.set("u", 0.0) == OK
    assert fmu.numbers("ContinuousStates") == ERROR
    assert "'x' is inf" in fmu.said
    assert fmu.set("u", 0.25) == OK
    assert fmu.numbers("ContinuousStates") == [4.0]


# ---------------------------------------------------------------- samples


def test_samples_are_taken_when_they_are_due_and_held_between(exchanged):
    fmu = exchanged("Sampler").initialize(sample_time=0.5)
    assert fmu.event(u=1.0) == (False, 0.5)
    assert (fmu.get("n"), fmu.get("y")) == (1, 2.0)
    assert fmu.set("u", 3.0) == OK
    assert fmu.put(2.0) == OK
    assert (fmu.get("y"), fmu.get("z")) == (2.0, 6.0)
    assert fmu.event(0.25, integrate=False)[1] == 0.5  # an event of another kind
    assert (fmu.get("n"), fmu.get("y")) == (1, 2.0)
    assert fmu.EnterContinuousTimeMode() == OK
    assert fmu.SetTime(c_double(0.5)) == OK
    assert fmu.EnterEventMode() == OK
    assert fmu.get("y") == 7.0  # of the inputs of this sample, and the memory before it
    assert fmu.event() == (False, 1.0)
    assert (fmu.get("n"), fmu.get("y")) == (2, 7.0)
    assert fmu.event(2.0)[1] == 2.5  # those that were passed by are made up for
    assert fmu.get("n") == 5


@pytest.mark.parametrize(("start", "period", "time"), [(0.0, 0.5, 1e18), (0.0, 1e-300, 1.0), (1.0, 1e-300, 1.0)])
def test_samples_without_end_are_refused(exchanged, start, period, time):
    fmu = exchanged("Sampler").initialize(start=start, sample_time=period)
    if time > start:
        fmu.event()
        assert fmu.SetTime(c_double(time)) == OK
        assert fmu.EnterEventMode() == OK
    assert fmu.NewDiscreteStates(byref(fmi2EventInfo())) == ERROR
    assert f"sample_time = {period:g} s is too short for an event at t = {time:.17g} s" in fmu.said


def test_without_communication_steps_the_period_is_the_default_step(exchanged):
    fmu = exchanged("Sampler").initialize()
    assert fmu.get("sample_time") == float(fmu.description.defaultExperiment.stepSize) == 0.1
    assert fmu.event()[1] == 0.1


def test_a_sample_may_put_a_state_back(exchanged):
    fmu = exchanged("Sampler").initialize()
    assert fmu.event(back=True)[0]
    assert fmu.numbers("ContinuousStates") == [-1.0]
    assert fmu.numbers("EventIndicators") == [-1.0]
    assert fmu.event(0.1)[0] is False  # to where it is


def test_random_numbers_change_when_their_hold_is_over(exchanged):
    fmu = exchanged("Late").initialize(sample_time=10.0, hold=0.75)
    assert fmu.event() == (False, 0.75)
    assert fmu.event(0.75) == (False, 1.5)
    assert fmu.event(9.8) == (False, 10.0)
    assert fmu.SetTime(c_double(9.9)) == OK
    assert fmu.EnterEventMode() == OK
    assert fmu.set("hold", 0.0) == OK
    assert fmu.NewDiscreteStates(byref(fmi2EventInfo())) == ERROR
    assert "hold must be positive" in fmu.said


# ---------------------------------------------------------------- standstill


def test_what_reaches_its_standstill_stands_until_it_is_driven(exchanged):
    fmu = exchanged("Pushed").initialize(force=-1.0)
    assert fmu.event()[0] is False
    assert fmu.numbers("EventIndicators") == [1.0]
    assert fmu.put(-1e-9) == OK
    assert fmu.numbers("Derivatives") == [-1.0]
    assert fmu.event(1.0)[0] is True
    assert fmu.numbers("ContinuousStates") == [0.0]
    assert fmu.numbers("Derivatives") == [0.0]
    assert fmu.numbers("EventIndicators")[0] > 0.0
    assert fmu.event(2.0)[0] is False


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_sets_off_with_a_sign_and_no_size(exchanged, side):
    fmu = exchanged("Sampler").initialize(v=side)
    fmu.event()
    fmu.put(-side)
    assert fmu.event(0.01, u=side)[0] is True
    (v,) = fmu.numbers("ContinuousStates")
    assert v == side * 1e-300
    assert fmu.numbers("EventIndicators") == [v]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_arrives_as_a_sample_is_due_stands_before_it_is_taken(exchanged, side):
    fmu = exchanged("Sampler").initialize(v=side, sample_time=0.5)
    fmu.event()
    fmu.put(-1e-3 * side)
    assert fmu.event(0.5) == (True, 1.0)
    assert fmu.get("n") == 2
    assert fmu.numbers("ContinuousStates") == [0.0]
    assert fmu.event(1.0) == (False, 1.5)


def test_what_time_sets_off_is_noticed(exchanged):
    fmu = exchanged("Driven").initialize()
    assert fmu.event() == (False, NULL)
    assert fmu.numbers("EventIndicators")[0] > 0.0
    fmu.put(1e-6)
    assert fmu.numbers("EventIndicators")[0] < 0.0
    assert fmu.event(1e-3)[0] is False
    assert fmu.numbers("EventIndicators") == [1e-6]


# ---------------------------------------------------------------- the interface


def test_saved_states_have_modes_and_sides(exchanged):
    fmu = exchanged("Choices").initialize()
    fmu.event()
    saved, before = fmu.save(), fmu.everything()
    content = fmu.to_bytes(saved)
    fmu.put(4.5)
    fmu.event(1.0, on=True)
    after = fmu.everything()
    assert fmu.SetFMUstate(saved) == OK
    assert fmu.everything() == before
    fmu.put(4.5)
    fmu.event(1.0, on=True)
    assert fmu.everything() == after
    assert fmu.to_bytes(fmu.save()) != content
    assert fmu.FreeFMUstate(byref(saved)) == OK


def test_a_reset_begins_anew_and_is_still_for_model_exchange(exchanged):
    fmu = exchanged("Pushed").initialize(force=-1.0)
    fmu.event()
    fmu.put(-1.0)
    fmu.event(1.0)
    assert fmu.Reset() == OK
    fmu.initialize(force=-1.0)
    assert fmu.event() == (False, NULL)
    assert fmu.numbers("ContinuousStates") == [1.0]
    assert fmu.Terminate() == OK
    assert fmu.numbers("Derivatives") == [-1.0]


def test_a_saved_state_of_the_other_kind_is_refused(exchanged):
    slave, one = exchanged("Choices", kind=1).initialize(), exchanged("Choices").initialize()
    for taker, giver, kind in ((one, slave, "co-simulation"), (slave, one, "model exchange")):
        before, state = taker.everything(), taker.from_bytes(giver.to_bytes(giver.save()))
        assert taker.SetFMUstate(state) == ERROR
        assert taker.said == f"Choices: the saved state is of an instance for {kind}"
        assert taker.everything() == before
        assert taker.FreeFMUstate(byref(state)) == OK


@pytest.mark.parametrize("name", ["Choices", "Sampler", "Nothing"])
def test_after_a_reset_all_is_as_in_a_new_instance(exchanged, name):
    fmu = exchanged(name)
    new = fmu.to_bytes(fmu.save())
    fmu.initialize(stop=10.0)
    fmu.event()
    fmu.put(-1.5)
    fmu.event(0.5)
    fmu.put(-2.5)
    assert fmu.Reset() == OK
    assert fmu.to_bytes(fmu.save()) == new


def test_in_initialization_mode_indicators_are_of_the_present_states(exchanged):
    anew, again = exchanged("Choices"), exchanged("Choices").initialize(x=0.1)
    again.event()
    assert again.Reset() == OK
    for fmu in (anew, again):
        fmu.enter()
        assert fmu.set("x_start", 2.5) == OK
    first = anew.numbers("EventIndicators")
    assert again.numbers("EventIndicators") == first
    assert anew.ExitInitializationMode() == OK
    assert anew.numbers("EventIndicators") == first
    moving = exchanged("Sampler").enter()
    assert moving.set("v_start", -7.5) == OK
    assert moving.numbers("EventIndicators") == [-7.5]
    assert moving.set("v_start", 7.5) == OK
    assert moving.numbers("EventIndicators") == [7.5]


CALLS = {
    "EnterEventMode": (lambda f: f.EnterEventMode(), ("event", "integrating")),
    "EnterContinuousTimeMode": (lambda f: f.EnterContinuousTimeMode(), ("event",)),
    "NewDiscreteStates": (lambda f: f.NewDiscreteStates(byref(fmi2EventInfo())), ("event",)),
    "NewDiscreteStates of nothing": (lambda f: f.NewDiscreteStates(NULL), ()),
    "CompletedIntegratorStep": (
        lambda f: f.CompletedIntegratorStep(1, byref(c_int(7)), byref(c_int(7))),
        ("integrating",),
    ),
    "CompletedIntegratorStep of nothing": (lambda f: f.CompletedIntegratorStep(1, NULL, byref(c_int())), ()),
    "CompletedIntegratorStep of half": (lambda f: f.CompletedIntegratorStep(1, byref(c_int()), NULL), ()),
    "SetTime": (lambda f: f.SetTime(c_double(0.25)), ("event", "integrating")),
    "SetTime of none": (lambda f: f.SetTime(c_double(math.nan)), ()),
    "SetContinuousStates": (lambda f: f.put(0.5), ("integrating",)),
    "SetContinuousStates of too few": (lambda f: f.put(), ()),
    "SetContinuousStates of none": (lambda f: f.SetContinuousStates(NULL, c_size_t(1)), ()),
    "SetContinuousStates of NaN": (lambda f: f.put(math.nan), ()),
    **{
        f"Get{name}": (
            lambda f, name=name: ERROR if f.numbers(name) == ERROR else OK,
            ("entered", "event", "integrating", "terminated"),
        )
        for name in ("Derivatives", "EventIndicators", "ContinuousStates")
    },
    "GetNominalsOfContinuousStates": (
        lambda f: ERROR if f.numbers("NominalsOfContinuousStates") == ERROR else OK,
        ("instantiated", "entered", "event", "integrating", "terminated"),
    ),
    "GetDerivatives of too many": (lambda f: f.numbers("Derivatives", 2), ()),
    "GetDerivatives of none": (lambda f: f.GetDerivatives(NULL, c_size_t(1)), ()),
    "DoStep": (lambda f: f.step(), ()),
    "SetRealInputDerivatives": (lambda f: f.set_derivatives("u", 1.0), ()),
}
PHASES = ("instantiated", "entered", "event", "integrating", "terminated")


def bring(fmu, phase):
    steps = {
        "entered": fmu.enter,
        "event": fmu.ExitInitializationMode,
        "integrating": fmu.event,
        "terminated": fmu.Terminate,
    }
    for name in PHASES[1 : PHASES.index(phase) + 1]:
        steps[name]()
    fmu.messages.clear()
    return fmu


@pytest.mark.parametrize(("call", "phase"), list(itertools.product(CALLS, PHASES)))
def test_a_call_is_answered_where_the_standard_has_it_and_refused_elsewhere(exchanged, call, phase):
    function, allowed = CALLS[call]
    fmu = bring(exchanged("Choices"), phase)
    status = function(fmu)
    assert status == (OK if phase in allowed else ERROR)
    assert bool(fmu.messages) == (status == ERROR)
    if status == ERROR:
        assert f"fmi2{call.split()[0]}" in fmu.said


@pytest.mark.parametrize(
    "call", [name for name in CALLS if " of " not in name and name not in ("DoStep", "SetRealInputDerivatives")]
)
def test_an_instance_for_co_simulation_refuses_them_all(exchanged, call):
    fmu = exchanged("Choices", kind=1).initialize()
    assert CALLS[call][0](fmu) == ERROR
    assert fmu.said == f"Choices: fmi2{call}: this instance is for co-simulation"
    assert fmu.step() == OK
    assert fmu.set_derivatives("u", 1.0) == OK
    assert fmu.set("level", 0.1) == OK
    assert (fmu.get("under"), fmu.get("der(x)")) == (0, 0.5)


@pytest.mark.parametrize("call", [name for name in CALLS if " of " not in name])
def test_without_an_instance_they_are_errors(exchanged, call):
    fmu = exchanged("Choices").initialize()
    instance, fmu.instance = fmu.instance, NULL
    try:
        assert CALLS[call][0](fmu) == ERROR
    finally:
        fmu.instance = instance


def test_no_step_needs_an_event(choices):
    answers = c_int(7), c_int(7)
    assert choices.CompletedIntegratorStep(1, *map(byref, answers)) == OK
    assert [answer.value for answer in answers] == [0, 0]


def test_no_token_no_instance(exchanged):
    fmu = exchanged("Choices")
    assert fmu.instantiate(kind=0, guid="{0}") is None


def test_a_component_without_choices_has_no_indicators(exchanged):
    fmu = exchanged("Nothing").initialize()
    assert fmu.event() == (False, NULL)
    assert fmu.numbers("EventIndicators") == []
    assert fmu.numbers("Derivatives") == [-1.0]


def test_a_component_without_states(exchanged):
    fmu = exchanged("Gust").initialize()
    assert fmu.event() == (False, pytest.approx(210.0))
    assert fmu.numbers("ContinuousStates") == []
    assert fmu.put() == OK
    assert fmu.event(210.0)[1] == pytest.approx(240.0)
    assert fmu.get("acceleration") < 0.0
