"""The variables of a model description as they are written, read from XML one by one, and what is wrong with them.

FMPy reads the rest of a description. Its own variables are five times as large, and take five times as long.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_TYPES = frozenset(("Real", "Integer", "Boolean", "String", "Enumeration"))
_PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")
_REALS = ("Real", "Float32", "Float64")
_RARE = {
    "displayUnit": "display",
    "declaredType": "declared",
    "min": "min",
    "max": "max",
    "nominal": "nominal",
    "derivative": "derivative",
    "mimeType": "media",
    "maxSize": "longest",
}
"""Attributes that most variables do not have, and what they are called here."""
_OF_PARAMETERS = {
    "structuralParameter": "exact",
    "parameter": "exact",
    "calculatedParameter": "calculated",
    "local": "calculated",
}
_INITIAL: Mapping[str, Mapping[str, str | None]] = {
    "constant": {"output": "exact", "local": "exact"},
    "fixed": _OF_PARAMETERS,
    "tunable": _OF_PARAMETERS,
    "discrete": {"input": "exact", "output": "calculated", "local": "calculated"},
    "continuous": {"input": "exact", "output": "calculated", "local": "calculated", "independent": None},
}  # fmt: skip
"""What `initial` is by variability and causality where a file does not say (FMI 2.0, 2.2.7)."""
_LEGAL = {
    *((causality, v, "exact") for causality in ("structuralParameter", "parameter") for v in ("fixed", "tunable")),
    *(
        (causality, v, initial)
        for causality in ("calculatedParameter", "local")
        for v in ("fixed", "tunable")
        for initial in ("calculated", "approx")
    ),
    *(("input", v, "exact") for v in ("discrete", "continuous")),
    *((causality, "constant", "exact") for causality in ("output", "local")),
    *(
        (causality, v, initial)
        for causality in ("output", "local")
        for v in ("discrete", "continuous")
        for initial in ("calculated", "exact", "approx")
    ),
    ("independent", "continuous", None),
}
"""Causality, variability and initial that go together."""


class Entry:
    """One variable as it is written.

    Attributes:
        reference: its value reference. line: of the file.
        start: its start value; starts: those of an array of texts.
        relative: whether it is a difference; None where only its type says. declared: the name of its type.
        derivative: which variable it is the rate of, by place (FMI 2.0) or reference (3.0).
        depends: the names of what it depends on directly; None where that is not said.
        negated, guessed: of FMI 1.0: whether its value is another's negative, and whether its start value is a guess.
        fmi_type: in FMI 3.0. aliases: its other names there, as elements. alias: what this one is another name of.
        sizes: of FMI 3.0: the dimensions of an array, each a number or the reference of the variable that has it.
        shape: the numbers. media, longest: of Binary variables: the MIME type, and the most bytes.
    """

    # What nearly all of them have takes no dictionary; of the rest most have what stands here.
    __slots__ = (
        "__dict__", "causality", "description", "fmi_type", "initial", "line", "name", "reference", "start", "type",
        "unit", "variability",
    )  # fmt: skip

    name: str
    reference: int
    line: int
    type: str
    causality: str
    variability: str
    initial: str | None
    start: str | None
    unit: str | None
    description: str | None
    fmi_type: str
    starts: Sequence[str | None] = ()
    display: str | None = None
    min: str | None = None
    max: str | None = None
    nominal: str | None = None
    relative: bool | None = None
    declared: str | None = None
    derivative: Any = None
    depends: Iterable[str] | None = None
    negated: bool = False
    guessed: bool = False
    aliases: Sequence[Any] = ()
    alias: Entry | None = None
    clocks: str | None = None
    sizes: tuple[int | str, ...] = ()
    shape: tuple[int, ...] = ()
    media: str | None = None
    longest: str | None = None
    resized: bool = False

    def named(self, name: str, start: str | None) -> Entry:
        """The same under another name, with another start value, and no array."""
        other = copy.copy(self)
        other.name, other.start, other.sizes, other.shape = name, start, (), ()
        return other


@dataclass
class Description:
    """A model description.

    Attributes:
        found: what FMPy has read, which is all but the variables. entries: the variables.
    """

    found: Any
    entries: list[Entry]


class Texts(dict[str, str]):
    """Texts that come again and again, each kept once."""

    def __missing__(self, text: str) -> str:
        self[text] = text
        return text


def read_entry(element: Any, version: str, texts: Texts) -> Entry:
    """One variable.

    Args:
        element: the XML.
        version: of the standard.
        texts: what units and the like are kept in.

    Raises:
        ValueError, TypeError: it cannot be used.
    """
    own = dict(element.items())
    nested = version != "3.0"
    value = element
    if nested:  # mostly the first child
        first = element[0] if len(element) else None
        value = first if first is not None and first.tag in _TYPES else _value(element)
    entry = Entry()
    entry.name, entry.reference, entry.line = own["name"], int(own["valueReference"]), element.sourceline
    if value is None:
        raise ValueError(f'the variable "{entry.name}" has no type')
    typed = dict(value.items()) if nested else own
    entry.type, entry.fmi_type = value.tag, "" if nested else value.tag
    entry.description = own.get("description")
    entry.causality = texts[own.get("causality", "local")]
    entry.variability = texts[own.get("variability", "")]
    initial, entry.start, unit = own.get("initial"), typed.get("start"), typed.get("unit")
    entry.initial = None if initial is None else texts[initial]
    entry.unit = None if unit is None else texts[unit]
    for key in _RARE.keys() & typed.keys():
        setattr(entry, _RARE[key], typed[key])
    if "relativeQuantity" in typed:
        entry.relative = typed["relativeQuantity"] in ("true", "1")
    if version == "3.0":
        _read_3(element, own, entry)
    elif version == "1.0":
        _read_1(element, own, typed, entry)
    elif not entry.variability:
        entry.variability = "continuous"
    if entry.initial is None and version != "1.0":
        try:
            entry.initial = _INITIAL[entry.variability][entry.causality]
        except KeyError:
            what = f'causality="{entry.causality}" and variability="{entry.variability}"'
            where = f'Variable "{entry.name}" (line {entry.line})'
            raise ValueError(f"{where} has an illegal combination of {what}.") from None
    return entry


def _value(element: Any) -> Any:
    return next((child for child in element if child.tag in _TYPES), None)


def _read_1(element: Any, own: Mapping[str, str], typed: Mapping[str, str], entry: Entry) -> None:
    entry.variability = entry.variability or "continuous"
    entry.guessed = typed.get("fixed") in ("false", "0")
    entry.negated = own.get("alias") == "negatedAlias" and entry.type != "String"
    direct = element.find("DirectDependency") if len(element) > 1 else None
    if direct is not None:
        entry.depends = [(name.text or "").strip() for name in direct.iterfind("Name")]


def _read_3(element: Any, own: Mapping[str, str], entry: Entry) -> None:
    if not entry.variability:
        fixed = "continuous" if entry.type in _REALS else "discrete"
        entry.variability = "fixed" if entry.causality in _PARAMETERS else fixed
    entry.clocks = own.get("clocks")
    if not len(element):
        return
    if entry.type in ("Binary", "String"):
        entry.starts = [start.get("value") for start in element.iterfind("Start")]
        entry.start = entry.starts[0] if entry.starts else None
    entry.aliases = tuple(element.iterfind("Alias"))
    sizes = ((size.get("start"), size.get("valueReference", "")) for size in element.iterfind("Dimension"))
    entry.sizes = tuple(reference if start is None else int(start) for start, reference in sizes)


def resolve(entries: list[Entry], version: str) -> None:
    """Put what entries say of others by place or reference into other words, in place; aliases follow at the end.

    Raises:
        ValueError, KeyError: there is no such variable.
    """
    if version == "1.0":
        return
    if version == "2.0":
        for entry in entries:
            if entry.derivative is not None:
                entry.derivative = entries[int(entry.derivative) - 1]
        return
    referred = {entry.reference: entry for entry in entries}
    for entry in entries:
        entry.shape = tuple(
            size if isinstance(size, int) else int(referred[int(size)].start or "") for size in entry.sizes
        )
    others = [_alias(entry, alias) for entry in entries for alias in entry.aliases]
    entries += others
    for entry in entries:
        if entry.derivative is not None:
            reference = int(entry.derivative)
            if reference not in referred:
                where = f"The derivative attribute of model variable {entry.name} (line {entry.line})"
                raise ValueError(f"{where} references value reference {reference} which does not exist.")
            entry.derivative = referred[reference]


def _alias(entry: Entry, element: Any) -> Entry:
    other = copy.copy(entry)
    other.name, other.alias = element.get("name"), entry
    other.description = element.get("description") or entry.description
    other.display = element.get("displayUnit") or entry.display
    other.aliases = ()
    return other


def problems(entries: Iterable[Entry], description: Any, version: str) -> Iterator[str]:
    """What is wrong with them, one sentence each; for files that keep the schema.

    Args:
        entries: the variables.
        description: FMPy's, for units and types.
        version: of the standard.
    """
    entries = list(entries)
    names: set[str] = set()
    for e in entries:
        if e.name in names:
            yield f'The variable name "{e.name}" (line {e.line}) is not unique.'
        names.add(e.name)
    for e in entries:
        if e.variability == "continuous" and e.type not in _REALS:
            yield f'{_the(e)} is of type {e.type} and must have variability != "continuous".'
    if version == "1.0":
        return
    for e in entries:
        if e.start is None and e.type != "Clock" and (e.initial in ("exact", "approx") or e.causality == "input"):
            yield f'Variable "{e.name}" (line {e.line}) has no start value.'
    yield from _roles(entries)
    yield from _units(entries, description)
    if version == "3.0":
        yield from _references(entries)


def _the(entry: Entry) -> str:
    return f'The variable "{entry.name}" (line {entry.line})'


def _roles(entries: Iterable[Entry]) -> Iterator[str]:
    for e in entries:
        if (e.causality, e.variability, e.initial) not in _LEGAL:
            what = f'causality="{e.causality}" and variability="{e.variability}"'
            yield f'The combination {what} in variable "{e.name}" (line {e.line}) is not allowed.'
    for e in entries:
        if e.start and e.initial == "calculated":
            yield f'{_the(e)} has initial="calculated" but provides a start value.'
        if e.start and e.causality == "independent":
            yield f'{_the(e)} has causality="independent" but provides a start value.'


def _units(entries: Iterable[Entry], description: Any) -> Iterator[str]:
    shown = {unit.name: {display.name for display in unit.displayUnits} for unit in description.unitDefinitions}
    types = {made.name: made.unit for made in description.typeDefinitions}
    for e in entries:
        unit = types.get(e.declared) if e.unit is None else e.unit
        if unit is not None and unit not in shown:
            yield f'The unit "{unit}" of variable "{e.name}" (line {e.line}) is not defined.'
        if e.display is not None and e.display not in shown.get(unit, ()):
            of = f'variable "{e.name}" (line {e.line})'
            of = (
                of if e.alias is None else f'the variable alias "{e.name}" of variable "{e.alias.name}" (line {e.line})'
            )
            yield f'The display unit "{e.display}" of {of} is not defined.'


def _references(entries: list[Entry]) -> Iterator[str]:
    if sum(e.causality == "independent" for e in entries) != 1:
        yield "Exactly one independent variable must be defined."
    first: dict[int, Entry] = {}
    for e in entries:
        other = first.setdefault(e.reference, e)
        if other is not e and e.alias is None:
            same = f'the same value reference as variable "{other.name}" (line {other.line})'
            yield f'Variable "{e.name}" (line {e.line}) has {same}.'
