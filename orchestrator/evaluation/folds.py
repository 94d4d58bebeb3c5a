"""Folds: how a reducer makes one number of a run that it is shown window by window, in the order of time."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import WindowError
from ..problems import Problem
from ..times import digits
from .time_windows import Span, Window

Array = NDArray[np.float64]


class Fold(Protocol):
    """What a reducer remembers of the windows it has seen."""

    def see(self, window: Window) -> None:
        """Take the next window in."""

    def value(self) -> float:
        """The number.

        Raises:
            WindowError: the windows do not tell it.
        """


class Merged:
    """A fold that keeps one array a window, merges it with that of the windows before, and makes the number of it.

    Args:
        part: of a window in which at least one point counts.
        merge: of two windows that follow one another.
        finish: the number.
        tolerates_nan: whether it is more than NaN where a point that counts is.
    """

    def __init__(
        self,
        part: Callable[[Window], Array],
        merge: Callable[[Array, Array], Array],
        finish: Callable[[Array], float],
        *,
        tolerates_nan: bool = False,
    ) -> None:
        self._part, self._merge, self._finish, self._tolerates_nan = part, merge, finish, tolerates_nan
        self._is_nan = False
        self._seen: Array | None = None

    def see(self, window: Window) -> None:
        """As `Fold` has it."""
        if not window.points.any():
            return  # no interval into it counts either
        self._is_nan = self._is_nan or (not self._tolerates_nan and bool(np.isnan(window.kept).any()))
        if not self._is_nan:
            part = self._part(window)
            self._seen = part if self._seen is None else self._merge(self._seen, part)

    def value(self) -> float:
        """As `Fold` has it."""
        if self._is_nan:
            return np.nan
        if self._seen is None:
            raise WindowError(Problem("", "no recorded point lies in the window", "widen it, or record more often"))
        return float(self._finish(self._seen))


def largest(values: Array) -> float:
    """The value of largest magnitude with its sign: one number for rows that each have one."""
    return float(values.flat[np.argmax(np.abs(values))])


def _first(before: Array, after: Array) -> Array:
    return before


def _last(before: Array, after: Array) -> Array:
    return after


def minimum() -> Fold:
    """The least value."""
    return Merged(lambda w: w.kept.min(axis=1), np.minimum, np.min)


def maximum() -> Fold:
    """The greatest value."""
    return Merged(lambda w: w.kept.max(axis=1), np.maximum, np.max)


def peaks(finish: Callable[[Array], float] = np.max) -> Fold:
    """The greatest magnitude, or what is to be made of that of each row."""
    return Merged(lambda w: np.abs(w.kept).max(axis=1), np.maximum, finish)


def initial() -> Fold:
    """The first value, of rows the largest."""
    return Merged(lambda w: w.kept[:, 0], _first, largest)


def final() -> Fold:
    """The last value, of rows the largest."""
    return Merged(lambda w: w.kept[:, -1], _last, largest)


def integral() -> Fold:
    """The integrals of all rows together."""
    return Merged(Window.integral, np.add, np.sum)


def duration() -> Fold:
    """How long a row is not zero, of rows the longest."""
    return Merged(lambda w: w.integral((w.rows != 0).astype(np.float64)), np.add, np.max)


def means(finish: Callable[[Array], float], *, squares: bool = False) -> Fold:
    """What is to be made of the time-weighted mean of each row, or of that of its squares."""

    def part(window: Window) -> Array:
        rows = np.square(window.rows) if squares else window.rows
        kept, area = rows[:, window.points], window.integral(rows)
        same = np.ones(len(rows))
        return np.array([area, same * window.duration(), kept.sum(axis=1), same * kept.shape[1]])

    def mean(sums: Array) -> float:
        area, time, total, count = sums
        return finish(area / time if time[0] > 0.0 else total / count)

    return Merged(part, np.add, mean)


def spread() -> Fold:
    """How far rows are apart at one time, at most."""
    return Merged(lambda w: np.ptp(w.kept, axis=0).max(keepdims=True), np.maximum, np.max)


def first_time() -> Fold:
    """When some row is not zero for the first time; infinite if never."""
    return Merged(lambda w: w.times[(w.kept != 0).any(axis=0)].min(initial=np.inf, keepdims=True), np.minimum, np.min)


def last_time() -> Fold:
    """When some row is not zero for the last time; infinite if never."""

    def finish(time: Array) -> float:
        return time[0] if np.isfinite(time[0]) else np.inf

    return Merged(lambda w: w.times[(w.kept != 0).any(axis=0)].max(initial=-np.inf, keepdims=True), np.maximum, finish)


def jerk() -> Fold:
    """The steepest slope between neighbouring points."""

    def finish(slopes: Array) -> float:
        if not slopes.max() >= 0.0:
            raise WindowError("jerk needs two neighbouring recorded points in the window")
        return float(slopes.max())

    return Merged(lambda w: np.abs(w.slopes()).max(axis=1, initial=-np.inf), np.maximum, finish)


def settling(is_beyond: Callable[[Array], NDArray[np.bool_]], begin: float = 0.0, *, tolerates_nan: bool) -> Fold:
    """The time from which on no row is beyond its bounds any more; infinite if they are up to the end.

    Args:
        is_beyond: whether values are beyond.
        begin: what is taken from the time, in s.
        tolerates_nan: whether NaN may be beyond, too.
    """

    def part(window: Window) -> Array:
        times = window.times
        beyond = np.flatnonzero(is_beyond(window.kept).any(axis=0))
        next_one = int(beyond[-1]) + 1 if beyond.size else 0
        since = times[next_one] if next_one < times.size else np.inf
        return np.array([since, times[0], float(beyond.size > 0)])

    def merge(before: Array, after: Array) -> Array:
        if after[2]:
            return np.array([after[0], before[1], 1.0])
        return np.array([before[0] if np.isfinite(before[0]) else after[1], *before[1:]])

    return Merged(part, merge, lambda seen: seen[0] - begin, tolerates_nan=tolerates_nan)


def overshoot() -> Fold:
    """How far a row goes beyond zero, seen from where it starts; from zero itself, either way."""

    def part(window: Window) -> Array:
        kept = window.kept
        return np.array([kept[:, 0], kept.max(axis=1), kept.min(axis=1)])

    def merge(before: Array, after: Array) -> Array:
        return np.array([before[0], np.maximum(before[1], after[1]), np.minimum(before[2], after[2])])

    def finish(seen: Array) -> float:
        start, most, least = seen
        over = np.where(start > 0, -least, np.where(start < 0, most, np.maximum(most, -least)))
        return float(over.max(initial=0.0))

    return Merged(part, merge, finish)


class Value:
    """A fold: the value at one time, between the points beside it.

    Args:
        moment: in s.
        span: of the run.
    """

    def __init__(self, moment: float, span: Span) -> None:
        self._moment, self._forgiven = moment, span.forgiven
        self._found: Array | None = None

    def see(self, window: Window) -> None:
        """As `Fold` has it."""
        time, moment, forgiven = window.time, self._moment, self._forgiven
        if self._found is None and time.size and time[0] - forgiven <= moment <= time[-1] + forgiven:
            self._found = np.array([np.interp(moment, time, row) for row in window.rows])

    def value(self) -> float:
        """As `Fold` has it."""
        if self._found is None:
            raise WindowError(f"no recorded points around t = {digits(self._moment)} s")
        return np.nan if np.isnan(self._found).any() else largest(self._found)


class MeanJerk:
    """A fold: the largest slope of a chord of some length in time.

    Args:
        width: of the chord, in s.
        span: of the run.
    """

    def __init__(self, width: float, span: Span) -> None:
        self._width, self._forgiven = width, span.forgiven
        self._time, self._starts = np.empty(0), np.empty(0, np.bool_)
        self._rows = np.empty((0, 0))
        self._largest, self._is_nan = -np.inf, False

    def see(self, window: Window) -> None:
        """As `Fold` has it."""
        new = slice(int(self._time.size > 0), None)  # the first point is the last one of before
        starts = window.points[new].copy()
        time, width = window.time[new], self._width
        for a, b in window.span.outside:
            starts &= ~((time <= b + self._forgiven) & (time + width >= a - self._forgiven))
        self._is_nan = self._is_nan or bool(np.isnan(window.kept).any())
        rows = window.rows[:, new]
        self._rows = rows if not self._time.size else np.concatenate([self._rows, rows], axis=1)
        self._time, self._starts = np.concatenate([self._time, time]), np.concatenate([self._starts, starts])
        kept = window.times
        self._look(kept[-1] if kept.size else -np.inf)

    def _look(self, last: float) -> None:
        """At the chords that end by then; what no later one needs is forgotten."""
        time, rows = self._time, self._rows
        chosen = self._starts & (time + self._width <= last + self._forgiven)
        if chosen.any():
            later = np.array([np.interp(time[chosen] + self._width, time, row) for row in rows])
            self._largest = max(self._largest, float(np.abs(later - rows[:, chosen]).max() / self._width))
        # Where none counts, chords that have begun do not end: outside is not crossed, nor the end.
        left = self._starts & ~chosen & np.isfinite(last)
        first = int(np.argmax(left)) if left.any() else max(time.size - 1, 0)
        self._time, self._rows, self._starts = time[first:], rows[:, first:], left[first:]

    def value(self) -> float:
        """As `Fold` has it."""
        if self._is_nan:
            return np.nan
        if not np.isfinite(self._largest):
            raise WindowError(f"mean_jerk needs recorded points {digits(self._width)} s apart in the window")
        return self._largest
