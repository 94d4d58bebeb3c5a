"""Which recorded points of a signal count: the windows that every reducer takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, WindowError
from ..problems import Problem
from ..times import digits, slack
from .signals import Signals

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Window:
    """The rows (n, T) of a signal, the points of time (T,) and which of them, and of the intervals, count."""

    rows: Array
    time: Array
    points: NDArray[np.bool_]  # (T,)
    intervals: NDArray[np.bool_]  # (T-1,): both ends count and nothing between them is excluded

    @property
    def kept(self) -> Array:
        """The rows at the points that count."""
        return np.asarray(self.rows[:, self.points])

    def reduce(self, rule: "Callable[[Window], Any]") -> float:
        """The rule's result, or NaN when there is a NaN among the points that count."""
        return np.nan if np.isnan(self.kept).any() else float(rule(self))

    def integral(self) -> Array:
        """Trapezoid rule over the intervals that count, one value a row."""
        areas = 0.5 * (self.rows[:, 1:] + self.rows[:, :-1]) * np.diff(self.time)
        return np.asarray(areas[:, self.intervals].sum(axis=1))

    def mean(self) -> Array:
        """Time-weighted mean of each row."""
        duration = np.diff(self.time)[self.intervals].sum()
        return self.integral() / duration if duration > 0 else np.asarray(self.kept.mean(axis=1))

    def times(self) -> Array:
        """The times that count at which some row is not zero."""
        return np.asarray(self.time[self.points][(self.kept != 0).any(axis=0)])

    def slopes(self) -> Array:
        """Difference quotients over the intervals that count, shape (n, intervals)."""
        slopes = np.diff(self.rows, axis=1)[:, self.intervals] / np.diff(self.time)[self.intervals]
        if not slopes.size:
            raise WindowError("jerk needs two neighbouring recorded points in the window")
        return np.asarray(slopes)


def scalar(value: Any, what: str) -> float:
    """A number out of an argument that must not vary over time.

    Raises:
        ExpressionError: it does, or it is a list or NaN.
    """
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


def select(
    signals: Signals, after: float | None, until: float | None, outside: Sequence[tuple[float, float]]
) -> NDArray[np.bool_]:
    """Which recorded points lie in after <= t <= until and in none of the closed intervals `outside`; shape (T,).

    Rounding is forgiven, because 3 * 0.1 is not 0.3.
    """
    time, forgiven = signals.time, slack(signals.step, *_ends(signals.time))
    points = np.ones(time.shape, dtype=np.bool_)
    if after is not None:
        points &= time >= after - forgiven
    if until is not None:
        points &= time <= until + forgiven
    for first, last in outside:
        points &= ~((time >= first - forgiven) & (time <= last + forgiven))
    return points


def _ends(time: NDArray[np.float64]) -> list[float]:
    return [float(time[0]), float(time[-1])] if time.size else []


def window_of(signals: Signals, x: Any, after: Any = None, until: Any = None, outside: Any = None) -> Window:
    """What a reducer sees of a signal.

    Raises:
        ExpressionError: the arguments are not of the right kind.
        WindowError: the recorded points do not cover the window.
    """
    start = None if after is None else scalar(after, "after")
    end = None if until is None else scalar(until, "until")
    excluded = [] if outside is None else time_windows(outside)
    time = signals.time
    last = float(time[-1]) if time.size else -np.inf
    if end is not None and end > last + slack(signals.step, last):
        raise WindowError(f"the window lasts until {digits(end)} s but the recorded points end at {digits(last)} s")
    points = select(signals, start, end, excluded)
    if not points.any():
        raise WindowError(Problem("", "no recorded point lies in the window", "widen it, or record more often"))
    intervals = points[:-1] & points[1:]
    for a, b in excluded:
        intervals &= ~((time[:-1] <= b) & (time[1:] >= a))
    values = np.atleast_2d(np.asarray(x, dtype=np.float64))
    return Window(np.broadcast_to(values, (values.shape[0], time.size)), time, points, intervals)
