"""Whether an input may follow an output, and how the value changes on the way: types and units."""

from __future__ import annotations

from dataclasses import dataclass

from ..fmi import Interface, Type, Variable
from ..system import Connection
from .units import relate

_COMPATIBLE: dict[Type, tuple[Type, ...]] = {
    "Real": ("Real", "Integer"),
    "Integer": ("Integer", "Enumeration"),
    "Enumeration": ("Enumeration", "Integer"),
    "Boolean": ("Boolean",),
    "String": ("String",),
}
"""For an input's type, the output types it may follow without losing anything."""


@dataclass(frozen=True)
class Conversion:
    """input = scale * output + offset; with a problem they do not fit; a note is what a user should know."""

    scale: float = 1.0
    offset: float = 0.0
    problem: str = ""
    note: str = ""


def fit(a: Variable, of_a: Interface, b: Variable, of_b: Interface, connection: Connection) -> Conversion:
    """How output ``a`` feeds input ``b``; the connection's scale and offset apply after the conversion of units."""
    scale, offset = 1.0 if connection.scale is None else connection.scale, connection.offset
    if a.type not in _COMPATIBLE[b.type]:
        return Conversion(problem=f"a {a.type} output cannot feed a {b.type} input")
    if b.type != "Real" and (scale, offset) != (1.0, 0.0):
        return Conversion(problem=f"scale and offset apply to Real inputs, not to {b.type}")
    found = relate(a, of_a, b, of_b)
    if connection.scale is not None or offset:  # whoever gives one has taken care of what is not known
        note = (
            f"{found.refused.partition(';')[0]}; what is given there is applied to the values" if found.refused else ""
        )
        found = found._replace(refused="", undefined="", note=note or found.note)
    note = found.undefined or found.note
    return Conversion(found.scale * scale, found.offset * scale + offset, found.refused, note)
