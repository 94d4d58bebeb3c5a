"""Swings that become larger and larger: what a coupling that is not stable does when it is slow at it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_FEWEST = 5
"""Swings, each larger than the last, that are no accident."""
FEWEST_RISES = _FEWEST - 2
"""How many of the last swings of such a signal are larger than the one before, whenever one has begun to look at it."""
_ALL = 20.0
"""Growth from the first of them to the last: a loop that is only badly damped has calmed down by then."""
_EVEN = 0.5
"""How much of the growth of the first half the second must have: resonance, which is linear, slows down."""
VISIBLE = 1e-3
"""Of a usual size: what happens to rounding errors is not worth a word."""


class Swings(NamedTuple):
    """The mean growth from one swing to the next, and the row at which the first of them begins."""

    factor: float
    begin: int


def find_swings(values: NDArray[Any], size: float = 1.0) -> Swings | None:
    """The swings that grow up to the end of a signal, if they do so geometrically.

    A swing is the way from one turning point to the next, whatever it swings about.

    Args:
        values: shape (T,).
        size: what is a usual size of it.
    """
    values = values[np.isfinite(values)]
    turns = _turns(values)
    sizes = np.abs(np.diff(values[turns]))
    if len(sizes) < _FEWEST or not sizes[-1] > VISIBLE * size:
        return None
    smaller = np.flatnonzero(~(sizes[1:] > sizes[:-1]))
    first = int(smaller[-1]) + 1 if smaller.size else 0
    first = max(first, int(np.argmax(sizes > 1e-9 * sizes[-1])))
    grown = sizes[first:]
    if len(grown) < _FEWEST or not grown[-1] > _ALL * grown[0]:
        return None
    middle = len(grown) // 2
    before, after = math.log(grown[middle] / grown[0]), math.log(grown[-1] / grown[middle])
    even = after / (len(grown) - 1 - middle) > _EVEN * before / middle
    return Swings((grown[-1] / grown[0]) ** (1.0 / (len(grown) - 1)), int(turns[first])) if even else None


def _turns(values: NDArray[Any]) -> NDArray[np.intp]:
    """The rows of the first value and of every extreme; a plateau counts where it begins."""
    moving = np.flatnonzero(np.diff(values))
    if not moving.size:
        return np.empty(0, dtype=np.intp)
    ways = np.sign(np.diff(values)[moving])
    turned = np.flatnonzero(ways[1:] != ways[:-1])
    return np.concatenate([[0], moving[turned] + 1])
