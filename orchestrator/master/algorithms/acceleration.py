"""From what was tried to what is tried next: ways to reach a fixed point sooner than by plain repetition.

All are functions of a guess and of what it led to; values are in units of their size. The compiled loop has them too
(``native/acceleration.c``), to the same bits: so every sum is taken from the first to the last, and least squares are
written out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
_DEPTH = 5
"""Former iterates that Anderson's method combines."""
_DEPENDENT = 1e-14
"""Part of a column that is left of one which depends on others."""


def _dot(a: Vector, b: Vector) -> float:
    """Their product, summed up in their sequence."""
    return float(np.cumsum(a * b)[-1]) if len(a) else 0.0


def _relaxed(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Part of the way, or more than all of it."""
    return lambda guess, reached: guess + relaxation * (reached - guess)


def _aitken(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Aitken's dynamic relaxation (Irons and Tuck 1969; Küttler and Wall 2008, eq. 44)."""
    factor, before = relaxation, None

    def following(guess: Vector, reached: Vector) -> Vector:
        nonlocal factor, before
        residual = reached - guess
        if before is not None:
            change = residual - before
            size = _dot(change, change)
            if size > 0.0:
                factor *= -_dot(before, change) / size
        before = residual
        return np.asarray(guess + factor * residual)

    return following


def _nearest(columns: Sequence[Vector], wanted: Vector) -> list[float]:
    """Weights of columns of which the sum comes nearest to what is wanted.

    By modified Gram-Schmidt, done twice (Björck 1967; Giraud et al. 2005), from the last column on: one that depends on
    those after it has no weight.
    """
    rest, weights = wanted.copy(), [0.0] * len(columns)
    basis: list[Vector] = []
    upper: list[list[float]] = []
    right, kept = list[float](), list[int]()
    for k in reversed(range(len(columns))):
        if len(basis) == len(wanted):
            break
        column, parts = columns[k].copy(), [0.0] * len(basis)
        for _ in range(2):  # the second takes away what rounding has left of the first
            for n, own in enumerate(basis):
                part = _dot(own, column)
                column -= part * own
                parts[n] += part
        left = math.sqrt(_dot(column, column))
        if not left > _DEPENDENT * math.sqrt(_dot(columns[k], columns[k])):
            continue
        basis.append(column / left)
        upper.append([*parts, left])
        right.append(_dot(basis[-1], rest))
        rest -= right[-1] * basis[-1]
        kept.append(k)
    for n in reversed(range(len(kept))):
        value = right[n]
        for m in range(n + 1, len(kept)):
            value -= upper[m][n] * weights[kept[m]]
        weights[kept[n]] = value / upper[n][n]
    return weights


def _anderson(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Anderson's method (Anderson 1965; Walker and Ni 2011, algorithm AA): the best combination of former iterates."""
    guesses: list[Vector] = []
    residuals: list[Vector] = []

    def following(guess: Vector, reached: Vector) -> Vector:
        residual = reached - guess
        guesses.append(guess)
        residuals.append(residual)
        del guesses[: -_DEPTH - 1], residuals[: -_DEPTH - 1]
        changes = [b - a for a, b in pairwise(residuals)]
        steps = [b - a for a, b in pairwise(guesses)]
        if not all(np.isfinite(change).all() for change in changes):
            return np.full_like(guess, np.nan)
        move = np.zeros_like(guess)
        for weight, step, change in zip(_nearest(changes, residual), steps, changes, strict=True):
            move += weight * (step + relaxation * change)
        return np.asarray(guess + relaxation * residual - move)

    return following


ACCELERATIONS: Mapping[str, Callable[[float], Callable[[Vector, Vector], Vector]]] = {
    "none": _relaxed,
    "aitken": _aitken,
    "anderson": _anderson,
}
"""Each given the relaxation: the first one of Aitken's, the mixing of Anderson's."""
