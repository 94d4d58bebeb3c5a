"""Which points of a signal count: the windows that every reducer takes."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...errors import ExpressionError, WindowError
from ...problems import Problem
from ...times import digits, slack
from ..signals import Part, Signals

Array = NDArray[np.float64]
Places: TypeAlias = tuple[slice, ...] | NDArray[np.intp]
"""Where points that count are: a few stretches of them, which are copied ten times as fast, or one by one."""
_STRETCHES = 16
"""So many of them at most."""


@dataclass(frozen=True)
class Span:
    """Which points of a run count.

    Attributes:
        after, until: the first and the last time in s, if there are such; outside: closed intervals that do not count.
        half_open: whether the point at `until` does not count either: at the end of a phase the reference has already
            the next one's value.
        begin: what times in the window are counted from, in s.
        forgiven: how far beside a time a point may lie, because 3 * 0.1 is not 0.3.
    """

    after: float | None
    until: float | None
    outside: Sequence[tuple[float, float]] = ()
    half_open: bool = False
    begin: float = 0.0
    forgiven: float = 0.0

    @cached_property
    def key(self) -> Hashable:
        """What tells it from others."""
        return self.after, self.until, tuple(self.outside), self.half_open, self.forgiven

    def points(self, time: Array) -> NDArray[np.bool_]:
        """Whether each of some times counts; shape (T,)."""
        chosen, forgiven = np.ones(time.shape, dtype=np.bool_), self.forgiven
        if self.after is not None:
            chosen &= time >= self.after - forgiven
        if self.until is not None:
            chosen &= time < self.until - forgiven if self.half_open else time <= self.until + forgiven
        for first, last in self.outside:
            chosen &= ~((time >= first - forgiven) & (time <= last + forgiven))
        return chosen

    def intervals(self, time: Array, points: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether each interval between two times counts: both ends do, and nothing between them is excluded."""
        chosen = points[:-1] & points[1:]
        for first, last in self.outside:
            chosen &= ~((time[:-1] <= last) & (time[1:] >= first))
        return chosen


@dataclass(frozen=True)
class Selection:
    """Which points of a part of a run count, and what follows from it.

    The first point may be the last of the part before: then only the interval from there counts.

    Attributes:
        time: all points, shape (T,), in s. points: whether each counts. span: why.
        ends: the same of the ends of intervals, among which is the last point of the part before.
        kept: where the points that count are.
    """

    time: Array
    points: NDArray[np.bool_]
    span: Span
    ends: NDArray[np.bool_]
    kept: Places

    @classmethod
    def of(cls, time: Array, overlap: int, span: Span) -> "Selection":
        """That of a span at some points, of which the first are those of the part before."""
        ends = span.points(time)
        points = ends.copy()
        points[:overlap] = False
        return cls(time, points, span, ends, _places(points))

    @cached_property
    def places(self) -> NDArray[np.intp]:
        """Where points count, those of the part before among them."""
        return np.flatnonzero(self.ends)

    @cached_property
    def between(self) -> Places:
        """Where the intervals that count are."""
        return _places(self.span.intervals(self.time, self.ends))

    @cached_property
    def times(self) -> Array:
        """The points that count, in s."""
        return at(self.time, self.kept)

    @cached_property
    def lengths(self) -> Array:
        """Of the intervals that count, in s."""
        return at(np.diff(self.time), self.between)


def _places(chosen: NDArray[np.bool_]) -> Places:
    """Where it is true."""
    ends = np.flatnonzero(np.diff(chosen, prepend=False, append=False)).reshape(-1, 2)
    if len(ends) > _STRETCHES:
        return np.flatnonzero(chosen)
    return tuple(slice(*pair) for pair in ends.tolist()) or (slice(0, 0),)


def at(rows: Array, places: Places) -> Array:
    """Rows at the points that count."""
    if isinstance(places, np.ndarray):
        return rows.take(places, axis=-1)
    if len(places) == 1:
        return rows[..., places[0]]
    return np.concatenate([rows[..., stretch] for stretch in places], axis=-1)


@dataclass(frozen=True)
class Window:
    """What is seen of signals at once: their rows and which points of these count.

    Attributes:
        rows: shape (g, n, T): n rows of each of g that are looked at in the same way; without g of one alone.
    """

    rows: Array
    selection: Selection

    @classmethod
    def of(cls, selection: Selection, values: Sequence[Array]) -> "Window":
        """Of signals of shape (k, n, T): k of n rows each, or without their values in time where these do not vary."""
        time, first = selection.time, values[0]
        if len(values) == 1 and first.dtype == np.float64 and first.shape[-1] >= time.size:
            return cls(first[..., : time.size], selection)
        rows, begin = np.empty((sum(map(len, values)), first.shape[1], time.size)), 0
        for value in values:
            end = begin + len(value)
            rows[begin:end] = value[..., : time.size]
            begin = end
        return cls(rows, selection)

    @property
    def time(self) -> Array:
        """All points, shape (T,), in s."""
        return self.selection.time

    @property
    def times(self) -> Array:
        """The points that count, in s."""
        return self.selection.times

    @cached_property
    def kept(self) -> Array:
        """The rows at the points that count."""
        return at(self.rows, self.selection.kept)

    def integral(self, rows: Array | None = None) -> Array:
        """Trapezoid rule over the intervals that count, one value a row; of other rows if they are given."""
        values = self.rows if rows is None else rows
        areas = at(values[..., 1:] + values[..., :-1], self.selection.between)
        areas *= 0.5
        areas *= self.selection.lengths
        return total(areas)

    def slopes(self) -> Array:
        """Difference quotients over the intervals that count, shape (..., intervals)."""
        slopes = at(np.diff(self.rows), self.selection.between)
        slopes /= self.selection.lengths
        return slopes


def total(values: Array) -> Array:
    """The sums over time: of a row alone in pairs, of several rows in the order of time."""
    if values.shape[-2] == 1:
        return np.asarray(values.sum(axis=-1))
    return np.asarray(np.ascontiguousarray(np.moveaxis(values, -1, 0)).sum(axis=0))


def scalar(value: Any, what: str) -> float:
    """A number out of an argument that must not vary over time.

    Raises:
        ExpressionError: it does, or it is a list or NaN.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0 and not np.isnan(value):
        return float(value)
    numbers = np.empty(0) if isinstance(value, list) else np.asarray(value, dtype=np.float64).ravel()
    if numbers.size == 0 or not np.all(numbers == numbers[0]):
        raise ExpressionError(f"{what} must be one number, not a list or a signal that varies")
    return float(numbers[0])


def time_windows(outside: Any) -> list[tuple[float, float]]:
    """The closed intervals [s] of an `outside` argument: `[210, 240]` or `[[0, 1], [210, 240]]`.

    Raises:
        ExpressionError: it is neither, or an interval ends before it starts.
    """
    pairs = outside if isinstance(outside, list) and all(isinstance(x, list) for x in outside) else [outside]
    windows = []
    for pair in pairs:
        if not isinstance(pair, list) or len(pair) != 2:
            raise ExpressionError("outside takes a window [from, to] or a list of them, as in outside = [210, 240]")
        first, last = (scalar(end, "an end of outside") for end in pair)
        if first > last:
            message = f"outside = [{digits(first)}, {digits(last)}] ends before it starts"
            raise ExpressionError(Problem("", message, "swap the two"))
        windows.append((first, last))
    return windows


def span_of(
    ends: tuple[float, float], step: float, after: Any, until: Any, outside: Any, *, half_open: bool = False
) -> Span:
    """The window that is asked for in a call of a reducer.

    Args:
        ends: the first and the last time of the run, in s.
        step: its communication step, in s.
        after: the first time in s that counts, as an argument's value, or None: then the first of the run.
        until: the last one, likewise.
        outside: a window [from, to] in s that does not count, or a list of them, or None.
        half_open: whether the point at `until` does not count either.

    Raises:
        ExpressionError: the arguments are not of the right kind.
        WindowError: the run does not cover it.
    """
    start = None if after is None else scalar(after, "after")
    end = None if until is None else scalar(until, "until")
    excluded = [] if outside is None else time_windows(outside)
    first, last = ends
    if end is not None and end > last + slack(step, last):
        raise WindowError(f"the window lasts until {digits(end)} s but the recorded points end at {digits(last)} s")
    return Span(start, end, excluded, half_open, first if start is None else start, slack(step, first, last))


def ends_of(signals: Signals) -> tuple[float, float]:
    """The first and the last time of a run in s; infinite, the wrong way round, if there is none."""
    count = signals.points
    if not count:
        return np.inf, -np.inf
    return float(signals.part(0, 1)["time"][0]), float(signals.part(count - 1, count)["time"][0])


def window_of(part: Part, x: Any, span: Span) -> Window:
    """What counts of a signal, shape (T,) or (n, T), in a part of a run."""
    selection = Selection.of(part.own_time, part.overlap, span)
    values = np.atleast_2d(np.asarray(x, dtype=np.float64))[:, : selection.time.size]
    return Window(np.broadcast_to(values, (len(values), selection.time.size)), selection)


def nothing_in_window() -> Problem:
    """What to say where no point counts."""
    return Problem("", "no recorded point lies in the window", "widen it, or record more often")
