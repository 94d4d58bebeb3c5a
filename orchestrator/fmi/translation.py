"""Model descriptions of FMI 1.0 and 3.0 in the terms of 2.0, in which everything behind `reader` thinks.

What 2.0 has no words for is kept beside: which variables of 3.0 are left out because nothing here can hold their
values, and what are elements of arrays.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

from ..errors import FmuFileError
from ..problems import suggestion
from .entries import Description, Entry

VERSIONS = {"1.0": re.compile(r"1\.0"), "2.0": re.compile(r"2\.0(\..*)?"), "3.0": re.compile(r"3\.\d+(\.\d+)?")}
"""The versions of FMI that are read, each with how files spell it."""
_TYPES_3 = {
    **dict.fromkeys(("Float32", "Float64"), "Real"),
    **{f"{sign}Int{bits}": "Integer" for sign in ("", "U") for bits in (8, 16, 32, 64)},
    "Binary": "String",  # of hexadecimal digits
}
_TRUE = ("true", "1")
_WHOLE = re.compile(r"U?Int\d+|Enumeration")
_REAL = re.compile(r"Float\d+")
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
    clocks = {str(v.reference): v.name for v in description.entries if v.type == "Clock"}
    binaries = {each.get("name"): each for each in root.iterfind("TypeDefinitions/BinaryType")}
    for v in description.entries:
        reason = _not_taken(v, names, clocks)
        if reason:
            left_out[v.name] = reason
            continue
        if v.type == "Binary" and v.declared in binaries:  # what the variable does not say itself, its type does
            v.media = v.media or binaries[v.declared].get("mimeType")
            v.longest = v.longest or binaries[v.declared].get("maxSize")
        v.type = _TYPES_3.get(v.type, v.type)
        if v.causality == "structuralParameter":
            v.initial = None  # can be set in configuration mode only, which is for arrays
        if v.alias is not None:
            _show_as_alias(v)
    if left_out:
        description.entries = [v for v in description.entries if v.name not in left_out]
    places = _expand(description) if arrays else {}
    return Beside(left_out=left_out, places=places)


def _not_taken(v: Entry, names: Set[str], clocks: Mapping[str, str]) -> str:
    if v.type == "Clock":
        return "a clock"
    if v.clocks:
        return f"clocked by {', '.join(clocks.get(each, each) for each in v.clocks.split())}"
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
    """The start values of an array's elements; one that stands alone is that of all.

    A list belongs to the size in the file: what the FMU makes of it at another size, nobody says.
    """
    starts = list(v.starts) if v.type == "String" else (v.start or "").split()
    if v.resized and len(starts) > 1:
        return [None] * count
    if len(starts) not in (0, 1, count):
        raise ValueError(f'the array "{v.name}" has {len(starts)} start values for {count} elements')
    return starts if len(starts) == count else [*(starts or [None])] * count


def _show_as_alias(v: Entry) -> None:
    """Another name can be read and set as the first can, but is no input or output once more."""
    v.causality = "local"
    assert v.alias is not None
    v.description = f"{v.description or ''} (another name of {v.alias.name})".strip()


# -------------------------------------------------------------------- structural parameters of FMI 3.0


def restructure(entries: Sequence[Entry], given: Mapping[str, Any], name: str) -> None:
    """Give structural parameters other values, in place: the description is as if it had been written so.

    The FMU itself is given them in its configuration mode (`binding.fmi3`). Lists of start values of arrays that change
    their size go.

    Args:
        entries: the variables as they are written.
        given: values by name.
        name: the FMU as the user knows it, for messages.

    Raises:
        FmuFileError: there is no such parameter, or it cannot have the value.
    """
    own = {entry.name: entry for entry in entries if entry.causality == "structuralParameter"}
    if not own and given:
        raise FmuFileError(f"{name} is built already; it takes no build arguments {sorted(given)}")
    for key, value in given.items():
        if key not in own:
            near = suggestion(key, own) or f"there are {', '.join(own)}"
            raise FmuFileError(f"{name} has no structural parameter {key!r}; {near}")
        own[key].start = _written(own[key], value, name)
    changed = {str(own[key].reference) for key in given}
    for entry in entries:
        entry.resized = any(size in changed for size in entry.sizes)


def _written(entry: Entry, value: Any, name: str) -> str:
    """A value as a description has it."""
    what = f"{name}: the structural parameter {entry.name!r} takes"
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if _WHOLE.fullmatch(entry.type):
        if not is_number or value != int(value):
            raise FmuFileError(f"{what} a whole number, not {value!r}")
        value = int(value)
    elif _REAL.fullmatch(entry.type):
        if not is_number:
            raise FmuFileError(f"{what} a number, not {value!r}")
    elif entry.type == "Boolean":
        if not isinstance(value, bool):
            raise FmuFileError(f"{what} true or false, not {value!r}")
        return str(value).lower()
    elif not isinstance(value, str):
        raise FmuFileError(f"{what} text, not {value!r}")
    for limit, wrong in ((entry.min, value.__lt__), (entry.max, value.__gt__)):
        if is_number and limit is not None and wrong(type(value)(limit)):
            raise FmuFileError(f"{what} {entry.min or 'any number'} to {entry.max or 'any number'}, not {value!r}")
    return str(value)
