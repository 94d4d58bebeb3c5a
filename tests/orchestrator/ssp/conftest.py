"""Small SSP archives, and FMUs for them that need not run."""

import io
import zipfile
from textwrap import indent

import pytest
from railcosim.orchestrator.ssp import read_system

NAMES = " ".join(
    f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for short, name in (
        ("ssc", "Common"),
        ("ssd", "Description"),
        ("ssv", "ParameterValues"),
        ("ssm", "ParameterMapping"),
        ("ssb", "SignalDictionary"),
    )
)
UNITS = """
<ssd:Units>
  <ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit>
  <ssc:Unit name="km/h"><ssc:BaseUnit m="1" s="-1" factor="0.2777777777777778"/></ssc:Unit>
  <ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>
</ssd:Units>"""
_VARIABLES = (
    ("u", 0, "input", "continuous", 'Real start="0" unit="m/s"'),
    ("y", 1, "output", "continuous", 'Real unit="m/s"'),
    ("z", 2, "output", "continuous", 'Real unit="km/h"'),
    ("k", 3, "parameter", "tunable", 'Real start="1"'),
    ("top.v", 4, "parameter", "fixed", 'Real start="1" unit="m/s"'),
    ("n", 0, "input", "discrete", 'Integer start="0"'),
    ("m", 1, "output", "discrete", "Integer"),
    ("on", 2, "input", "discrete", 'Boolean start="false"'),
    ("off", 3, "output", "discrete", "Boolean"),
    ("label", 0, "parameter", "fixed", 'String start=""'),
    ("c", 9, "calculatedParameter", "fixed", "Real"),
)
_FMU = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Gadget" guid="{1}">
<CoSimulation modelIdentifier="Gadget" canGetAndSetFMUstate="true"/>
<UnitDefinitions><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
<Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit></UnitDefinitions>
<DefaultExperiment stopTime="20" stepSize="0.05"/>
<ModelVariables>{}</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/><Unknown index="3"/><Unknown index="7"/><Unknown index="9"/></Outputs>
</ModelStructure></fmiModelDescription>"""


def packed(files):
    """A zip archive as bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()


_ROW = '<ScalarVariable name="{}" valueReference="{}" causality="{}" variability="{}"><{}/></ScalarVariable>'
DESCRIPTION = _FMU.replace("{}", "".join(_ROW.format(*each) for each in _VARIABLES))
GADGET = packed({"modelDescription.xml": DESCRIPTION})
"""u, y in m/s, z in km/h, k and top.v, whole numbers n and m, truths on and off, a text, a calculated parameter c."""


def structure(inside, after=UNITS, name="root", version="1.0"):
    """A system structure description."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<ssd:SystemStructureDescription {NAMES} name="{name}" '
        f'version="{version}">\n<ssd:System name="root">\n{inside}\n</ssd:System>{after}\n'
        "</ssd:SystemStructureDescription>"
    )


def connectors(**kinds):
    """The connectors of an element: their kinds by name, a unit after a blank."""
    made = []
    for name, text in kinds.items():
        kind, _, unit = text.partition(" ")
        type_ = f'<ssc:Real unit="{unit}"/>' if unit else ""
        made.append(f'<ssd:Connector name="{name}" kind="{kind}">{type_}</ssd:Connector>')
    return f"<ssd:Connectors>{''.join(made)}</ssd:Connectors>"


def component(name, bindings="", source="resources/gadget.fmu", shown=None, **attributes):
    """A component of the gadget."""
    own = "".join(f' {key}="{value}"' for key, value in attributes.items())
    where = "" if source is None else f' source="{source}"'
    shown = shown or connectors(
        u="input", y="output", z="output", n="input", m="output", on="input", off="output", k="parameter"
    )
    return f'<ssd:Component name="{name}"{where}{own}>{shown}{bindings}</ssd:Component>'


def connection(start, end, inside="", **attributes):
    """``"a.y"`` to ``"b.u"``; a name without a dot is the system's own."""
    ends = []
    for which, text in (("start", start), ("end", end)):
        element, _, name = text.rpartition(".")
        ends.append((f'{which}Element="{element}" ' if element else "") + f'{which}Connector="{name}"')
    own = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<ssd:Connection {' '.join(ends)}{own}>{inside}</ssd:Connection>"


def parameters(*values, units=""):
    """A parameter set: name, type and attributes of each."""
    rows = "".join(f'<ssv:Parameter name="{name}">{typed}</ssv:Parameter>' for name, typed in values)
    inside = f"<ssv:Parameters>{rows}</ssv:Parameters>{units}"
    return f'<ssv:ParameterSet {NAMES} version="1.0" name="p">{inside}</ssv:ParameterSet>'


def real(value, unit=None):
    """A real value."""
    return f'<ssv:Real value="{value}"' + (f' unit="{unit}"/>' if unit else "/>")


def binding(values, mapping="", **attributes):
    """One binding of inline values."""
    own = "".join(f' {key}="{value}"' for key, value in attributes.items())
    inline = f"<ssd:ParameterValues>{values}</ssd:ParameterValues>" if values else ""
    return f"<ssd:ParameterBinding{own}>{inline}{mapping}</ssd:ParameterBinding>"


def bindings(*each):
    """The bindings of an element."""
    return f"<ssd:ParameterBindings>{''.join(each)}</ssd:ParameterBindings>"


def mapping(*entries):
    """An inline mapping: source, target, transformation, attributes of each."""
    rows = "".join(
        f'<ssm:MappingEntry source="{source}" target="{target}"{more}>{inside}</ssm:MappingEntry>'
        for source, target, inside, more in entries
    )
    return f'<ssm:ParameterMapping {NAMES} version="1.0">{rows}</ssm:ParameterMapping>'


def system(elements, connections="", shown="", bound="", *, name=None, more=""):
    """The inside of a system; the whole of it where it has a name."""
    wires = f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    inside = f"{shown}{bound}<ssd:Elements>{indent(elements, ' ')}</ssd:Elements>{wires}{more}"
    return inside if name is None else f'<ssd:System name="{name}">{inside}</ssd:System>'


@pytest.fixture
def archive(tmp_path):
    """Writes an SSP; the gadget is in it."""

    def write(top, files=None, name="system.ssp"):
        own = {"SystemStructure.ssd": top} if isinstance(top, str) else top
        path = tmp_path / name
        path.write_bytes(packed({"resources/gadget.fmu": GADGET} | own | (files or {})))
        return str(path)

    return write


@pytest.fixture
def read(archive, tmp_path):
    """The system of an SSP."""

    def make(inside, files=None, after=UNITS, variant=""):
        return read_system(archive(structure(inside, after), files) + variant, tmp_path / "fmus")

    return make


def wires(found):
    """Connections in short: target, source, and what happens on the way."""
    return {
        one.target: (one.source, one.scale, one.offset, *((one.convert,) if not one.convert else ()))
        for one in found.connections
    }
