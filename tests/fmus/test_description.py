"""The model description against the declarations, against the equations themselves, and by hand."""

import json
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree
from railcosim.components import ComponentError
from railcosim.components.component import evaluated
from railcosim.components.declarations import Input, Memory, Output, Parameter, State, Tape
from railcosim.components.tracing import start_name
from railcosim.fmus.build import build
from railcosim.fmus.description import write
from railcosim.fmus.references import resolve
from railcosim.fmus.units import BASE, parse
from railcosim.fmus.variables import scalar_variables

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"
TYPES = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}


@pytest.fixture
def described(reference, model):
    return resolve(reference)(), model(reference)


def variables(root):
    """Attributes of every variable by name, with those of its type, its type and its index."""
    return {
        v.get("name"): {**v.attrib, **v[0].attrib, "type": v[0].tag, "index": str(k)}
        for k, v in enumerate(root.find("ModelVariables"), 1)
    }


def unknowns(root, tag):
    """The dependencies of each entry of a part of ModelStructure, as names; None where they are not told."""
    names = [v.get("name") for v in root.find("ModelVariables")]
    found = {}
    for entry in root.iterfind(f"ModelStructure/{tag}/Unknown"):
        told = entry.get("dependencies")
        name = names[int(entry.get("index")) - 1]
        assert name not in found
        found[name] = None if told is None else {names[int(index) - 1] for index in told.split()}
    return found


# ---------------------------------------------------------------- what a validator says


@pytest.mark.few
def test_the_validator_finds_nothing(reference):
    assert validate_fmu(str(build(reference))) == []


def test_the_schema_is_obeyed(reference, model):
    etree.XMLSchema(etree.parse(str(SCHEMA))).assertValid(model(reference))


# ---------------------------------------------------------------- the stricter rules, for every component


def test_every_declared_scalar_is_there_with_its_type_unit_bounds_and_text(described):
    component, root = described
    found = variables(root)
    computed = evaluated(component, "initial")
    kept = [slot for kind in (State, Memory) for slot in component.of(kind)]
    started = [(start_name(name), slot) for slot in kept if slot.name not in computed for name in slot.scalars]
    declared = [(name, slot) for slot in component.of(Parameter) for name in slot.scalars] + started
    declared += [(name, slot) for kind in (Input, Output) for slot in component.of(kind) for name in slot.scalars]
    declared += [(name, slot) for slot in kept for name in slot.scalars]
    assert list(found) == [name for name, _ in declared]
    for reference, (name, slot) in enumerate(declared):
        entry, declaration = found[name], slot.declaration
        assert entry["valueReference"] == str(reference)
        assert entry["type"] == TYPES[slot.type]
        assert entry.get("description", "").endswith(declaration.description)
        assert entry.get("description", "").startswith("start value of ") == (name not in slot.scalars)
        assert entry.get("unit", "1") == (slot.unit if slot.type is float else "1")
        for attribute, bound in (("min", declaration.minimum), ("max", declaration.maximum)):
            shown = entry.get(attribute)
            assert (shown is None) == (bound is None or slot.type in (bool, str))
            assert shown is None or float(shown) == bound


def test_causality_and_variability(described):
    component, root = described
    found = variables(root)
    for slot in component.slots.values():
        declaration = slot.declaration
        for name in () if isinstance(declaration, Tape) else slot.scalars:
            causality, variability = found[name]["causality"], found[name]["variability"]
            if isinstance(declaration, Parameter):
                assert (causality, variability) == ("parameter", "tunable" if declaration.tunable else "fixed")
            else:
                shown = isinstance(declaration, Output) or getattr(declaration, "output", False)
                assert causality == ("input" if isinstance(declaration, Input) else "output" if shown else "local")
                smooth = slot.type is float and not isinstance(declaration, Memory)
                assert variability == ("continuous" if smooth else "discrete")


def test_only_parameters_are_exact_and_states_that_nothing_computes_begin_at_one(described):
    component, root = described
    computed, found = evaluated(component, "initial"), variables(root)
    for entry in found.values():
        expected = {"input": None, "parameter": "exact"}.get(entry["causality"], "calculated")
        assert entry.get("initial") == expected
        assert ("start" in entry) == (expected != "calculated")
    for slot in component.of(State, Memory):
        for name in slot.scalars:
            assert (start_name(name) in found) == (slot.name not in computed)
            if slot.name not in computed:
                assert (found[start_name(name)]["causality"], found[start_name(name)]["variability"]) == (
                    "parameter",
                    "fixed",
                )


def test_initial_unknowns_are_exactly_the_calculated_outputs(described):
    _, root = described
    calculated = {n for n, v in variables(root).items() if v["causality"] == "output" and v["initial"] == "calculated"}
    assert unknowns(root, "InitialUnknowns").keys() == calculated
    outputs = {n for n, v in variables(root).items() if v["causality"] == "output"}
    assert unknowns(root, "Outputs").keys() == outputs


@pytest.mark.few
def test_known_dependencies_hold_at_a_few_points(described):
    """No number may move an output that does not name it: the equations are asked, at random points.

    Directly (Outputs, inputs only) and at the start (InitialUnknowns, everything that is set there).
    """
    component, root = described
    cls, found = type(component), variables(root)
    direct, initial = unknowns(root, "Outputs"), unknowns(root, "InitialUnknowns")
    random = np.random.default_rng(1)
    bases = {name.partition("[")[0] for name in found}
    kept = {slot.name for slot in component.of(State, Memory)}

    def value(slot):
        if slot.type is str:
            return str(random.integers(100))
        if slot.type is bool:
            draw = random.integers(0, 2, slot.shape).astype(bool)
        elif slot.type is int:
            draw = random.integers(1, 9, slot.shape)
        else:
            draw = random.uniform(0.5, 2.0, slot.shape)
        return draw if slot.shape else draw.item()

    def evaluate(values, start):
        probe = cls(**values)
        if start:
            probe = cls(**values | evaluated(probe, "initial"))
        return {
            name: np.ravel(v)
            for name, v in {**probe.present_values, **evaluated(probe, "outputs")}.items()
            if name in probe.slots
        }

    settable = [
        s for s in component.slots.values() if {*s.scalars} & {*found} and not isinstance(s.declaration, Output)
    ]
    settable = [s for s in settable if not isinstance(s.declaration, State | Memory) or start_name(s.name) in bases]
    for _ in range(3):
        base = {slot.name: value(slot) for slot in settable}
        for slot in settable:
            other = base | {slot.name: value(slot)}
            for entries, start in ((direct, False), (initial, True)):
                if isinstance(slot.declaration, Input) or start:
                    before, after = evaluate(base, start), evaluate(other, start)
                    for name, sources in entries.items():
                        output = component.slots[name.partition("[")[0]]
                        k = output.scalars.index(name)
                        if output.name != slot.name and before[output.name][k] != after[output.name][k]:
                            named = {start_name(n) if slot.name in kept else n for n in slot.scalars}
                            assert sources & named, (name, slot.name)


def test_direct_dependencies_name_inputs_and_initial_ones_nothing_calculated(described):
    _, root = described
    found = variables(root)
    for sources in unknowns(root, "Outputs").values():
        assert {found[n]["causality"] for n in sources} <= {"input"}
    for sources in unknowns(root, "InitialUnknowns").values():
        assert {found[n].get("initial", "input") for n in sources} <= {"input", "exact"}


def test_units_are_defined_by_base_units(described):
    component, root = described
    used = {s.unit for s in component.slots.values() if s.type is float and {*s.scalars} & {*variables(root)}} - {"1"}
    defined = {u.get("name"): dict(u.find("BaseUnit").attrib) for u in root.iterfind("UnitDefinitions/Unit")}
    assert defined.keys() == used
    for name, base in defined.items():
        expected = parse(name)
        assert [int(base.get(symbol, 0)) for symbol in BASE] == list(expected.exponents)
        assert float(base.get("factor", 1.0)) == expected.factor


def test_head_experiment_and_annotation(described, reference):
    component, root = described
    cls = type(component)
    head = root.find("CoSimulation").attrib
    assert root.get("modelName") == head["modelIdentifier"] == cls.__name__
    assert root.get("variableNamingConvention") == "structured"
    for flag in ("canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate", "canSerializeFMUstate"):
        assert head[flag] == "true"
    assert "canBeInstantiatedOnlyOncePerProcess" not in head
    experiment = root.find("DefaultExperiment").attrib
    assert experiment["startTime"] == "0"
    assert float(experiment["stepSize"]) > 0.0
    (tool,) = root.findall("VendorAnnotations/Tool")
    assert tool.get("name") == "railcosim"
    entry = tool.find("component").attrib
    assert entry["name"] == cls.__name__
    assert json.loads(entry["arguments"]) == json.loads(json.dumps(component.build_arguments))
    assert root.get("guid") == "{" + entry["digest"][:32] + "}"
    assert build(reference).parent.name == entry["digest"][:32]
    assert entry.get("note", "") == cls.note
    assert entry.get("source", "") == cls.source


# ---------------------------------------------------------------- by hand


def test_point_mass_train_by_hand(model):
    root = model("PointMassTrain")
    found, direct, initial = variables(root), unknowns(root, "Outputs"), unknowns(root, "InitialUnknowns")
    limits = {"limit_force", "traction_limit", "braking_limit"}
    assert direct == {
        "acceleration": {"force", "disturbance", "line_resistance", "curve_resistance"},
        "applied_force": {"force"},
        "position": set(),
        "speed": set(),
    }
    assert initial == {
        "acceleration": {
            *("force", "disturbance", "line_resistance", "curve_resistance"),
            *("mass", "c0", "c1", "c2", "starting_resistance", "speed_start", *limits),
        },
        "applied_force": {"force", *limits},
        "position": {"position_start"},
        "speed": {"speed_start"},
    }
    assert found["position"] == {
        "name": "position",
        "valueReference": found["position"]["valueReference"],
        "description": "position of the front, growing in the running direction",
        "causality": "output",
        "variability": "continuous",
        "initial": "calculated",
        "unit": "m",
        "type": "Real",
        "index": found["position"]["index"],
    }
    assert found["position_start"] == {
        "name": "position_start",
        "valueReference": found["position_start"]["valueReference"],
        "description": "start value of position: position of the front, growing in the running direction",
        "causality": "parameter",
        "variability": "fixed",
        "initial": "exact",
        "unit": "m",
        "start": "0.0",
        "type": "Real",
        "index": found["position_start"]["index"],
    }
    assert found["limit_force"]["start"] == "false"
    assert found["max_step"]["causality"] == "parameter"
    assert "sample_time" not in found
    base = {u.get("name"): dict(u.find("BaseUnit").attrib) for u in root.iterfind("UnitDefinitions/Unit")}
    assert base["N"] == {"kg": "1", "m": "1", "s": "-2"}
    assert base["m/s2"] == base["N/kg"] == {"m": "1", "s": "-2"}
    assert base["N.s2/(m2.kg)"] == {"m": "-1"}


def test_the_rate_of_a_state_has_the_unit_of_one_more_second(write_component):
    body = "from railcosim.components import Component, State\n\n\nclass C(Component):\n"
    units = {"m": "m/s", "m/s": "m/s2", "m/s2": "m/s3", "rad/s": "rad/s2", "N.s/(m.kg)": "N.s/(m.kg)/s"}
    body += "".join(f"    x{k} = State({unit!r})\n" for k, unit in enumerate(units))
    body += "\n    def derivatives(self):\n        return {" + ", ".join(f"'x{k}': 0.0" for k in range(5)) + "}\n"
    root = etree.fromstring(write(resolve(write_component(body))(), "native", "0" * 64))
    found = {v.get("name"): v.find("Real").get("unit") for v in root.iter("ScalarVariable")}
    assert [found[f"der(x{k})"] for k in range(5)] == list(units.values())
    exponents = {u.get("name"): dict(u.find("BaseUnit").attrib) for u in root.iterfind("UnitDefinitions/Unit")}
    assert exponents["m/s3"] == {"m": "1", "s": "-3"}


def test_comfort_cruise_by_hand(model):
    root = model("ComfortCruise")
    direct = unknowns(root, "Outputs")
    heard = {"position", "speed", "target_speed", "has_ahead", "ahead_position", "ahead_speed"}
    heard |= {"has_behind", "behind_position", "behind_speed", "has_leader", "leader_speed", "ahead_age", "behind_age"}
    assert direct["force"] == heard | {"line_resistance", "curve_resistance"}
    assert direct["demand"] == direct["bottom_demand"] == heard
    neighbours = {f"{side}_{what}" for side in ("ahead", "behind") for what in ("position", "speed", "age")}
    assert direct["range_violated"] == {"position", "has_ahead", "has_behind"} | neighbours
    sides = ("ahead", "behind", "leader")
    assert direct["degraded"] == {f"has_{side}" for side in sides} | {f"{side}_age" for side in sides}
    entry = root.find("VendorAnnotations/Tool/component")
    optional = entry.get("optionalInputs").split()
    assert {"ahead_position", "has_leader", "line_resistance"} <= set(optional)
    assert {"position", "speed", "target_speed"}.isdisjoint(optional)
    assert "figure-consistent" in entry.get("note")
    assert entry.get("recommendedStep") == root.find("DefaultExperiment").get("stepSize") == "0.1"


def test_arrays_have_structured_names_and_their_own_dependencies(model, sample):
    root = model(sample("Chain"), {"masses": 4})
    direct, initial = unknowns(root, "Outputs"), unknowns(root, "InitialUnknowns")
    assert {f"position[{k}]" for k in range(1, 5)} | {f"tension[{k}]" for k in range(1, 4)} | {"momentum"} == set(
        direct
    )
    assert direct["tension[1]"] == set()
    assert initial["tension[2]"] == {"stiffness[2]", "position_start[2]", "position_start[3]"}
    assert initial["momentum"] == {"mass", *(f"speed_start[{k}]" for k in range(1, 5))}
    assert initial["position[3]"] == {"position_start[3]"}


def test_an_array_of_two_axes(model, write_component):
    reference = write_component(
        "from railcosim.components import Component, Input, Output\n\n\n"
        "class C(Component):\n"
        "    u = Input('m', [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], shape=(2, 3))\n"
        "    y = Output('m', shape=(2,))\n\n"
        "    def outputs(self):\n"
        "        return {'y': self.u[:, 2]}\n"
    )
    root = model(reference)
    assert validate_fmu(str(build(reference))) == []
    starts = {name: v["start"] for name, v in variables(root).items() if "start" in v}
    assert starts == {
        "u[1,1]": "1.0",
        "u[1,2]": "2.0",
        "u[1,3]": "3.0",
        "u[2,1]": "4.0",
        "u[2,2]": "5.0",
        "u[2,3]": "6.0",
    }
    assert unknowns(root, "Outputs") == {"y[1]": {"u[1,3]"}, "y[2]": {"u[2,3]"}}


def test_types_tunable_parameters_and_bounds(model, sample):
    found = variables(model(sample("Types")))
    assert found["gain"]["variability"] == "tunable"
    assert found["label"]["variability"] == "fixed"
    assert (found["gear_ratio"]["min"], found["gear_ratio"]["max"], found["gear_ratio"]["start"]) == ("1", "9", "2")
    assert (found["label"]["type"], found["label"]["start"]) == ("String", "train")
    assert (found["doors[2]"]["type"], found["doors[2]"]["start"]) == ("Boolean", "false")
    assert unknowns(model(sample("Types")), "Outputs")["shift"] == {"offset"}


def test_a_computed_start_is_calculated_and_depends_on_what_computes_it(model, sample):
    root = model(sample("Estimator"))
    found = variables(root)
    assert found["estimate"]["initial"] == found["innovation"]["initial"] == "calculated"
    assert unknowns(root, "InitialUnknowns") == {"estimate": {"measured", "bias"}, "error": {"measured", "bias"}}
    assert unknowns(root, "Outputs") == {"estimate": set(), "error": {"measured"}}


def test_a_sampled_block_says_its_step(model, sample):
    root = model(sample("Counter"))
    assert root.find("DefaultExperiment").get("stepSize") == "0.1"
    assert root.find("VendorAnnotations/Tool/component").get("sampled") == "true"
    assert unknowns(root, "Outputs") == {
        "through": {"u"},
        "count": set(),
        "total": set(),
        "last_time": set(),
        "last_step": set(),
    }


# ---------------------------------------------------------------- what cannot be described


def test_the_name_of_a_start_value_that_is_taken_is_refused_unless_the_start_is_computed(write_component, model):
    text = (
        "from railcosim.components import Component, Memory, Parameter\n\n\n"
        "class C(Component):\n"
        "    m_start = Parameter('m', 2.0)\n"
        "    m = Memory('m', output=True)\n\n"
        "    def update(self):\n"
        "        return {'m': self.m}\n"
    )
    with pytest.raises(ComponentError, match=r"C\.m_start is the name of m's start value; choose another, or let init"):
        build(write_component(text))
    root = model(write_component(text + "\n    def initial(self):\n        return {'m': self.m_start}\n", folder="b"))
    assert unknowns(root, "InitialUnknowns") == {"m": {"m_start"}}


def test_a_name_that_fmi_does_not_know_is_refused(write_component):
    reference = write_component(
        "from railcosim.components import Component, Parameter\n\n\nclass C(Component):\n    größe = Parameter('m')\n"
    )
    with pytest.raises(ComponentError, match="C: FMI allows ASCII letters, digits and _ in names; rename 'größe'"):
        build(reference)


BRANCHING = (
    "from railcosim.components import Component, Input, Output\n\n\n"
    "class C(Component):\n"
    "    u = Input('m')\n"
    "    y = Output('m')\n\n"
    "    def outputs(self):\n"
    "        return {'y': self.u if self.u > 0.0 else 0.0}\n"
)


def test_equations_that_cannot_be_traced_are_refused(write_component):
    with pytest.raises(ComponentError, match=r"C\.outputs: .* use railcosim\.components\.maths"):
        build(write_component(BRANCHING))


def test_a_python_only_component_leaves_its_dependencies_unknown(write_component, model):
    text = BRANCHING.replace("    u = Input", "    requires = ('scipy',)\n    u = Input")
    reference = write_component(text)
    root = model(reference)
    assert validate_fmu(str(build(reference))) == []
    assert unknowns(root, "Outputs") == unknowns(root, "InitialUnknowns") == {"y": None}
    assert root.find("VendorAnnotations/Tool/component").get("requires") == "scipy"


def test_value_references_are_those_of_the_slave(reference):
    """The slave inside the FMU numbers with the function it carries: the same file, byte for byte."""
    with zipfile.ZipFile(build(reference)) as archive:
        (carried,) = [name for name in archive.namelist() if name.endswith("fmus/variables.py")]
        text = archive.read(carried).decode()
    assert text == (Path(__file__).parents[2] / "fmus" / "variables.py").read_text(encoding="utf-8")
    numbers = [v.reference for v in scalar_variables(resolve(reference)())]
    assert numbers == list(range(len(numbers)))
