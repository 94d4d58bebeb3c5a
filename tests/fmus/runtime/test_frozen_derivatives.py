"""exchange.c: directional derivatives are of the choices that are kept, as central differences of reading have them."""

import math
from ctypes import c_double

import pytest

OK, ERROR = 0, 3
NAMES = ("branch", "piece", "timed", "root", "der(x)")
WIDTH = 1e-6


def differences(fmu, direction):
    """Of the outputs and the rate over the state and the input, by sets and gets between events."""
    (x,), u = fmu.numbers("ContinuousStates"), fmu.get("u")
    sides = []
    for sign in (WIDTH, -WIDTH):
        assert fmu.put(x + sign * direction[0]) == OK
        assert fmu.set("u", u + sign * direction[1]) == OK
        sides.append([fmu.get(name) for name in NAMES])
    assert fmu.put(x) == OK
    assert fmu.set("u", u) == OK
    return [(a - b) / (2.0 * WIDTH) for a, b in zip(*sides, strict=True)]


@pytest.mark.parametrize("time", [0.5, 1.0, 1.25])
@pytest.mark.parametrize(
    ("since", "x"),
    [
        *((since, x) for since in (0.25, 1.5) for x in (0.75, 1.0, 1.0 + 1e-9, 1.75, 2.0, 3.0, 3.5)),
        *((2.5, x) for x in (1.75, 2.25, 3.0, 3.5)),  # below 2 outputs are as they stand, and the rate is not
    ],
)
def test_between_events_they_are_of_the_modes_that_began(exchanged, since, x, time):
    """Wherever the state has gone since the last event, also right at a switch, where the equations jump."""
    fmu = exchanged("Kinds").initialize(x=since)
    fmu.event()
    fmu.event(time)
    assert fmu.put(x) == OK
    for direction in ((1.0, 0.0), (0.0, 1.0), (0.5, -2.0)):
        found = fmu.directional(NAMES, ("x", "u"), direction)
        assert found == pytest.approx(differences(fmu, direction), rel=1e-6, abs=1e-8)


def test_an_event_brings_those_of_the_new_modes(exchanged):
    """der(x) = u x below 1, -x^3 from there on; the time event is a rounding early and is past."""
    fmu = exchanged("Kinds").initialize(x=0.5)
    fmu.event()
    fmu.put(1.0)
    assert fmu.directional(("der(x)", "timed"), ("x", "u"), (1.0, 0.0)) == [0.5, 1.0]
    assert fmu.SetTime(c_double(1.0 - 1e-15)) == OK
    assert fmu.EnterEventMode() == OK
    assert fmu.directional(("der(x)", "timed"), ("x", "u"), (1.0, 0.0)) == [-3.0, 0.0]


def test_what_is_held_answers_to_nothing_until_a_sample_is_due(exchanged):
    """y = 2 u + n is held, z = 3 v is not."""
    fmu = exchanged("Sampler").initialize(sample_time=0.5)
    known, direction = ("u", "v"), (1.0, 1.0)
    assert fmu.directional(("y", "z", "der(v)"), known, direction) == [2.0, 3.0, 1.0]
    fmu.event()
    assert fmu.directional(("y", "z", "der(v)"), known, direction) == [0.0, 3.0, 1.0]
    assert fmu.SetTime(c_double(0.25)) == OK
    assert fmu.EnterEventMode() == OK
    assert fmu.directional(("y",), known, direction) == [0.0], "an event at which no sample is due"
    fmu.event()
    assert fmu.SetTime(c_double(0.5)) == OK
    assert fmu.directional(("y",), known, direction) == [0.0]
    assert fmu.EnterEventMode() == OK
    assert fmu.directional(("y",), known, direction) == [2.0]
    fmu.event(integrate=False)
    assert fmu.directional(("y", "z"), known, direction) == [0.0, 3.0], "the sample is taken, the event is not over"
    slave = exchanged("Sampler", kind=1).initialize(sample_time=0.5)
    assert slave.step(0.1) == OK
    assert slave.directional(("y",), known, direction) == [2.0], "of co-simulation they are of the equations"


def test_a_sample_that_is_due_sees_choices_as_they_stand(exchanged):
    """y = 1 / x, and a rate of modes alone."""
    fmu = exchanged("Inverse").initialize(x=2.0, u=1.0)
    assert fmu.directional(("y", "der(x)"), ("x",), (4.0,)) == [-1.0, 0.0]
    fmu.event()
    assert fmu.directional(("y", "der(x)"), ("x",), (4.0,)) == [-1.0, 0.0]


def test_in_initialization_mode_they_are_as_they_stand(exchanged):
    fmu = exchanged("Kinds").enter()
    for x, slope in ((0.5, 0.5), (2.0, -12.0)):
        assert fmu.set("x_start", x) == OK
        assert fmu.directional(("der(x)",), ("x_start",), (1.0,)) == [slope]


@pytest.mark.parametrize("name", ["Gust", "Nothing", "Close"])
def test_of_components_without_states_without_outputs_and_without_choices(exchanged, name):
    fmu = exchanged(name).initialize()
    fmu.event()
    known = {"Gust": (), "Nothing": ("x",), "Close": ("x",)}[name]
    unknown, expected = {
        "Gust": ("acceleration", 0.0),
        "Nothing": ("der(x)", -1.0),
        "Close": ("der(x)", 0.0),
    }[name]
    assert fmu.directional((unknown,), known, (1.0,) * len(known)) == [expected]


def test_a_rate_that_is_found_as_it_stands_moves_as_it_stands(exchanged):
    """log(x - 1) is kept where it has a value; below, -x is what a solver is told."""
    fmu = exchanged("Rooted").initialize()
    fmu.event()
    for x, rate, slope in ((3.0, pytest.approx(0.6931471805599453), 0.5), (0.75, -0.75, -1.0)):
        assert fmu.put(x) == OK
        assert fmu.numbers("Derivatives") == [rate]
        assert fmu.directional(("der(x)",), ("x",), (1.0,)) == [slope]


def test_an_output_without_a_value_is_in_the_way_of_its_own_derivative_only(exchanged):
    """y = log(x), der(x) = u - 3 x: also while an event is handled, and in initialization mode."""
    fmu = exchanged("Blind").enter()

    def check(known):
        assert fmu.directional(("der(x)", "x"), (known, "u"), (1.0, 1.0)) == [-2.0, 1.0], fmu.said
        assert fmu.directional(("der(x)", "y"), (known,), (1.0,)) == ERROR
        assert "'y' is" in fmu.said

    assert fmu.set("x_start", -1.0) == OK
    check("x_start")
    assert fmu.ExitInitializationMode() == OK
    check("x")
    fmu.event()
    check("x")
    assert fmu.put(2.0) == OK
    assert fmu.directional(("der(x)", "y"), ("x",), (1.0,)) == [-3.0, 0.5]


def test_where_a_rate_or_its_slope_has_no_value_there_is_no_derivative(exchanged):
    """der(x) = -log(x), whose slope has one also below zero, and der(z) = -sqrt(z), whose slope has none at zero."""
    fmu = exchanged("Draining").initialize()
    fmu.event()
    for x, z, why in ((-1.0, 1.0, "'der(x)' is"), (1.0, -1.0, "'der(z)' is"), (1.0, 0.0, "is -inf at t = 0 s")):
        assert fmu.put(x, z) == OK
        assert fmu.directional(("der(x)", "der(z)"), ("x", "z"), (1.0, 1.0)) == ERROR
        assert why in fmu.said
        assert fmu.directional(("x",), ("x",), (1.0,)) == [1.0]
    assert fmu.put(0.5, 0.25) == OK
    assert fmu.directional(("der(x)", "der(z)"), ("x", "z"), (1.0, 1.0)) == [-2.0, -1.0]
    slave = exchanged("Draining", kind=1).initialize(z=0.0)
    assert slave.directional(("der(z)",), ("z",), (1.0,)) == [-math.inf], "of co-simulation they are as they are"
