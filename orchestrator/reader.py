"""Reading ``modelDescription.xml`` into an `Interface`: tolerant of pedantry, and telling about it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, cast

from fmpy.model_description import ValidationError, read_model_description
from lxml import etree

from .errors import FmuFileError
from .interface import Interface, Type, Unit, Variable

_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_ELEMENT = re.compile(r"^(?P<array>.*)\[(?P<index>\d+(?:,\s*\d+)*)\]$")


def read(folder: Path, name: str) -> Interface:
    """The interface of an unpacked FMU.

    Args:
        folder: where it was unpacked.
        name: the file as the user knows it, for messages.

    Raises:
        FmuFileError: not an FMI 2.0 co-simulation FMU, or a description beyond repair.
    """
    root = _parse(folder / "modelDescription.xml", name)
    version = root.get("fmiVersion", "")
    if version != "2.0":
        raise FmuFileError(f"{name} is FMI {version or '?'}; this version of railcosim runs FMI 2.0 co-simulation FMUs")
    if root.find("CoSimulation") is None:
        raise FmuFileError(f"{name} has no co-simulation part (it is a model-exchange FMU)")
    description, warnings = _read(folder, name)
    try:
        return _interface(description, root, warnings)
    except (ValueError, TypeError, AttributeError) as error:
        raise FmuFileError(f"{name}: its modelDescription.xml cannot be used: {error}") from error


def _interface(description: Any, root: Any, warnings: list[str]) -> Interface:
    variables = {v.name: v for v in _variables(description)}
    simulation = description.coSimulation
    experiment = description.defaultExperiment
    return Interface(
        model=description.modelName,
        identifier=simulation.modelIdentifier,
        guid=description.guid,
        variables=variables,
        units={unit.name: unit for unit in map(_unit, description.unitDefinitions)},
        arrays=_arrays(variables),
        description=description.description or "",
        generator=description.generationTool or "",
        default_step=_number(experiment.stepSize) if experiment else None,
        default_stop=_number(experiment.stopTime) if experiment else None,
        can_save_state=bool(simulation.canGetAndSetFMUstate),
        can_serialize_state=bool(simulation.canGetAndSetFMUstate and simulation.canSerializeFMUstate),
        directional_derivatives=bool(simulation.providesDirectionalDerivative),
        interpolates_inputs=bool(simulation.canInterpolateInputs),
        variable_step=bool(simulation.canHandleVariableCommunicationStepSize),
        single_instance=bool(simulation.canBeInstantiatedOnlyOncePerProcess),
        needs_tool=bool(simulation.needsExecutionTool),
        vendor=_vendor(root),
        warnings=tuple(warnings),
    )


def _parse(path: Path, name: str) -> Any:
    try:
        parsed = etree.parse(str(path), etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:
        raise FmuFileError(f"{name}: its modelDescription.xml is not XML: {error}") from error
    # Asked of the parser, not searched for in the bytes: they may be in any encoding.
    if parsed.docinfo.internalDTD is not None:
        raise FmuFileError(f"{name} is refused: its modelDescription.xml has a DOCTYPE, which may declare XML entities")
    return parsed.getroot()


def _read(folder: Path, name: str) -> tuple[Any, list[str]]:
    try:
        return read_model_description(str(folder), validate=True), []
    except ValidationError as error:
        problems = [f"{name}: {problem}" for problem in error.problems]
    except Exception as error:
        problems = [f"{name}: {error}"]
    try:
        return read_model_description(str(folder), validate=False), problems
    except Exception as error:
        raise FmuFileError(f"{name}: its modelDescription.xml cannot be used: {error}") from error


def _variables(description: Any) -> list[Variable]:
    outputs = {unknown.variable.name: unknown for unknown in description.outputs}
    return [_variable(v, outputs.get(v.name)) for v in description.modelVariables]


def _variable(v: Any, unknown: Any) -> Variable:
    listed = None if unknown is None else unknown.dependencies
    unit = v.unit or (v.declaredType.unit if v.declaredType is not None else None)
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=cast(Type, v.type),
        causality=v.causality or "local",
        variability=v.variability or "continuous",
        initial=v.initial,
        start=_start(v),
        unit=None if unit in (None, "", "-", "1") else unit,
        minimum=_number(v.min),
        maximum=_number(v.max),
        description=v.description or "",
        dependencies=None if listed is None else frozenset(d.name for d in listed),
    )


def _start(v: Any) -> Any:
    if v.start is None:
        return None
    text = str(v.start)
    if v.type == "Real":
        return _number(text)
    if v.type in ("Integer", "Enumeration"):
        return int(text)
    if v.type == "Boolean":
        return text in ("true", "1", "True")
    return text


def _number(text: Any) -> float | None:
    return None if text is None else float(text)


def _unit(unit: Any) -> Unit:
    base = unit.baseUnit
    if base is None:
        return Unit(unit.name, None)
    return Unit(unit.name, tuple(getattr(base, e) for e in _EXPONENTS), float(base.factor), float(base.offset))


def _arrays(variables: dict[str, Variable]) -> dict[str, tuple[str, ...]]:
    found: dict[str, list[tuple[tuple[int, ...], str]]] = {}
    for name in variables:
        match = _ELEMENT.match(name)
        if match:
            index = tuple(int(k) for k in match["index"].split(","))
            found.setdefault(match["array"], []).append((index, name))
    # By index, because a file may list the elements in any order.
    return {array: tuple(n for _, n in sorted(elements)) for array, elements in found.items() if array not in variables}


def _vendor(root: Any) -> dict[str, Any]:
    """Our own annotation, if the FMU is one of ours."""
    element = root.find("VendorAnnotations/Tool[@name='railcosim']/component")
    if element is None:
        return {}
    fields: dict[str, Any] = dict(element.attrib)
    step = fields.get("recommendedStep")
    return {
        "component": fields.get("name", ""),
        "arguments": json.loads(fields.get("arguments", "{}")),
        "digest": fields.get("digest", ""),
        "kind": fields.get("kind", ""),
        "kind_note": fields.get("kindNote", ""),
        "source": fields.get("source", ""),
        "note": fields.get("note", ""),
        "requires": tuple(fields.get("requires", "").split()),
        "optional_inputs": frozenset(fields.get("optionalInputs", "").split()),
        "recommended_step": float(step) if step else None,
        "sampled": fields.get("sampled") == "true",
    }
