"""`Dimension`: a key of the scenario, and the values it takes from run to run."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ScenarioError
from ...problems import Problem
from ...scenario import parse_value, split_assignment
from .laws import Law

MOST_VALUES = 1_000_000
_NUMBER = re.compile(r"[+-]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_WHOLE = re.compile(r"[+-]?\d[\d_]*")
_COUNTED = re.compile(r"simulation\.(seed|max_iterations|extrapolation)|[^.]+\.count")
"""Keys that take whole numbers alone, whatever the models are."""
_FORMS = "low:high:count, low:high, values with commas, or a distribution such as normal(mean, sd)"


@dataclass(frozen=True)
class Dimension:
    """One thing that is varied: either the values of a grid or list, or a distribution.

    Attributes:
        name: a key as `--set` has it (`cruise.alpha`, `train[2].mass`, `simulation.seed`, `events[1].at`), an instance
            whose model is swapped (`cruise`), or `preset`.
        values: of a grid or a list, in their order; empty for a distribution.
        law: the distribution; None for a grid or a list.
    """

    name: str
    values: tuple[Any, ...] = ()
    law: Law | None = None

    @classmethod
    def parse(cls, text: str) -> Dimension:
        """Read what `--vary` takes: `cruise.alpha=0.005:0.05:10`, `cruise=ComfortCruise,TunablePotentialCruise`, ...

        Raises:
            ScenarioError: it cannot be read.
        """
        key, equals, what = split_assignment(text)
        if not equals or not key.strip() or not what.strip():
            example = "is not of the form name=values, as in --vary cruise.alpha=0.005:0.05:10"
            raise ScenarioError(Problem(f"--vary {text}", example))
        try:
            return cls.read(key.strip(), what.strip())
        except ScenarioError as error:
            raise ScenarioError(error.at(f"--vary {text}")) from None

    @classmethod
    def read(cls, name: str, what: Any) -> Dimension:
        """A dimension of a key and what stands for its values: a text as above, or a list or value of TOML.

        Raises:
            ScenarioError: it cannot be read; without its place.
        """
        if isinstance(what, str):
            return _of_text(name, what)
        return _listed(name, what if isinstance(what, list) else [what])

    def at(self, shares: NDArray[np.float64]) -> list[Any]:
        """Its values at given shares of it: quantiles of a distribution; of a list all are as likely.

        Args:
            shares: (n,), from 0 to 1.
        """
        if self.law is not None:
            drawn: list[Any] = self.law.at(shares).tolist()
            return drawn
        places = np.minimum((shares * len(self.values)).astype(np.int64), len(self.values) - 1)
        return [self.values[k] for k in places.tolist()]

    @property
    def is_numeric(self) -> bool:
        """Whether all its values are numbers."""
        return all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)

    def __str__(self) -> str:
        if self.law is not None:
            return str(self.law)
        if len(self.values) > 4 and self.is_numeric:
            return f"{len(self.values)} values from {min(self.values)} to {max(self.values)}"
        return ", ".join(map(str, self.values))


def _of_text(name: str, text: str) -> Dimension:
    if re.match(r"signal\s*\(", text):  # with a rate its pieces depend on one another
        remedy = "vary the values of a Schedule one by one: target.values[1]=60:85"
        raise ScenarioError(Problem("", "a signal over time is for falsify and optimize", remedy))
    law = Law.read(text)
    if law is not None:
        return Dimension(name, law=law)
    parts = [part.strip() for part in text.split(":")]
    if len(parts) > 1 and any(map(_NUMBER.fullmatch, parts)):
        return _between(name, parts)
    return _listed(name, [_value(item) for item in _items(text)])


def _between(name: str, parts: list[str]) -> Dimension:
    """`low:high`, or `low:high:count`."""
    wrong = next((part for part in parts if not _NUMBER.fullmatch(part)), None)
    if wrong is not None or len(parts) > 3:
        message = f"has {len(parts)} numbers" if wrong is None else f"'{wrong}' is no number"
        raise ScenarioError(Problem("", message, f"write {_FORMS}"))
    if any(math.isinf(float(part)) for part in parts):
        raise ScenarioError("takes finite numbers")
    if len(parts) == 2:
        law = "integers" if _COUNTED.fullmatch(name) else "uniform"
        return Dimension(name, law=Law(law, (float(parts[0]), float(parts[1]))))
    if not _WHOLE.fullmatch(parts[2]) or not 2 <= int(parts[2]) <= MOST_VALUES:
        raise ScenarioError(f"the count of a grid is a whole number from 2 to {MOST_VALUES}, not {parts[2]}")
    # In fractions, so that a value is the number that one would write for it: 0.015, not 0.015000000000000001.
    first, last, steps = Fraction(parts[0]), Fraction(parts[1]), int(parts[2]) - 1
    if first == last:
        raise ScenarioError(Problem("", "a grid from a number to itself", "give the number alone"))
    points = [first + (last - first) * k / steps for k in range(steps + 1)]
    are_whole = all(map(_WHOLE.fullmatch, parts)) and all(point.denominator == 1 for point in points)
    return _listed(name, [int(point) if are_whole else float(point) for point in points])


def _listed(name: str, values: list[Any]) -> Dimension:
    wrong = next((value for value in values if not _is_plain(value)), None)
    if wrong is not None or not values:
        message = (
            "takes no empty list" if wrong is None else f"takes numbers, texts, true or false, or lists, not {wrong!r}"
        )
        raise ScenarioError(Problem("", message, f"write {_FORMS}"))
    made = Dimension(name, tuple(values))
    if made.is_numeric and any(isinstance(value, float) for value in values):
        made = Dimension(name, tuple(map(float, values)))
    seen: set[str] = set()
    for shown in map(repr, made.values):
        if shown in seen:
            raise ScenarioError(Problem("", f"{shown} stands there twice", "each value once"))
        seen.add(shown)
    return made


def _is_plain(value: Any) -> bool:
    if isinstance(value, list):
        return all(map(_is_plain, value))
    if isinstance(value, int | float) and not isinstance(value, bool):
        return -(2**63) <= value < 2**63 if isinstance(value, int) else math.isfinite(value)
    return isinstance(value, bool | str)


def _value(text: str) -> Any:
    """A value as `--set` takes it: of TOML, or the text as it is; and numbers as people write them."""
    if not text:
        raise ScenarioError(Problem("", "a value is empty", "is there a comma too many?"))
    value = parse_value(text)
    if value == text and _NUMBER.fullmatch(text):
        return float(text)
    return value if _is_plain(value) else text


def _items(text: str) -> list[str]:
    """A text parted at its commas, but for those in quotes, brackets and parentheses."""
    items, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        else:
            depth += (letter in "[({") - (letter in "])}")
        if letter == "," and not quote and depth == 0:
            items.append("")
        else:
            items[-1] += letter
    return [item.strip() for item in items]
