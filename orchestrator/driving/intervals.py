"""An interval of the mesh: its collocation points, the polynomials through them, and how long a train takes over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

DEGREE = 3
"""Collocation points in an interval: integrals are exact for polynomials of degree 5."""
_PLACES = ca.collocation_points(DEGREE, "legendre")
POINTS = np.array(_PLACES)
"""Shares of an interval, shape (DEGREE,)."""
SLOPES, END, WEIGHTS = (np.array(each) for each in ca.collocation_coeff(_PLACES))
"""From the values at begin and points, or at the points alone: slopes at the points, value at the end, integral."""
WEIGHTS = WEIGHTS.ravel()


def basis(share: Any) -> list[Any]:
    """Each Lagrange polynomial through the collocation points, at a share of the interval."""
    values = []
    for k, point in enumerate(POINTS):
        value: Any = 1.0
        for other in np.delete(POINTS, k):
            value = value * (share - other) / (point - other)
        values.append(value)
    return values


def pace(share: float, first: Any, last: Any, inside: Sequence[Any]) -> Any:
    """Time from an interval's begin to a share of it, over the interval's length, in s/m.

    Near a standstill 1 / v is no polynomial, and Gauss' rule is off by per cents there. So the time is that of the
    constant acceleration between the ends, exactly, times what the speeds inside differ from it by, which is smooth.

    Args:
        share: of the way, up to 1.
        first: speed at the begin in m/s, a number, an array or a symbol.
        last: at the end.
        inside: speeds at the collocation points.
    """
    until = share * (first + last) / (first + _steady(share, first, last))  # share of the time, steadily accelerated
    ratios = [_steady(point, first, last) / speed for point, speed in zip(POINTS, inside, strict=True)]
    bend = (last - first) / (last + first)
    total: Any = 0.0
    for node, weight in zip(POINTS, WEIGHTS, strict=True):
        moment = until * node
        place = (1.0 - bend) * moment + bend * moment * moment
        total = total + weight * sum(part * ratio for part, ratio in zip(basis(place), ratios, strict=True))
    return 2.0 * until * total / (first + last)


def _steady(share: float, first: Any, last: Any) -> Any:
    """The speed at a share of the interval under a constant acceleration between the speeds at its ends."""
    return (first * first + (last * last - first * first) * share) ** 0.5
