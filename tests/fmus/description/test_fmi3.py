"""The description in FMI 3.0 against that in FMI 2.0, FMPy's validator and the schema."""

import math
import re
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree
from railcosim.components import CATALOGUE, Component, Memory, Output, Parameter
from railcosim.components.tracing import TracingError
from railcosim.fmus.annotation import read
from railcosim.fmus.description import ModelExchange, write
from railcosim.fmus.references import resolve

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3ModelDescription.xsd"
MIXED = f"{Path(__file__).parents[1] / 'native_samples.py'}:Mixed"
EVERYTHING = f"{Path(__file__).parents[2] / 'components' / 'samples.py'}:Everything"
FEW = (MIXED, EVERYTHING, "PointMassTrain", "Consist", "Cailc")
SCALAR = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean", "String": "String"}
TAGS = {"Output": "Outputs", "ContinuousStateDerivative": "Derivatives", "InitialUnknown": "InitialUnknowns"}


def described(component, fmi, exchange=None):
    return etree.fromstring(write(component, "native", "0123456789abcdef" * 4, fmi=fmi, exchange=exchange))


def array_of(name):
    """``x[1,2]`` is an element of ``x``, and ``der(x[2])`` of ``der(x)``."""
    return re.sub(r"\[[\d,]+\]", "", name)


def scalars(root):
    """Of FMI 2.0, by name of the array: the variables with their types."""
    found = {}
    for variable in root.find("ModelVariables"):
        found.setdefault(array_of(variable.get("name")), []).append((variable, variable[0]))
    return found


def named(names, entry):
    told = entry.get("dependencies")
    return None if told is None else {array_of(names[reference]) for reference in told.split()}


def dependencies_2(root):
    names = {str(k): v.get("name") for k, v in enumerate(root.find("ModelVariables"), 1)}
    for new, old in TAGS.items():
        for entry in root.iterfind(f"ModelStructure/{old}/Unknown"):
            yield new, array_of(names[entry.get("index")]), named(names, entry)


def dependencies_3(root):
    names = {v.get("valueReference"): v.get("name") for v in root.find("ModelVariables")}
    for entry in root.find("ModelStructure"):
        yield entry.tag, names[entry.get("valueReference")], named(names, entry)


def together(entries):
    """An array depends on all that its elements depend on."""
    found = {}
    for tag, name, sources in entries:
        found.setdefault((tag, name), set()).update(sources)
    return found


def starts(variable):
    inside = [start.get("value") for start in variable.iterfind("Start")]
    return inside or variable.get("start", "").split()


REST = [pytest.param(name, marks=pytest.mark.campaign) for name in CATALOGUE if name not in FEW]


@pytest.mark.parametrize("name", [*FEW, *REST], ids=lambda name: name.rpartition(":")[2])
def test_it_says_in_arrays_what_fmi_2_says_in_scalars(name, tmp_path):
    component = resolve(name)()
    two, three = described(component, "2"), described(component, "3")
    valid(three, tmp_path)
    assert three.get("instantiationToken") == two.get("guid")
    expected, (*variables, time) = scalars(two), three.find("ModelVariables")
    assert (time.tag, time.get("causality")) == ("Float64", "independent")
    assert [variable.get("name") for variable in variables] == list(expected)
    for variable in variables:
        own = expected[variable.get("name")]
        (scalar, kind) = own[0]
        sizes = [int(dimension.get("start")) for dimension in variable.iterfind("Dimension")]
        assert len(own) == math.prod(sizes)
        assert SCALAR[variable.tag] == kind.tag
        for key in ("valueReference", "causality", "variability", "initial", "description"):
            assert array_of(variable.get(key) or "") == array_of(scalar.get(key) or "")
        for key in ("unit", "min", "max"):
            assert variable.get(key) == kind.get(key)
        assert starts(variable) == [start for _, kind in own if (start := kind.get("start")) is not None]
    assert together(dependencies_3(three)) == together(dependencies_2(two))
    assert read(three) == read(two)


def test_units_have_the_seconds_of_the_time_and_rates_point_at_their_states():
    root = described(resolve("ComfortCruise")(), "3")
    assert "s" in {unit.get("name") for unit in root.iterfind("UnitDefinitions/Unit")}
    consist = described(resolve("Consist")(), "3")
    variables = {variable.get("name"): variable for variable in consist.find("ModelVariables")}
    assert variables["der(speed)"].get("derivative") == variables["speed"].get("valueReference")


def test_what_it_can_is_said_in_the_words_of_fmi_3():
    attributes = described(resolve("ComfortCruise")(), "3").find("CoSimulation").attrib
    assert dict(attributes) == {
        "modelIdentifier": "ComfortCruise",
        "needsExecutionTool": "false",
        "canHandleVariableCommunicationStepSize": "true",
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
    }


def valid(root, folder):
    etree.XMLSchema(etree.parse(str(SCHEMA))).assertValid(root)
    (folder / "modelDescription.xml").write_bytes(etree.tostring(root))
    assert validate_fmu(str(folder)) == []
    return fmpy.read_model_description(str(folder), validate=False)


def test_model_exchange_stands_beside_co_simulation(tmp_path):
    component = resolve("Consist")()
    root = described(component, "3", ModelExchange(9, ()))
    assert dict(root.find("ModelExchange").attrib) == {
        "modelIdentifier": "Consist",
        "needsExecutionTool": "false",
        "needsCompletedIntegratorStep": "false",
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
    }
    assert dict(root.find("CoSimulation").attrib) == dict(described(component, "3").find("CoSimulation").attrib)
    assert root.get("numberOfEventIndicators") is None  # that is FMI 2.0
    told = valid(root, tmp_path)
    assert (told.numberOfContinuousStates, told.numberOfEventIndicators) == (9, 9)
    variables = {v.get("name"): v for v in root.find("ModelVariables")}
    assert [name for name, v in variables.items() if v.get("reinit") == "true"] == ["speed"]  # they can stand still
    indicators = variables["event.indicators"]
    assert (indicators.get("causality"), indicators.get("initial")) == ("local", "calculated")
    (entry,) = root.iterfind("ModelStructure/EventIndicator")
    assert dict(entry.attrib) == {"valueReference": indicators.get("valueReference")}
    assert int(entry.get("valueReference")) == int(variables["time"].get("valueReference")) + 1
    unknown = {entry.get("valueReference") for entry in root.iterfind("ModelStructure/InitialUnknown")}
    assert entry.get("valueReference") not in unknown


def test_without_choices_there_are_no_event_indicators_and_what_samples_put_back_is_told(tmp_path):
    root = described(resolve(MIXED)(), "3", ModelExchange(0, ("v",)))
    told = valid(root, tmp_path)
    assert (told.numberOfContinuousStates, told.numberOfEventIndicators) == (3, 0)
    assert root.find("ModelStructure/EventIndicator") is None
    assert [v.get("name") for v in root.find("ModelVariables") if v.get("reinit") == "true"] == ["v"]


def test_co_simulation_alone_says_nothing_of_model_exchange():
    root = described(resolve("Consist")(), "3")
    assert not [*root.iter("ModelExchange", "EventIndicator")]
    assert "event.indicators" not in {v.get("name") for v in root.find("ModelVariables")}
    assert not {key for element in root.iter() for key in element.attrib} & {"reinit", "needsCompletedIntegratorStep"}


class Unclear(Component):
    """What it depends on is not known, for it reads values as plain numbers with another package."""

    requires = ("scipy",)
    gain = Parameter("1", [1.0, 2.0], shape=(2,))
    m = Memory("1", 0.0)
    y = Output("1", shape=(2,))

    def outputs(self):
        return {"y": [float(self.gain[0]), float(self.gain[1])]}

    def update(self):
        return {"m": self.m}


def test_what_is_not_known_to_depend_is_not_said():
    found = list(dependencies_3(described(Unclear(), "3")))
    assert found
    assert {sources is None for _, name, sources in found if name == "y"} == {True}


def test_what_reads_values_as_plain_numbers_says_so_or_is_refused():
    class Hidden(Unclear):
        """It does not name the package."""

        requires = ()

    with pytest.raises(TracingError, match="Hidden"):
        described(Hidden(), "3")


def test_where_nothing_has_a_unit_none_is_defined():
    class Bare(Component):
        """A number."""

        y = Output("1")

        def outputs(self):
            return {"y": 1.0}

    assert described(Bare(), "2").find("UnitDefinitions") is None
    assert [unit.get("name") for unit in described(Bare(), "3").iterfind("UnitDefinitions/Unit")] == ["s"]
