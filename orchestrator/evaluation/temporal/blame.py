"""Which point of a run and which comparison decide a formula: down from the whole to the part with its value."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..syntax import Node, Operation, Temporal
from .values import Formula, is_past

Array = NDArray[np.float64]


class Culprit(NamedTuple):
    """The point that decides, by its number; the comparison or boolean; its row, where it has several.

    Without a comparison, it is what a run does not tell that decides.
    """

    place: int
    node: Node | None = None
    row: int = 0
    rows: int = 1


class Search:
    """For the culprit of a formula.

    Args:
        formula: with its values. begin, end: the points that it was looked at last, which cost nothing.
    """

    def __init__(self, formula: Formula, begin: int, end: int) -> None:
        self._formula, self._begin, self._end = formula, begin, end

    def find(self, node: Node, place: int, high: bool, row: int = 0) -> Culprit:  # noqa: PLR0911 (one a kind of node)
        """What decides a part of the formula at a point.

        Args:
            node: the part.
            place: the point, by its number.
            high: whether the most that it can be is asked about, or the least.
            row: which row of the values, where they have several.
        """
        match node:
            case Temporal(word="rise" | "fall"):
                return self._change(node, place, high)
            case Temporal(word="until" | "since"):
                return self._held(node, place, high)
            case Temporal():
                return self._extreme(node, place, high)
            case Operation(operator="not", operands=(operand,)):
                return self.find(operand, place, not high, row)
            case Operation(operator="and" | "or" as operator, operands=operands):
                values = np.array([self._at(operand, place, high, row) for operand in operands])
                return self.find(operands[_first(values, most=operator == "or")], place, high, row)
            case Operation(operator="if", operands=(condition, then, otherwise)):
                choice = np.atleast_2d(self._formula.choice(condition, place, place + 1))
                chosen = choice[min(row, len(choice) - 1), 0]
                return self.find(condition if np.isnan(chosen) else then if chosen else otherwise, place, high, row)
        rows = len(np.atleast_2d(self._formula.values(node, *self._about(place))[high]))
        return Culprit(place, node, min(row, rows - 1), rows)

    def _about(self, place: int) -> tuple[int, int]:
        """Points around one."""
        return (self._begin, self._end) if self._begin <= place < self._end else (place, place + 1)

    def _at(self, node: Node, place: int, high: bool, row: int) -> float:
        """The value of a part at a point."""
        first, last = self._about(place)
        values = np.atleast_2d(self._formula.values(node, first, last)[high])
        return float(values[min(row, len(values) - 1), place - first])

    def _operand(self, node: Temporal, first: int, last: int, high: bool, which: int = 0) -> Array:
        return self._formula.values(node.operands[which], first, last).together()[high] if first < last else np.empty(0)

    def _into(self, node: Temporal, place: int, high: bool, which: int = 0) -> Culprit:
        """Into an operand, of whose rows the least counts."""
        rows = np.atleast_2d(self._formula.values(node.operands[which], place, place + 1)[high])[:, 0]
        return self.find(node.operands[which], place, high, _first(rows, most=False))

    def _change(self, node: Temporal, place: int, high: bool) -> Culprit:
        sign = 1.0 if node.word == "rise" else -1.0
        own = high if sign > 0 else not high
        now = sign * float(self._operand(node, place, place + 1, own)[0])
        if place == 0:
            return self._into(node, place, own)
        before = -sign * float(self._operand(node, place - 1, place, not own)[0])
        if _first(np.array([now, before]), most=False):
            return self._into(node, place - 1, not own)
        return self._into(node, place, own)

    def _extreme(self, node: Temporal, place: int, high: bool) -> Culprit:
        seen = self._formula.windows(node, place, place + 1)
        first, last = int(seen.first[0]), int(seen.last[0])
        values = self._operand(node, first, last, high)
        most = node.word in ("eventually", "once")
        is_open = bool(seen.beyond[0] | seen.unknown[0]) and most == high  # what is not known may be what decides
        if not len(values) or (is_open and not np.isnan(values).any()):
            return Culprit(place)
        return self._into(node, first + _first(values, most=most), high)

    def _held(self, node: Temporal, place: int, high: bool) -> Culprit:
        seen = self._formula.windows(node, place, place + 1)
        first, last = int(seen.first[0]), int(seen.last[0])
        past = is_past(node)
        start, stop = (first, place + 1) if past else (place, last)
        p, q = (self._operand(node, start, stop, high, which) for which in (0, 1))
        places = np.arange(start, stop)
        if past:
            p, q, places = p[::-1], q[::-1], places[::-1]
        inside = (places >= first) & (places < last)
        if high and bool(seen.beyond[0] | seen.unknown[0]):  # q may hold where nothing is known
            q, inside = np.append(q, np.inf), np.append(inside, True)
        until_then = np.minimum.accumulate(np.concatenate([[np.inf], p]))[: len(q)]
        best = np.where(inside, np.minimum(q, until_then), -np.inf)
        k = _first(best, most=True) if inside.any() else len(places)
        if k == len(places) and (until_then[-1] == np.inf or not inside.any()):
            return Culprit(place)
        if np.isnan(q[k]) or q[k] <= until_then[k]:
            return self._into(node, int(places[k]), high, 1)
        return self._into(node, int(places[_first(p[:k], most=False)]), high, 0)


def _first(values: Array, *, most: bool) -> int:
    """Where the first of the greatest or of the least is; where one is NaN, that."""
    return int(np.argmax(values) if most else np.argmin(values))
