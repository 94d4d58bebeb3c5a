"""What becomes of values on their way: each number by hand from the clause that it is about."""

import pytest
from railcosim.orchestrator import ScenarioError
from railcosim.orchestrator.fmi import Unit
from railcosim.orchestrator.ssp.transport import Way
from railcosim.orchestrator.ssp.values import Transformation

from .conftest import DESCRIPTION, UNITS, component, connection, connectors, packed, system, wires

LINEAR = '<ssc:LinearTransformation factor="2" offset="10"/>'
PAIR = component("a") + component("b")


def wire(read, *attributes, inside="", start="a.y", end="b.u"):
    return read(system(PAIR, connection(start, end, inside, **dict(attributes)))).connections[0]


def test_units_of_the_fmus_are_left_to_the_wiring(read):
    """m/s to m/s and km/h to m/s: converted by what the FMUs say, whatever a transformation adds (SSP 4.4)."""
    for start in ("a.y", "a.z"):
        made = wire(read, start=start)
        assert (made.convert, made.scale, made.offset) == (True, None, 0.0)
        made = wire(read, start=start, inside=LINEAR)
        assert (made.convert, made.scale, made.offset) == (True, 2.0, 10.0)


def test_a_suppressed_conversion_leaves_the_number(read):
    """36 km/h arrive as 36 m/s; a transformation is done instead of a conversion: 2 * 36 + 10."""
    made = wire(read, ("suppressUnitConversion", "true"), start="a.z")
    assert (made.convert, made.scale, made.offset) == (False, None, 0.0)
    made = wire(read, ("suppressUnitConversion", "true"), start="a.z", inside=LINEAR)
    assert (made.convert, made.scale, made.offset) == (False, 2.0, 10.0)


def test_units_of_connectors_count_before_those_of_variables(read):
    """What the description calls km/h is km/h: 36 of it are 10 m/s, and 2 * 10 + 10 after the transformation."""
    told = component("a", shown=connectors(y="output km/h")) + component("b", shown=connectors(u="input m/s"))
    (made,) = read(system(told, connection("a.y", "b.u", LINEAR))).connections
    assert made.convert is False
    assert made.scale * 36.0 + made.offset == pytest.approx(30.0, rel=1e-15)


def test_units_on_the_way(read):
    """m/s become km/h at the system's door, where 5 is added: 10 m/s are 36, 41 km/h, and 41 / 3.6 m/s inside."""
    inner = system(component("t"), connection("i", "t.u"), connectors(i="input km/h"), name="inner")
    added = '<ssc:LinearTransformation offset="5"/>'
    (made,) = read(system(component("g") + inner, connection("g.y", "inner.i", added))).connections
    assert made.convert is False
    assert (made.scale or 1.0) * 10.0 + made.offset == pytest.approx(41.0 / 3.6, rel=1e-14)


def test_a_suppressed_conversion_of_what_does_not_convert(read):
    """The FMUs' own units are of different dimensions: the number arrives all the same."""
    other = DESCRIPTION.replace('<Unit name="km/h"><BaseUnit m="1" s="-1"', '<Unit name="km/h"><BaseUnit kg="1"')
    files = {"resources/gadget.fmu": packed({"modelDescription.xml": other})}
    bare = component("a", shown=connectors(z="output")) + component("b", shown=connectors(u="input"))
    (made,) = read(system(bare, connection("a.z", "b.u", suppressUnitConversion="true")), files).connections
    assert (made.convert, made.scale) == (False, None)
    with pytest.raises(ScenarioError, match="unit 'km/h' does not convert to 'm/s'"):
        read(system(bare, connection("a.z", "b.u")), files)


def test_two_transformations_one_after_the_other(read):
    """2 (2 x + 10) + 10 = 4 x + 30."""
    inner = system(component("t"), connection("i", "t.u", LINEAR), connectors(i="input"), name="inner")
    found = read(system(component("g") + inner, connection("g.y", "inner.i", LINEAR)))
    assert wires(found) == {"inner_t.u": ("g.y", 4.0, 30.0)}


def table(kind, **entries):
    rows = "".join(f'<ssc:MapEntry source="{a.strip("_")}" target="{b}"/>' for a, b in entries.items())
    return f"<ssc:{kind}MappingTransformation>{rows}</ssc:{kind}MappingTransformation>"


def test_tables(read):
    assert wire(read, start="a.m", end="b.n", inside=table("Integer", _1="10", _2="20")).map == {"1": "10", "2": "20"}
    truths = table("Boolean", true="false", _0="1")
    assert wire(read, start="a.off", end="b.on", inside=truths).map == {"true": "false", "false": "true"}
    assert wire(read, start="a.m", end="b.n", inside=table("Enumeration", park="hold")).map == {"park": "hold"}


def test_tables_one_after_the_other(read):
    """1 to 2 to 3; what the first leaves (4) is the second's: 4 to 5."""
    first, second = table("Integer", _1="2"), table("Integer", _2="3", _4="5")
    inner = system(component("t"), connection("i", "t.n", second), connectors(i="input"), name="inner")
    (made,) = read(system(component("g") + inner, connection("g.m", "inner.i", first))).connections
    assert made.map == {"1": "3", "2": "3", "4": "5"}


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        (LINEAR, table("Integer", _1="2"), "a table for values that were transformed linearly"),
        (table("Integer", _1="2"), LINEAR, "a linear transformation of values that were mapped by a table"),
        (table("Integer", _1="2", _1_="3"), "", "it maps one value to several"),
        ('<ssc:LinearTransformation factor="two"/>', "", "factor of LinearTransformation is 'two', not a number"),
    ],
)
def test_transformations_that_do_not_go_together(read, first, second, said):
    inner = system(component("t"), connection("i", "t.n", second), connectors(i="input"), name="inner")
    with pytest.raises(ScenarioError, match=said):
        read(system(component("g") + inner, connection("g.m", "inner.i", first)))


def test_units_with_an_offset(read):
    """20 degC are 293.15 K; and doubled after the conversion, with 10 added: 596.3."""
    kelvin = UNITS.replace("</ssd:Units>", '<ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit></ssd:Units>')
    told = component("a", shown=connectors(y="output degC")) + component("b", shown=connectors(u="input K"))
    for inside, expected in (("", 293.15), (LINEAR, 596.3)):
        (made,) = read(system(told, connection("a.y", "b.u", inside)), after=kelvin).connections
        assert made.convert is False
        assert (made.scale or 1.0) * 20.0 + made.offset == pytest.approx(expected, rel=1e-15)


def test_units_of_different_dimensions(read):
    told = component("a", shown=connectors(y="output degC")) + component("b")
    with pytest.raises(ScenarioError, match="unit 'degC' does not convert to 'm/s': they are of different dimensions"):
        read(system(told, connection("a.y", "b.u")))
    (made,) = read(system(told, connection("a.y", "b.u", suppressUnitConversion="1"))).connections
    assert (made.convert, made.scale) == (True, None)  # the FMUs' own are the same


def test_units_that_nobody_defined(read):
    """They say nothing: values pass as they are."""
    inner = system(component("t"), connection("i", "t.u"), connectors(i="input furlong"), name="inner")
    assert wires(read(system(component("g") + inner, connection("g.y", "inner.i")))) == {
        "inner_t.u": ("g.y", None, 0.0)
    }


def test_values_by_the_way():
    mps, kmh = (Unit(name, (0, 1, -1, 0, 0, 0, 0, 0), factor) for name, factor in (("m/s", 1.0), ("km/h", 1 / 3.6)))
    way = Way(kmh).to(mps, False, Transformation(2.0, 1.0), "here")
    assert way.apply([36.0, 72], "there") == pytest.approx([21.0, 41.0])
    assert Way().apply("text", "there") == "text"
    swapped = Way().to(None, False, Transformation(entries={"true": "false", "1": "7", "park": "hold"}), "here")
    assert [swapped.apply(x, "") for x in (True, False, 1, 2, "park", "go")] == [False, False, 7, 2, "hold", "go"]
    for value in (True, "text"):
        with pytest.raises(ScenarioError, match=r"there: .* is no number, and is transformed linearly"):
            way.apply(value, "there")
    with pytest.raises(ScenarioError, match="there: its table makes 'x' of 1"):
        Way().to(None, False, Transformation(entries={"1": "x"}), "here").apply(1, "there")
