"""Reading ``modelDescription.xml`` into an `Interface`: tolerant of pedantry, and telling about it."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterable, Mapping, Set
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any, cast

from fmpy.model_description import ValidationError, read_model_description
from lxml import etree

from ...fmus.annotation import read as read_annotation
from .. import world
from ..errors import FmuFileError
from ..names import arrays_of
from .interface import Interface, Type, Unit, Variable
from .repair import repair
from .translation import VERSIONS, Beside, is_for_co_simulation, is_pedantry, other_kind, standard, translate

_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_MOST_WARNINGS = 12
"""Kinds of faults that are told of one file."""


def read_interface(folder: Path, name: str) -> Interface:
    """The interface of an unpacked FMU.

    Args:
        folder: where it was unpacked.
        name: the file as the user knows it, for messages.

    Raises:
        FmuFileError: not a co-simulation FMU of a version of FMI that is known, or a description beyond repair.
    """
    root, overlooked = _parse(folder / "modelDescription.xml", name)
    version = standard(root)
    if version not in VERSIONS:
        raise FmuFileError(
            f"{name} is FMI {version}; this version of railcosim runs co-simulation FMUs of FMI {', '.join(VERSIONS)}"
        )
    if not is_for_co_simulation(root, version):
        other = other_kind(root, version)
        raise FmuFileError(f"{name} has no co-simulation part{f' (it is {other})' if other else ''}")
    try:
        before = etree.tostring(root)
        faults = [*overlooked, *(repair(root) if version == "2.0" else [])]
        # Of FMI 3.0 FMPy would read the description of the sources, too, and refuse an FMU for faults in that.
        alone = version == "3.0" or overlooked or etree.tostring(root) != before
        description, problems = _read(folder, root if alone else None)
        beside = translate(description, root, version)
        told = [problem for problem in problems if not is_pedantry(version, problem)]
        warnings = [f"{name}: {text}" for text in _folded([*faults, *told])]
        interface = _interface(description, root, beside)
        return replace(interface, version=version, warnings=(*warnings, *beside.warnings(name)))
    except Exception as error:
        raise FmuFileError(f"{name}: its modelDescription.xml cannot be used: {error}") from error


def _interface(description: Any, root: Any, beside: Beside) -> Interface:
    variables = _variables(description, _relative(root), beside)
    simulation = description.coSimulation
    experiment = description.defaultExperiment
    return Interface(
        model=description.modelName or "",
        identifier=simulation.modelIdentifier or "",  # of a second element without one, too
        guid=description.guid or "",
        variables=variables,
        units={unit.name: unit for unit in map(_unit, description.unitDefinitions)},
        arrays=find_arrays(variables),
        description=description.description or "",
        generator=description.generationTool or "",
        default_step=_number(experiment.stepSize) if experiment else None,
        default_stop=_number(experiment.stopTime) if experiment else None,
        default_tolerance=_number(experiment.tolerance) if experiment else None,
        can_save_state=bool(simulation.canGetAndSetFMUstate),
        can_serialize_state=bool(simulation.canGetAndSetFMUstate and simulation.canSerializeFMUstate),
        directional_derivatives=bool(simulation.providesDirectionalDerivative),
        interpolates_inputs=bool(simulation.canInterpolateInputs),
        variable_step=bool(simulation.canHandleVariableCommunicationStepSize),
        single_instance=bool(simulation.canBeInstantiatedOnlyOncePerProcess),
        needs_tool=bool(simulation.needsExecutionTool),
        event_mode=bool(simulation.hasEventMode),
        output_derivatives=int(simulation.maxOutputDerivativeOrder or 0),
        annotation=read_annotation(root),
        left_out=beside.left_out,
    )


def _parse(path: Path, name: str) -> tuple[Any, list[str]]:
    """The root element, and what had to be overlooked to read it."""
    overlooked: list[str] = []
    try:
        parsed = etree.parse(str(path), _parser())
    except (etree.XMLSyntaxError, OSError) as error:  # the latter where bytes do not fit the encoding
        parsed, overlooked = _parse_anyhow(world.read_bytes(path))
        if parsed is None:
            what = getattr(error, "msg", None) or "it has bytes that do not fit its encoding"
            raise FmuFileError(f"{name}: its modelDescription.xml is not XML: {what}") from error
    # Asked of the parser, not searched for in the bytes: they may be in any encoding.
    if parsed.docinfo.internalDTD is not None:
        raise FmuFileError(f"{name} is refused: its modelDescription.xml has a DOCTYPE, which may declare XML entities")
    return parsed.getroot(), overlooked


def _parser(encoding: str | None = None) -> etree.XMLParser:
    return etree.XMLParser(resolve_entities=False, no_network=True, encoding=encoding)


def _parse_anyhow(content: bytes) -> tuple[Any, list[str]]:
    """What is XML but for blanks at its beginning or letters of Windows' in what calls itself UTF-8; None otherwise."""
    overlooked = []
    begun = content.removeprefix(codecs.BOM_UTF8).lstrip()
    if begun != content.removeprefix(codecs.BOM_UTF8):
        overlooked.append("it begins with blanks, which XML does not allow")
    try:
        begun.decode()
        encoding = None
    except UnicodeDecodeError:
        encoding = "windows-1252"
        overlooked.append("its letters are not those of the encoding it names; they are read as Windows-1252")
    if b"\0" in content[:4] or not overlooked:
        return None, []
    try:
        return etree.parse(BytesIO(begun), _parser(encoding)), overlooked
    except (etree.XMLSyntaxError, OSError, LookupError):
        return None, []


def _read(folder: Path, repaired: Any) -> tuple[Any, list[str]]:
    """What FMPy reads, and what it finds wrong with it.

    Args:
        folder: where the FMU was unpacked.
        repaired: the root element to read instead of what stands there; None for that.
    """
    if repaired is None:
        return _read_leniently(str(folder))
    with world.TemporaryDirectory() as place:
        source = f"{place}/modelDescription.xml"
        repaired.getroottree().write(source, encoding="UTF-8", xml_declaration=True)
        return _read_leniently(source)


def _read_leniently(source: str) -> tuple[Any, list[str]]:
    try:
        return read_model_description(source, validate=True), []
    except ValidationError as error:
        problems = list(error.problems)
    except Exception as error:  # FMPy's checks of a file that it can read may fail themselves
        problems = [str(error)]
    return read_model_description(source, validate=False), problems


def _folded(faults: Iterable[str]) -> list[str]:
    """Faults that differ in names in double quotes and in numbers only, told once: a tool makes them everywhere."""
    alike: dict[str, list[str]] = {}
    for fault in faults:
        alike.setdefault(re.sub(r'"[^"]*"|\d+', "", fault), []).append(fault)
    told = [
        first + (f" (and {len(rest)} more like it)" if rest else "")
        for first, *rest in list(alike.values())[:_MOST_WARNINGS]
    ]
    more = len(alike) - len(told)
    return [*told, f"and {more} more kinds of faults"] if more > 0 else told


def _variables(description: Any, relative: Set[str], beside: Beside) -> dict[str, Variable]:
    outputs = {unknown.variable.name: unknown.dependencies for unknown in description.outputs}
    return {v.name: _variable(v, outputs.get(v.name), v.name in relative, beside) for v in description.modelVariables}


def _variable(v: Any, listed: Any, relative: bool, beside: Beside) -> Variable:
    unit = _typed(v, "unit")
    return Variable(
        name=v.name,
        reference=v.valueReference,
        type=cast(Type, v.type),
        causality=v.causality or "local",
        variability=v.variability or "continuous",
        initial=v.initial,
        start=_start(v),
        unit=None if unit in (None, "", "-", "1") else unit,
        minimum=_number(_typed(v, "min")),
        maximum=_number(_typed(v, "max")),
        nominal=_number(_typed(v, "nominal")),
        choices=tuple((item.name or "", int(item.value)) for item in v.declaredType.items) if v.declaredType else (),
        description=v.description or "",
        dependencies=None if listed is None else frozenset(d.name for d in listed),
        derivative=None if v.derivative is None else v.derivative.name,
        relative=relative,
        fmi_type=beside.fmi_types.get(v.name, ""),
        negated=v.name in beside.negated,
        element=beside.places.get(v.name),
    )


def _typed(v: Any, key: str) -> Any:
    """An attribute of a variable, or of its type where it has none of its own."""
    own = getattr(v, key)
    return getattr(v.declaredType, key) if own is None and v.declaredType is not None else own


def _relative(root: Any) -> set[str]:
    """Variables that are differences of quantities, whose unit has no offset: FMPy overlooks that attribute.

    In FMI 3.0 it stands in the variable or type itself, before in an element inside.
    """
    types = {t.get("name") for t in root.iterfind("TypeDefinitions/*") if any(map(_is_relative, (t, *t)))}
    return {
        v.get("name")
        for v in root.iterfind("ModelVariables/*")
        for real in (v, *v.iterfind("Real"))
        if _is_relative(real) or (real.get("relativeQuantity") is None and real.get("declaredType", 0) in types)
    }


def _is_relative(element: Any) -> bool:
    return element.get("relativeQuantity") in ("true", "1")


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
    factor, offset = (0.0, 0.0) if base is None else (float(base.factor), float(base.offset))
    if not factor or not math.isfinite(factor) or not math.isfinite(offset):
        return Unit(unit.name, None)
    return Unit(unit.name, tuple(getattr(base, e) for e in _EXPONENTS), factor, offset)


def find_arrays(variables: Mapping[str, Variable]) -> dict[str, tuple[str, ...]]:
    """The scalars of each array by the array's name, in the order of their indices."""
    found: dict[str, list[tuple[tuple[int, ...], str]]] = {}
    for name in variables:
        for array, place in arrays_of(name):
            found.setdefault(array, []).append((place, name))
    # By index, because a file may list the elements in any order.
    return {array: tuple(n for _, n in sorted(elements)) for array, elements in found.items() if array not in variables}
