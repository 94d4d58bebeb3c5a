"""Reading ``modelDescription.xml`` into an `Interface`: tolerant of pedantry, and telling about it."""

from __future__ import annotations

import gc
import math
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from ...fmus.annotation import read as read_annotation
from ..errors import FmuFileError
from ..names import arrays_of
from .entries import Description, Entry
from .interface import Interface, Sort, Type, Unit, Variable
from .reading import read
from .translation import Beside, is_pedantry, translate

_NO_STRUCTURE: Mapping[str, Any] = {}
_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def read_interface(folder: Path, name: str, structure: Mapping[str, Any] = _NO_STRUCTURE) -> Interface:
    """The interface of an unpacked FMU.

    Args:
        folder: where it was unpacked.
        name: the file as the user knows it, for messages.
        structure: values of its structural parameters by name (FMI 3.0).

    Raises:
        FmuFileError: not a co-simulation FMU of a version of FMI that is known, or a description beyond repair.
    """
    try:
        with _without_collection():
            return _read(folder, name, structure)
    except FmuFileError:
        raise
    except Exception as error:
        raise FmuFileError(f"{name}: its modelDescription.xml cannot be used: {error}") from error


@contextmanager
def _without_collection() -> Iterator[None]:
    """Let Python not look for circles among millions of new objects again and again: there are none."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _read(folder: Path, name: str, structure: Mapping[str, Any]) -> Interface:
    reading = read(folder / "modelDescription.xml", name, structure=structure)
    version, faults = reading.version, reading.faults
    faults.add(problem for problem in reading.problems() if not is_pedantry(version, problem))
    beside = translate(reading.description, reading.root, version)
    warnings = [f"{name}: {text}" for text in faults.told()]
    interface = _interface(reading.description, reading.root, beside)
    given = {key: interface.variables[key].start for key in structure}
    warnings += beside.warnings(name)
    return replace(interface, version=version, structure=given, warnings=tuple(warnings))


def _interface(description: Description, root: Any, beside: Beside) -> Interface:
    found = description.found
    variables = _variables(description, _relative_types(root), beside)
    simulation = found.coSimulation
    experiment = found.defaultExperiment
    return Interface(
        model=found.modelName or "",
        identifier=simulation.modelIdentifier or "",  # of a second element without one, too
        guid=found.guid or "",
        variables=variables,
        units={unit.name: unit for unit in map(_unit, found.unitDefinitions)},
        arrays=find_arrays(variables),
        description=found.description or "",
        generator=found.generationTool or "",
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


def _variables(description: Description, relative: Set[str], beside: Beside) -> dict[str, Variable]:
    """The variables by name; the entries they are made of go as they are read, for there may be a million."""
    types = {made.name: made for made in description.found.typeDefinitions}
    sorts: dict[Any, Sort] = {}
    variables = {}
    entries = description.entries
    entries.reverse()
    while entries:
        entry = entries.pop()
        variables[entry.name] = _variable(entry, types.get(entry.declared), relative, beside, sorts)
    return variables


def _variable(entry: Entry, made: Any, relative: Set[str], beside: Beside, sorts: dict[Any, Sort]) -> Variable:
    unit, low, high, nominal = entry.unit, entry.min, entry.max, entry.nominal
    if made is not None:  # what the variable does not say itself, its type does
        unit, low, high, nominal = (
            getattr(made, key) if own is None else own
            for key, own in (("unit", unit), ("min", low), ("max", high), ("nominal", nominal))
        )
    key = (
        entry.type, entry.causality, entry.variability, entry.initial, unit, low, high, nominal, entry.declared,
        entry.relative, entry.fmi_type, entry.negated, entry.media, entry.longest,
    )  # fmt: skip
    if key not in sorts:
        sorts[key] = Sort(
            type=cast(Type, entry.type),
            causality=entry.causality or "local",
            variability=entry.variability or "continuous",
            initial=entry.initial,
            unit=None if unit in (None, "", "-", "1") else unit,
            minimum=_number(low),
            maximum=_number(high),
            nominal=_number(nominal),
            choices=tuple((item.name or "", int(item.value)) for item in made.items) if made else (),
            relative=entry.declared in relative if entry.relative is None else entry.relative,
            fmi_type=entry.fmi_type,
            negated=entry.negated,
            media=entry.media or "",
            longest=None if entry.longest is None else int(entry.longest),
        )
    rate = entry.derivative
    return Variable(
        entry.name,
        entry.reference,
        sorts[key],
        _start(entry),
        entry.description or "",
        None if entry.depends is None else frozenset(entry.depends),
        None if rate is None else rate.name,
        beside.places.get(entry.name),
    )


def _relative_types(root: Any) -> set[str]:
    """Types of differences of quantities, whose unit has no offset: FMPy overlooks that attribute of variables.

    In FMI 3.0 it stands in the variable or type itself, before in an element inside.
    """
    return {t.get("name") for t in root.iterfind("TypeDefinitions/*") if any(map(_is_relative, (t, *t)))}


def _is_relative(element: Any) -> bool:
    return element.get("relativeQuantity") in ("true", "1")


def _start(entry: Entry) -> Any:
    text = entry.start
    if text is None:
        return None
    if entry.type == "Real":
        return float(text)
    if entry.type in ("Integer", "Enumeration"):
        return int(text)
    if entry.type == "Boolean":
        return text in ("true", "1", "True")
    return text.lower() if entry.fmi_type == "Binary" else text


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
