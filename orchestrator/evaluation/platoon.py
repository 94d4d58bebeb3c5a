"""Reducers for trains that follow one another: convergence, string stability, distances, capacity.

Defined in `docs/metrics.md`. "Rows" are signals of several trains or gaps, as `train[:].speed` gives them, the front
one first.
"""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, WindowError
from ..problems import Problem
from .signals import Signals
from .time_windows import Window, scalar, window_of

Array = NDArray[np.float64]


def _phase(signals: Signals, x: Any, after: Any, until: Any) -> tuple[Array, Array]:
    """Time (P,) since the begin of the phase after <= t < until, and the rows (n, P) in it.

    Half open, because at the end of a phase the reference has already the next one's value.
    """
    seen = window_of(signals, x, after, until)
    inside = seen.points
    if until is not None:
        inside = inside & (signals.time < scalar(until, "until") - 1e-6 * signals.step)
    if not inside.any():
        raise WindowError(Problem("", "no recorded point lies in the phase", "widen it, or record more often"))
    begin = float(signals.time[0]) if after is None else scalar(after, "after")
    return signals.time[inside] - begin, seen.rows[:, inside]


def _convergence_time(signals: Signals, x: Any, band: Any = 1.0, *, after: Any = None, until: Any = None) -> float:
    limit = scalar(band, "the band of convergence_time")
    since, rows = _phase(signals, x, after, until)
    beyond = np.flatnonzero(~(np.abs(rows) <= limit).all(axis=0))  # NaN is beyond
    first = int(beyond[-1]) + 1 if beyond.size else 0
    return float(since[first]) if first < since.size else np.inf


def _speed_overshoot(signals: Signals, x: Any, *, after: Any = None, until: Any = None) -> float:
    return float(_phase(signals, x, after, until)[1].max())


def _gap_overshoot(signals: Signals, gap: Array, nominal: Any, *, after: Any = None, until: Any = None) -> float:
    return float(_phase(signals, gap, after, until)[1].max() - scalar(nominal, "the nominal gap"))


def _peak_acceleration(signals: Signals, x: Any, *, after: Any = None, until: Any = None) -> float:
    return float(np.abs(_phase(signals, x, after, until)[1]).max())


def _ratio(peak: float, before: float) -> float:
    if before > 0.0:
        return peak / before
    return np.nan if peak == 0.0 or np.isnan(peak) else np.inf


def _amplification(
    signals: Signals, x: Any, ahead: Any, *, after: Any = None, until: Any = None, outside: Any = None
) -> float:
    def peak(signal: Any) -> float:
        return window_of(signals, signal, after, until, outside).reduce(lambda w: np.abs(w.kept).max())

    return _ratio(peak(x), peak(ahead))


def _string_ratio(signals: Signals, x: Any, *, after: Any = None, until: Any = None, outside: Any = None) -> float:
    def largest(seen: Window) -> float:
        if len(seen.rows) < 2:
            raise ExpressionError("string_ratio compares trains with the one ahead: give rows, as in train[:].speed")
        peaks = np.abs(seen.kept).max(axis=1)
        return max(_ratio(float(b), float(a)) for a, b in itertools.pairwise(peaks))

    return window_of(signals, x, after, until, outside).reduce(largest)


def _time_to_collision(
    signals: Signals, gap: Any, closing: Any, *, after: Any = None, until: Any = None, outside: Any = None
) -> float:
    distance, speed = np.broadcast_arrays(np.asarray(gap, dtype=np.float64), np.asarray(closing, dtype=np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        times = np.where(speed > 0.0, np.maximum(distance, 0.0) / speed, np.inf)
    times = np.where(distance <= 0.0, 0.0, times)
    unknown = np.isnan(distance) | np.isnan(speed)
    seen = window_of(signals, np.where(unknown, np.nan, times), after, until, outside)
    return seen.reduce(lambda w: w.kept.min())


def _braking_margin(  # noqa: PLR0917 (as a user writes it)
    signals: Signals,
    gap: Any,
    speed: Any,
    ahead_speed: Any,
    braking: Any,
    ahead_braking: Any,
    reaction_time: Any = 0.0,
    standstill_gap: Any = 0.0,
    *,
    after: Any = None,
    until: Any = None,
    outside: Any = None,
) -> float:
    own, other = scalar(braking, "braking"), scalar(ahead_braking, "ahead_braking")
    if not (own > 0.0 and other > 0.0):
        raise ExpressionError("braking and ahead_braking must be greater than 0 m/s2")
    reaction, rest = scalar(reaction_time, "reaction_time"), scalar(standstill_gap, "standstill_gap")
    v, w = np.maximum(speed, 0.0), np.maximum(ahead_speed, 0.0)
    margin = gap - rest - (v * reaction + v * v / (2.0 * own) - w * w / (2.0 * other))
    return window_of(signals, margin, after, until, outside).reduce(lambda seen: seen.kept.min())


def _headway_capacity(
    signals: Signals, gap: Any, speed: Any, *, after: Any = None, until: Any = None, outside: Any = None
) -> float:
    distance, v = np.broadcast_arrays(np.asarray(gap, dtype=np.float64), np.asarray(speed, dtype=np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        headway = np.where(v > 0.0, distance / v, np.where(np.isnan(v), np.nan, np.inf))

    def capacity(seen: Window) -> float:
        if np.isinf(seen.kept).any():
            return 0.0
        longest = float(seen.mean().max())
        return 3600.0 / longest if longest else np.inf

    return window_of(signals, headway, after, until, outside).reduce(capacity)


PLATOON: dict[str, tuple[str, Callable[..., Any]]] = {
    "convergence_time": ("s", _convergence_time),
    "speed_overshoot": ("same", _speed_overshoot),
    "gap_overshoot": ("same", _gap_overshoot),
    "peak_acceleration": ("same", _peak_acceleration),
    "amplification": ("", _amplification),
    "string_ratio": ("", _string_ratio),
    "time_to_collision": ("s", _time_to_collision),
    "braking_margin": ("m", _braking_margin),
    "headway_capacity": ("trains/h", _headway_capacity),
}
"""Unit and rule by name, for the registry of `metrics`."""
