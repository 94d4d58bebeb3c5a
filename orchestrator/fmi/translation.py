"""Model descriptions of FMI 1.0 and 3.0 in the terms of 2.0, in which everything behind `reader` thinks.

What 2.0 has no words for is kept beside: which variables of 3.0 are left out because nothing here can hold their
values, and what are elements of arrays.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from typing import Any

from .entries import Description, Entry

VERSIONS = {"1.0": re.compile(r"1\.0"), "2.0": re.compile(r"2\.0(\..*)?"), "3.0": re.compile(r"3\.\d+(\.\d+)?")}
"""The versions of FMI that are read, each with how files spell it."""
_TYPES_3 = {
    **dict.fromkeys(("Float32", "Float64"), "Real"),
    **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
_TRUE = ("true", "1")
_CAPABILITIES_1 = (
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "canBeInstantiatedOnlyOncePerProcess",
)
_LARGEST_ARRAY = 100_000
"""How many elements an array may have: each becomes a variable."""
_NAMED = 10
"""How many variables a warning names."""


@dataclass(frozen=True)
class Beside:
    """What the terms of FMI 2.0 do not say.

    Attributes:
        left_out: what variables are that are not taken, by name.
        places: of elements of FMI 3.0 arrays, by name: the array's name, and the place in it from 0.
    """

    places: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)

    def warnings(self, name: str) -> Iterator[str]:
        """What a user should know who gives the file that name."""
        if self.left_out:
            listed = [f"{variable} ({what})" for variable, what in list(self.left_out.items())[:_NAMED]]
            more = len(self.left_out) - len(listed)
            listed += [f"and {more} more"] if more else []
            yield f"{name}: variables of kinds that are not supported are left out: {', '.join(listed)}"


def standard(root: Any) -> str:
    """The version of FMI, one of `VERSIONS`; otherwise what the file says, or a question mark."""
    written = str(root.get("fmiVersion", "")).strip()
    return next((version for version, spelled in VERSIONS.items() if spelled.fullmatch(written)), written or "?")


def is_for_co_simulation(root: Any, version: str) -> bool:
    """Whether it is an FMU for co-simulation, or for that, too."""
    return root.find("Implementation" if version == "1.0" else "CoSimulation") is not None


def other_kind(root: Any, version: str) -> str:
    """What an FMU that is not for co-simulation is."""
    if version == "1.0" or root.find("ModelExchange") is not None:
        return "a model-exchange FMU"
    return "an FMU for scheduled execution" if root.find("ScheduledExecution") is not None else ""


def is_pedantry(version: str, problem: str) -> bool:
    """Whether FMPy complains of a default: FMI 1.0 makes every type continuous of which a file says nothing."""
    return version == "1.0" and problem.rstrip().endswith('and must have variability != "continuous".')


def translate(description: Description, root: Any, version: str) -> Beside:
    """Put what was read into the terms of FMI 2.0, in place.

    Args:
        description: FMPy's, with the variables as they are written.
        root: the root element of the file, without the variables.
        version: from `standard`.

    Raises:
        ValueError: a number in the file is none.
    """
    if version == "1.0":
        return _from_1(description, root)
    if version == "3.0":
        return _from_3(description, root)
    return Beside()


# -------------------------------------------------------------------- FMI 1.0


def _from_1(description: Description, root: Any) -> Beside:
    simulation = description.found.coSimulation
    capabilities = root.find("Implementation/*/Capabilities")
    for name in _CAPABILITIES_1:
        setattr(simulation, name, capabilities is not None and capabilities.get(name) in _TRUE)
    simulation.needsExecutionTool = root.find("Implementation/CoSimulation_Tool") is not None
    names = {v.name for v in description.entries} if any(v.depends for v in description.entries) else set()
    for v in description.entries:
        _roles_1(v)
        if v.causality != "output":
            v.depends = None
        elif v.depends is not None:
            v.depends = [name for name in v.depends if name in names]
    return Beside()


def _roles_1(v: Entry) -> None:
    """Causality, variability and initial.

    A parameter without a start value depends on others; any other variable with one may be set before initialization.
    """
    causality, has_start = v.causality, v.start is not None
    if v.variability == "parameter":
        v.causality = "parameter" if has_start else "output" if causality == "output" else "calculatedParameter"
        v.variability = "fixed"
    else:
        v.causality = causality if causality in ("input", "output") else "local"
        if v.variability == "continuous" and v.type != "Real":
            v.variability = "discrete"
    v.initial = ("approx" if v.guessed else "exact") if has_start else "calculated"
    if v.causality == "input":
        v.initial = None


# -------------------------------------------------------------------- FMI 3.0


def _from_3(description: Description, root: Any) -> Beside:
    element, simulation = root.find("CoSimulation"), description.found.coSimulation
    simulation.providesDirectionalDerivative = element.get("providesDirectionalDerivatives") in _TRUE
    simulation.canInterpolateInputs = False  # the standard has no call for that
    left_out = {}
    arrays = any(v.sizes for v in description.entries)
    names = {v.name for v in description.entries} if arrays else set()
    for v in description.entries:
        reason = _not_taken(v, names)
        if reason:
            left_out[v.name] = reason
            continue
        v.type = _TYPES_3.get(v.type, v.type)
        if v.causality == "structuralParameter":
            v.initial = None  # can be set in configuration mode only, which is for arrays
        if v.alias is not None:
            _show_as_alias(v)
    if left_out:
        description.entries = [v for v in description.entries if v.name not in left_out]
    places = _expand(description) if arrays else {}
    return Beside(left_out=left_out, places=places)


def _not_taken(v: Entry, names: Set[str]) -> str:
    if v.type == "Clock":
        return "a clock"
    if v.type == "Binary":
        return "binary"
    if v.clocks:
        return "clocked"
    if not v.sizes:
        return ""
    count = math.prod(v.shape)
    if not 0 < count <= _LARGEST_ARRAY:
        return f"an array of {count} elements"
    return "" if names.isdisjoint(_element_names(v)) else "an array, and its elements' names are those of others"


def _expand(description: Description) -> dict[str, tuple[str, int]]:
    """Put elements in the place of arrays, in place: ``a[1]``, ``m[1,2]``, the last index the fastest.

    An element depends on all that its array depends on; of derivatives the array is the derivative element by element.
    """
    elements = {v.name: _elements(v) if v.sizes else [v] for v in description.entries}
    for v in description.entries:
        rates = [] if v.derivative is None else elements.get(v.derivative.name, [])
        for k, element in enumerate(elements[v.name]):
            element.derivative = rates[k] if k < len(rates) else None
        if v.depends:
            depends = frozenset(x.name for name in v.depends for x in elements.get(name, ()))
            for element in elements[v.name]:
                element.depends = depends
    arrays = [v for v in description.entries if v.sizes]
    description.entries = [e for own in elements.values() for e in own]
    return {e.name: (v.name, k) for v in arrays for k, e in enumerate(elements[v.name])}


def _elements(v: Entry) -> list[Entry]:
    names = _element_names(v)
    return [v.named(name, start) for name, start in zip(names, _starts(v, len(names)), strict=True)]


def _element_names(v: Entry) -> list[str]:
    places = itertools.product(*(range(1, size + 1) for size in v.shape))
    return [f"{v.name}[{','.join(map(str, place))}]" for place in places]


def _starts(v: Entry, count: int) -> list[Any]:
    """The start values of an array's elements; one that stands alone is that of all."""
    starts = list(v.starts) if v.type == "String" else (v.start or "").split()
    if len(starts) not in (0, 1, count):
        raise ValueError(f'the array "{v.name}" has {len(starts)} start values for {count} elements')
    return starts if len(starts) == count else [*(starts or [None])] * count


def _show_as_alias(v: Entry) -> None:
    """Another name can be read and set as the first can, but is no input or output once more."""
    v.causality = "local"
    assert v.alias is not None
    v.description = f"{v.description or ''} (another name of {v.alias.name})".strip()
