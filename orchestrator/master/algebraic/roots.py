"""Roots of systems of equations: Newton's method within a trust region, by Powell's dog-leg (Powell 1970).

The compiled loop has it too (``native/algebraic/roots.c``), to the same bits: so it is all written out here, each sum
is taken from the first to the last, and nothing is left to a library of linear algebra.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
SETTLED = 1e-13
"""Relative mismatch, and correction, below which nothing is solved any more."""
SOLVED = 1e-9
"""The same, below which what rounding leaves of it need not become smaller."""
_MOST = 100
"""Steps, each with slopes of its own."""
_WIDE, _NARROW = 100.0, 1e-14
"""Radius of the first trust region, and of the last, relative to the values."""
_ACCEPTED, _POOR, _GOOD = 1e-4, 0.25, 0.75
"""Parts of the decrease of the mismatch that was hoped for: from which on there is a step, below which the region
becomes smaller, from which on larger."""


def relative(difference: Vector, values: Vector) -> float:
    """The largest difference, relative to its value's size above 1; infinite where one is no number."""
    largest = float(np.max(np.abs(difference) / np.maximum(1.0, np.abs(values)), initial=0.0))
    return largest if math.isfinite(largest) else math.inf


def find_root(
    evaluate: Callable[[Vector], Vector], derive: Callable[[Vector], Vector], begin: Vector, mismatch: Vector
) -> tuple[Vector, float, bool]:
    """Values near those to begin with at which nothing is left of a mismatch.

    Args:
        evaluate: the mismatch, (n,), at values, (n,).
        derive: the derivatives of the mismatch, (n, n), at the values at which it was evaluated last.
        begin: the values to begin with, at which it was evaluated last.
        mismatch: there.

    Returns:
        the values, the larger one of what is left there of the mismatch and of Newton's next correction, relative to
        the values, and whether they are those at which it was evaluated last, with nothing derived since. A small
        mismatch alone proves nothing: x = x + 1 has one at any x that is large enough.
    """
    here, off, radius, left = begin, mismatch, -1.0, math.inf
    scale = np.ones(len(here))
    for _ in range(_MOST):
        scale = np.maximum(scale, np.abs(here))
        slopes = derive(here) * scale / scale[:, np.newaxis]
        scaled = off / scale
        if not (np.isfinite(slopes).all() and np.isfinite(scaled).all()):
            return here, math.inf, False
        factors, order = _factored(slopes)
        newton = _solved(factors, order, scaled)
        left = _left(off, here, newton, scale)
        if left <= SETTLED:
            return here, left, False
        size = max(1.0, _norm(here / scale))
        if radius < 0.0:
            radius = _WIDE * size
        before, trial = _norm(scaled), here
        while True:
            step = _dog_leg(newton, slopes, scaled, radius)
            length, hoped = _norm(step), before - _norm(scaled + _product(slopes, step))
            trial = here + scale * step
            reached = evaluate(trial)
            gain = before - _norm(reached / scale)
            is_step = gain > 0.0 and gain >= _ACCEPTED * hoped
            if not (is_step and gain >= _POOR * hoped):
                radius = _POOR * min(radius, length)
            elif gain >= _GOOD * hoped:
                radius = max(radius, 2.0 * length)
            if is_step:
                break
            if left <= SOLVED or not radius > _NARROW * size:
                return here, left, False
        here, off = trial, reached
        last, left = left, _left(off, here, _solved(factors, order, off / scale), scale)
        if left <= SETTLED or (left <= SOLVED and not left <= 0.5 * last):
            return here, left, True
    return here, left, True


def _left(mismatch: Vector, values: Vector, correction: Vector, scale: Vector) -> float:
    """What is left of a mismatch at values, or of Newton's correction there, in units of their scale."""
    return max(relative(mismatch, values), relative(correction * scale, values))


def _norm(vector: Vector) -> float:
    """The Euclidean one, by way of the largest, so that nothing overflows; infinite where one is no number."""
    largest = float(np.max(np.abs(vector), initial=0.0))
    if not 0.0 < largest < math.inf:
        return 0.0 if largest == 0.0 else math.inf
    parts = vector / largest
    return largest * math.sqrt(float(np.cumsum(parts * parts)[-1]))


def _product(matrix: Vector, vector: Vector) -> Vector:
    """Of a matrix and a vector: one column after the other."""
    found = np.zeros(len(vector))
    for k, factor in enumerate(vector):
        found = found + factor * matrix[:, k]
    return found


def _factored(matrix: Vector) -> tuple[Vector, list[int]]:
    """LU factors by partial pivoting, in one matrix, and which row came first of those that were left, each time."""
    factors, order = matrix.copy(), []
    for k in range(len(factors)):
        first = k + int(np.argmax(np.abs(factors[k:, k])))
        order.append(first)
        if first != k:
            factors[[k, first]] = factors[[first, k]]
        if factors[k, k] != 0.0:
            factors[k + 1 :, k] /= factors[k, k]
            factors[k + 1 :, k + 1 :] -= factors[k + 1 :, k, np.newaxis] * factors[k, k + 1 :]
    return factors, order


def _solved(factors: Vector, order: list[int], mismatch: Vector) -> Vector:
    """Newton's step, which cancels a mismatch; not finite where the matrix is singular."""
    found = -mismatch
    for k, first in enumerate(order):
        found[k], found[first] = found[first], found[k]
    for k in range(len(found)):
        found[k + 1 :] -= found[k] * factors[k + 1 :, k]
    for k in reversed(range(len(found))):
        found[k] /= factors[k, k]
        found[:k] -= found[k] * factors[:k, k]
    return found


def _dog_leg(newton: Vector, slopes: Vector, mismatch: Vector, radius: float) -> Vector:
    """Newton's step, if it is not too long; else one that goes steepest downhill first, and then towards it."""
    size = _norm(newton)
    if size <= radius:
        return newton
    is_finite = bool(np.isfinite(newton).all())
    gradient = np.zeros(len(mismatch))
    for k, factor in enumerate(mismatch):
        gradient = gradient + factor * slopes[k]
    steep = _norm(gradient)
    along = _norm(_product(slopes, gradient / steep)) if steep > 0.0 else 0.0
    if not along > 0.0:
        return newton * (radius / size) if is_finite else np.zeros(len(newton))
    lowest = steep / along / along
    if lowest >= radius or not is_finite:
        return gradient / steep * -min(lowest, radius)
    corner = gradient / steep * -lowest
    way = newton - corner
    length, base = _norm(way), 0.0
    for a, b in zip(corner, way, strict=True):
        base += float(a) * (float(b) / length)
    room = (radius - lowest) * (radius + lowest)
    root = math.sqrt(base * base + room)
    part = root - base if base < 0.0 else room / (root + base)
    return np.asarray(corner + way * (min(part, length) / length))
