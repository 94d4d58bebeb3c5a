"""Units as text, ``"N.s2/(m2.kg)"``, and what they mean in SI base units (the exponents FMI asks for)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""The base units of FMI 2.0, in the order of the exponents."""


@dataclass(frozen=True)
class UnitMeaning:
    """Value in SI base units = factor * value + offset; exponents over `BASE`."""

    exponents: tuple[int, ...]
    factor: float = 1.0
    offset: float = 0.0


def _unit(factor: float = 1.0, offset: float = 0.0, **exponents: int) -> UnitMeaning:
    return UnitMeaning(tuple(exponents.get(base, 0) for base in BASE), factor, offset)


_SYMBOLS = {
    **{base: _unit(**{base: 1}) for base in BASE},
    "1": _unit(),
    "N": _unit(kg=1, m=1, s=-2),
    "J": _unit(kg=1, m=2, s=-2),
    "W": _unit(kg=1, m=2, s=-3),
    "Pa": _unit(kg=1, m=-1, s=-2),
    "V": _unit(kg=1, m=2, s=-3, A=-1),
    "Hz": _unit(s=-1),
    "km": _unit(1e3, m=1),
    "mm": _unit(1e-3, m=1),
    "kN": _unit(1e3, kg=1, m=1, s=-2),
    "t": _unit(1e3, kg=1),
    "min": _unit(60.0, s=1),
    "h": _unit(3600.0, s=1),
    "deg": _unit(math.pi / 180.0, rad=1),
    "degC": _unit(1.0, 273.15, K=1),
    "%": _unit(0.01),
}


def parse(text: str) -> UnitMeaning:
    """The meaning of a unit: symbols with trailing exponents, joined by ``.`` and ``/``, grouped by parentheses.

    Raises:
        ValueError: an unknown symbol or a malformed text.
    """
    tokens = re.findall(r"[A-Za-z%]+|-?\d+|[./()]|.", text)
    meaning, rest = _product(tokens, text)
    if rest:
        raise ValueError(f"unit {text!r}: {rest[0]!r} is out of place")
    return meaning


def _product(tokens: list[str], text: str) -> tuple[UnitMeaning, list[str]]:
    meaning, tokens = _factor(tokens, text)
    while tokens and tokens[0] in (".", "/"):
        power = 1 if tokens[0] == "." else -1
        other, tokens = _factor(tokens[1:], text)
        exponents = tuple(a + power * b for a, b in zip(meaning.exponents, other.exponents, strict=True))
        meaning = UnitMeaning(exponents, meaning.factor * other.factor**power)
    return meaning, tokens


def _factor(tokens: list[str], text: str) -> tuple[UnitMeaning, list[str]]:
    if not tokens:
        raise ValueError(f"unit {text!r} ends too early")
    first, rest = tokens[0], tokens[1:]
    if first == "(":
        inner, rest = _product(rest, text)
        if not rest or rest[0] != ")":
            raise ValueError(f"unit {text!r} lacks a closing parenthesis")
        return inner, rest[1:]
    if first not in _SYMBOLS:
        raise ValueError(f"unit {text!r}: {first!r} is not a unit known here ({', '.join(_SYMBOLS)})")
    meaning = _SYMBOLS[first]
    if rest and first != "1" and re.fullmatch(r"-?\d+", rest[0]):
        power = int(rest[0])
        return UnitMeaning(tuple(power * e for e in meaning.exponents), meaning.factor**power), rest[1:]
    return meaning, rest
