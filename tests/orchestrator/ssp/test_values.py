"""Parameter bindings: every clause of SSP 5.3.1 with the value that it gives by hand."""

from pathlib import Path

import pytest
from railcosim.orchestrator import ScenarioError
from railcosim.orchestrator.fmi import Workspace, load_fmu

from .conftest import (
    DESCRIPTION,
    UNITS,
    binding,
    bindings,
    component,
    connection,
    connectors,
    mapping,
    packed,
    parameters,
    real,
    structure,
    system,
)

SPEEDS = UNITS.replace("ssd:Units", "ssv:Units")


def starts(read, inside, files=None):
    return {name: instance.start for name, instance in read(inside, files).instances.items() if instance.start}


def values(**each):
    return binding(parameters(*((name.replace("__", "."), real(value)) for name, value in each.items())))


def test_values_of_every_type(read):
    """By the FMU's names, which need no connectors."""
    given = parameters(
        ("k", real("2.5")),
        ("top.v", real("36", "km/h")),
        ("n", '<ssv:Integer value="3"/>'),
        ("on", '<ssv:Boolean value="1"/>'),
        ("label", '<ssv:String value="3 + 4"/>'),
        units=SPEEDS,
    )
    found = starts(read, system(component("a", bindings(binding(given)))))
    assert found["a"] == {"k": 2.5, "top.v": pytest.approx(10.0), "n": 3, "on": True, "label": "3 + 4"}


def test_an_item_of_an_enumeration_goes_by_its_name(read):
    """SSP, Enumeration of SSV: which number that is, the FMU's own type says (here 5)."""
    items = '<Enumeration><Item name="park" value="1"/><Item name="go" value="5"/></Enumeration>'
    types = f'<TypeDefinitions><SimpleType name="G">{items}</SimpleType></TypeDefinitions>'
    text = DESCRIPTION.replace("<DefaultE", f"{types}<DefaultE")
    gear = '<ScalarVariable name="g" valueReference="7" causality="parameter" variability="fixed">'
    text = text.replace("</ModelV", f'{gear}<Enumeration declaredType="G" start="1"/></ScalarVariable></ModelV')
    given = parameters(("g", '<ssv:Enumeration value="go"/>'))
    files = {"resources/gadget.fmu": packed({"modelDescription.xml": text})}
    found = read(system(component("a", bindings(binding(given)))), files)
    assert found.instances["a"].start == {"g": "go"}
    with Workspace() as workspace:
        interface = load_fmu(Path(found.instances["a"].model), workspace).interface
    assert interface.variables["g"].choices == (("park", 1), ("go", 5))


def test_arrays_of_values(read):
    """SSP 2.0: in one attribute, or one element each."""
    given = parameters(
        ("k", '<ssv:Real value="1 2 3"/><ssv:Dimension size="3"/>'),
        ("label", '<ssv:String><ssv:Value value="a"/><ssv:Value value="b"/></ssv:String><ssv:Dimension size="2"/>'),
    )
    found = starts(read, system(component("a", bindings(binding(given)))))
    assert found["a"] == {"k": [1.0, 2.0, 3.0], "label": ["a", "b"]}


def test_later_bindings_win_at_one_level(read):
    found = starts(read, system(component("a", bindings(values(k=1, n=1), values(k=2)))))
    assert found["a"] == {"k": 2.0, "n": 1.0}


def test_a_higher_level_wins(read):
    """Of the component 1, of its system 2, of the root 3; each of what the higher ones leave."""
    inner = system(
        component("c", bindings(values(k=1, n=1, u=1))), bound=bindings(values(c__k=2, c__n=2)), name="inner"
    )
    found = starts(read, system(inner, bound=bindings(values(inner__c__k=3))))
    assert found["inner_c"] == {"k": 3.0, "n": 2.0, "u": 1.0}


def test_one_name_for_several_things(read):
    """SSP 5.3.1, punning: B.C of a system and a component that is called B.C."""
    inner = system(component("C"), name="B")
    found = starts(read, system(inner + component("B.C"), bound=bindings(values(B__C__k=5))))
    assert found == {"B_C": {"k": 5.0}, "B_C_2": {"k": 5.0}}


def test_a_prefix_makes_a_set_of_a_component_one_of_its_system(read):
    given = binding(parameters(("k", real(4))), prefix="a.")
    assert starts(read, system(component("a") + component("b"), bound=bindings(given))) == {"a": {"k": 4.0}}


def test_a_mapping_lets_through_what_it_names(read):
    """Once doubled, once as it is; `v` is not named, and not applied."""
    given = parameters(("gain", real(3)), ("v", real(9)))
    linear = '<ssc:LinearTransformation factor="2" offset="1"/>'
    table = mapping(("gain", "k", linear, ""), ("gain", "u", "", ""), ("none", "n", "", ""))
    inline = f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping>"
    found = read(system(component("a", bindings(binding(given, inline)))))
    assert found.instances["a"].start == {"k": 7.0, "u": 3.0}
    assert any("there is no parameter 'none' in what is mapped" in note for note in found.provenance.notes)


def test_a_mapping_sees_names_with_their_prefix(read):
    table = mapping(("a.gain", "b.k", "", ""))
    inline = f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping>"
    given = binding(parameters(("gain", real(3))), inline, prefix="a.")
    assert starts(read, system(component("b"), bound=bindings(given))) == {"b": {"k": 3.0}}


@pytest.mark.parametrize(("suppressed", "arrives"), [("", 21.0), (' suppressUnitConversion="true"', 73.0)])
def test_units_are_converted_before_a_mapping_transforms(read, suppressed, arrives):
    """36 km/h are 10 m/s, and 2 * 10 + 1; or 2 * 36 + 1 where that is suppressed."""
    linear = '<ssc:LinearTransformation factor="2" offset="1"/>'
    table = mapping(("speed", "top.v", linear, suppressed))
    given = parameters(("speed", real(36, "km/h")), units=SPEEDS)
    inline = f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping>"
    found = starts(read, system(component("a", bindings(binding(given, inline)))))
    assert found["a"] == {"top.v": pytest.approx(arrives)}


def test_a_mapping_of_truths_and_of_whole_numbers(read):
    """By a table; what it does not name stays (SSP, IntegerMappingTransformation)."""
    given = parameters(("t", '<ssv:Boolean value="true"/>'), ("w", '<ssv:Integer value="3"/>'))
    truths = '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>'
    numbers = '<ssc:IntegerMappingTransformation><ssc:MapEntry source="{}" target="30"/>'
    for source, expected in ((3, 30), (4, 3)):
        table = mapping(
            ("t", "on", f"{truths}</ssc:BooleanMappingTransformation>", ""),
            ("w", "n", f"{numbers.format(source)}</ssc:IntegerMappingTransformation>", ""),
        )
        inline = f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping>"
        found = starts(read, system(component("a", bindings(binding(given, inline)))))
        assert found["a"] == {"on": False, "n": expected}


def test_files_of_their_own(read):
    """A set and a mapping beside the description, and both inside the FMU."""
    files = {
        "resources/p.ssv": parameters(("gain", real(3))),
        "resources/p.ssm": mapping(("gain", "k", "", "")),
    }
    table = '<ssd:ParameterMapping source="resources/p.ssm"/>'
    given = bindings(binding("", table, source="resources/p.ssv"))
    assert starts(read, system(component("a", given)), files) == {"a": {"k": 3.0}}
    inside = {
        "modelDescription.xml": DESCRIPTION,
        **{name.replace("p.", "q."): text for name, text in files.items()},
    }
    table = '<ssd:ParameterMapping source="resources/q.ssm" sourceBase="component"/>'
    given = bindings(binding("", table, source="resources/q.ssv", sourceBase="component"))
    assert starts(read, system(component("a", given)), {"resources/gadget.fmu": packed(inside)}) == {"a": {"k": 3.0}}
    with pytest.raises(ScenarioError, match="its source is relative to a component, and there is none"):
        read(system(component("a"), bound=given))
    beside = bindings(binding("", source="p.ssv", sourceBase="component"))
    text = files["resources/p.ssv"].replace("gain", "c.k")
    part = component("more", beside, source="parts/one.ssd", type="application/x-ssp-definition", shown=" ")
    own = structure(system(component("c", source="../resources/gadget.fmu"), bound=bindings(values(c__k=1, c__n=2))))
    found = starts(read, system(part), {"parts/one.ssd": own, "parts/p.ssv": text})
    assert found == {"more_c": {"k": 3.0, "n": 2.0}}  # those of the component come last


def test_names_that_nothing_has_are_told(read):
    found = read(system(component("a", bindings(values(gain=1, k=2)))))
    assert found.instances["a"].start == {"k": 2.0}
    assert any("a has no 'gain'; the value is left out" in note for note in found.provenance.notes)


def test_what_cannot_be_set_is_told(read):
    found = read(system(component("a", bindings(values(y=1)))))
    assert found.instances["a"].start == {}
    assert any("a.y cannot be set before a run" in note for note in found.provenance.notes)


def test_values_of_a_system_go_where_its_connectors_lead(read):
    """The root's parameter 36 km/h to an input in m/s, doubled on the way; its own input to two components."""
    shown = connectors(i="input", p="parameter km/h", unused="parameter")
    wires = (
        connection("i", "a.u")
        + connection("i", "b.u")
        + connection("p", "b.top.v", '<ssc:LinearTransformation factor="2"/>')
    ).replace('endElement="b.top" endConnector="v"', 'endElement="b" endConnector="top.v"')
    own = connectors(u="input", **{"top.v": "parameter"})
    bound = bindings(binding(parameters(("i", real(7)), ("p", real(36, "km/h")), ("unused", real(1)), units=SPEEDS)))
    found = read(system(component("a") + component("b", bindings(values(top__v=1)), shown=own), wires, shown, bound))
    assert found.instances["a"].start == {"u": 7.0}
    assert found.instances["b"].start == {"u": 7.0, "top.v": pytest.approx(20.0)}
    assert any("unused gives its value to nothing" in note for note in found.provenance.notes)


def test_inputs_of_a_system_without_a_value_stay_as_they_are(read):
    shown = connectors(i="input")
    found = read(system(component("a"), connection("i", "a.u"), shown))
    assert found.connections == []
    assert found.instances["a"].start == {}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("k", '<ssv:Real value="much"/>'), "parameter 'k': 'much' is no Real"),
        (("k", '<ssv:Boolean value="yes"/>'), "parameter 'k': 'yes' is no Boolean"),
        (("k", '<ssv:Real value="1 2"/>'), "parameter 'k': '1 2' is no Real"),
    ],
)
def test_values_that_are_none(read, given, said):
    with pytest.raises(ScenarioError, match=said):
        read(system(component("a", bindings(binding(parameters(given))))))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("k", '<ssv:Binary value="00"/>'), "parameter 'k' is Binary, which is not supported; it is left out"),
        (("k", ""), "parameter 'k' has no value of a known type; it is left out"),
    ],
)
def test_values_that_are_left_out(read, given, said):
    found = read(system(component("a", bindings(binding(parameters(given))))))
    assert any(said in note for note in found.provenance.notes)


def test_two_values_for_one_name(read):
    table = mapping(("a", "k", "", ""), ("b", "k", "", ""))
    inline = f"<ssd:ParameterMapping>{table}</ssd:ParameterMapping>"
    with pytest.raises(ScenarioError, match="'k' is mapped to already, from 'a'; one value has one source"):
        read(system(component("a", bindings(binding(parameters(("a", real(1))), inline)))))


def test_bindings_that_hold_nothing(read):
    empty = bindings(binding("", "<ssd:ParameterMapping/>"))
    assert starts(read, system(component("a", empty))) == {}
