"""What becomes of a value on its way: conversions of units and transformations, one after the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ..errors import ScenarioError
from ..fmi import Unit
from ..problems import Problem
from ..wiring import convert
from .values import Transformation


@dataclass(frozen=True)
class Way:
    """``scale * value + offset``, or another value by a table.

    Attributes:
        entries: of the table, as text; None for a linear way.
        unit: what the value has come to be in; None where that is not known.
        suppressed: whether some conversion of units was to be left out.
        known: whether all units were known that were to be converted.
    """

    unit: Unit | None = None
    scale: float = 1.0
    offset: float = 0.0
    entries: dict[str, str] | None = None
    suppressed: bool = False
    known: bool = True

    def to(self, unit: Unit | None, suppressed: bool, transformation: Transformation | None, place: str) -> Way:
        """The way to the next connector: units are converted first, then the transformation applies.

        Args:
            unit: of the next connector; None where it has none of its own.
            suppressed: whether units are left as they are.
            transformation: that of a connection or a mapping.
            place: where that stands.

        Raises:
            ScenarioError: units of different dimensions, or transformations that do not go together.
        """
        way = replace(self, unit=unit or self.unit, suppressed=self.suppressed or suppressed)
        if self.unit is not None and unit is not None and self.unit.name != unit.name and not suppressed:
            way = way._converted(self.unit, unit, place)
        if transformation is None:
            return way
        if transformation.entries is None:
            if way.entries is not None:
                raise ScenarioError(Problem(place, "a linear transformation of values that were mapped by a table"))
            factor, offset = transformation.factor, transformation.offset
            return replace(way, scale=way.scale * factor, offset=way.offset * factor + offset)
        if (way.scale, way.offset) != (1.0, 0.0):
            raise ScenarioError(Problem(place, "a table for values that were transformed linearly"))
        table, entries = way.entries or {}, transformation.entries
        merged = {source: entries.get(target, target) for source, target in table.items()}
        return replace(way, entries=entries | merged)

    def _converted(self, a: Unit, b: Unit, place: str) -> Way:
        if a.exponents is None or b.exponents is None:
            return replace(self, known=False)
        if a.exponents[:-1] != b.exponents[:-1]:  # tools do not agree on whether an angle has a dimension
            what = f"unit {a.name!r} does not convert to {b.name!r}: they are of different dimensions"
            raise ScenarioError(Problem(place, what, "suppressUnitConversion leaves values as they are"))
        factor, offset = convert(a, b)
        return replace(self, scale=self.scale * factor, offset=self.offset * factor + offset)

    def apply(self, value: Any, place: str) -> Any:
        """What a value becomes.

        Raises:
            ScenarioError: it is no number, and is to be calculated with.
        """
        if isinstance(value, list):
            return [self.apply(one, place) for one in value]
        if self.entries is not None:
            text = str(value).lower() if isinstance(value, bool) else str(value)
            found = self.entries.get(text, text)
            try:
                return {"true": True, "false": False}[found] if isinstance(value, bool) else type(value)(found)
            except (KeyError, ValueError):
                raise ScenarioError(Problem(place, f"its table makes {found!r} of {value!r}")) from None
        if (self.scale, self.offset) == (1.0, 0.0):
            return value
        if isinstance(value, str | bool):
            raise ScenarioError(Problem(place, f"{value!r} is no number, and is transformed linearly"))
        return self.scale * value + self.offset
