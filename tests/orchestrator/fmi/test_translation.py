"""Descriptions of FMI 1.0 and 3.0 in the terms of 2.0."""

from types import SimpleNamespace

import pytest
from lxml import etree
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi import entries as entries_module
from railcosim.orchestrator.fmi import translation


def root(text):
    return etree.fromstring(text)


@pytest.mark.parametrize(
    ("written", "version"),
    [
        ("1.0", "1.0"),
        (" 2.0 ", "2.0"),
        ("2.0.3", "2.0"),
        ("2.0.x", "2.0"),
        ("3.0", "3.0"),
        ("3.1.2", "3.0"),
        ("3.0-beta.2", "3.0-beta.2"),
        ("2.1", "2.1"),
        ("1.0.1", "1.0.1"),
        ("", "?"),
    ],
)
def test_the_standard_by_what_is_written(written, version):
    assert translation.standard(root(f'<fmiModelDescription fmiVersion="{written}"/>')) == version


def test_a_file_without_a_version():
    assert translation.standard(root("<fmiModelDescription/>")) == "?"


@pytest.mark.parametrize(
    ("content", "version", "runs", "kind"),
    [
        ("<CoSimulation/>", "2.0", True, ""),
        ("<CoSimulation/><ModelExchange/>", "3.0", True, "a model-exchange FMU"),
        ("<ModelExchange/>", "2.0", False, "a model-exchange FMU"),
        ("<ScheduledExecution/>", "3.0", False, "an FMU for scheduled execution"),
        ("<Implementation/>", "1.0", True, "a model-exchange FMU"),
        ("", "1.0", False, "a model-exchange FMU"),
        ("", "2.0", False, ""),
    ],
)
def test_what_a_file_is_for(content, version, runs, kind):
    it = root(f"<fmiModelDescription>{content}</fmiModelDescription>")
    assert translation.is_for_co_simulation(it, version) == runs
    assert translation.other_kind(it, version) == kind


def translated(variables, version, implementation=""):
    """Variables, as XML, in the terms of FMI 2.0, what is kept beside, and the capabilities."""
    it = root(f"<x>{implementation}<ModelVariables>{variables}</ModelVariables></x>")
    entries = [
        entries_module.read_entry(element, version, entries_module.Texts())
        for element in it.find("ModelVariables")
        if isinstance(element.tag, str)
    ]
    entries_module.resolve(entries, version)
    description = entries_module.Description(SimpleNamespace(coSimulation=SimpleNamespace()), entries)
    beside = translation.translate(description, it, version)
    return {v.name: v for v in description.entries}, beside, description.found.coSimulation


def scalar(name, attributes="", kind="Real", value="", more=""):
    """A variable of FMI 1.0."""
    return f'<ScalarVariable name="{name}" valueReference="0" {attributes}><{kind} {value}/>{more}</ScalarVariable>'


@pytest.mark.parametrize(
    ("start", "kind", "attributes", "value", "expected"),
    [
        ("1", "Real", 'variability="parameter"', "", ("parameter", "fixed", "exact")),
        (None, "Real", 'variability="parameter"', "", ("calculatedParameter", "fixed", "calculated")),
        (None, "Real", 'variability="parameter" causality="output"', "", ("output", "fixed", "calculated")),
        (None, "Real", "", "", ("local", "continuous", "calculated")),
        ("1", "Real", "", 'fixed="false"', ("local", "continuous", "approx")),
        ("1", "Real", "", 'fixed="true"', ("local", "continuous", "exact")),
        ("1", "Real", 'causality="input"', "", ("input", "continuous", None)),
        (None, "Integer", 'causality="output"', "", ("output", "discrete", "calculated")),
        (None, "Real", 'causality="none"', "", ("local", "continuous", "calculated")),
    ],
)
def test_roles_of_fmi_1(start, kind, attributes, value, expected):
    value += "" if start is None else f' start="{start}"'
    variables, _, _ = translated(scalar("v", attributes, kind, value), "1.0")
    v = variables["v"]
    assert (v.causality, v.variability, v.initial) == expected


def test_outputs_and_what_they_depend_on_directly():
    """Nothing said is no list; a name that is not there is passed over; only of an output is it of any use."""
    depends = "<DirectDependency><Name> u </Name><Name>gone</Name><Name/></DirectDependency>"
    variables, _, _ = translated(
        scalar("u", 'causality="input"', more=depends)
        + scalar("y", 'causality="output"', more=depends)
        + scalar("z", 'causality="output"'),
        "1.0",
    )
    assert [variables[name].depends for name in "uyz"] == [None, ["u"], None]


def test_negatives_of_other_variables():
    kinds = (("a", "Real"), ("b", "Boolean"), ("c", "String"))
    variables, _, _ = translated("".join(scalar(n, 'alias="negatedAlias"', kind) for n, kind in kinds), "1.0")
    assert [name for name, v in variables.items() if v.negated] == ["a", "b"], "no text has a negative"


def test_a_variable_without_a_type_is_named():
    with pytest.raises(ValueError, match='the variable "v" has no type'):
        translated('<ScalarVariable name="v" valueReference="0"/>', "1.0")


def test_capabilities_of_fmi_1():
    told = '<Capabilities canInterpolateInputs="1" canHandleVariableCommunicationStepSize="true"/>'
    able = f"<CoSimulation_Tool>{told}</CoSimulation_Tool>"
    for implementation, expected in ((able, (True, True, False, True)), ("", (False, False, False, False))):
        simulation = translated("", "1.0", f"<Implementation>{implementation}</Implementation>")[2]
        assert (
            simulation.canHandleVariableCommunicationStepSize,
            simulation.canInterpolateInputs,
            simulation.canBeInstantiatedOnlyOncePerProcess,
            simulation.needsExecutionTool,
        ) == expected


def test_types_of_fmi_3_and_what_is_left_out():
    written = (
        '<Float32 name="x" valueReference="1" causality="output"><Alias name="twin" description="again"/></Float32>'
        '<UInt64 name="n" valueReference="2" min="1" max="18446744073709551615"/><!-- a comment -->'
        '<Boolean name="on" valueReference="3"/>'
        '<Int8 name="k" valueReference="4" causality="structuralParameter" start="2"/>'
        '<Float64 name="vast" valueReference="5"><Dimension start="1000000"/><Dimension start="1000000"/></Float64>'
        '<Float64 name="none" valueReference="6"><Dimension start="0"/></Float64>'
        '<Float64 name="row" valueReference="7"><Dimension valueReference="4"/></Float64>'
        '<Boolean name="row[2]" valueReference="8"/>'
        '<Binary name="blob" valueReference="9"><Start value="00"/></Binary>'
        '<Clock name="tick" valueReference="10" intervalVariability="triggered"/>'
        '<Float64 name="sampled" valueReference="11" clocks="10 99"/>'
        '<Binary name="note" valueReference="12" declaredType="Note" maxSize="9"/>'
    )
    simulation = (
        '<CoSimulation providesDirectionalDerivatives="true"/>'
        '<TypeDefinitions><BinaryType name="Note" mimeType="text/plain" maxSize="5"/></TypeDefinitions>'
    )
    by_name, beside, able = translated(written, "3.0", simulation)
    assert {name: (v.type, v.fmi_type) for name, v in by_name.items()} == {
        "x": ("Real", "Float32"),
        "n": ("Integer", "UInt64"),
        "on": ("Boolean", "Boolean"),
        "k": ("Integer", "Int8"),
        "row[2]": ("Boolean", "Boolean"),
        "blob": ("String", "Binary"),
        "note": ("String", "Binary"),
        "twin": ("Real", "Float32"),
    }
    assert beside.left_out == {
        "vast": "an array of 1000000000000 elements",
        "none": "an array of 0 elements",
        "row": "an array, and its elements' names are those of others",
        "tick": "a clock",
        "sampled": "clocked by tick, 99",
    }
    assert (by_name["n"].min, by_name["n"].max) == ("1", "18446744073709551615")
    assert by_name["k"].initial is None
    assert [(by_name[name].media, by_name[name].longest) for name in ("blob", "note")] == [
        (None, None),
        ("text/plain", "9"),
    ], "of a type what the variable does not say itself"
    assert (by_name["twin"].causality, by_name["twin"].description) == ("local", "again (another name of x)")
    assert able.providesDirectionalDerivative is True
    assert able.canInterpolateInputs is False


def test_fmi_2_is_left_as_it_is():
    assert translation.translate(None, None, "2.0") == translation.Beside()


@pytest.mark.parametrize(
    ("count", "ends"), [(1, "v0 (an array)"), (10, "v9 (an array)"), (12, "v9 (an array), and 2 more")]
)
def test_of_what_is_left_out_ten_are_named(count, ends):
    (warning,) = translation.Beside(left_out={f"v{k}": "an array" for k in range(count)}).warnings("f.fmu")
    assert warning.startswith("f.fmu: variables of kinds that are not supported are left out: v0 (an array)")
    assert warning.endswith(ends)
    assert list(translation.Beside().warnings("f.fmu")) == []


STRUCTURED = """<x>
  <UInt64 name="n" valueReference="1" causality="structuralParameter" start="3" min="1" max="9"/>
  <Float64 name="width" valueReference="2" causality="structuralParameter" start="0.5"/>
  <Boolean name="on" valueReference="3" causality="structuralParameter" start="false"/>
  <String name="kind" valueReference="4" causality="structuralParameter"><Start value="a"/></String>
  <Float64 name="row" valueReference="5" start="1 2 3"><Dimension valueReference="1"/></Float64>
  <Float64 name="pair" valueReference="6" start="1 2"><Dimension start="2"/></Float64>
</x>"""


def structured():
    return [entries_module.read_entry(element, "3.0", entries_module.Texts()) for element in root(STRUCTURED)]


def test_structural_parameters_are_as_if_they_stood_in_the_file():
    found = structured()
    translation.restructure(found, {"n": 5.0, "width": 0.25, "on": True, "kind": "b"}, "it.fmu")
    of = {entry.name: entry for entry in found}
    assert [of[name].start for name in ("n", "width", "on", "kind")] == ["5", "0.25", "true", "b"]
    assert (of["row"].resized, of["pair"].resized) == (True, False)


def test_no_structural_parameter_is_given():
    found = structured()
    translation.restructure(found, {}, "it.fmu")
    assert not any(entry.resized for entry in found)


@pytest.mark.parametrize(
    ("given", "wrong"),
    [
        ({"n": 0}, "it.fmu: the structural parameter 'n' takes 1 to 9, not 0"),
        ({"n": 10}, "it.fmu: the structural parameter 'n' takes 1 to 9, not 10"),
        ({"n": 1.5}, "it.fmu: the structural parameter 'n' takes a whole number, not 1.5"),
        ({"n": True}, "it.fmu: the structural parameter 'n' takes a whole number, not True"),
        ({"width": "x"}, "it.fmu: the structural parameter 'width' takes a number, not 'x'"),
        ({"on": 1}, "it.fmu: the structural parameter 'on' takes true or false, not 1"),
        ({"kind": 1}, "it.fmu: the structural parameter 'kind' takes text, not 1"),
        ({"pair": 1}, "it.fmu has no structural parameter 'pair'; there are n, width, on, kind"),
    ],
)
def test_what_structural_parameters_cannot_be(given, wrong):
    with pytest.raises(FmuFileError) as caught:
        translation.restructure(structured(), given, "it.fmu")
    assert str(caught.value) == wrong
