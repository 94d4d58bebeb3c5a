"""What units make of a value, by what FMUs say of them."""

import math
from dataclasses import replace

import pytest
from railcosim.orchestrator.fmi.interface import Interface, Sort, Unit, Variable
from railcosim.orchestrator.wiring.units import Relation, convert, relate

ANGLE, RATE, PLAIN_RATE, NONE = (0,) * 7 + (1,), (0, 0, -1, 0, 0, 0, 0, 1), (0, 0, -1, 0, 0, 0, 0, 0), (0,) * 8
KELVIN = (0, 0, 0, 0, 1, 0, 0, 0)
DEG = math.pi / 180.0


def end(model, unit, exponents, factor=1.0, offset=0.0, *, relative=False):
    """A variable in a unit, and the interface it stands in; a unit without exponents is not defined."""
    v = Variable("v", 0, Sort("Real", "output", "continuous", None, unit, relative=relative))
    units = {} if exponents is None else {unit: Unit(unit, exponents, factor, offset)}
    return v, Interface(model, "m", "", {"v": v}, units, {})


def between(a, b):
    return relate(*end("A", *a), *end("B", *b))


def test_convert_both_ways():
    kelvin, celsius = Unit("K", (0,) * 8), Unit("degC", (0,) * 8, 1.0, 273.15)
    fahrenheit = Unit("degF", (0,) * 8, 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0)
    for a, b, x, y in [(celsius, fahrenheit, 100.0, 212.0), (fahrenheit, kelvin, -40.0, 233.15)]:
        scale, offset = convert(a, b)
        assert scale * x + offset == pytest.approx(y)
        scale, offset = convert(b, a)
        assert scale * y + offset == pytest.approx(x)


@pytest.mark.parametrize(
    ("a", "b", "scale"),
    [
        (("deg", ANGLE, DEG), ("rad", ANGLE), DEG),
        (("deg", NONE, DEG), ("rad", NONE), DEG),
        (("deg/s", RATE, DEG), ("rad/s", RATE), DEG),
        (("Hz", RATE, 2.0 * math.pi), ("rad/s", RATE), 2.0 * math.pi),
        (("rpm", RATE, math.pi / 30.0), ("rad/s", RATE), math.pi / 30.0),
        (("rad/s", PLAIN_RATE), ("rpm", PLAIN_RATE, math.pi / 30.0), 30.0 / math.pi),
        (("rpm", PLAIN_RATE, 1.0 / 60.0), ("Hz", PLAIN_RATE), 1.0 / 60.0),
        (("1/min", PLAIN_RATE, 1.0 / 60.0), ("1/s", PLAIN_RATE), 1.0 / 60.0),
    ],
)
def test_angles_convert_where_both_are_defined_alike(a, b, scale):
    found = between(a, b)
    assert found == Relation(pytest.approx(scale, rel=1e-15))


@pytest.mark.parametrize(
    ("a", "b", "scale"),
    [
        (("deg", ANGLE, DEG), ("rad", NONE), DEG),
        (("rad", NONE), ("deg", ANGLE, DEG), 1.0 / DEG),
        (("Hz", PLAIN_RATE), ("rad/s", RATE), 2.0 * math.pi),
        (("rad/s", RATE), ("Hz", PLAIN_RATE), 0.5 / math.pi),
        (("rpm", RATE, math.pi / 30.0), ("rad/s", PLAIN_RATE), math.pi / 30.0),
        (("mrad", ANGLE, 1e-3), ("m/m", NONE), 1e-3),
    ],
)
def test_an_angle_does_not_convert_to_what_is_none(a, b, scale):
    """The message says what each FMU declares, and the scale that makes up for it."""
    refused = between(a, b).refused
    assert refused.startswith(
        f"unit {a[0]!r} does not convert to {b[0]!r}: A gives {a[0]!r} the exponent {a[1][-1]} of"
    )
    assert float(refused.rpartition("scale = ")[2].rstrip(")")) == pytest.approx(scale, rel=1e-15)


@pytest.mark.parametrize(
    ("a", "b", "made", "scale"),
    [
        (("Hz", PLAIN_RATE), ("rad/s", PLAIN_RATE), 1.0, 2.0 * math.pi),
        (("Hz", RATE), ("rad/s", RATE), 1.0, 2.0 * math.pi),
        (("rad/s", PLAIN_RATE), ("Hz", PLAIN_RATE), 1.0, 0.5 / math.pi),
        (("Hz", PLAIN_RATE), ("rad.s-1", PLAIN_RATE), 1.0, 2.0 * math.pi),
        (("Hz", PLAIN_RATE), ("rad s^-1", PLAIN_RATE), 1.0, 2.0 * math.pi),
        (("Hz", PLAIN_RATE), ("rad/sec", PLAIN_RATE), 1.0, 2.0 * math.pi),
        (("MHz", PLAIN_RATE, 1e6), ("rad·s⁻¹", PLAIN_RATE), 1e6, 2.0 * math.pi),
        (("min-1", PLAIN_RATE, 1.0 / 60.0), ("rad/s", PLAIN_RATE), 1.0 / 60.0, 2.0 * math.pi),
        (("°", NONE), ("radian", NONE), 1.0, DEG),
        (("rpm", PLAIN_RATE, 1.0 / 60.0), ("rad/s", PLAIN_RATE), 1.0 / 60.0, 2.0 * math.pi),
        (("rev", NONE), ("rad", NONE), 1.0, 2.0 * math.pi),
        (("deg", NONE), ("rad", NONE), 1.0, DEG),
    ],
)
def test_definitions_that_belie_a_unit_s_name_are_told(a, b, made, scale):
    found = between(a, b)
    assert (found.scale, found.refused) == (pytest.approx(made), "")
    assert found.doubt.startswith(f"as the FMUs define them, 1 {a[0]} is {made:g} {b[0]}, not ")
    assert float(found.doubt.rpartition("scale = ")[2]) == pytest.approx(scale, rel=1e-15)


def test_other_dimensions():
    refused = between(("N", (1, 1, -2, 0, 0, 0, 0, 0)), ("m", (0, 1, 0, 0, 0, 0, 0, 0))).refused
    assert refused.startswith("unit 'N' does not convert to 'm': they are of different dimensions")
    assert refused.endswith("give the connection a scale (scale = 1.0)")


def test_a_difference_has_no_offset_and_beside_what_is_none_that_is_told():
    celsius, kelvin = ("degC", KELVIN, 1.0, 273.15), ("K", KELVIN)
    absolute, rise = end("A", *celsius), end("A", *celsius, relative=True)
    assert relate(*absolute, *end("B", *kelvin)) == Relation(1.0, 273.15)
    assert relate(*rise, *end("B", *kelvin, relative=True)) == Relation(1.0, 0.0)
    for a, b in ((rise, end("B", *kelvin)), (absolute, end("B", *kelvin, relative=True))):
        note = "one of the two is a difference (relativeQuantity), so 'degC' becomes 'K' without an offset"
        assert relate(*a, *b) == Relation(1.0, 0.0, note=note)


@pytest.mark.parametrize("undefined", [None, "no exponents"])
def test_units_that_nobody_defined(undefined):
    a, b = end("A", "furlong", None), end("B", "K", KELVIN)
    if undefined:
        a = a[0], replace(a[1], units={"furlong": Unit("furlong", None)})
    assert relate(*a, *b).doubt == (
        "'furlong' is not defined in SI units by A: what is in 'furlong' is taken for 'K' as it is; where they differ, "
        "give the connection a scale"
    )
    assert relate(*a, *a) == Relation()


def test_of_undefined_units_of_angle_the_scale_is_told():
    doubt = relate(*end("A", "Hz", None), *end("B", "rad/s", None)).doubt
    assert float(doubt.rpartition("scale = ")[2]) == 2.0 * math.pi
