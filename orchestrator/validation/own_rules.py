"""What our own FMUs keep beyond the standard: see `docs/architecture.md`, and `fmus.description`, which writes it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from lxml import etree

from ..fmi import Interface, Variable


class _Words(NamedTuple):
    """How a version of FMI calls what we keep.

    Attributes:
        capabilities: of a native FMU.
        moving: one more where there are real inputs.
        reference: the attribute by which the model structure knows variables.
        initial: path of the unknowns at the start.
        rates: path of those of the derivatives.
    """

    capabilities: tuple[str, ...]
    moving: tuple[str, ...]
    reference: str
    initial: str
    rates: str


_WORDS = {
    "2.0": _Words(
        ("canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative"),
        ("canInterpolateInputs",),
        "index",
        "ModelStructure/InitialUnknowns/Unknown",
        "ModelStructure/Derivatives/Unknown",
    ),
    "3.0": _Words(
        ("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives"),
        (),
        "valueReference",
        "ModelStructure/InitialUnknown",
        "ModelStructure/ContinuousStateDerivative",
    ),
}


def broken_rules(folder: Path, interface: Interface) -> list[str]:
    """Sentences on every rule that one of our FMUs does not keep.

    Args:
        folder: where it was unpacked.
        interface: its interface, with our annotation.
    """
    if interface.version not in _WORDS:
        return [f"it says that it is one of ours, but is of FMI {interface.version}"]
    root = etree.parse(str(folder / "modelDescription.xml")).getroot()
    words = _WORDS[interface.version]
    broken = [*_variables(_listed(root, words, words.initial), interface), *_units(interface), *_archive(root, folder)]
    if interface.own_kind == "native":
        broken += _native(root, interface, folder, words)
    return broken


def _listed(root: Any, words: _Words, path: str) -> dict[str, str | None]:
    """The names of unknowns, of arrays too, with what they depend on; what is no variable is left out."""
    variables = list(root.find("ModelVariables"))
    if words.reference == "index":
        names = {str(k): variable.get("name") for k, variable in enumerate(variables, 1)}
    else:
        names = {variable.get(words.reference): variable.get("name") for variable in variables}
    entries = ((names.get(entry.get(words.reference)), entry) for entry in root.iterfind(path))
    return {name: entry.get("dependencies") for name, entry in entries if name}


def _variables(initial: Mapping[str, str | None], interface: Interface) -> Iterator[str]:
    for v in interface.variables.values():
        if not v.description and v.causality != "local":
            yield f"{v.name} has no description"
        if v.causality == "parameter" and (v.variability not in ("fixed", "tunable") or v.start is None):
            yield f"the parameter {v.name} is neither fixed nor tunable, or has no start value"
        if v.causality == "output" and v.dependencies is None:
            yield f"the output {v.name} lists no dependencies"
        if v.initial == "calculated" and v.start is not None:
            yield f"{v.name} is calculated and has a start value all the same"
        if v.initial == "calculated" and v.causality == "output" and _written(v) not in initial:
            yield f"{v.name} is calculated and missing from InitialUnknowns"
    for name, dependencies in initial.items():
        if dependencies is None:
            yield f"{name} lists no dependencies in InitialUnknowns"


def _written(variable: Variable) -> str:
    """The name in the file: of an element of an FMI 3.0 array the array's."""
    return variable.element[0] if variable.element else variable.name


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


def _native(root: Any, interface: Interface, folder: Path, words: _Words) -> Iterator[str]:
    simulation = root.find("CoSimulation")
    moves = any(v.type == "Real" for v in interface.of("input"))
    for capability in (*words.capabilities, *(words.moving if moves else ())):
        if simulation.get(capability) != "true":
            yield f"{capability} is not declared"
    files = _sources(simulation, folder, interface.version)
    if not files:
        yield "no source files are listed"
    for name in files:
        if not (folder / "sources" / name).is_file():
            yield f"sources/{name} is listed and missing"
    listed = _listed(root, words, words.rates)
    for name in dict.fromkeys(_written(v) for v in interface.variables.values() if v.derivative):
        if name not in listed:
            yield f"{name} is missing from the derivatives in ModelStructure"


def _sources(simulation: Any, folder: Path, version: str) -> list[str]:
    """The source files that the FMU lists; none where it does so in no XML."""
    if version == "2.0":
        return [file.get("name", "") for file in simulation.iterfind("SourceFiles/File")]
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.parse(str(folder / "sources" / "buildDescription.xml"), parser).getroot()
    except (OSError, etree.XMLSyntaxError):
        return []
    return [file.get("name", "") for file in root.iter("SourceFile")]
