"""The documents of an SSP archive: its system structure (SSD 1.0) and parameter sets (SSV 1.0).

Prefixes are those that the standard's own examples have: libcosim and Ecos look for them, not for namespaces. Of
connectors only those are written that are connected, and outputs: FMPy takes an input that nothing leads to for
connected to whatever comes before it.
"""

from __future__ import annotations

import importlib.metadata
import re
from collections.abc import Mapping
from typing import Any

from lxml import etree

from ..fmi import Unit, Variable
from ..run import Checked
from ..scenario import dump_beside
from ..ssp import OWN
from ..system import TOGETHER
from ..wiring import Link
from .parts import Part

_SPACES = {
    **{
        short: f"http://ssp-standard.org/SSP1/SystemStructure{name}"
        for short, name in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"))
    },
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
    OWN: f"urn:{OWN}:ssp",
}
_OSP, _OMS = "com.opensimulationplatform", "org.openmodelica"
_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
SET = "initialValues"
"""The name of all parameter sets: Ecos applies those of the one name that it is asked for."""
_TOLERANCE = "0.0001"
"""What OMSimulator writes where none is given; its fixed-step master has no use for it."""


def system_structure(checked: Checked, parts: Mapping[str, Part]) -> bytes:
    """``SystemStructure.ssd``.

    Args:
        checked: what is written.
        parts: its instances, by name.
    """
    system = checked.system
    came, stepping = system.provenance, system.stepping
    root = _root("ssd:SystemStructureDescription", {"name": came.title or came.name})
    name = re.sub(r"\W", "_", came.name, flags=re.ASCII)
    top = _below(root, "ssd:System", {"name": name, **({"description": came.description} if came.description else {})})
    units, ends = _units(parts), _ends(checked)
    elements = _below(top, "ssd:Elements")
    for part in parts.values():
        _component(elements, part, units, ends[part.instance.name], stepping.step)
    if checked.wiring.links:
        connections = _below(top, "ssd:Connections")
        for link in checked.wiring.links:
            _connection(connections, link, parts)
    information = _below(
        _annotation(_below(top, "ssd:Annotations"), _OMS, "oms:Annotations"), "oms:SimulationInformation"
    )
    facts = {"description": "oms-ma", "stepSize": repr(float(stepping.step))}
    facts |= {"absoluteTolerance": _TOLERANCE, "relativeTolerance": _TOLERANCE}
    _below(information, "oms:FixedStepMaster", facts)
    _enumerations(root, parts, ends)
    if units:
        definitions = _below(root, "ssd:Units")
        for unit in units.values():
            _below(_below(definitions, "ssc:Unit", {"name": unit.name}), "ssc:BaseUnit", _base(unit))
    times = {"startTime": repr(float(stepping.start_time)), "stopTime": repr(float(stepping.stop_time))}
    experiment = _below(_below(root, "ssd:DefaultExperiment", times), "ssd:Annotations")
    fixed = {"baseStepSize": repr(float(stepping.step))}
    _below(_annotation(experiment, _OSP, "osp:Algorithm"), "osp:FixedStepAlgorithm", fixed)
    _annotation(_below(root, "ssd:Annotations"), OWN, f"{OWN}:Scenario").text = f"\n{dump_beside(system)}"
    return _text(root)


def parameter_set(part: Part) -> bytes:
    """The start values of an instance, ``NAME.ssv``."""
    root = _root("ssv:ParameterSet", {"name": SET})
    parameters = _below(root, "ssv:Parameters")
    for variable, value in part.values():
        parameter = _below(parameters, "ssv:Parameter", {"name": variable.name})
        _below(parameter, f"ssv:{variable.type}", {"value": value})
    return _text(root)


def _component(elements: Any, part: Part, units: Mapping[str, Unit], ends: set[str], step: float) -> None:
    facts = {"name": part.name, "type": "application/x-fmu-sharedlibrary", "source": f"resources/{part.source}"}
    component = _below(elements, "ssd:Component", facts | {"implementation": "CoSimulation"})
    shown = [v for v in part.interface.variables.values() if v.name in ends or _is_shown(v)]
    if shown:
        connectors = _below(component, "ssd:Connectors")
    for variable in shown:
        connector = _below(connectors, "ssd:Connector", {"name": variable.name, "kind": variable.causality})
        typed = {"unit": variable.unit} if variable.type == "Real" and variable.unit in units and variable.unit else {}
        if variable.type == "Enumeration":
            typed = {"name": f"{part.name}.{variable.name}"}
        _below(connector, f"ssc:{variable.type}", typed)
    if part.starts:
        bindings = _below(component, "ssd:ParameterBindings")
        _below(bindings, "ssd:ParameterBinding", {"source": f"resources/{part.name}.ssv"})
    annotations, instance = _below(component, "ssd:Annotations"), part.instance
    own = {"name": instance.name}
    own |= {key: "true" for key in ("isolate", "swapped") if getattr(instance, key)}
    own |= {"isolate": TOGETHER} if instance.isolate == TOGETHER else {}
    for key in ("step_timeout", "memory_limit"):
        if (value := getattr(instance, key)) is not None:
            own[key] = repr(float(value))
    kept = _annotation(annotations, OWN, f"{OWN}:Instance", own)
    for name, value in part.left.items():
        _below(kept, f"{OWN}:Left", {"name": name, "value": repr(value).lower()})
    if instance.step not in (None, step):
        _annotation(annotations, _OSP, "osp:StepSizeHint", {"value": repr(float(instance.step or step))})


def _is_shown(variable: Variable) -> bool:
    """Outputs are, but for Strings, which hardly a tool hands on, and enumerations, which stop libcosim."""
    return variable.causality == "output" and variable.type in ("Real", "Integer", "Boolean")


def _connection(connections: Any, link: Link, parts: Mapping[str, Part]) -> None:
    facts: dict[str, str] = {}
    for which, end in (("start", link.source), ("end", link.target)):
        facts |= {f"{which}Element": parts[end.instance].name, f"{which}Connector": end.variable}
    a, b = (parts[end.instance].interface.variables[end.variable] for end in (link.source, link.target))
    # Not every tool converts units: what comes of it stands in the transformation, and none is to convert once more.
    if not link.connection.convert or (a.unit is not None and b.unit is not None and a.unit != b.unit):
        facts["suppressUnitConversion"] = "true"
    connection = _below(connections, "ssd:Connection", facts)
    if link.mapping is not None:
        table = _below(connection, f"ssc:{a.type}MappingTransformation")
        for source, target in (link.connection.map or {}).items():
            _below(table, "ssc:MapEntry", {"source": source, "target": _entry(target)})
    elif (link.scale, link.offset) != (1.0, 0.0):
        _below(connection, "ssc:LinearTransformation", {"factor": repr(link.scale), "offset": repr(link.offset)})
    own = {"delay": str(link.delay)} if link.delay else {}
    if link.threshold is not None:
        own["threshold"] = repr(float(link.threshold))
    if own:
        _annotation(_below(connection, "ssd:Annotations"), OWN, f"{OWN}:Connection", own)


def _entry(value: bool | int | str) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _enumerations(root: Any, parts: Mapping[str, Part], ends: Mapping[str, set[str]]) -> None:
    """The items of what is connected, under the names that connectors refer to."""
    used = [
        (f"{part.name}.{name}", part.interface.variables[name].choices)
        for part in parts.values()
        for name in sorted(ends[part.instance.name])
        if part.interface.variables[name].type == "Enumeration"
    ]
    definitions = _below(root, "ssd:Enumerations") if used else None
    for name, choices in used:
        enumeration = _below(definitions, "ssc:Enumeration", {"name": name})
        for item, number in choices:
            _below(enumeration, "ssc:Item", {"name": item, "value": str(number)})


def _ends(checked: Checked) -> dict[str, set[str]]:
    """The connected variables of every instance."""
    ends: dict[str, set[str]] = {name: set() for name in checked.models}
    for link in checked.wiring.links:
        for end in (link.source, link.target):
            ends[end.instance].add(end.variable)
    return ends


def _units(parts: Mapping[str, Part]) -> dict[str, Unit]:
    """Units that FMUs define; one that two of them define differently is left out."""
    units: dict[str, Unit] = {}
    unclear = set()
    for part in parts.values():
        for unit in part.interface.units.values():
            if unit.exponents is None or units.setdefault(unit.name, unit) != unit:
                unclear.add(unit.name)
    return {name: unit for name, unit in units.items() if name not in unclear}


def _base(unit: Unit) -> dict[str, str]:
    base = {name: str(n) for name, n in zip(_EXPONENTS, unit.exponents or (), strict=True) if n}
    return base | {
        key: repr(float(value))
        for key, value, usual in (("factor", unit.factor, 1.0), ("offset", unit.offset, 0.0))
        if value != usual
    }


def _root(name: str, facts: Mapping[str, str]) -> Any:
    tool = f"{OWN} {importlib.metadata.version('railcosim')}"
    spaces = _SPACES if name.startswith("ssd:") else {"ssv": _SPACES["ssv"], "ssc": _SPACES["ssc"]}
    return etree.Element(_tag(name), {"version": "1.0", **facts, "generationTool": tool}, nsmap=spaces)


def _annotation(annotations: Any, kind: str, name: str, facts: Mapping[str, str] | None = None) -> Any:
    return _below(_below(annotations, "ssc:Annotation", {"type": kind}), name, facts)


def _below(parent: Any, name: str, facts: Mapping[str, str] | None = None) -> Any:
    return etree.SubElement(parent, _tag(name), dict(facts or {}))


def _tag(name: str) -> str:
    space, _, local = name.partition(":")
    return f"{{{_SPACES[space]}}}{local}"


def _text(root: Any) -> bytes:
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))
