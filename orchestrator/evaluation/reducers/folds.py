"""Folds: how a reducer makes one number of a run that it is shown window by window, in the order of time.

A fold looks at several signals at once, each of one row or more, and makes one number of each: arrays have the shape
(g, n, T), or (g, n) without the time. What it gives for one does not depend on the others.
"""

from collections.abc import Callable
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import WindowError
from ...times import digits
from .windows import Span, Window, nothing_in_window, total

Array = NDArray[np.float64]


class Fold(Protocol):
    """What a reducer remembers of the windows it has seen."""

    def see(self, window: Window) -> None:
        """Take the next window in."""

    def numbers(self, signals: slice) -> Array:
        """The numbers of the signals in these places.

        Raises:
            WindowError: the windows do not tell one of them.
        """


class Merged:
    """A fold that keeps an array a window, merges it with that of the windows before, and makes the numbers of it.

    Args:
        part: of a window in which at least one point counts.
        merge: of two windows that follow one another.
        finish: the numbers of what is left, shape (g,).
        nan: what NaN at a point that counts is: ``"looked for"``, as it makes the number NaN; ``"carried"`` by all
            that follows, so that it need not be looked for; or ``"tolerated"``.
        needs: what is missing where the number is NaN or infinite although no value is NaN.
    """

    def __init__(
        self,
        part: Callable[[Window], Array],
        merge: Callable[[Array, Array], Array],
        finish: Callable[[Array], Array],
        *,
        nan: Literal["looked for", "carried", "tolerated"] = "looked for",
        needs: str = "",
    ) -> None:
        self._part, self._merge, self._finish, self._nan, self._needs = part, merge, finish, nan, needs
        self._is_nan: NDArray[np.bool_] | None = None
        self._seen: Array | None = None
        self._numbers: Array | None = None

    def see(self, window: Window) -> None:
        """As `Fold` has it."""
        if not window.times.size:
            return  # no interval into it counts either
        if self._nan == "looked for":
            unknown = np.isnan(window.kept)
            if np.count_nonzero(unknown):
                found = np.asarray(unknown.any(axis=(-2, -1)))
                self._is_nan = found if self._is_nan is None else self._is_nan | found
        part = self._part(window)
        self._seen = part if self._seen is None else self._merge(self._seen, part)

    def numbers(self, signals: slice) -> Array:
        """As `Fold` has it."""
        if self._seen is None:
            raise WindowError(nothing_in_window())
        if self._numbers is None:
            numbers = self._finish(self._seen)
            self._numbers = numbers if self._is_nan is None else np.where(self._is_nan, np.nan, numbers)
        found = self._numbers[signals]
        if self._needs:
            told = found >= 0.0 if self._is_nan is None else (found >= 0.0) | self._is_nan[signals]
            if not told.all():
                raise WindowError(self._needs)
        return found


def largest(values: Array) -> Array:
    """The value of largest magnitude with its sign: one number for rows that each have one."""
    if values.shape[-1] == 1:
        return values[..., 0]
    places = np.abs(values).argmax(axis=-1)
    return np.asarray(np.take_along_axis(values, places[..., np.newaxis], axis=-1)[..., 0])


def _first(before: Array, after: Array) -> Array:
    return before


def _last(before: Array, after: Array) -> Array:
    return after


def _as_it_is(seen: Array) -> Array:
    return seen


def _least(seen: Array) -> Array:
    return np.asarray(np.minimum.reduce(seen, axis=-1))


def _most(seen: Array) -> Array:
    return np.asarray(np.maximum.reduce(seen, axis=-1))


def _sum(seen: Array) -> Array:
    return np.asarray(seen.sum(axis=-1))


def minimum() -> Fold:
    """The least value."""
    return Merged(lambda w: _least(w.kept), np.minimum, _least, nan="carried")


def maximum() -> Fold:
    """The greatest value."""
    return Merged(lambda w: _most(w.kept), np.maximum, _most, nan="carried")


def peaks(finish: Callable[[Array], float] | None = None) -> Fold:
    """The greatest magnitude, or what is to be made of that of each row."""

    def part(window: Window) -> Array:
        return np.asarray(np.maximum(_most(window.kept), -_least(window.kept)) + 0.0)  # never -0

    if finish is None:
        return Merged(part, np.maximum, _most, nan="carried")
    return Merged(part, np.maximum, lambda seen: np.array([finish(rows) for rows in seen]))


def initial() -> Fold:
    """The first value, of rows the largest."""
    return Merged(lambda w: w.kept[..., 0], _first, largest)


def final() -> Fold:
    """The last value, of rows the largest."""
    return Merged(lambda w: w.kept[..., -1], _last, largest)


def integral() -> Fold:
    """The integrals of all rows together."""
    return Merged(Window.integral, np.add, _sum)


def duration() -> Fold:
    """How long a row is not zero, of rows the longest."""
    return Merged(lambda w: w.integral((w.rows != 0).astype(np.float64)), np.add, _most)


def means(finish: Callable[[Array], Array], *, squares: bool = False) -> Fold:
    """What is to be made of the time-weighted mean of each row, or of that of its squares."""

    def part(window: Window) -> Array:
        seen = Window(np.square(window.rows), window.selection) if squares else window
        area, duration = seen.integral(), float(window.selection.lengths.sum())
        sums = np.zeros((4, *area.shape))
        sums[0], sums[1], sums[3] = area, duration, seen.times.size
        if not duration:  # else nobody asks for it
            sums[2] = total(seen.kept)
        return sums

    def mean(sums: Array) -> Array:
        area, time, sum_of_all, count = sums
        return finish(area / time if time.flat[0] > 0.0 else sum_of_all / count)

    return Merged(part, np.add, mean)


def spread() -> Fold:
    """How far rows are apart at one time, at most."""
    return Merged(lambda w: np.asarray(np.ptp(w.kept, axis=-2).max(axis=-1)), np.maximum, _as_it_is, nan="carried")


def _when(window: Window, hits: NDArray[np.bool_], *, last: bool) -> Array:
    """The first time with a hit (g, T), infinite if there is none; or the last one, else minus infinity."""
    times = window.times
    place = times.size - 1 - hits[:, ::-1].argmax(axis=-1) if last else hits.argmax(axis=-1)
    return np.where(hits.any(axis=-1), times[place], -np.inf if last else np.inf)


def first_time() -> Fold:
    """When some row is not zero for the first time; infinite if never."""
    return Merged(lambda w: _when(w, (w.kept != 0).any(axis=-2), last=False), np.minimum, _as_it_is)


def last_time() -> Fold:
    """When some row is not zero for the last time; infinite if never."""
    return Merged(
        lambda w: _when(w, (w.kept != 0).any(axis=-2), last=True),
        np.maximum,
        lambda time: np.where(np.isfinite(time), time, np.inf),
    )


def jerk() -> Fold:
    """The steepest slope between neighbouring points."""
    return Merged(
        lambda w: np.maximum.reduce(np.abs(w.slopes()), axis=-1, initial=-np.inf),
        np.maximum,
        _most,
        needs="jerk needs two neighbouring recorded points in the window",
    )


def settling(is_beyond: Callable[[Array], NDArray[np.bool_]], begin: float = 0.0, *, tolerates_nan: bool) -> Fold:
    """The time from which on no row is beyond its bounds any more; infinite if they are up to the end.

    Args:
        is_beyond: whether values are beyond.
        begin: what is taken from the time, in s.
        tolerates_nan: whether NaN may be beyond, too.
    """

    def part(window: Window) -> Array:
        times = window.times
        beyond = np.asarray(is_beyond(window.kept).any(axis=-2))
        was = beyond.any(axis=-1)
        next_one = np.where(was, times.size - beyond[:, ::-1].argmax(axis=-1), 0)
        since = np.append(times, np.inf)[next_one]
        return np.array([since, np.full(len(since), times[0]), was])

    def merge(before: Array, after: Array) -> Array:
        still = np.where(np.isfinite(before[0]), before[0], after[1])
        return np.array([np.where(after[2] > 0.0, after[0], still), before[1], np.maximum(before[2], after[2])])

    nan: Literal["tolerated", "looked for"] = "tolerated" if tolerates_nan else "looked for"
    return Merged(part, merge, lambda seen: seen[0] - begin, nan=nan)


def overshoot() -> Fold:
    """How far a row goes beyond zero, seen from where it starts; from zero itself, either way."""

    def part(window: Window) -> Array:
        kept = window.kept
        return np.array([kept[..., 0], _most(kept), _least(kept)])

    def merge(before: Array, after: Array) -> Array:
        return np.array([before[0], np.maximum(before[1], after[1]), np.minimum(before[2], after[2])])

    def finish(seen: Array) -> Array:
        start, most, least = seen
        over = np.where(start > 0, -least, np.where(start < 0, most, np.maximum(most, -least)))
        return np.asarray(over.max(axis=-1, initial=0.0))

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
            place = int(time.searchsorted(moment))
            beside = slice(max(place - 2, 0), place + 2)
            shape = window.rows.shape[:-1]
            rows = window.rows[..., beside].reshape(-1, time[beside].size)
            self._found = np.array([np.interp(moment, time[beside], row) for row in rows]).reshape(shape)

    def numbers(self, signals: slice) -> Array:
        """As `Fold` has it."""
        if self._found is None:
            raise WindowError(f"no recorded points around t = {digits(self._moment)} s")
        found = self._found[signals]
        return np.where(np.isnan(found).any(axis=-1), np.nan, largest(found))


class MeanJerk:
    """A fold: the largest slope of a chord of some length in time.

    Args:
        width: of the chord, in s.
        span: of the run.
    """

    def __init__(self, width: float, span: Span) -> None:
        self._width, self._forgiven = width, span.forgiven
        self._time, self._starts = np.empty(0), np.empty(0, np.bool_)
        self._rows = np.empty((0, 0, 0))
        self._largest: Array = np.empty(0)
        self._is_nan: NDArray[np.bool_] = np.empty(0, np.bool_)

    def see(self, window: Window) -> None:
        """As `Fold` has it."""
        if not self._largest.size:
            self._largest, self._is_nan = np.full(len(window.rows), -np.inf), np.zeros(len(window.rows), np.bool_)
        new = slice(int(self._time.size > 0), None)  # the first point is the last one of before
        starts = window.selection.points[new].copy()
        time, width = window.time[new], self._width
        for a, b in window.selection.span.outside:
            starts &= ~((time <= b + self._forgiven) & (time + width >= a - self._forgiven))
        self._is_nan = np.asarray(self._is_nan | np.isnan(window.kept).any(axis=(-2, -1)))
        rows = window.rows[..., new]
        self._rows = rows if not self._time.size else np.concatenate([self._rows, rows], axis=-1)
        self._time, self._starts = np.concatenate([self._time, time]), np.concatenate([self._starts, starts])
        kept = window.times
        self._look(kept[-1] if kept.size else -np.inf)

    def _look(self, last: float) -> None:
        """At the chords that end by then; what no later one needs is forgotten."""
        time, rows = self._time, self._rows
        chosen = self._starts & (time + self._width <= last + self._forgiven)
        places = np.flatnonzero(chosen)
        if places.size:
            ends = time[places] + self._width
            later = np.array([[np.interp(ends, time, row) for row in signal] for signal in rows])
            steepest = np.abs(later - rows.take(places, axis=-1)).max(axis=(-2, -1)) / self._width
            self._largest = np.fmax(self._largest, steepest)
        # Where none counts, chords that have begun do not end: outside is not crossed, nor the end.
        left = self._starts & ~chosen & np.isfinite(last)
        first = int(np.argmax(left)) if left.any() else max(time.size - 1, 0)
        self._time, self._rows, self._starts = time[first:], rows[..., first:], left[first:]

    def numbers(self, signals: slice) -> Array:
        """As `Fold` has it."""
        found = np.where(self._is_nan, np.nan, self._largest)[signals]
        if np.isinf(found).any():
            raise WindowError(f"mean_jerk needs recorded points {digits(self._width)} s apart in the window")
        return found
