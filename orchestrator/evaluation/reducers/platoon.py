"""Reducers for trains that follow one another: convergence, string stability, distances, capacity.

Defined in `docs/metrics.md`. "Rows" are signals of several trains or gaps, as `train[:].speed` gives them, the front
one first.
"""

import itertools

import numpy as np
from numpy.typing import NDArray

from ...errors import ExpressionError
from ..functions import Function
from .folds import Fold, maximum, means, minimum, peaks, settling
from .windows import Span

Array = NDArray[np.float64]
Reduction = tuple[Array, Fold]


def _convergence_time(span: Span, x: Array, band: float = 1.0) -> Reduction:
    return x, settling(lambda rows: ~(np.abs(rows) <= band), span.begin, tolerates_nan=True)  # NaN is beyond


def _speed_overshoot(_: Span, x: Array) -> Reduction:
    return x, maximum()


def _gap_overshoot(_: Span, gap: Array, nominal: float) -> Reduction:
    return gap - nominal, maximum()


def _peak_acceleration(_: Span, x: Array) -> Reduction:
    return x, peaks()


def _ratio(peak: float, before: float) -> float:
    if before > 0.0:
        return peak / before
    return np.nan if peak == 0.0 else np.inf


def _amplification(_: Span, x: Array, ahead: Array) -> Reduction:
    own, other = np.atleast_2d(x), np.atleast_2d(ahead)
    wide = max(own.shape[1], other.shape[1])
    rows = np.concatenate([np.broadcast_to(part, (len(part), wide)) for part in (own, other)])
    return rows, peaks(lambda peaks: _ratio(float(peaks[: len(own)].max()), float(peaks[len(own) :].max())))


def _string_ratio(_: Span, x: Array) -> Reduction:
    if np.atleast_2d(x).shape[0] < 2:
        raise ExpressionError("string_ratio compares trains with the one ahead: give rows, as in train[:].speed")
    return x, peaks(lambda peaks: max(_ratio(float(b), float(a)) for a, b in itertools.pairwise(peaks)))


_ROUNDING = 1e-9
"""Up to this closing speed, in m/s, trains keep their distance: it is what is left of equal speeds."""


def _time_to_collision(_: Span, gap: Array, closing: Array) -> Reduction:
    distance, speed = np.broadcast_arrays(gap, closing)
    with np.errstate(divide="ignore", invalid="ignore"):
        times = np.where(speed > _ROUNDING, np.maximum(distance, 0.0) / speed, np.inf)
    times = np.where(distance <= 0.0, 0.0, times)
    return np.where(np.isnan(distance) | np.isnan(speed), np.nan, times), minimum()


def _braking_margin(  # noqa: PLR0917 (as a user writes it)
    _: Span,
    gap: Array,
    speed: Array,
    ahead_speed: Array,
    braking: float,
    ahead_braking: float,
    reaction_time: float = 0.0,
    standstill_gap: float = 0.0,
) -> Reduction:
    if not (braking > 0.0 and ahead_braking > 0.0):
        raise ExpressionError("braking and ahead_braking must be greater than 0 m/s2")
    v, w = np.maximum(speed, 0.0), np.maximum(ahead_speed, 0.0)
    needed = v * reaction_time + v * v / (2.0 * braking) - w * w / (2.0 * ahead_braking)
    return gap - standstill_gap - needed, minimum()


def _headway_capacity(_: Span, gap: Array, speed: Array) -> Reduction:
    distance, v = np.broadcast_arrays(gap, speed)
    with np.errstate(divide="ignore", invalid="ignore"):
        headway = np.where(v > 0.0, distance / v, np.where(np.isnan(v), np.nan, np.inf))

    def capacity(means: Array) -> Array:
        longest = means.max(axis=-1)
        return np.where(longest == 0.0, np.inf, 3600.0 / longest)

    return headway, means(capacity)


PLATOON: dict[str, Function] = {
    "convergence_time": Function(_convergence_time, "s", window="phase"),
    "speed_overshoot": Function(_speed_overshoot, "same", window="phase"),
    "gap_overshoot": Function(_gap_overshoot, "same", window="phase"),
    "peak_acceleration": Function(_peak_acceleration, "same", window="phase"),
    "amplification": Function(_amplification, window="span", compares=True),
    "string_ratio": Function(_string_ratio, window="span", compares=True),
    "time_to_collision": Function(_time_to_collision, "s", window="span"),
    "braking_margin": Function(_braking_margin, "m", window="span"),
    "headway_capacity": Function(_headway_capacity, "trains/h", window="span"),
}
"""For the registry of `metrics`."""
