"""Connections through nested systems, each against what the clause of the standard makes of it by hand."""

import pytest
from railcosim.orchestrator import ScenarioError
from railcosim.orchestrator.ssp import read_system

from .conftest import component, connection, connectors, structure, system, wires


def test_start_and_end_give_no_direction(read):
    """SSP 5.3.2: that follows from the kinds."""
    found = read(system(component("a") + component("b"), connection("b.u", "a.y") + connection("b.y", "a.u")))
    assert wires(found) == {"b.u": ("a.y", None, 0.0), "a.u": ("b.y", None, 0.0)}
    assert all(one.origin.endswith("SystemStructure.ssd:4") for one in found.connections)


def test_nested_systems_are_passed_through(read):
    """Out of one system, through another that hands it straight on, into a third; two levels deep."""
    giving = system(component("g"), connection("g.y", "out"), connectors(out="output"), name="giver")
    through = system("", connection("i", "o"), connectors(i="input", o="output"), name="through").replace(
        "<ssd:Elements></ssd:Elements>", ""
    )
    inner = system(component("t"), connection("t.u", "i"), connectors(i="input"), name="inner")
    taking = system(inner, connection("i", "inner.i"), connectors(i="input"), name="taker")
    found = read(
        system(giving + through + taking, connection("giver.out", "through.i") + connection("through.o", "taker.i"))
    )
    assert wires(found) == {"taker_inner_t.u": ("giver_g.y", None, 0.0)}
    assert list(found.instances) == ["giver_g", "taker_inner_t"]
    assert any("giver.g is giver_g, taker.inner.t is taker_inner_t" in note for note in found.provenance.notes)


def test_an_empty_name_is_that_of_the_system(read):
    """As in public archives that OMSimulator wrote, such as pwmtest of its test suite."""
    named = connection("i", "t.u").replace("<ssd:Connection ", '<ssd:Connection startElement="" ')
    assert 'startElement=""' in named
    inner = system(component("t"), named, connectors(i="input"), name="inner")
    found = read(system(inner + component("g"), connection("g.y", "inner.i")))
    assert wires(found) == {"inner_t.u": ("g.y", None, 0.0)}


def test_names_that_a_scenario_cannot_write(read):
    names = ["class", "1a", "a b", "a_b", "x.y"]
    found = read(system("".join(component(name) for name in names)))
    assert list(found.instances) == ["_class", "_1a", "a_b", "a_b_2", "x_y"]


def test_a_component_without_source_gives_nothing(read):
    found = read(
        system(component("a") + component("plan", source="").replace(' source=""', ""), connection("plan.y", "a.u"))
    )
    assert wires(found) == {}
    assert any("'plan' has no source: nothing comes from it" in note for note in found.provenance.notes)


def test_archives_and_structures_inside(archive, tmp_path):
    """A component that is an SSP (its own FMU and its variant), and one that is an SSD beside this one."""
    inner = structure(system(component("g"), connection("g.y", "out"), connectors(out="output")))
    other = inner.replace('"g"', '"h"').replace('"g.y"', '"h.y"').replace('startElement="g"', 'startElement="h"')
    nested = archive({"SystemStructure.ssd": inner, "B.ssd": other}, name="inner.ssp")
    shown = connectors(out="output")
    parts = [
        component("first", source="resources/inner.ssp", type="application/x-ssp-package", shown=shown),
        component("second", source="resources/inner.ssp#B.ssd", type="application/x-ssp-package", shown=shown),
        component("third", source="parts/one.ssd", type="application/x-ssp-definition", shown=shown),
    ]
    top = structure(
        system(
            "".join(parts) + component("a") + component("b"),
            connection("first.out", "a.u") + connection("third.out", "b.u"),
        )
    )
    beside = inner.replace("resources/gadget.fmu", "../resources/gadget.fmu")
    with open(nested, "rb") as stream:
        files = {"resources/inner.ssp": stream.read(), "parts/one.ssd": beside}
    found = read_system(archive(top, files), tmp_path / "fmus")
    assert list(found.instances) == ["first_g", "second_h", "third_g", "a", "b"]
    assert wires(found) == {"a.u": ("first_g.y", None, 0.0), "b.u": ("third_g.y", None, 0.0)}


def test_a_system_that_is_used_twice(read):
    """SSP 2.0: a component may name an element of its own document."""
    unit = system(component("g"), connection("g.y", "out"), connectors(out="output"), name="unit").replace(
        'name="unit"', 'name="unit" id="u1"'
    )
    again = component("more", source="#u1", shown=connectors(out="output"))
    found = read(system(unit + again + component("a"), connection("more.out", "a.u")))
    assert list(found.instances) == ["unit_g", "more_g", "a"]
    assert wires(found) == {"a.u": ("more_g.y", None, 0.0)}
    with pytest.raises(ScenarioError, match="there is no system with the id 'u2'"):
        read(system(unit + again.replace("#u1", "#u2")))


def reference(name, dictionary, **kinds):
    own = f'name="{name}" dictionary="{dictionary}"'
    return f"<ssd:SignalDictionaryReference {own}>{connectors(**kinds)}</ssd:SignalDictionaryReference>"


DICTIONARY = (
    '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary version="1.0">'
    '<ssb:DictionaryEntry name="v"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary></ssd:SignalDictionary>'
    "</ssd:SignalDictionaries>"
)


def test_signal_dictionaries_are_one_signal_wherever_they_stand(read):
    """The dictionary of the root is found from inside a nested system; a connector of both kinds takes either part."""
    inside = system(component("t") + reference("r", "bus", v="inout"), connection("t.u", "r.v"), name="deep")
    found = read(
        system(
            component("g")
            + component("b")
            + reference("r", "bus", v="inout")
            + reference("q", "bus", v="inout")
            + inside,
            connection("r.v", "g.y") + connection("q.v", "b.u"),
            more=DICTIONARY,
        )
    )
    assert wires(found) == {"b.u": ("g.y", None, 0.0), "deep_t.u": ("g.y", None, 0.0)}
    with pytest.raises(ScenarioError, match="there is no signal dictionary 'can'"):
        read(system(component("g") + reference("r", "can", v="inout"), connection("g.y", "r.v")))


def test_the_nearest_signal_dictionary_of_a_name_counts(read):
    """Both systems have a bus: what the outer one carries does not reach the inner one's component."""
    near = component("g") + component("t") + reference("r", "bus", v="inout")
    inside = system(near, connection("g.y", "r.v") + connection("t.u", "r.v"), more=DICTIONARY, name="deep")
    outside = component("g") + component("b") + reference("r", "bus", v="inout")
    found = read(system(outside + inside, connection("g.y", "r.v") + connection("b.u", "r.v"), more=DICTIONARY))
    assert wires(found) == {"b.u": ("g.y", None, 0.0), "deep_t.u": ("deep_g.y", None, 0.0)}


def test_directions_that_follow_from_others(read):
    """Two dictionaries connected to each other: from the one that is fed to the other; or told where none is."""
    two = DICTIONARY.replace("</ssd:SignalDictionaries>", '<ssd:SignalDictionary name="can"/></ssd:SignalDictionaries>')
    parts = component("g") + component("b") + reference("r", "bus", v="inout") + reference("q", "can", v="inout")
    found = read(
        system(parts, connection("q.v", "r.v") + connection("g.y", "r.v") + connection("b.u", "q.v"), more=two)
    )
    assert wires(found) == {"b.u": ("g.y", None, 0.0)}
    found = read(system(parts, connection("q.v", "r.v"), more=two))
    assert any("nothing says in which direction" in note for note in found.provenance.notes)
    clash = connection("q.v", "r.v") + connection("g.y", "r.v") + connection("g.y", "q.v")
    assert wires(read(system(parts, clash, more=two))) == {}


def test_the_fmu_says_what_the_description_does_not(read):
    bare = component("a", shown=" ")
    found = read(system(bare + component("b"), connection("b.u", "a.y")))
    assert wires(found) == {"b.u": ("a.y", None, 0.0)}
    assert any("a declares no connector 'y'; that of its FMU is taken" in note for note in found.provenance.notes)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (connection("a.y", "b.y"), "a.y and b.y both give a value; a connection leads from an output to an input"),
        (connection("a.u", "b.u"), "a.u and b.u both take a value"),
        (connection("a.y", "b.u") * 2, "b.u takes a value already, by the connection at "),
        (connection("a.y", "c.u"), "there is no element 'c'; "),
        (connection("a.y", "b.nothing"), "b has no connector 'nothing'; it has u, y"),
        (connection("i", "o"), "root has no connector 'i'; it has none"),
        (connection("a.y", "b.u", startIndices="1"), "it connects parts of arrays, which is not supported"),
        (connection("a.y", "b.k"), "b.k is a parameter, and would follow a.y; what is calculated is only handed on"),
    ],
)
def test_connections_that_cannot_be(read, wrong, said):
    with pytest.raises(ScenarioError) as caught:
        read(system(component("a") + component("b"), wrong))
    assert f"system.ssp/SystemStructure.ssd:4: {said}" in str(caught.value)


def test_a_value_that_comes_from_itself(read):
    """Two systems that hand on what the other hands on."""
    ring = "".join(
        system("", connection("i", "o"), connectors(i="input", o="output"), name=name).replace(
            "<ssd:Elements></ssd:Elements>", ""
        )
        for name in ("one", "two")
    )
    round_ = connection("one.o", "two.i") + connection("two.o", "one.i") + connection("two.o", "a.u")
    with pytest.raises(ScenarioError, match="takes its value from itself"):
        read(system(ring + component("a"), round_))
