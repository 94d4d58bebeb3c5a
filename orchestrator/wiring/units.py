"""How a value in one FMU's unit becomes a value in another's, by what the FMUs say of their units."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from ..fmi import Interface, Unit, Variable

_RATES = {"rad/s": 1.0, "rad/min": 1.0 / 60.0, "deg/s": math.pi / 180.0, "deg/min": math.pi / 10800.0}
_RATES |= {"Hz": 2.0 * math.pi, "kHz": 2e3 * math.pi, "MHz": 2e6 * math.pi, "rev/s": 2.0 * math.pi}
_RATES |= dict.fromkeys(("rpm", "RPM", "rev/min", "r/min", "U/min", "1/min"), math.pi / 30.0)
_ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi, "turn": 2.0 * math.pi}
"""What units of angle and of rotation mean, in rad and rad/s: tools disagree on how to define them."""
_PER = re.compile(r"[ .*·]?(s|min)(?:\^|\*\*)?\(?(?:-1|⁻¹)\)?")
_OTHER_WORDS = {"°": "deg", "degrees": "deg", "degree": "deg", "radians": "rad", "radian": "rad"}


class Relation(NamedTuple):
    """What is ``x`` in one unit is ``scale * x + offset`` in the other.

    Attributes:
        refused: why there is no such scale by what the FMUs say. doubt: why it may be another one. A connection's own
            scale settles both. note: what a user should know of it anyhow.
    """

    scale: float = 1.0
    offset: float = 0.0
    refused: str = ""
    doubt: str = ""
    note: str = ""


def relate(a: Variable, of_a: Interface, b: Variable, of_b: Interface) -> Relation:
    """The relation of an output's unit to an input's."""
    if a.unit is None or b.unit is None:
        return Relation()
    ua, ub = of_a.units.get(a.unit), of_b.units.get(b.unit)
    if ua is None or ub is None or ua.exponents is None or ub.exponents is None:
        model, unit = (of_a.model, a.unit) if ua is None or ua.exponents is None else (of_b.model, b.unit)
        why = f"{unit!r} is not defined in SI units by {model}: what is in {a.unit!r} is taken for {b.unit!r} as it is"
        known = _known(a.unit, b.unit)
        remedy = "where they differ, give the connection a scale" + (f", such as scale = {known!r}" if known else "")
        return Relation(doubt="" if a.unit == b.unit else f"{why}; {remedy}")
    if a.unit == b.unit:
        note = f"{of_a.model} and {of_b.model} define the unit {a.unit!r} differently: values pass as they are"
        return Relation(note="" if _is_same(ua, ub) else note)
    if ua.exponents != ub.exponents:
        return Relation(refused=_refusal(ua, of_a, ub, of_b))
    scale, offset = convert(ua, ub)
    if not (a.relative or b.relative):
        return Relation(scale, offset, doubt=_doubt(ua, ub, scale))
    note = f"one of the two is a difference (relativeQuantity), so {a.unit!r} becomes {b.unit!r} without an offset"
    return Relation(scale, note=note if offset and a.relative != b.relative else "")


def convert(a: Unit, b: Unit) -> tuple[float, float]:
    """Scale and offset that turn a value in unit ``a`` into unit ``b``; both of the same dimension."""
    return a.factor / b.factor, (a.offset - b.offset) / b.factor


def _is_same(a: Unit, b: Unit) -> bool:
    """Whether two definitions agree; tools do not on whether an angle has a dimension, the last of the exponents."""
    scale, offset = convert(a, b)
    alike = (a.exponents or ())[:-1] == (b.exponents or ())[:-1]
    return alike and abs(scale - 1.0) <= 1e-6 and abs(offset) <= 1e-6 * max(1.0, abs(a.offset))


def _refusal(a: Unit, of_a: Interface, b: Unit, of_b: Interface) -> str:
    what = f"unit {a.name!r} does not convert to {b.name!r}"
    in_a, in_b = (a.exponents or ())[-1], (b.exponents or ())[-1]
    if (a.exponents or ())[:-1] != (b.exponents or ())[:-1]:
        return f"{what}: they are of different dimensions; if the values fit, give the connection a scale (scale = 1.0)"
    said = f"{of_a.model} gives {a.name!r} the exponent {in_a} of rad, {of_b.model} gives {b.name!r} {in_b}"
    scale = _known(a.name, b.name) or convert(a, b)[0]
    return f"{what}: {said}; give the connection a scale (if they are what they are called, scale = {scale!r})"


def _doubt(a: Unit, b: Unit, scale: float) -> str:
    """What to say of definitions that make something else of an angle than its name does: 1 Hz is not 1 rad/s."""
    known = _known(a.name, b.name)
    if known is None or abs(scale - known) <= 1e-3 * known:
        return ""
    made = f"as the FMUs define them, 1 {a.name} is {scale:g} {b.name}, not {known:g}"
    return f"{made}; if they are what they are called, give the connection scale = {known / scale!r}"


def _known(a: str, b: str) -> float | None:
    """The scale between two units of angle or of rotation by their names."""
    a, b = _spelled(a), _spelled(b)
    table = next((table for table in (_ANGLES, _RATES) if a in table and b in table), None)
    return None if table is None else table[a] / table[b]


def _spelled(unit: str) -> str:
    """A unit as the tables spell it: ``rad.s-1`` and ``rad s^-1`` are ``rad/s``."""
    over, _, per = _PER.sub(r"/\1", unit.strip()).partition("/")
    over = _OTHER_WORDS.get(over.strip(), over.strip() or "1")
    return f"{over}/{'s' if per == 'sec' else per.strip()}" if per else over
