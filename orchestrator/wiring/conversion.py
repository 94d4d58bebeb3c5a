"""Whether an input may follow an output, and how the value changes on the way: types and units."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from ..fmi import Interface, Type, Variable
from ..system import Connection
from .units import Relation, relate

_AS_IT_IS: dict[Type, tuple[Type, ...]] = {
    "Real": ("Real", "Integer", "Enumeration", "Boolean"),
    "Integer": ("Integer", "Enumeration", "Boolean"),
    "Enumeration": ("Enumeration", "Integer", "Boolean"),
    "Boolean": ("Boolean",),
    "String": ("String",),
}
"""For an input's type, the output types it may follow without losing anything."""
_AS_NUMBER: dict[Type, str] = {"Boolean": "false as 0, true as 1", "Enumeration": "the number of its item"}
_ANY_BYTES = "application/octet-stream"
"""The MIME type of Binary variables of which the FMU does not say it."""
_A: dict[Type, str] = {kind: f"a{'n' * (kind[0] in 'EI')} {kind}" for kind in _AS_IT_IS}
_MAKES: dict[Type, str] = {"Boolean": "threshold = 0.5 makes it true above 0.5"}
_INTEGER = re.compile(r"[+-]?\d{1,19}")
_ROUNDS = "threshold = 0.5 takes the nearest whole number"


@dataclass(frozen=True)
class Conversion:
    """input = scale * output + offset; with a problem they do not fit; a note is what a user should know.

    Where there is a mapping, the input is what that makes of the output, or the output where it says nothing of it.
    """

    scale: float = 1.0
    offset: float = 0.0
    problem: str = ""
    note: str = ""
    mapping: Mapping[int, int] | None = None


def fit(a: Variable, of_a: Interface, b: Variable, of_b: Interface, connection: Connection) -> Conversion:
    """How output ``a`` feeds input ``b``; the connection's scale and offset apply after the conversion of units."""
    if connection.map is not None:
        return _mapped(a, b, connection)
    scale, offset = 1.0 if connection.scale is None else connection.scale, connection.offset
    problem = _misfit(a.type, b.type, connection, is_changed=(scale, offset) != (1.0, 0.0)) or _other_bytes(a, b)
    if problem:
        return Conversion(problem=problem)
    found = relate(a, of_a, b, of_b) if connection.convert else Relation()
    if connection.scale is not None or offset:  # whoever gives a scale has taken care; an offset leaves its doubt
        told = f"{found.refused.partition(';')[0]}; what is given there is applied to the values"
        found = found._replace(
            refused="",
            doubt="" if connection.scale is not None else found.doubt,
            note=told if found.refused else found.note,
        )
    note = found.doubt or found.note or _told(a.type, b.type, connection.threshold) or _told_of_bytes(a, b)
    note = "; ".join(filter(None, (note, _twice(found, scale, offset, a, b))))
    return Conversion(found.scale * scale, found.offset * scale + offset, found.refused, note)


def _mapped(a: Variable, b: Variable, connection: Connection) -> Conversion:
    """What single values become, as the numbers that instances exchange."""
    assert connection.map is not None
    if connection.scale is not None or connection.offset or connection.threshold is not None:
        return Conversion(problem="map stands for itself: leave scale, offset and threshold out")
    is_truth = a.type == b.type == "Boolean"
    if not is_truth and not {a.type, b.type} <= {"Integer", "Enumeration"}:
        what = f"{_A[a.type]} output leads to {_A[b.type]} input"
        return Conversion(problem=f"map is for Booleans, or for whole numbers and enumerations, and {what}")
    try:
        pairs = connection.map.items()
        return Conversion(mapping={_whole(source, a): _whole(str(target), b) for source, target in pairs})
    except ValueError as error:
        return Conversion(problem=str(error))


def _whole(text: str, variable: Variable) -> int:
    """A value in a map as a number.

    Raises:
        ValueError: the variable has no such value.
    """
    if variable.type == "Boolean" and text.lower() in ("true", "false"):
        return int(text.lower() == "true")
    if text in dict(variable.choices):
        return dict(variable.choices)[text]
    if variable.type != "Boolean" and _INTEGER.fullmatch(text):
        return int(text)
    items = ", ".join(name for name, _ in variable.choices)
    kind = "true or false" if variable.type == "Boolean" else f"a whole number{' or one of ' * bool(items)}{items}"
    raise ValueError(f"map takes {kind} for {variable.name}, not {text!r}")


def _twice(found: Relation, scale: float, offset: float, a: Variable, b: Variable) -> str:
    """What a user should know of a connection whose value is changed once for its units, and once more."""
    own, given = _change(found.scale, found.offset), _change(scale, offset)
    if not (own and given):
        return ""
    remedy = "; that is the same twice: leave scale and offset out" if own == given else ""
    return f"{a.unit!r} becomes {b.unit!r} by itself ({own}), and what is given ({given}) is applied after that{remedy}"


def _change(scale: float, offset: float) -> str:
    """What becomes of a value, in words; empty where nothing does."""
    parts = (f"times {scale:.6g}" if scale != 1.0 else "", f"plus {offset:.6g}" if offset else "")
    return ", ".join(filter(None, parts))


def _misfit(a: Type, b: Type, connection: Connection, *, is_changed: bool) -> str:
    """Why types do not go together, with the way out."""
    threshold = connection.threshold
    if "String" in (a, b) and a != b:
        return f"{_A[a]} output cannot feed {_A[b]} input"
    if b == "String" and (is_changed or threshold is not None):
        return "scale, offset and threshold apply to numbers, not to String"
    if b == "Real" and threshold is not None:
        return "a threshold is for inputs that are no Real"
    if threshold is None and (a not in _AS_IT_IS[b] or (is_changed and b != "Real")):
        what = "scale and offset lead" if a in _AS_IT_IS[b] else f"{_A[a]} output leads"
        return f"{what} to {_A[b]} input only with a threshold: {_MAKES.get(b, _ROUNDS)}"
    if threshold is not None and b in ("Integer", "Enumeration") and not 0.0 <= threshold < 1.0:
        return f"for {_A[b]} input the threshold is the fraction above which it is rounded up: from 0 to below 1"
    return ""


def _other_bytes(a: Variable, b: Variable) -> str:
    """Why bytes and texts, or bytes of two MIME types, do not go together."""
    if a.is_binary != b.is_binary:
        kinds = [f"{'a Binary' if one.is_binary else _A[one.type]}" for one in (a, b)]
        return f"{kinds[0]} output cannot feed {kinds[1]} input"
    given, taken = ("".join(one.media.lower().split()).partition(";")[0] for one in (a, b))
    if given != taken and _ANY_BYTES not in (given or _ANY_BYTES, taken or _ANY_BYTES):
        return f"the output is {a.media!r}, the input takes {b.media!r}"
    return ""


def _told_of_bytes(a: Variable, b: Variable) -> str:
    """What a user should know of bytes that may not be what the input takes."""
    given, taken = ("".join(one.media.lower().split()) for one in (a, b))
    notes = []
    if given != taken:
        notes.append(f"the output is {a.media or _ANY_BYTES!r}, the input takes {b.media or _ANY_BYTES!r}")
    if b.longest is not None and (a.longest is None or a.longest > b.longest):
        most = "any number of" if a.longest is None else a.longest
        notes.append(f"the output may have {most} bytes, the input takes {b.longest}; more would stop the run")
    return "; ".join(notes)


def _told(a: Type, b: Type, threshold: float | None) -> str:
    """What a user should know of a value that changes its type."""
    if threshold is not None and (a, b) != ("Boolean", "Boolean"):
        how = f"true above {threshold:g}" if b == "Boolean" else f"rounded up above a fraction of {threshold:g}"
        return f"{_A[a]} is given to {_A[b]}, {how}"
    is_number = b == "Real" or (b != "Boolean" and a == "Boolean")
    return f"{_A[a]} is given to {_A[b]}, {_AS_NUMBER[a]}" if is_number and a in _AS_NUMBER else ""
