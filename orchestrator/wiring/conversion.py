"""Whether an input may follow an output, and how the value changes on the way: types and units."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..fmi import Interface, Type, Unit, Variable
from ..system import Connection

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
    own = Conversion(connection.scale, connection.offset)
    if a.type not in _COMPATIBLE[b.type]:
        return Conversion(problem=f"a {a.type} output cannot feed a {b.type} input")
    if b.type != "Real" and own != Conversion():
        return Conversion(problem=f"scale and offset apply to Real inputs, not to {b.type}")
    if a.unit is None or b.unit is None:
        return own
    return _units(a, of_a, b, of_b, own)


def _units(a: Variable, of_a: Interface, b: Variable, of_b: Interface, own: Conversion) -> Conversion:
    ua, ub = (of.units.get(it.unit or "") for it, of in ((a, of_a), (b, of_b)))
    if ua is None or ub is None or ua.exponents is None or ub.exponents is None:
        if a.unit == b.unit or own != Conversion():  # whoever gives a scale has taken care
            return own
        model, unit = (of_a.model, a.unit) if ua is None or ua.exponents is None else (of_b.model, b.unit)
        note = f"{unit!r} is not defined in SI units by {model}: what is in {a.unit!r} is taken for {b.unit!r} as it is"
        return replace(own, note=f"{note}; where they differ, give the connection a scale")
    if a.unit == b.unit:
        note = f"{of_a.model} and {of_b.model} define the unit {a.unit!r} differently: values pass as they are"
        return own if _is_same(ua, ub) else replace(own, note=note)
    if ua.exponents != ub.exponents:
        return Conversion(problem=f"unit {a.unit!r} does not convert to {b.unit!r}")
    scale, offset = convert(ua, ub)
    if a.relative or b.relative:
        offset = 0.0
    return Conversion(own.scale * scale, own.scale * offset + own.offset)


def convert(a: Unit, b: Unit) -> tuple[float, float]:
    """Scale and offset that turn a value in unit ``a`` into unit ``b``; both of the same dimension."""
    return a.factor / b.factor, (a.offset - b.offset) / b.factor


def _is_same(a: Unit, b: Unit) -> bool:
    """Whether two definitions agree; tools do not on whether an angle has a dimension, the last of the exponents."""
    scale, offset = convert(a, b)
    alike = (a.exponents or ())[:-1] == (b.exponents or ())[:-1]
    return alike and abs(scale - 1.0) <= 1e-6 and abs(offset) <= 1e-6 * max(1.0, abs(a.offset))
