"""Values on their way from output to input: what fits, and what units make of it."""

from dataclasses import replace

import pytest
from railcosim.orchestrator.fmi.interface import Interface, Sort, Unit, Variable
from railcosim.orchestrator.system import Connection
from railcosim.orchestrator.wiring.conversion import Conversion, fit

KELVIN = (0, 0, 0, 0, 1, 0, 0, 0)
K, DEGC = Unit("K", KELVIN), Unit("degC", KELVIN, 1.0, 273.15)


def end(model, unit=None, definition=None, kind="Real", **of):
    """A variable, and the interface it stands in."""
    variable = Variable("v", 0, Sort(kind, "output", "continuous", None, unit, **of))
    units = {} if definition is None else {unit: definition}
    return variable, Interface(model, "m", "", {"v": variable}, units, {})


def between(a, b, **how):
    return fit(*a, *b, Connection("a.v", "b.v", **how))


def test_a_difference_of_temperatures_has_no_offset():
    rise = end("A", "degC", DEGC, relative=True)
    assert between(rise, end("B", "K", K, relative=True)) == Conversion(1.0, 0.0)
    assert between(end("A", "degC", DEGC), end("B", "K", K)) == Conversion(1.0, 273.15)


@pytest.mark.parametrize(
    ("other", "noted"),
    [
        (DEGC, False),
        (replace(DEGC, offset=0.0), True),
        (replace(DEGC, factor=1.8), True),
        (replace(DEGC, exponents=(0, 1, 0, 0, 0, 0, 0, 0)), True),
        (replace(DEGC, exponents=(0, 0, 0, 0, 1, 0, 0, 1)), False),  # whether an angle has a dimension is open
        (replace(DEGC, exponents=None), False),
        (None, False),
    ],
)
def test_units_of_one_name_pass_values_as_they_are(other, noted):
    found = between(end("A", "degC", DEGC), end("B", "degC", other), scale=2.0)
    assert (found.scale, found.offset, found.problem) == (2.0, 0.0, "")
    assert found.note == "A and B define the unit 'degC' differently: values pass as they are" * noted


@pytest.mark.parametrize("undefined", [None, Unit("furlong", None)])
def test_units_that_nobody_defined(undefined):
    """Whoever gives a scale has taken care of it."""
    a, b = end("A", "furlong", undefined), end("B", "K", K)
    note = "'furlong' is not defined in SI units by A: what is in {} is taken for {} as it is"
    more = "; where they differ, give the connection a scale"
    assert between(a, b) == Conversion(note=note.format("'furlong'", "'K'") + more)
    assert between(b, a) == Conversion(note=note.format("'K'", "'furlong'") + more)
    assert between(a, b, scale=201.168) == Conversion(201.168)
    assert between(a, b, offset=1.0) == Conversion(offset=1.0, note=note.format("'furlong'", "'K'") + more)


def test_a_scale_settles_a_doubt():
    rate = (0, 0, -1, 0, 0, 0, 0, 0)
    a, b = end("A", "Hz", Unit("Hz", rate)), end("B", "rad/s", Unit("rad/s", rate))
    assert between(a, b).note.startswith("as the FMUs define them, 1 Hz is 1 rad/s, not 6.28319")
    assert between(a, b, scale=6.25) == Conversion(6.25)


def test_what_does_not_convert_is_refused_unless_a_scale_is_given():
    """Nobody can mend another maker's definitions; a scale of 1 is a scale, too."""
    a, b = end("A", "deg", Unit("deg", (0,) * 7 + (1,), 0.5)), end("B", "rad", Unit("rad", (0,) * 8))
    assert "give the connection a scale" in between(a, b).problem
    what = "unit 'deg' does not convert to 'rad': A gives 'deg' the exponent 1 of rad, B gives 'rad' 0"
    for scale in (0.5, 1.0):
        found = between(a, b, scale=scale)
        assert (found.scale, found.offset, found.problem) == (scale, 0.0, "")
        assert found.note == f"{what}; what is given there is applied to the values"


def a(kind):
    return f"a{'n' * (kind[0] in 'EI')} {kind}"


def test_types_that_pass_as_they_are():
    whole, real, gear = end("A", kind="Integer"), end("B", "K", K), end("C", kind="Enumeration")
    truth, word = end("D", kind="Boolean"), end("E", kind="String")
    assert between(whole, real) == between(gear, whole) == between(whole, gear) == Conversion()
    assert between(truth, truth) == between(word, word) == Conversion()
    assert between(truth, real) == Conversion(note="a Boolean is given to a Real, false as 0, true as 1")
    assert between(truth, whole) == Conversion(note="a Boolean is given to an Integer, false as 0, true as 1")
    assert between(gear, real) == Conversion(note="an Enumeration is given to a Real, the number of its item")
    scaled = between(truth, real, scale=10.0, offset=-5.0)
    assert (scaled.scale, scaled.offset) == (10.0, -5.0)


def test_types_that_need_a_threshold():
    whole, real, gear = end("A", kind="Integer"), end("B", "K", K), end("C", kind="Enumeration")
    truth = end("D", kind="Boolean")
    nearest = "threshold = 0.5 takes the nearest whole number"
    for source in (real, whole, gear):
        kind = source[0].type
        asked = (
            f"{a(kind)} output leads to a Boolean input only with a threshold: threshold = 0.5 makes it true above 0.5"
        )
        assert between(source, truth).problem == asked
        note = f"{a(kind)} is given to a Boolean, true above -2.5"
        assert between(source, truth, threshold=-2.5) == Conversion(note=note)
    for target in (whole, gear):
        kind = target[0].type
        asked = f"a Real output leads to {a(kind)} input only with a threshold: {nearest}"
        assert between(real, target).problem == asked
        asked = f"scale and offset lead to {a(kind)} input only with a threshold: {nearest}"
        assert between(whole, target, scale=2.0).problem == between(truth, target, offset=1.0).problem == asked
        found = between(real, target, scale=2.0, offset=1.0, threshold=0.0)
        assert found == Conversion(2.0, 1.0, note=f"a Real is given to {a(kind)}, rounded up above a fraction of 0")
        for wrong in (-0.1, 1.0):
            assert "from 0 to below 1" in between(real, target, threshold=wrong).problem


def test_types_that_do_not_go_together():
    real, word = end("B"), end("E", kind="String")
    assert between(real, word).problem == "a Real output cannot feed a String input"
    assert between(word, real, threshold=0.5).problem == "a String output cannot feed a Real input"
    assert between(word, word, scale=2.0).problem == "scale, offset and threshold apply to numbers, not to String"
    assert between(real, real, threshold=0.5).problem == "a threshold is for inputs that are no Real"


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ({}, ""),
        ({"scale": 1.0}, ""),
        ({"scale": 0.277778}, "what is given (times 0.277778) is applied after that; that is the same twice: leave"),
        ({"scale": 3.6}, "what is given (times 3.6) is applied after that"),
        ({"offset": 1.0}, "what is given (plus 1) is applied after that"),
    ],
)
def test_a_value_that_is_changed_twice_is_told(how, told):
    speed = (0, 1, -1, 0, 0, 0, 0, 0)
    a, b = end("A", "km/h", Unit("km/h", speed, 1 / 3.6)), end("B", "m/s", Unit("m/s", speed))
    found = between(a, b, **how)
    assert found.scale == pytest.approx(how.get("scale", 1.0) / 3.6)
    assert told in found.note
    assert found.note.startswith("'km/h' becomes 'm/s' by itself (times 0.277778), and ") == bool(told)
    assert ("twice" in found.note) == (how == {"scale": 0.277778})


def test_an_offset_that_is_added_twice_is_told():
    found = between(end("A", "degC", DEGC), end("B", "K", K), offset=273.15)
    assert found.offset == 546.3
    assert found.note.endswith(
        "(plus 273.15) is applied after that; that is the same twice: leave scale and offset out"
    )


def mapped(a, b, table, **how):
    return between(a, b, map=table, **how)


def test_single_values_that_become_others():
    truth, whole = end("A", kind="Boolean"), end("B", kind="Integer")
    gear = end("C", kind="Enumeration", choices=(("park", 1), ("drive", 5)))
    assert mapped(truth, truth, {"true": False, "false": True}).mapping == {1: 0, 0: 1}
    assert mapped(whole, whole, {"1": 10, "-2": 20}).mapping == {1: 10, -2: 20}
    assert mapped(gear, gear, {"park": "drive"}).mapping == {1: 5}
    assert mapped(gear, whole, {"drive": 7}).mapping == {5: 7}
    assert mapped(whole, gear, {"0": "park"}).mapping == {0: 1}


def test_maps_that_mean_nothing():
    truth, whole, real = end("A", kind="Boolean"), end("B", kind="Integer"), end("D")
    gear = end("C", kind="Enumeration", choices=(("park", 1), ("drive", 5)))
    asked = "map is for Booleans, or for whole numbers and enumerations, and a Real output leads to an Integer input"
    assert mapped(real, whole, {"1": 2}).problem == asked
    assert "a Boolean output leads to an Integer input" in mapped(truth, whole, {"true": 2}).problem
    assert mapped(truth, truth, {"yes": True}).problem == "map takes true or false for v, not 'yes'"
    assert mapped(whole, whole, {"1": "ten"}).problem == "map takes a whole number for v, not 'ten'"
    assert (
        mapped(gear, whole, {"reverse": 1}).problem
        == "map takes a whole number or one of park, drive for v, not 'reverse'"
    )
    for how in ({"scale": 2.0}, {"offset": 1.0}, {"threshold": 0.5}):
        problem = "map stands for itself: leave scale, offset and threshold out"
        assert mapped(whole, whole, {"1": 2}, **how).problem == problem


def test_units_that_are_not_to_be_converted():
    warm, cold = end("A", "degC", DEGC), end("B", "K", K)
    assert between(warm, cold, convert=False) == Conversion()
    assert between(warm, cold, convert=False, scale=2.0, offset=1.0) == Conversion(2.0, 1.0)
