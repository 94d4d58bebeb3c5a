"""Parameter sets (SSV), the mappings that are applied to them (SSM), and transformations of values."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from ..errors import ScenarioError
from ..fmi import Unit
from ..problems import Problem
from .documents import Document, children, first, local, only_child

_INTEGERS = {"Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))}
TRUTH = {"true": True, "1": True, "false": False, "0": False}
"""What XML has for Booleans."""
_READ: dict[str, Callable[[str], Any]] = {
    **dict.fromkeys(("Real", "Float64", "Float32"), float),
    **dict.fromkeys(_INTEGERS, int),
    "Boolean": lambda text: TRUTH[text.strip()],
    "String": str,
    "Enumeration": str,
}
_MAPS = ("BooleanMappingTransformation", "IntegerMappingTransformation", "EnumerationMappingTransformation")


@dataclass(frozen=True)
class Transformation:
    """What becomes of a value: ``factor * value + offset``, or another value by a table.

    Attributes:
        entries: values by values, both as text; None for a linear one.
    """

    factor: float = 1.0
    offset: float = 0.0
    entries: dict[str, str] | None = None


@dataclass(frozen=True)
class Setting:
    """A value for a parameter or another start value, by its name in what the binding belongs to."""

    name: str
    value: Any
    unit: Unit | None
    place: str
    suppressed: bool = False
    transformation: Transformation | None = None


def read_transformation(document: Document, element: Any) -> Transformation | None:
    """The transformation that stands in a connection or in an entry of a mapping."""
    linear = first(element, "LinearTransformation")
    if linear is not None:
        factor, offset = document.number(linear, "factor", 1.0), document.number(linear, "offset", 0.0)
        return Transformation(factor, offset)
    for name in _MAPS:
        table = first(element, name)
        if table is not None:
            pairs = [(entry.get("source", ""), entry.get("target", "")) for entry in children(table, "MapEntry")]
            if name == _MAPS[0]:
                pairs = [(_truth(source), _truth(target)) for source, target in pairs]
            entries = dict(pairs)
            if len(entries) < len(pairs):
                raise ScenarioError(Problem(document.place(table), "it maps one value to several"))
            return Transformation(entries=entries)
    return None


def _truth(text: str) -> str:
    return {"1": "true", "0": "false"}.get(text, text)


def is_suppressed(element: Any) -> bool:
    """Whether units are not converted."""
    return TRUTH.get(element.get("suppressUnitConversion", "false"), False)


def read_bindings(document: Document, element: Any, source: str | None) -> list[Setting]:
    """The settings of an element, in the order in which they apply.

    Args:
        document: that the element stands in.
        element: a system or a component.
        source: where the component's own file is, for sources that are relative to it.

    Raises:
        ScenarioError: a source cannot be read.
    """
    found: list[Setting] = []
    for binding in children(element, "ParameterBindings", "ParameterBinding"):
        sets = _sourced(document, binding, "ParameterValues", "ParameterSet", source)
        prefix = binding.get("prefix", "")
        settings = [replace(one, name=prefix + one.name) for part in sets for one in _parameters(part)]
        mapping = first(binding, "ParameterMapping")
        if mapping is not None:
            settings = [one for part in _mappings(document, mapping, source) for one in _mapped(settings, part)]
        found += settings
    return found


def _sourced(document: Document, element: Any, inline: str, kind: str, source: str | None) -> Iterator[Document]:
    """What an element names as its source, or holds itself."""
    uri = element.get("source")
    if uri is not None:
        yield _external(document, element, uri, kind, source)
    elif (content := first(element, inline)) is not None and (inner := only_child(content)) is not None:
        yield document.part(inner, kind)


def _mappings(document: Document, mapping: Any, source: str | None) -> Iterator[Document]:
    uri = mapping.get("source")
    if uri is not None:
        yield _external(document, mapping, uri, "ParameterMapping", source)
    elif (inner := only_child(mapping)) is not None:
        yield document.part(inner, "ParameterMapping")


def _external(document: Document, element: Any, uri: str, kind: str, source: str | None) -> Document:
    place = document.place(element)
    package, base = document.package, document.path
    if element.get("sourceBase") == "component":
        if source is None:
            raise ScenarioError(Problem(place, "its source is relative to a component, and there is none"))
        package, base = (package, source) if source.lower().endswith(".ssd") else (package.inner(source), "")
    path, _ = package.resolve(uri, base, place)
    return Document.read(package, path, kind, document.notes)


def _parameters(document: Document) -> Iterator[Setting]:
    for parameter in children(document.root, "Parameters", "Parameter"):
        place = document.place(parameter)
        name = parameter.get("name", "")
        kind = next((one for one in parameter if local(one) in (*_READ, "Binary")), None)
        if kind is None or local(kind) == "Binary":
            what = "has no value of a known type" if kind is None else "is Binary, which is not supported"
            document.note(parameter, f"parameter {name!r} {what}; it is left out")
            continue
        read = _READ[local(kind)]
        single = [one.get("value", one.text or "") for one in children(kind, "Value")] or [kind.get("value", "")]
        try:
            if first(parameter, "Dimension") is None:
                (text,) = single
                value: Any = read(text)
            elif len(single) == 1 and read is not str:
                value = [read(text) for text in single[0].split()]
            else:
                value = [read(text) for text in single]
        except (ValueError, KeyError):
            what = f"parameter {name!r}: {', '.join(single)[:80]!r} is no {local(kind)}"
            raise ScenarioError(Problem(place, what)) from None
        yield Setting(name, value, document.unit(kind), place)


def _mapped(settings: list[Setting], mapping: Document) -> Iterator[Setting]:
    """What a mapping makes of the settings: those that it does not name are not applied."""
    taken: dict[str, str] = {}
    for entry in children(mapping.root, "MappingEntry"):
        source, target = entry.get("source", ""), entry.get("target", "")
        if target in taken:
            what = f"{target!r} is mapped to already, from {taken[target]!r}"
            raise ScenarioError(Problem(mapping.place(entry), what, "one value has one source"))
        taken[target] = source
        transformation, suppressed = read_transformation(mapping, entry), is_suppressed(entry)
        matching = [one for one in settings if one.name == source]
        if not matching:
            mapping.note(entry, f"there is no parameter {source!r} in what is mapped")
        for one in matching:
            place = f"{one.place} (as mapped at {mapping.place(entry)})"
            yield replace(one, name=target, suppressed=suppressed, transformation=transformation, place=place)
