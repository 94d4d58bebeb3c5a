"""Component -> ``modelDescription.xml``: one writer for every kind of FMU."""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from lxml import etree

from ..components.component import Component
from ..components.declarations import Input, Memory, Parameter, State
from ..components.tracing import Names, TracingError, dependencies, initial_dependencies
from .units import BASE, parse
from .variables import ScalarVariable, scalar_variables

Kind = Literal["python"]
TOOL = "railcosim"
_ELEMENT = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}
_NOTE_OF_KIND: dict[Kind, str] = {"python": "runs in the importing process's Python: needs Python 3.11+ and NumPy there"}


@dataclass(frozen=True)
class Structure:
    """What depends on what, found by running the equations; None where they cannot be traced.

    Attributes:
        direct: for each scalar output, the inputs it depends on at one instant.
        initial: for each scalar that is computed at the start, what it follows from.
        computed: scalars of State and Memory that ``initial`` computes.
    """

    direct: Mapping[str, Names] | None
    initial: Mapping[str, Names] | None
    computed: frozenset[str]


def structure(component: Component) -> Structure:
    """Trace a component; one that reads values as plain numbers (a Python-only one) keeps its dependencies unknown."""
    try:
        inputs = {name for slot in component.of(Input) for name in slot.scalars}
        direct = {name: sources & inputs for name, sources in dependencies(component).items()}
        computed, initial = initial_dependencies(component)
        return Structure(direct, {**computed, **initial}, frozenset(computed))
    except TracingError:
        if not component.requires:
            raise
        started = component.initial()
        names = frozenset(n for s in component.of(State, Memory) if s.name in started for n in s.scalars)
        return Structure(None, None, names)


def write(component: Component, kind: Kind, digest: str) -> bytes:
    """The model description of a component's FMU.

    Args:
        component: built with its arguments; its values are the start values.
        kind: how it is packaged.
        digest: hash of everything in the FMU; it becomes the GUID.
    """
    cls = type(component)
    variables = scalar_variables(component)
    traced = structure(component)
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=cls.__name__,
        guid="{" + digest[:32] + "}",
        description=summary(cls),
        version=digest[:12],
        license="MIT" if cls.__module__.startswith(__package__.rpartition(".")[0]) else "",
        generationTool=f"{TOOL} {importlib.metadata.version(TOOL)}",
        variableNamingConvention="structured",
    )
    if not root.get("license"):
        del root.attrib["license"]
    etree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=cls.__name__,
        needsExecutionTool="true" if kind == "python" else "false",
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    _write_units(root, variables)
    step = cls.recommended_step or component.__dict__.get("sample_time") or component.__dict__.get("max_step") or 0.1
    etree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=_number(step))
    annotations = etree.SubElement(root, "VendorAnnotations")
    tool = etree.SubElement(annotations, "Tool", name=TOOL)
    etree.SubElement(tool, "component", **_annotation(component, kind, digest))
    block = etree.SubElement(root, "ModelVariables")
    for variable in variables:
        _write_variable(block, variable, component, traced)
    _write_structure(root, variables, traced)
    text: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return text


def summary(cls: type[Component]) -> str:
    """First line of the class's docstring."""
    return (cls.__doc__ or cls.__name__).strip().splitlines()[0]


def _annotation(component: Component, kind: Kind, digest: str) -> dict[str, str]:
    cls = type(component)
    optional = [n for s in component.of(Input) if s.declaration.optional for n in s.scalars]  # type: ignore[attr-defined]
    fields = {
        "name": cls.__name__,
        "arguments": json.dumps(component.build_arguments, sort_keys=True),
        "digest": digest,
        "kind": kind,
        "kindNote": _NOTE_OF_KIND[kind],
        "source": cls.source,
        "note": cls.note,
        "requires": " ".join(cls.requires),
        "optionalInputs": " ".join(optional),
        "recommendedStep": "" if cls.recommended_step is None else _number(cls.recommended_step),
        "sampled": "true" if component.is_sampled else "",
    }
    return {name: value for name, value in fields.items() if value}


def _write_units(root: Any, variables: Iterable[ScalarVariable]) -> None:
    names = sorted({v.slot.unit for v in variables if v.slot.type is float and v.slot.unit != "1"})
    if not names:
        return
    block = etree.SubElement(root, "UnitDefinitions")
    for name in names:
        meaning = parse(name)
        exponents = {base: str(e) for base, e in zip(BASE, meaning.exponents, strict=True) if e}
        scale = {} if meaning.factor == 1.0 else {"factor": _number(meaning.factor)}
        shift = {} if meaning.offset == 0.0 else {"offset": _number(meaning.offset)}
        etree.SubElement(etree.SubElement(block, "Unit", name=name), "BaseUnit", **exponents, **scale, **shift)


def initial_kind(variable: ScalarVariable, traced: Structure) -> str | None:
    """FMI ``initial``: only parameters and states that nothing computes are exact; inputs have none."""
    declaration = variable.slot.declaration
    if isinstance(declaration, Input):
        return None
    if isinstance(declaration, Parameter):
        return "exact"
    if isinstance(declaration, State | Memory) and variable.name not in traced.computed:
        return "exact"
    return "calculated"


def _write_variable(block: Any, variable: ScalarVariable, component: Component, traced: Structure) -> None:
    declaration, slot = variable.slot.declaration, variable.slot
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": declaration.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    initial = initial_kind(variable, traced)
    if initial is not None:
        attributes["initial"] = initial
    element = etree.SubElement(
        etree.SubElement(block, "ScalarVariable", **{k: v for k, v in attributes.items() if v}), _ELEMENT[slot.type]
    )
    if slot.type is float and slot.unit != "1":
        element.set("unit", slot.unit)
    if slot.type in (float, int):
        for bound, value in (("min", declaration.minimum), ("max", declaration.maximum)):
            if value is not None:
                element.set(bound, _number(value) if slot.type is float else str(int(value)))
    if initial != "calculated":
        value = component.__dict__[slot.name]
        element.set("start", _text(value if variable.element is None else np.ravel(value)[variable.element]))


def _write_structure(root: Any, variables: tuple[ScalarVariable, ...], traced: Structure) -> None:
    block = etree.SubElement(root, "ModelStructure")
    index = {v.name: str(k + 1) for k, v in enumerate(variables)}
    knowns = {v.name for v in variables if v.causality == "input" or initial_kind(v, traced) == "exact"}
    shown = [v for v in variables if v.causality == "output"]
    unknowns = [v for v in shown if initial_kind(v, traced) == "calculated"]
    for tag, members, sources in (("Outputs", shown, traced.direct), ("InitialUnknowns", unknowns, traced.initial)):
        if not members:
            continue
        parent = etree.SubElement(block, tag)
        for variable in members:
            entry = etree.SubElement(parent, "Unknown", index=index[variable.name])
            if sources is not None:
                names = sources.get(variable.name, frozenset()) & knowns
                entry.set("dependencies", " ".join(sorted((index[n] for n in names), key=int)))


def _text(value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    return value if isinstance(value, str) else _number(value)


def _number(value: Any) -> str:
    return str(int(value)) if isinstance(value, int | np.integer) else repr(float(value))
