"""Descriptions of FMI 1.0 and 3.0 in the terms of 2.0."""

from types import SimpleNamespace

import pytest
from lxml import etree
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


def variable(name, kind="Real", start=None, **own):
    """What FMPy makes of a variable."""
    named = {"causality": None, "variability": "continuous", "initial": None, "alias": None, "description": None}
    more = {"dimensions": [], "clocks": None, "min": None, "max": None}
    return SimpleNamespace(name=name, type=kind, start=start, **{**named, **more, **own})


def from_1(*pairs, implementation=""):
    """Translate variables of FMI 1.0, each with its element."""
    listed = "".join(element for _, element in pairs)
    it = root(f"<x><Implementation>{implementation}</Implementation><ModelVariables>{listed}</ModelVariables></x>")
    description = SimpleNamespace(coSimulation=SimpleNamespace(), modelVariables=[v for v, _ in pairs], outputs=[])
    return description, translation.translate(description, it, "1.0")


@pytest.mark.parametrize(
    ("start", "kind", "attributes", "child", "expected"),
    [
        (1.0, "Real", 'variability="parameter"', "", ("parameter", "fixed", "exact")),
        (None, "Real", 'variability="parameter"', "", ("calculatedParameter", "fixed", "calculated")),
        (None, "Real", 'variability="parameter" causality="output"', "", ("output", "fixed", "calculated")),
        (None, "Real", "", "", ("local", "continuous", "calculated")),
        (1.0, "Real", "", '<Real fixed="false"/>', ("local", "continuous", "approx")),
        (1.0, "Real", "", '<Real fixed="true"/>', ("local", "continuous", "exact")),
        (1.0, "Real", 'causality="input"', "", ("input", "continuous", None)),
        (None, "Integer", 'causality="output"', "", ("output", "discrete", "calculated")),
        (None, "Real", 'causality="none"', "", ("local", "continuous", "calculated")),
    ],
)
def test_roles_of_fmi_1(start, kind, attributes, child, expected):
    v = variable("v", kind, start)
    from_1((v, f'<ScalarVariable name="v" {attributes}>{child}</ScalarVariable>'))
    assert (v.causality, v.variability, v.initial) == expected


def test_outputs_and_what_they_depend_on_directly():
    """Nothing said is no list; a name that is not there is passed over."""
    u, y, z = variable("u", start=0.0), variable("y"), variable("z")
    depends = "<DirectDependency><Name> u </Name><Name>gone</Name><Name/></DirectDependency>"
    description, _ = from_1(
        (u, '<ScalarVariable name="u" causality="input"/>'),
        (y, f'<ScalarVariable name="y" causality="output">{depends}</ScalarVariable>'),
        (z, '<ScalarVariable name="z" causality="output"/>'),
    )
    assert [(known.variable.name, known.dependencies) for known in description.outputs] == [("y", [u]), ("z", None)]


def test_negatives_of_other_variables():
    element = '<ScalarVariable name="{}" alias="negatedAlias"/>'
    pairs = [(variable(n, kind), element.format(n)) for n, kind in (("a", "Real"), ("b", "Boolean"), ("c", "String"))]
    _, beside = from_1(*pairs)
    assert beside.negated == {"a", "b"}, "no text has a negative"


def test_capabilities_of_fmi_1():
    told = '<Capabilities canInterpolateInputs="1" canHandleVariableCommunicationStepSize="true"/>'
    able = f"<CoSimulation_Tool>{told}</CoSimulation_Tool>"
    for implementation, expected in ((able, (True, True, False, True)), ("", (False, False, False, False))):
        simulation = from_1(implementation=implementation)[0].coSimulation
        assert (
            simulation.canHandleVariableCommunicationStepSize,
            simulation.canInterpolateInputs,
            simulation.canBeInstantiatedOnlyOncePerProcess,
            simulation.needsExecutionTool,
        ) == expected


def test_types_of_fmi_3_and_what_is_left_out():
    variables = [
        variable("x", "Float32"),
        variable("n", "UInt64"),
        variable("on", "Boolean"),
        variable("k", "Int8", initial="exact", causality="structuralParameter"),
        variable("vast", "Float64", dimensions=[SimpleNamespace()], shape=(10**6, 10**6)),
        variable("none", "Float64", dimensions=[SimpleNamespace()], shape=(0,)),
        variable("row", "Float64", dimensions=[SimpleNamespace()], shape=(2,)),
        variable("row[2]", "Boolean"),
        variable("blob", "Binary"),
        variable("tick", "Clock"),
        variable("sampled", "Float64", clocks=["tick"]),
        variable("twin", "Float64", causality="output", alias=SimpleNamespace(name="x"), description="again"),
    ]
    written = '<UInt64 name="n" min="1" max="18446744073709551615"/><!-- a comment --><Float32 name="x"/>'
    it = root(f'<x><CoSimulation providesDirectionalDerivatives="true"/><ModelVariables>{written}</ModelVariables></x>')
    description = SimpleNamespace(coSimulation=SimpleNamespace(), modelVariables=variables)
    beside = translation.translate(description, it, "3.0")
    by_name = {v.name: v for v in description.modelVariables}
    assert {name: v.type for name, v in by_name.items()} == {
        "x": "Real", "n": "Integer", "on": "Boolean", "k": "Integer", "twin": "Real", "row[2]": "Boolean",
    }  # fmt: skip
    assert beside.fmi_types == {
        "x": "Float32", "n": "UInt64", "on": "Boolean", "k": "Int8", "twin": "Float64", "row[2]": "Boolean",
    }  # fmt: skip
    assert beside.left_out == {
        "vast": "an array of 1000000000000 elements",
        "none": "an array of 0 elements",
        "row": "an array, and its elements' names are those of others",
        "blob": "binary",
        "tick": "a clock",
        "sampled": "clocked",
    }
    assert (by_name["n"].min, by_name["n"].max) == ("1", "18446744073709551615")
    assert by_name["k"].initial is None
    assert (by_name["twin"].causality, by_name["twin"].description) == ("local", "again (another name of x)")
    assert description.coSimulation.providesDirectionalDerivative is True
    assert description.coSimulation.canInterpolateInputs is False


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
