"""Faults of an FMI 2.0 model description that FMPy cannot read past, or reads as something else, put right and told.

Tools write them, and the FMUs run: a parameter without a variability, a type that is not defined, a dependency on a
variable that is not there. Where a fault leaves no doubt about what is meant, that is put in its place; where it does,
what is doubtful is taken out.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from .entries import Entry

_TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
_CAUSALITIES = ("parameter", "calculatedParameter", "input", "output", "local", "independent")
_VARIABILITIES = ("constant", "fixed", "tunable", "discrete", "continuous")
_LEGAL = {
    ("output", "constant"),
    ("local", "constant"),
    *((causality, v) for causality in ("parameter", "calculatedParameter", "local") for v in ("fixed", "tunable")),
    *((causality, v) for causality in ("input", "output", "local") for v in ("discrete", "continuous")),
    ("independent", "continuous"),
}
"""Causalities and variabilities that go together (FMI 2.0, 2.2.7), so that `initial` has a default."""
_TYPE_ATTRIBUTES = frozenset(
    ("quantity", "unit", "displayUnit", "relativeQuantity", "min", "max", "nominal", "unbounded")
)
_ITEM_ATTRIBUTES = frozenset(("name", "value", "description"))
_EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_LARGEST = 2**32 - 1
_SHORT = 10
"""Digits that a number has to have to be larger."""
_PLAIN = frozenset(("start", "unit", "quantity"))
"""Attributes of a value of which nothing else can be wrong."""
_OWN = re.compile(r'"[^"]*"|\d+')
"""In what faults of one kind differ: names in double quotes, and numbers."""
_MOST_KINDS = 12
"""Kinds of faults that are told of one file."""


class Faults:
    """The first of each kind, and how many there were: a million of them take no room."""

    def __init__(self) -> None:
        self._first: dict[str, str] = {}
        self._count = Counter[str]()

    def add(self, faults: Iterable[str]) -> None:
        """Note some, a sentence each."""
        for fault in faults:
            kind = _OWN.sub("", fault)
            self._first.setdefault(kind, fault)
            self._count[kind] += 1

    def join(self, others: Faults) -> None:
        """Note those of others."""
        for kind, first in others._first.items():
            self._first.setdefault(kind, first)
        self._count += others._count

    def told(self) -> list[str]:
        """A sentence for each kind."""
        told = [
            first + (f" (and {self._count[kind] - 1} more like it)" if self._count[kind] > 1 else "")
            for kind, first in list(self._first.items())[:_MOST_KINDS]
        ]
        more = len(self._first) - len(told)
        return [*told, f"and {more} more kinds of faults"] if more > 0 else told


class Repair:
    """Puts a model description right, in place and part by part; one sentence a fault, with names in double quotes.

    Args:
        before: one that has been through the whole file already, where what is referred to comes after what refers.

    Attributes:
        head, variables, structure: what was wrong.
    """

    def __init__(self, before: Repair | None = None) -> None:
        self.head, self.variables, self.structure = Faults(), Faults(), Faults()
        self.names: set[str] = set()
        self._count: int = 0 if before is None else before._count
        self._is_known = before is not None
        self._definitions = Faults()
        self._units: set[str | None] = set() if before is None else before._units
        self._types: dict[str | None, str | None] = {} if before is None else before._types
        self._is_begun = False

    def begin(self, root: Any) -> None:
        """Units and types, as far as they have been read."""
        if not self._is_begun:
            self._is_begun = True
            self._define(root)

    def end(self, root: Any) -> None:
        """All but variables and structure."""
        self._define(root)
        self.head.add(_head(root))
        self.head.join(self._definitions)
        if root.find("ModelVariables") is None:
            root.append(root.makeelement("ModelVariables"))
            self.variables.add(["it lists no variables"])

    def _define(self, root: Any) -> None:
        """Put units and types right, once each, and note them."""
        self._definitions.add(_units(root))
        self._definitions.add(_types(root))
        units = root.findall("UnitDefinitions/Unit")
        self._units |= {unit.get("name") for unit in units}
        self._types |= {made.get("name"): made[0].get("unit") for made in root.findall("TypeDefinitions/SimpleType")}

    def take_variables(self, elements: Iterable[Any]) -> list[Any]:
        """Variables; those that are some.

        Raises:
            ValueError: one cannot be used; the message names it.
        """
        taken = []
        for element in elements:
            if element.tag == "ScalarVariable":
                taken.append(element)
            else:
                element.getparent().remove(element)
                self.variables.add([f"<{element.tag}> among the variables is left out"])
        for element in taken:
            if not self._is_plain(element):
                self.variables.add(self._variable(element, len(self.names) + 1))
        self._count = self._count if self._is_known else len(self.names)
        return taken

    def _is_plain(self, variable: Any) -> bool:
        """Whether a variable has nothing that could be wrong, as most of a million have; its name is noted then."""
        name, reference = variable.get("name"), variable.get("valueReference", "")
        if not name or name in self.names or not (reference.isdecimal() and len(reference) < _SHORT):
            return False
        if len(variable) != 1 or variable[0].tag != "Real":
            return False
        if (variable.get("causality", "local"), variable.get("variability", "continuous")) not in _LEGAL:
            return False
        value = variable[0]
        if not _PLAIN.issuperset(value.keys()) or _number(value.get("start", "0")) is None:
            return False
        self.names.add(name)
        return True

    def _variable(self, variable: Any, place: int) -> Iterator[str]:
        yield from _name(variable, place, self.names)
        name = variable.get("name")
        value = next((child for child in variable if child.tag in _TYPES), None)
        if value is None:
            raise ValueError(f'the variable "{name}" has no type')
        reference = variable.get("valueReference", "")
        if not (reference.strip().isdecimal() and int(reference) <= _LARGEST):
            raise ValueError(f'the variable "{name}" has the value reference "{reference}"')
        yield from _causality(variable, name)
        yield from _value(value, name)
        made = value.get("declaredType")
        if made is not None and made not in self._types:
            yield f'the type "{made}" of "{name}" is not defined'
            del value.attrib["declaredType"]
        unit = value.get("unit") or self._types.get(made)
        if value.get("displayUnit") is not None and unit not in self._units:
            yield f'the display unit of "{name}" is left out: its unit "{unit or ""}" is not defined'
            del value.attrib["displayUnit"]

    def take_unknowns(self, section: str, elements: Iterable[Any]) -> list[Any]:
        """What a section of the model structure lists; those of them that are variables."""
        taken = []
        for unknown in elements:
            index = unknown.get("index")
            if unknown.get("dependencies", "") == "" and _place(index, self._count) is not None:
                taken.append(unknown)
            elif _place(index, self._count) is None:
                unknown.getparent().remove(unknown)
                self.structure.add([f'{section} lists variable number "{index}": there is none'])
            else:
                self.structure.add(_dependencies(unknown, section, index, self._count))
                taken.append(unknown)
        return taken

    def take_derivative(self, entry: Entry) -> None:
        """What a variable is the rate of, once all are known."""
        if entry.derivative is not None and _place(entry.derivative, self._count) is None:
            told = f'"{entry.name}" is to be the derivative of variable number "{entry.derivative}": there is none'
            self.variables.add([told])
            entry.derivative = None

    @property
    def faults(self) -> Faults:
        """All of them, in the order of a file."""
        every = Faults()
        for part in (self.head, self.variables, self.structure):
            every.join(part)
        return every


def _head(root: Any) -> Iterator[str]:
    version = root.get("fmiVersion", "")
    if version != "2.0":
        root.set("fmiVersion", "2.0")
        yield f'fmiVersion="{version}" is taken for 2.0'
    simulation = root.find("CoSimulation")
    names = simulation.get("modelIdentifier"), root.get("modelName"), "model"
    known = next(name for name in names if name)
    for element, key, value in ((root, "modelName", known), (simulation, "modelIdentifier", known), (root, "guid", "")):
        if element.get(key) is None:
            element.set(key, value)
            yield f"it has no {key}"
    for element in (simulation, root.find("ModelExchange")):
        yield from _truths(element, () if element is None else set(element.attrib) - {"modelIdentifier"})
    if not simulation.get("maxOutputDerivativeOrder", "0").isdecimal():
        del simulation.attrib["maxOutputDerivativeOrder"]
    for experiment in root.findall("DefaultExperiment"):
        yield from _numbers(experiment, ("startTime", "stopTime", "tolerance", "stepSize"), "the default experiment")


def _truths(element: Any, keys: Iterable[str]) -> Iterator[str]:
    """``True`` is not how XML writes it, and would count as false."""
    for key in keys:
        text = element.get(key, "")
        meant = text.strip().lower()
        if meant != text and meant in ("true", "false"):
            element.set(key, meant)
            yield f'{key}="{text}" is taken for {meant}'


def _numbers(element: Any, keys: Iterable[str], owner: str) -> Iterator[str]:
    """Take out what is no number."""
    for key in keys:
        text = element.get(key)
        if text is not None and _number(text) is None:
            del element.attrib[key]
            yield f'{owner} has {key}="{text}", which is no number; it is left out'


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


# -------------------------------------------------------------------- units and types


def _units(root: Any) -> Iterator[str]:
    for unit in root.findall("UnitDefinitions/Unit"):
        name = unit.get("name")
        if name is None:
            unit.getparent().remove(unit)
            yield "a unit without a name is left out"
            continue
        for base in unit.findall("BaseUnit"):
            exponents = [_number(base.get(key, "0")) for key in _EXPONENTS]
            factor, offset = _number(base.get("factor", "1")), _number(base.get("offset", "0"))
            known = all(e is not None and e.is_integer() for e in exponents)
            if known and factor and offset is not None and math.isfinite(factor) and math.isfinite(offset):
                for key, exponent in zip(_EXPONENTS, exponents, strict=True):
                    if base.get(key) not in (None, str(int(exponent or 0))):
                        base.set(key, str(int(exponent or 0)))
                continue
            unit.remove(base)
            yield f'the definition of the unit "{name}" cannot be used ({_written(base)}); it converts to no other'
        for display in unit.findall("DisplayUnit"):
            yield from _numbers(display, ("factor", "offset"), f'a display unit of "{name}"')


def _written(element: Any) -> str:
    return " ".join(f'{key}="{text}"' for key, text in element.attrib.items())


def _types(root: Any) -> Iterator[str]:
    for made in root.findall("TypeDefinitions/SimpleType"):
        kind = next((child for child in made if child.tag in _TYPES), None)
        if kind is None or made.get("name") is None:
            made.getparent().remove(made)
            yield f'the type "{made.get("name")}" is not defined'
            continue
        made[:] = [kind]  # FMPy looks at the first child, were it a comment
        for element, known in ((kind, _TYPE_ATTRIBUTES), *((item, _ITEM_ATTRIBUTES) for item in kind.findall("Item"))):
            for key in set(element.attrib) - known:
                del element.attrib[key]
                yield f'the type "{made.get("name")}" has an attribute "{key}", which the standard does not know'
        yield from _numbers(kind, ("min", "max", "nominal"), f'the type "{made.get("name")}"')
        for place, item in enumerate(kind.findall("Item"), 1):
            if not _is_whole(item.get("value", "")):
                yield f'"{item.get("name")}", an item of the type "{made.get("name")}", is taken for number {place}'
                item.set("value", str(place))


# -------------------------------------------------------------------- variables


def _name(variable: Any, place: int, names: set[str]) -> Iterator[str]:
    """Nothing is taken away: others are counted from here on."""
    given = variable.get("name")
    name = given or f"variable_{place}"
    if not given:
        yield f'variable number {place} has no name; it is called "{name}"'
    base, count = name, 1
    while name in names:
        count += 1
        name = f"{base} ({count})"
    if name != base:
        yield f'there are several variables "{base}"; this one is called "{name}"'
    names.add(name)
    if name != given:
        variable.set("name", name)


def _causality(variable: Any, name: str) -> Iterator[str]:
    causality, variability = variable.get("causality", "local"), variable.get("variability")
    if causality not in _CAUSALITIES:
        yield f'causality="{causality}" of "{name}" is taken for local'
        causality = "local"
        variable.set("causality", causality)
    if variability not in (None, *_VARIABILITIES):
        yield f'variability="{variability}" of "{name}" is left out'
        variability = None
        del variable.attrib["variability"]
    if variability is None and causality in ("parameter", "calculatedParameter"):
        yield f'the {causality} "{name}" does not say whether it is fixed; it is taken to be'
        variability = "fixed"
        variable.set("variability", variability)
    if variable.get("initial") is None and (causality, variability or "continuous") not in _LEGAL:
        yield f'"{name}" is {variability or "continuous"} though its causality is {causality}'
        variable.set("initial", "exact" if causality in ("parameter", "input") else "calculated")


def _value(value: Any, name: str) -> Iterator[str]:
    yield from _numbers(value, ("min", "max", "nominal"), f'"{name}"')
    start = value.get("start")
    if start is None or value.tag == "String":
        return
    if value.tag == "Boolean":
        yield from _truths(value, ("start",))
        usable = value.get("start") in ("true", "false", "0", "1")
    else:
        number = _number(start)
        usable = number is not None and (value.tag == "Real" or number.is_integer())
        if usable and number is not None and value.tag != "Real":
            value.set("start", str(int(number)))
            if not _is_whole(start):
                yield f'the start value "{start}" of "{name}" is taken for {int(number)}'
    if not usable:
        yield f'the start value "{start}" of "{name}" is no {value.tag}; it is left out'
        del value.attrib["start"]


def _is_whole(text: str) -> bool:
    try:
        return int(text) is not None
    except ValueError:
        return False


# -------------------------------------------------------------------- model structure


def _dependencies(unknown: Any, section: str, index: str, count: int) -> Iterator[str]:
    """Whitespace as FMPy expects it; what is no variable goes, and with the last of them what is known of others."""
    words = unknown.get("dependencies", "").split()
    usable = [word for word in words if _place(word, count) is not None]
    strange = [word for word in words if _place(word, count) is None]
    if strange:
        yield f'in {section}, variable number {index} depends on variable number "{strange[0]}": there is none'
    if words and not usable:
        del unknown.attrib["dependencies"]
    elif words:
        unknown.set("dependencies", " ".join(usable))


def _place(text: str | None, count: int) -> int | None:
    """A number from 1 to the number of variables."""
    if text is None or not text.strip().isdecimal():
        return None
    number = int(text)
    return number if 1 <= number <= count else None
