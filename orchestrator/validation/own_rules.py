"""What our own FMUs keep beyond the standard: see `docs/architecture.md`, and `fmus.description`, which writes it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lxml import etree

from ..fmi import Interface

_CAPABILITIES = ("canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative")


def broken_rules(folder: Path, interface: Interface) -> list[str]:
    """Sentences on every rule that one of our FMUs does not keep.

    Args:
        folder: where it was unpacked.
        interface: its interface, with our annotation.
    """
    if interface.version != "2.0":
        return [f"it says that it is one of ours, but is of FMI {interface.version}"]
    root = etree.parse(str(folder / "modelDescription.xml")).getroot()
    broken = [*_variables(root, interface), *_units(interface), *_archive(root, folder)]
    if interface.own_kind == "native":
        broken += _native(root, interface, folder)
    return broken


def _variables(root: Any, interface: Interface) -> Iterator[str]:
    names = [v.get("name") for v in root.iter("ScalarVariable")]
    unknowns = {_index(u): u for u in root.iterfind("ModelStructure/InitialUnknowns/Unknown")}
    initial = {name: unknowns[place] for place, name in enumerate(names, 1) if place in unknowns}
    for v in interface.variables.values():
        if not v.description and v.causality != "local":
            yield f"{v.name} has no description"
        if v.causality == "parameter" and (v.variability not in ("fixed", "tunable") or v.start is None):
            yield f"the parameter {v.name} is neither fixed nor tunable, or has no start value"
        if v.causality == "output" and v.dependencies is None:
            yield f"the output {v.name} lists no dependencies"
        if v.initial == "calculated" and v.start is not None:
            yield f"{v.name} is calculated and has a start value all the same"
        if v.initial == "calculated" and v.causality == "output" and v.name not in initial:
            yield f"{v.name} is calculated and missing from InitialUnknowns"
    for name, unknown in initial.items():
        if unknown.get("dependencies") is None:
            yield f"{name} lists no dependencies in InitialUnknowns"


def _index(unknown: Any) -> int:
    """The number of a variable; 0 where the file, which says that it is one of ours, has something else there."""
    text = unknown.get("index", "")
    return int(text) if text.isdecimal() and len(text) < 10 else 0


def _units(interface: Interface) -> Iterator[str]:
    for name in dict.fromkeys(v.unit for v in interface.variables.values() if v.unit):
        if name not in interface.units or interface.units[name].exponents is None:
            yield f"the unit {name!r} is not defined by base units"


def _archive(root: Any, folder: Path) -> Iterator[str]:
    if root.find("DefaultExperiment") is None:
        yield "there is no DefaultExperiment"
    if root.get("generationDateAndTime") is not None:
        yield "it carries the date of its making, so that no two builds are equal"
    if not (folder / "documentation" / "index.html").is_file():
        yield "documentation/index.html is missing"


def _native(root: Any, interface: Interface, folder: Path) -> Iterator[str]:
    simulation = root.find("CoSimulation")
    moves = any(v.type == "Real" for v in interface.of("input"))
    for capability in (*_CAPABILITIES, *(("canInterpolateInputs",) if moves else ())):
        if simulation.get(capability) != "true":
            yield f"{capability} is not declared"
    files = [f.get("name", "") for f in simulation.iterfind("SourceFiles/File")]
    if not files:
        yield "no source files are listed"
    for name in files:
        if not (folder / "sources" / name).is_file():
            yield f"sources/{name} is listed and missing"
    variables = list(root.iter("ScalarVariable"))
    derivatives = {
        k for k, v in enumerate(variables, 1) if v.find("Real") is not None and v.find("Real").get("derivative")
    }
    listed = {_index(u) for u in root.iterfind("ModelStructure/Derivatives/Unknown")}
    for k in sorted(derivatives - listed):
        yield f"{variables[k - 1].get('name')} is missing from ModelStructure/Derivatives"
