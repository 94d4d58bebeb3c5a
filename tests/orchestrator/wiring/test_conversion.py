"""Values on their way from output to input: what fits, and what units make of it."""

from dataclasses import replace

import pytest
from railcosim.orchestrator.fmi.interface import Interface, Unit, Variable
from railcosim.orchestrator.system import Connection
from railcosim.orchestrator.wiring.conversion import Conversion, fit

KELVIN = (0, 0, 0, 0, 1, 0, 0, 0)
K, DEGC = Unit("K", KELVIN), Unit("degC", KELVIN, 1.0, 273.15)


def end(model, unit=None, definition=None, kind="Real", **of):
    """A variable, and the interface it stands in."""
    variable = Variable("v", 0, kind, "output", "continuous", None, None, unit, **of)
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
    assert between(a, b, offset=1.0) == Conversion(offset=1.0)


def test_what_does_not_convert_is_refused_unless_a_scale_is_given():
    """Nobody can mend another maker's definitions; a scale of 1 is a scale, too."""
    a, b = end("A", "deg", Unit("deg", (0,) * 7 + (1,), 0.5)), end("B", "rad", Unit("rad", (0,) * 8))
    assert "give the connection a scale" in between(a, b).problem
    what = "unit 'deg' does not convert to 'rad': A gives 'deg' the exponent 1 of rad, B gives 'rad' 0"
    for scale in (0.5, 1.0):
        found = between(a, b, scale=scale)
        assert (found.scale, found.offset, found.problem) == (scale, 0.0, "")
        assert found.note == f"{what}; what is given there is applied to the values"


def test_types():
    whole, real, gear = end("A", kind="Integer"), end("B", "K", K), end("C", kind="Enumeration")
    assert between(whole, real) == between(gear, whole) == between(whole, gear) == Conversion()
    assert between(real, whole).problem == "a Real output cannot feed a Integer input"
    assert between(gear, whole, scale=2.0).problem == "scale and offset apply to Real inputs, not to Integer"
