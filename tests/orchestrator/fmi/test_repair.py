"""Faults of real model descriptions: what is meant is read, and told; nothing is taken for another thing in silence."""

import pytest
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi.interface import Unit
from railcosim.orchestrator.fmi.reader import read_interface

HEAD = '<?xml version="1.0"?>\n<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}">'
TAIL = "</fmiModelDescription>"
SIMULATION = '<CoSimulation modelIdentifier="M"/>'
U = '<ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>'
Y = '<ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>'
OUTPUT = '<Outputs><Unknown index="2"/></Outputs><InitialUnknowns><Unknown index="2"/></InitialUnknowns>'


@pytest.fixture
def reading(tmp_path):
    """Read a description of given parts."""

    def parse(variables=U + Y, structure=OUTPUT, before="", *, head=HEAD, simulation=SIMULATION):
        variables = f"<ModelVariables>{variables}</ModelVariables>"
        text = f"{head}{simulation}{before}{variables}<ModelStructure>{structure}</ModelStructure>{TAIL}"
        (tmp_path / "modelDescription.xml").write_text(text, encoding="utf-8")
        return read_interface(tmp_path, "their.fmu")

    return parse


def told(interface):
    assert all(warning.startswith("their.fmu: ") for warning in interface.warnings)
    return [warning.removeprefix("their.fmu: ") for warning in interface.warnings]


def variable(text, *, name="p", kind='<Real start="1"/>', reference="7"):
    return U + Y + f'<ScalarVariable name="{name}" valueReference="{reference}" {text}>{kind}</ScalarVariable>'


def test_nothing_is_wrong(reading):
    assert reading().warnings == ()


# -------------------------------------------------------------------- causality and variability


@pytest.mark.parametrize(
    ("text", "expected", "warning"),
    [
        (
            'causality="parameter"',
            ("parameter", "fixed", True),
            'the parameter "p" does not say whether it is fixed; it is taken to be',
        ),
        (
            'causality="parameter" variability="constant"',
            ("parameter", "constant", False),
            '"p" is constant though its causality is parameter',
        ),
        (
            'causality="input" variability="fixed"',
            ("input", "fixed", True),
            '"p" is fixed though its causality is input',
        ),
        ('causality="none"', ("local", "continuous", False), 'causality="none" of "p" is taken for local'),
        ('variability="always"', ("local", "continuous", False), 'variability="always" of "p" is left out'),
    ],
)
def test_what_does_not_go_together(reading, text, expected, warning):
    it = reading(variable(text))
    assert told(it)[0] == warning
    p = it.variables["p"]
    assert (p.causality, p.variability, p.settable) == expected


# -------------------------------------------------------------------- values


@pytest.mark.parametrize(
    ("kind", "start", "warning"),
    [
        ('<Integer start="3.0"/>', 3, 'the start value "3.0" of "p" is taken for 3'),
        ('<Integer start="3.5"/>', None, 'the start value "3.5" of "p" is no Integer; it is left out'),
        ('<Real start="3,5"/>', None, 'the start value "3,5" of "p" is no Real; it is left out'),
        ('<Real start=""/>', None, 'the start value "" of "p" is no Real; it is left out'),
        ('<Boolean start="TRUE"/>', True, 'start="TRUE" is taken for true'),
        ('<Boolean start="yes"/>', None, 'the start value "yes" of "p" is no Boolean; it is left out'),
    ],
)
def test_start_values(reading, kind, start, warning):
    it = reading(variable('causality="parameter" variability="fixed"', kind=kind))
    assert told(it)[0] == warning
    assert it.variables["p"].start == start


def test_bounds(reading):
    it = reading(variable('causality="parameter" variability="fixed"', kind='<Real start="1" min="none" max="INF"/>'))
    assert (it.variables["p"].minimum, it.variables["p"].maximum) == (None, float("inf"))
    assert told(it) == ['"p" has min="none", which is no number; it is left out']


def test_capabilities(reading):
    it = reading(
        simulation='<CoSimulation modelIdentifier="M" canGetAndSetFMUstate="True" maxOutputDerivativeOrder=""/>'
    )
    assert it.can_save_state
    assert told(it)[0] == 'canGetAndSetFMUstate="True" is taken for true'


def test_names(reading):
    it = reading(U + Y + Y.replace('"1"', '"2"') + Y.replace(' name="y"', ""))
    assert list(it.variables) == ["u", "y", "y (2)", "variable_4"]
    assert [it.variables[name].reference for name in it.variables] == [0, 1, 2, 1]
    assert told(it) == [
        'there are several variables "y"; this one is called "y (2)"',
        'variable number 4 has no name; it is called "variable_4"',
    ]


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"kind": ""}, 'the variable "p" has no type'),  # FMPy takes it for one of the type of the variable before
        ({"reference": "-2"}, 'the variable "p" has the value reference "-2"'),
        ({"reference": "4294967296"}, 'the variable "p" has the value reference "4294967296"'),
    ],
)
def test_what_cannot_be_used(reading, how, message):
    with pytest.raises(FmuFileError) as caught:
        reading(variable('causality="output"', **how))
    assert str(caught.value) == f"their.fmu: its modelDescription.xml cannot be used: {message}"


# -------------------------------------------------------------------- types and units


TYPES = (
    '<TypeDefinitions><SimpleType name="Force"><Real unit="N" min="0" max="9" nominal="3"{}/></SimpleType>'
    '<SimpleType name="Gear"><Enumeration><Item name="low" value="1"/><Item name="high" value="3"/></Enumeration>'
    "</SimpleType></TypeDefinitions>"
)
UNITS = '<UnitDefinitions><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit></UnitDefinitions>'


def test_a_variable_has_what_its_type_says(reading):
    own = '<Real start="1" declaredType="Force" nominal="5"/>'
    it = reading(
        variable('causality="input"', kind=own) + variable("", name="g", kind='<Integer declaredType="Gear"/>'),
        before=UNITS + TYPES.format(""),
    )
    p = it.variables["p"]
    assert (p.unit, p.minimum, p.maximum, p.nominal) == ("N", 0.0, 9.0, 5.0)
    assert it.variables["g"].choices == (("low", 1), ("high", 3))
    assert (it.variables["u"].nominal, it.variables["u"].choices) == (None, ())


def test_differences_of_quantities(reading):
    types = TYPES.format(' relativeQuantity="true"')
    kinds = {
        "a": '<Real start="1" declaredType="Force"/>',
        "b": '<Real start="1" declaredType="Force" relativeQuantity="false"/>',
        "c": '<Real start="1" relativeQuantity="1"/>',
    }
    text = "".join(variable('causality="input"', name=name, kind=kind)[len(U + Y) :] for name, kind in kinds.items())
    it = reading(U + Y + text, before=UNITS + types)
    assert [it.variables[name].relative for name in ("u", "a", "b", "c")] == [False, True, False, True]


def test_types_that_are_not_defined(reading):
    kind = '<Real start="1" declaredType="Farce"/>'
    it = reading(
        variable('causality="input"', kind=kind), before='<TypeDefinitions><SimpleType name="T"/></TypeDefinitions>'
    )
    assert told(it)[:2] == ['the type "T" is not defined', 'the type "Farce" of "p" is not defined']


def test_items_without_a_number(reading):
    types = TYPES.format("").replace(' value="3"', "")
    it = reading(variable("", kind='<Enumeration declaredType="Gear"/>'), before=UNITS + types)
    assert it.variables["p"].choices == (("low", 1), ("high", 2))
    assert '"high", an item of the type "Gear", is taken for number 2' in told(it)


def test_types_with_attributes_of_somebody_s_own(reading):
    it = reading(variable('causality="input"'), before=UNITS + TYPES.format(' colour="red"'))
    assert told(it) == ['the type "Force" has an attribute "colour", which the standard does not know']


@pytest.mark.parametrize(
    ("base", "expected", "warned"),
    [
        ('m="1.0" s="-2"', (0, 1, -2, 0, 0, 0, 0, 0), False),
        ('m="0.5"', None, True),
        ('m="1" factor="0"', None, True),
        ('m="1" factor="much"', None, True),
        ('m="1" factor="INF"', None, True),
    ],
)
def test_units(reading, base, expected, warned):
    it = reading(before=f'<UnitDefinitions><Unit name="x"><BaseUnit {base}/></Unit></UnitDefinitions>')
    assert it.units["x"] == Unit("x", expected)
    assert told(it) == [f'the definition of the unit "x" cannot be used ({base}); it converts to no other'] * warned


def test_a_display_unit_of_a_unit_that_is_not_defined(reading):
    """FMPy's check fails itself there, and tells no more than the unit's name."""
    it = reading(variable('causality="input"', kind='<Real start="1" unit="-" displayUnit="rpm"/>'))
    assert told(it) == [
        'the display unit of "p" is left out: its unit "-" is not defined',
        'The unit "-" of variable "p" (line 2) is not defined.',
    ]


# -------------------------------------------------------------------- model structure


@pytest.mark.parametrize(
    ("unknown", "expected", "warning"),
    [
        ('index="2" dependencies=" 1  2 "', {"u", "y"}, None),
        ('index="2" dependencies=""', set(), None),
        ('index="2" dependencies="1 4294967295"', {"u"}, 'variable number "4294967295": there is none'),
        ('index="2" dependencies="0"', None, 'variable number "0": there is none'),  # for FMPy, the last one
        ('index="2" dependencies="u"', None, 'variable number "u": there is none'),
        ('index="0" dependencies="1"', None, 'Outputs lists variable number "0": there is none'),
        ('index="9" dependencies="1"', None, 'Outputs lists variable number "9": there is none'),
    ],
)
def test_dependencies(reading, unknown, expected, warning):
    it = reading(structure=f"<Outputs><Unknown {unknown}/></Outputs>")
    assert it.variables["y"].dependencies == expected
    assert told(it)[0].endswith(warning) if warning else not it.warnings


def test_no_structure_at_all(tmp_path):
    text = f"{HEAD}{SIMULATION}<ModelVariables>{U}{Y}</ModelVariables>{TAIL}"
    (tmp_path / "modelDescription.xml").write_text(text, encoding="utf-8")
    it = read_interface(tmp_path, "their.fmu")
    assert it.variables["y"].dependencies is None
    assert "Expected is ( ModelStructure )" in told(it)[0]


def test_a_derivative_of_nothing(reading):
    it = reading(variable('causality="local"', kind='<Real derivative="12"/>'))
    assert told(it) == ['"p" is to be the derivative of variable number "12": there is none']


# -------------------------------------------------------------------- the head


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ('modelName="M" ', "", "it has no modelName"),
        (' guid="{1}"', "", "it has no guid"),
        ('fmiVersion="2.0"', 'fmiVersion="2.0.4"', 'fmiVersion="2.0.4" is taken for 2.0'),
    ],
)
def test_the_head(reading, old, new, warning):
    assert told(reading(head=HEAD.replace(old, new))) == [warning]


def test_what_is_no_number_in_the_experiment(reading):
    it = reading(before='<DefaultExperiment stepSize="1 ms" stopTime="3"/>')
    assert (it.default_step, it.default_stop) == (None, 3.0)
    assert told(it) == ['the default experiment has stepSize="1 ms", which is no number; it is left out']


def test_no_variables_at_all(tmp_path):
    (tmp_path / "modelDescription.xml").write_text(f"{HEAD}{SIMULATION}<ModelStructure/>{TAIL}", encoding="utf-8")
    it = read_interface(tmp_path, "their.fmu")
    assert (dict(it.variables), told(it)[0]) == ({}, "it lists no variables")


def test_what_is_alike_is_told_once(reading):
    text = "".join(variable('causality="parameter"', name=f"p{k}")[len(U + Y) :] for k in range(100))
    it = reading(U + Y + text)
    assert told(it) == ['the parameter "p0" does not say whether it is fixed; it is taken to be (and 99 more like it)']
