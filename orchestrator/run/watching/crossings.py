"""Rules watched over blocks of communication points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .finding import Finding
from .rules import Rule, Seen

Array = NDArray[np.float64]


class Crossings:
    """Where rules are broken. A block in which no rule can be, by its extreme values, costs those alone.

    Args:
        rules: what is watched.
        places: the column of each signal in the blocks; what they hold beyond is not looked at.
    """

    def __init__(self, rules: Sequence[Rule], places: Mapping[str, int]) -> None:
        self._rules = rules
        self._offsets = np.array([rule.quantity.offset for rule in rules], dtype=np.float64)
        self._terms = [[(places[str(signal)], weight) for signal, weight in rule.quantity.terms] for rule in rules]
        longest = max(map(len, self._terms), default=0)
        self._layers = [self._layer(k) for k in range(longest)]
        self._seen: dict[int, Seen] = {}

    def _layer(self, k: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
        """The rules that have a k-th term, its column and its weight."""
        found = [(number, *terms[k]) for number, terms in enumerate(self._terms) if len(terms) > k]
        rules, columns, weights = zip(*found, strict=True)
        return np.array(rules, dtype=np.intp), np.array(columns, dtype=np.intp), np.array(weights)

    def see(self, time: Array, values: Array) -> None:
        """Look at a block.

        Args:
            time: shape (T,), s.
            values: shape (T, columns); columns that stand side by side are quickest.
        """
        if not self._rules or not len(time):
            return
        low, high = values.min(axis=0), values.max(axis=0)
        least = self._offsets.copy()
        with np.errstate(invalid="ignore", over="ignore"):
            for rules, columns, weights in self._layers:
                least[rules] += weights * np.where(weights > 0.0, low[columns], high[columns])
            for number in np.flatnonzero(~(least > 0.0)):
                self._look(int(number), time, values)

    def _look(self, number: int, time: Array, values: Array) -> None:
        quantity = np.full(len(time), self._offsets[number])
        for column, weight in self._terms[number]:
            quantity += weight * values[:, column]
        rule = self._rules[number]
        broken = np.flatnonzero((quantity <= 0.0) & (time >= rule.begin) & (time < rule.end))
        if not broken.size:
            return
        lowest = int(broken[np.argmin(quantity[broken])])
        found = Seen(float(time[broken[0]]), float(time[broken[-1]]), float(quantity[lowest]), float(time[lowest]))
        before = self._seen.get(number)
        if before is not None:
            worse = found if found.worst < before.worst else before
            found = Seen(before.since, found.last, worse.worst, worse.worst_time)
        self._seen[number] = found

    def findings(self) -> Iterator[Finding]:
        """What was found so far."""
        return (self._rules[number].tell(seen) for number, seen in sorted(self._seen.items()))

    def save(self) -> Any:
        """What was seen, as JSON-ready values."""
        return [[number, *seen] for number, seen in self._seen.items()]

    def restore(self, saved: Any) -> None:
        """Go on where `save` was called.

        Raises:
            LookupError, TypeError, ValueError: it was not.
        """
        seen = {int(number): Seen(*map(float, values)) for number, *values in saved}
        if not seen.keys() <= set(range(len(self._rules))):
            raise LookupError(f"there are {len(self._rules)} rules")
        self._seen = seen
