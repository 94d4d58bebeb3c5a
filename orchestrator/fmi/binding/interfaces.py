"""An interface as plain values and back: a new process is told what its FMU shows, and need not read the XML again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ....fmus.annotation import Annotation
from ..interface import Interface, Sort, Unit, Variable


def plain_interface(interface: Interface) -> dict[str, Any]:
    """Numbers, texts, and lists and mappings of them, for `read_interface`."""
    own = interface.annotation
    sorts = {sort: k for k, sort in enumerate(dict.fromkeys(v.sort for v in interface.variables.values()))}
    return _fields(interface) | {
        "sorts": [sort._asdict() for sort in sorts],
        "variables": [[_plain(sorts.get(x, x) if x is v.sort else x) for x in v] for v in interface.variables.values()],
        "units": [_fields(unit) for unit in interface.units.values()],
        "annotation": own and _fields(own),
    }


def _fields(record: Any) -> dict[str, Any]:
    return {field.name: _plain(getattr(record, field.name)) for field in fields(record)}


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple | frozenset) else value


def read_interface(told: Mapping[str, Any]) -> Interface:
    """The interface that was told."""

    def unit(entry: dict[str, Any]) -> Unit:
        exponents = entry["exponents"]
        return Unit(**entry | {"exponents": None if exponents is None else tuple(exponents)})

    sorts = [Sort(**sort | {"choices": tuple(map(tuple, sort["choices"]))}) for sort in told["sorts"]]

    def variable(entry: list[Any]) -> Variable:
        name, reference, sort, start, description, dependencies, derivative, element = entry
        known = None if dependencies is None else frozenset(dependencies)
        of_array = None if element is None else (element[0], element[1])
        return Variable(name, reference, sorts[sort], start, description, known, derivative, of_array)

    own = told["annotation"]
    tuples = {name: tuple(value) for name, value in (own or {}).items() if isinstance(value, list)}
    parts = {
        "variables": {entry[0]: variable(entry) for entry in told["variables"]},
        "units": {entry["name"]: unit(entry) for entry in told["units"]},
        "arrays": {name: tuple(scalars) for name, scalars in told["arrays"].items()},
        "annotation": own and Annotation(**own | tuples),
        "warnings": tuple(told["warnings"]),
    }
    return Interface(**{name: parts.get(name, value) for name, value in told.items() if name != "sorts"})
