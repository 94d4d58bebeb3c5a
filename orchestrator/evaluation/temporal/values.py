"""The robustness of a formula at every point of a run: by how much it holds there, or is missed.

A formula may look beyond the end of the run. What is there is not known, so that every value has two bounds: the least
and the most that it can be, whatever comes. Mostly they are one.
"""

from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import ExpressionError, WindowError
from ...problems import Problem
from ...times import digits
from .. import signals as runs
from ..calculation import Scope, evaluate
from ..reducers import Selection, Span, scalar
from ..signals import Part
from ..slack import Scales, slack_of
from ..syntax import CHANGES, Node, Operation, Reference, Temporal, walk
from .extrema import clamped, least
from .points import Places, Points, Windows

Array = NDArray[np.float64]


class Bounds(NamedTuple):
    """The least and the most that values can be, of shape (T,), or (n, T) with one row a signal of a slice."""

    low: Array
    high: Array

    @classmethod
    def exact(cls, values: Array) -> "Bounds":
        """Of values that are known."""
        return cls(values, values)

    def of(self, change: Callable[[Array], Array]) -> "Bounds":
        """What a change that never turns their order makes of both."""
        low = change(self.low)
        return Bounds(low, low if self.high is self.low else change(self.high))

    def negative(self) -> "Bounds":
        """Of the negative values."""
        low = -self.high
        return Bounds(low, low if self.high is self.low else -self.low)

    def together(self) -> "Bounds":
        """The least row, where there are several."""
        return self.of(lambda values: values.min(axis=0)) if self.low.ndim == 2 else self

    def between(self, first: int, last: int) -> "Bounds":
        """At some of the points."""
        return self.of(lambda values: values[..., first:last])


def joined(*parts: Bounds) -> Bounds:
    """Values one after the other."""
    low = np.concatenate([part.low for part in parts], axis=-1)
    same = all(part.high is part.low for part in parts)
    return Bounds(low, low if same else np.concatenate([part.high for part in parts], axis=-1))


def is_temporal(node: Node) -> bool:
    """Whether a word of logic over time stands in a formula."""
    return any(isinstance(part, Temporal) for part in walk(node))


def is_past(node: Temporal) -> bool:
    """Whether a word looks back."""
    return node.word in ("once", "historically", "since")


def horizon(node: Node, interval: Callable[[Temporal], tuple[float, float]]) -> float:
    """How far ahead a formula looks in s, beyond words without end, which look at what there is."""
    if isinstance(node, Temporal):
        bounds = (0.0, 0.0) if is_past(node) or node.word in CHANGES else interval(node)
        return bounds[int(np.isfinite(bounds[1]))] + max(horizon(operand, interval) for operand in node.operands)
    if isinstance(node, Operation):
        return max(horizon(operand, interval) for operand in node.operands)
    return 0.0


def interval_of(node: Temporal, scope: Scope) -> tuple[float, float]:
    """The interval of a word in s.

    Raises:
        WindowError: a bound varies, is negative, or the interval ends before it begins.
    """
    if node.interval is None:
        return 0.0, np.inf
    try:
        low, high = (scalar(evaluate(bound, scope), f"a bound of {node.word}") for bound in node.interval)
    except ExpressionError as error:
        raise WindowError(error.problems) from None
    if not 0.0 <= low <= high or low == np.inf:
        written = f"{node.word}[{digits(low)}, {digits(high)}]"
        remedy = "its first time is 0 or later, and its last one no earlier than that"
        raise WindowError(Problem("", f"'{written}' is no interval", remedy))
    return low, high


def rehearsed_interval(node: Temporal, scope: Scope) -> tuple[float, float]:
    """The same in a rehearsal, in which parameters have no values yet: any that is one."""
    bounds = node.interval or ()
    if not any(isinstance(part, Reference) for bound in bounds for part in walk(bound)):
        try:
            return interval_of(node, scope)
        except WindowError as error:  # which no run will change
            raise ExpressionError(error.problems) from None
    for bound in bounds:
        scalar(evaluate(bound, scope), f"a bound of {node.word}")
    return 0.0, np.inf


class Formula:
    """The values of a formula and its parts in a run, for one value of its index.

    Args:
        scope: what its names stand for. points: of the run. scales: of its comparisons, or 1. interval: of a word.
    """

    def __init__(
        self,
        scope: Scope,
        points: Points,
        scales: Scales | None = None,
        interval: Callable[[Temporal, Scope], tuple[float, float]] = interval_of,
    ) -> None:
        self.scope, self.points, self._scales, self._interval_of = scope, points, scales, interval
        self.gaps: set[str] = set()
        self._last: dict[int, tuple[int, int, Bounds]] = {}
        self._ends: dict[int, dict[int, Bounds]] = {}
        self._intervals: dict[int, tuple[float, float]] = {}

    def values(self, node: Node, first: int, last: int) -> Bounds:
        """Of a part of the formula at the points from `first` up to `last`, which is not among them."""
        start, stop, found = self._last.get(id(node), (0, -1, None))
        if found is None or not start <= first <= last <= stop:
            found, start, stop = self._values(node, first, last), first, last
            self._last[id(node)] = start, stop, found
        return found if (start, stop) == (first, last) else found.between(first - start, last - start)

    def _values(self, node: Node, first: int, last: int) -> Bounds:
        match node:
            case Temporal():
                return self._temporal(node, first, last)
            case Operation(operator="not", operands=(operand,)):
                return self.values(operand, first, last).negative()
            case Operation(operator="and" | "or" as operator, operands=operands):
                choose = np.minimum if operator == "and" else np.maximum
                return _combined(partial(reduce, choose), [self.values(operand, first, last) for operand in operands])
            case Operation(operator="if", operands=(condition, *branches)):
                choice = self.choice(condition, first, last)
                return _combined(
                    lambda both: np.where(np.isnan(choice), np.nan, np.where(choice, both[0], both[1])),
                    [self.values(branch, first, last) for branch in branches],
                )
            case _ if not self.is_temporal(node):
                return self._plain(node, first, last)
        evaluate(node, self.scope)  # which says what is wrong
        raise AssertionError("a formula in a number")  # pragma: no cover: that was an error

    def is_temporal(self, node: Node) -> bool:
        """Whether a word of logic over time stands in a part."""
        return self.scope.binding.known(is_temporal, node)

    def within(self, span: Span, first: int, last: int) -> Selection:
        """Which of the points from `first` up to `last` count."""
        return self.scope.frame.run.frame(self.points.part(first, last)).selection(span)

    def choice(self, condition: Node, first: int, last: int) -> Array:
        """The truth of the condition of an `if`."""
        part = self.points.part(first, last)
        return _own(np.asarray(evaluate(condition, self.scope.of(part)), np.float64), part)

    def _plain(self, node: Node, first: int, last: int) -> Bounds:
        part = self.points.part(first, last)
        return Bounds.exact(_own(slack_of(node, self.scope.of(part), self._scales), part))

    def interval(self, node: Temporal) -> tuple[float, float]:
        """The interval of a word in s."""
        if id(node) not in self._intervals:
            self._intervals[id(node)] = self._interval_of(node, self.scope)
        return self._intervals[id(node)]

    def windows(self, node: Temporal, first: int, last: int) -> Windows:
        """Where a word looks from each of some points."""
        look = self.points.back if is_past(node) else self.points.ahead
        return look(first, last, *self.interval(node))

    def _temporal(self, node: Temporal, first: int, last: int) -> Bounds:
        match node.word:
            case "rise" | "fall":
                return self._change(node, first, last)
            case "until" | "since":
                return self._held(node, first, last)
            case "eventually" | "once":  # the most is the negative of the least negative
                return self._least(node, first, last).negative()
        return self._least(node, first, last)

    def _operand(self, node: Temporal, first: int, last: int, place: int = 0) -> Bounds:
        """The values that are compared over time; the rows of a slice count together."""
        if first >= last:
            return Bounds.exact(np.empty(0))
        values = self.values(node.operands[place], first, last).together()
        return values.negative() if node.word in ("eventually", "once", "fall") else values

    def _change(self, node: Temporal, first: int, last: int) -> Bounds:
        """What holds now and did not before; before the run, nothing did."""
        values = self._operand(node, max(first - 1, 0), last)
        if first == 0:
            values = joined(Bounds.exact(np.full(1, -np.inf)), values)
        before, now = values.between(0, last - first).negative(), values.between(1, last - first + 1)
        return _combined(np.minimum.reduce, [before, now])

    def _least(self, node: Temporal, first: int, last: int) -> Bounds:
        seen = self._seen(node, first, last)
        begin, end = seen.begin, seen.end
        firsts, lasts = seen.first, seen.last
        parts = []
        if self.interval(node)[1] < np.inf:
            parts = [self._operand(node, begin, end)]
        elif is_past(node):
            begin = int(lasts[0]) // runs.BLOCK * runs.BLOCK
            parts = [self._rest(node, begin), self._operand(node, begin, int(lasts[-1]))]
            begin, firsts = begin - 1, np.full_like(firsts, begin - 1)
        else:
            end = self._boundary(int(firsts[-1]))
            parts = [self._operand(node, begin, end), self._rest(node, end)]
            lasts = np.full_like(lasts, end + 1)
        values = joined(*parts)
        found = values.of(lambda x: least(x, firsts - begin, lasts - begin))
        return _opened(found, seen.beyond | seen.unknown, found.high)

    def _held(self, node: Temporal, first: int, last: int) -> Bounds:
        """Of `p until q`: the best moment of q up to which p holds. With p and q in reverse, of `p since q`."""
        seen, is_bounded = self._seen(node, first, last), self.interval(node)[1] < np.inf
        begin, end = min(seen.begin, first), max(seen.end, last)
        rest = Bounds.exact(np.full(1, -np.inf))
        if not is_bounded and is_past(node):
            begin = min(int(seen.last[0]), first) // runs.BLOCK * runs.BLOCK
            rest = self._rest(node, begin)
        elif not is_bounded:
            end = self._boundary(max(int(seen.first[-1]), last))
            rest = self._rest(node, end)
        p, q = (self._operand(node, begin, end, place) for place in (0, 1))
        own, firsts, lasts = np.arange(first, last) - begin, seen.first - begin, seen.last - begin
        if is_past(node):
            p, q = (x.of(lambda values: values[::-1]) for x in (p, q))
            own, firsts, lasts = (end - begin - x for x in (own + 1, seen.last - begin, seen.first - begin))
        if not is_bounded:
            lasts = np.full_like(lasts, end - begin)
        look = Look(own, firsts, lasts, is_bounded)
        low = look.best(p.low, q.low, float(rest.low[0]), np.zeros_like(seen.beyond))
        if all(x.high is x.low for x in (p, q, rest)) and not (seen.beyond | seen.unknown).any():
            return Bounds.exact(low)
        high = look.best(p.high, q.high, float(rest.high[0]), seen.beyond)
        return _opened(Bounds(low, high), seen.unknown, look.until_then(p.high))

    def _seen(self, node: Temporal, first: int, last: int) -> Windows:
        seen = self.windows(node, first, last)
        if seen.unknown.any():
            self.gaps.add(self.written(node))
        return seen

    def written(self, node: Temporal) -> str:
        """A word with its interval."""
        return f"{node.word}[{', '.join(map(digits, self.interval(node)))}]" if node.interval else node.word

    def _boundary(self, place: int) -> int:
        """The first boundary of a block from a point on."""
        return min(-(-place // runs.BLOCK) * runs.BLOCK, self.points.count)

    def _rest(self, node: Temporal, place: int) -> Bounds:
        """What a word without end makes of all points before, or from, a boundary on; shape (1,)."""
        if id(node) not in self._ends:
            self._ends[id(node)] = self._all_rest(node)
        return self._ends[id(node)][place]

    def _all_rest(self, node: Temporal) -> dict[int, Bounds]:
        count, is_held = self.points.count, node.word in ("until", "since")
        rest = Bounds.exact(np.full(1, -np.inf if is_held else np.inf))
        if is_held and not is_past(node) and self.points.is_cut:
            rest = Bounds(rest.low, np.full(1, np.inf))
        starts = range(0, count, runs.BLOCK)
        found = {0 if is_past(node) else count: rest}
        for start in starts if is_past(node) else reversed(starts):
            stop = min(start + runs.BLOCK, count)
            if is_held:
                rest = self._held_rest(node, start, stop, rest)
            else:
                rest = joined(rest, self._operand(node, start, stop)).of(lambda x: x.min(keepdims=True))
            found[stop if is_past(node) else start] = rest
        return found

    def _held_rest(self, node: Temporal, start: int, stop: int, rest: Bounds) -> Bounds:
        p, q = (self._operand(node, start, stop, place) for place in (0, 1))
        order = slice(None, None, 1 if is_past(node) else -1)
        low = clamped(q.low[order], p.low[order], float(rest.low[0]))[-1:]
        if all(x.high is x.low for x in (p, q, rest)):
            return Bounds.exact(low)
        return Bounds(low, clamped(q.high[order], p.high[order], float(rest.high[0]))[-1:])


class Look(NamedTuple):
    """Where `until` looks, in arrays of its operands: from `own`, q within `first` to `last`, that one excluded."""

    own: Places
    first: Places
    last: Places
    is_bounded: bool

    def until_then(self, p: Array) -> Array:
        """The least of p before the window."""
        return least(p, self.own, self.first)

    def best(self, p: Array, q: Array, rest: float, beyond: NDArray[np.bool_]) -> Array:
        """The best moment of q in the window up to which p holds.

        With an end, it is the least of three (after Donze, Ferrere and Maler 2013): p up to the window; q somewhere in
        it; and p until q from its begin on, however long that takes.

        Args:
            p: what has to hold.
            q: up to when.
            rest: of the points behind them.
            beyond: whether q may hold behind them.
        """
        missing = np.isnan(p) | np.isnan(q)
        if self.is_bounded and missing.any():
            return self._best_of_some(p, q, rest, beyond)
        begin = np.inf if self.is_bounded else rest
        later = np.append(clamped(q[::-1], p[::-1], begin)[::-1], begin)
        found = np.asarray(np.minimum(self.until_then(p), later[self.first]))
        if not self.is_bounded:
            return found
        return np.asarray(np.minimum(found, np.where(beyond, np.inf, -least(-q, self.first, self.last))))

    def _best_of_some(self, p: Array, q: Array, rest: float, beyond: NDArray[np.bool_]) -> Array:
        """The same where some values are no numbers: what looks at one of them is none."""
        known = self.best(np.where(np.isnan(p), -np.inf, p), np.where(np.isnan(q), -np.inf, q), rest, beyond)
        looked = np.isnan(least(p, self.own, self.last - 1)) | np.isnan(least(q, self.first, self.last))
        return np.where(looked, np.nan, known)


def _own(values: Array, part: Part) -> Array:
    """Values at the points of a part itself, without those beyond; of what does not vary, as many."""
    if values.shape[-1:] != (part.points,):
        values = np.broadcast_to(values, (*values.shape[:-1], part.points))
    return values[..., : part.points - part.beyond]


def _opened(found: Bounds, where: NDArray[np.bool_], most: Array) -> Bounds:
    """Bounds that are none at some points: anything up to `most` is possible there."""
    if not where.any():
        return found
    where = where & ~np.isnan(found.low)
    return Bounds(np.where(where, -np.inf, found.low), np.where(where, most, found.high))


def _combined(combine: Callable[[Sequence[Array]], Array], parts: list[Bounds]) -> Bounds:
    low = np.asarray(combine([part.low for part in parts]))
    if all(part.high is part.low for part in parts):
        return Bounds.exact(low)
    return Bounds(low, combine([part.high for part in parts]))
