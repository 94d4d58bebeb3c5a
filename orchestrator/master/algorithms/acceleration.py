"""From what was tried to what is tried next: ways to reach a fixed point sooner than by plain repetition.

All are functions of a guess and of what it led to; values are in units of their size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
_DEPTH = 5
"""Former iterates that Anderson's method combines."""


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
            size = float(change @ change)
            if size > 0.0:
                factor *= -float(before @ change) / size
        before = residual
        return np.asarray(guess + factor * residual)

    return following


def _anderson(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Anderson's method (Anderson 1965; Walker and Ni 2011, algorithm AA): the best combination of former iterates."""
    guesses: list[Vector] = []
    residuals: list[Vector] = []

    def following(guess: Vector, reached: Vector) -> Vector:
        residual = reached - guess
        guesses.append(guess)
        residuals.append(residual)
        del guesses[: -_DEPTH - 1], residuals[: -_DEPTH - 1]
        if len(residuals) == 1:
            return np.asarray(guess + relaxation * residual)
        steps = np.diff(np.array(guesses), axis=0).T
        changes = np.diff(np.array(residuals), axis=0).T
        if not np.isfinite(changes).all():
            return np.full_like(guess, np.nan)
        weights = np.linalg.lstsq(changes, residual, rcond=1e-14)[0]
        return np.asarray(guess + relaxation * residual - (steps + relaxation * changes) @ weights)

    return following


ACCELERATIONS: Mapping[str, Callable[[float], Callable[[Vector, Vector], Vector]]] = {
    "none": _relaxed,
    "aitken": _aitken,
    "anderson": _anderson,
}
"""Each given the relaxation: the first one of Aitken's, the mixing of Anderson's."""
