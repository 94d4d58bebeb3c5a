"""Tubes around a curve: where another one may run that is meant to be the same.

Source: the rectangles of csv-compare, the Modelica Association's tool: a point is inside if a rectangle around it, of
half the width and height of the tube, meets the reference curve, which is linear between its points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tube:
    """How far another curve may be from the reference.

    Attributes:
        width: in time, to either side, s. height: in value, to either side, in the signal's unit.
    """

    width: float
    height: float


@dataclass(frozen=True)
class Departure:
    """Where a curve is furthest from the reference.

    Attributes:
        distance: in value, of the worst point from all that the reference is within the width of the tube; inf where
            one of both is no number.
        at: its time, s. value: of the curve there. least, greatest: of the reference within the width.
        outside: how many points are further away than the height. points: how many there are.
    """

    distance: float
    at: float
    value: float
    least: float
    greatest: float
    outside: int
    points: int


def envelope(time: Array, values: Array, at: Array, width: float) -> tuple[Array, Array]:
    """The least and the greatest value of a curve within a width in time of some points.

    Args:
        time: of the curve, s, shape (T,); it never goes back, and may stand still where the curve jumps.
        values: shape (T,).
        at: points in time, s, shape (N,).
        width: to either side, s.
    """
    first = np.searchsorted(time, at - width, side="left")
    last = np.searchsorted(time, at + width, side="right")
    ends = [np.interp(np.clip(at + side, time[0], time[-1]), time, values) for side in (-width, width)]
    least, greatest = np.fmin(*ends), np.fmax(*ends)
    level = np.full(len(at), -1)
    within = last > first
    level[within] = np.log2(last[within] - first[within]).astype(int)
    low = high = values  # of each point the extremes of as many as a power of two from there on
    for power in range(int(level.max(initial=-1)) + 1):
        span = 1 << power
        chosen = level == power
        begin, end = first[chosen], last[chosen] - span
        least[chosen] = np.fmin(least[chosen], np.fmin(low[begin], low[end]))
        greatest[chosen] = np.fmax(greatest[chosen], np.fmax(high[begin], high[end]))
        low, high = np.fmin(low[:-span], low[span:]), np.fmax(high[:-span], high[span:])
    return least, greatest


def departure(time: Array, values: Array, at: Array, tested: Array, tube: Tube) -> Departure:
    """How far a curve departs from a reference at the points that it has itself.

    Args:
        time: of the reference, s.
        values: of it.
        at: points of the other curve, s, within the time of the reference.
        tested: its values.
        tube: how far it may.
    """
    least, greatest = envelope(time, values, at, tube.width)
    with np.errstate(invalid="ignore"):  # of infinities
        distance = np.maximum(0.0, np.fmax(least - tested, tested - greatest))
    distance[np.isnan(tested) != np.isnan(least)] = np.inf
    distance[np.isnan(tested) & np.isnan(least)] = 0.0
    distance[(tested == least) | (tested == greatest)] = 0.0  # infinities among them
    worst = int(np.argmax(distance))
    far, time_of, value, low, high = (float(x[worst]) for x in (distance, at, tested, least, greatest))
    return Departure(far, time_of, value, low, high, int(np.count_nonzero(distance > tube.height)), len(at))
