"""How a requirement comes out in a run: the point that decides, and by how much."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .. import signals as runs
from ..reducers import Selection, Span, at
from ..syntax import Node
from .blame import Culprit, Search
from .values import Formula, horizon

Array = NDArray[np.float64]
Word = Literal["always", "eventually", "finally", ""]
"""When a condition has to hold: at every point, at some, at the last one; or, if it says so itself, at the first."""


@dataclass(frozen=True)
class Extreme:
    """A value at a point, by its number, in one of some rows."""

    value: float
    place: int
    row: int
    rows: int


class Decision:
    """What decides whether a condition holds, for one value of its index, or for several that are its rows.

    Attributes:
        formula: with its values. points: how many were judged.
        low, high: the least and the most that its value can be, whatever comes behind the run.
    """

    def __init__(self, formula: Formula, node: Node, word: Word, span: Span) -> None:
        self.formula, self._node, self._word = formula, node, word
        self.points = 0
        self.low: Extreme | None = None
        self.high: Extreme | None = None
        self._missing: Extreme | None = None
        self._block = (0, 0)
        final: int | None = None
        for first, last in self._blocks():
            chosen = formula.within(span, first, last)
            count = chosen.times.size
            self.points += count
            if word == "finally":
                final = first + int(chosen.places[-1]) if count else final
            elif count:
                self._see(first, last, chosen)
        if final is not None:
            self._see(final, final + 1, None)
        if word in ("finally", "") and self.points:
            self.points = 1

    def _blocks(self) -> list[tuple[int, int]]:
        count, size = self.formula.points.count, runs.BLOCK
        if self._word == "":
            return [(0, 1)][:count]
        if count > size:
            ahead = horizon(self._node, self.formula.interval) / self.formula.points.signals.step
            if size < ahead < count:  # or most would be looked at again and again
                size *= int(ahead // size) + 1
        return [(first, min(first + size, count)) for first in range(0, count, size)]

    def _see(self, first: int, last: int, chosen: Selection | None) -> None:
        """Take in points from one up to another, all or those chosen."""
        values, block = self.formula.values(self._node, first, last), (first, last)
        numbers: Sequence[int] | NDArray[np.int64] = range(first, last)
        if chosen is not None and chosen.times.size < last - first:
            values, numbers = values.of(lambda x: at(x, chosen.kept)), first + chosen.places
        new = _least(values.high, numbers)
        if np.isnan(new.value) and (self._missing is None or new.row < self._missing.row):
            self._missing = new
        high = _best(values.high, numbers) if self._word == "eventually" else new
        low = high
        if values.low is not values.high:
            low = (_best if self._word == "eventually" else _least)(values.low, numbers)
        if self._counts(low, self.low):
            self.low = low
        if self._counts(high, self.high):
            self.high, self._block = high, block

    def _counts(self, new: Extreme, old: Extreme | None) -> bool:
        if old is None:
            return True
        if self._word == "eventually":
            return new.value > old.value
        return (not np.isnan(new.value), new.value, new.row) < (not np.isnan(old.value), old.value, old.row)

    @property
    def is_missing(self) -> bool:
        """Whether a value is no number."""
        return self._missing is not None

    @property
    def holds(self) -> bool:
        """Whether it holds, whatever comes."""
        return not self.is_missing and self.low is not None and self.low.value > 0.0

    @property
    def fails(self) -> bool:
        """Whether it does not, whatever comes."""
        return self.is_missing or (self.high is not None and not self.high.value > 0.0)

    @property
    def decisive(self) -> Extreme:
        """The value that decides; where none does, the most that it can be."""
        extreme = self._missing or (self.low if self.holds else self.high)
        assert extreme is not None
        return extreme

    @property
    def badness(self) -> tuple[bool, float]:
        """In the order of which the least is the worst."""
        return not self.is_missing, 0.0 if self.is_missing else self.decisive.value

    def culprit(self) -> Culprit:
        """What decides it, and where."""
        found = self.decisive
        return Search(self.formula, *self._block).find(self._node, found.place, not self.holds, found.row)


def _least(values: Array, places: Sequence[int] | NDArray[np.int64]) -> Extreme:
    """The first of the least values, of the row furthest ahead; a NaN is less than all."""
    rows = np.atleast_2d(values)
    row, column = divmod(int(np.argmin(rows)), rows.shape[1])
    return Extreme(float(rows[row, column]), int(places[column]), row, len(rows))


def _best(values: Array, places: Sequence[int] | NDArray[np.int64]) -> Extreme:
    """The first of the greatest values; of rows, which count together, the least."""
    rows = np.atleast_2d(values)
    together = rows.min(axis=0)
    column = int(np.argmax(np.where(np.isnan(together), -np.inf, together)))
    row = int(np.argmin(rows[:, column]))
    return Extreme(float(rows[row, column]), int(places[column]), row, len(rows))
