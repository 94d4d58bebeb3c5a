"""Tables of constants that are found by where a value lies among breakpoints: what all look-ups are made of.

Only the constants of a cell are looked up; what is computed of them is written as equations. So derivatives are exact:
constants have none.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def is_plain(values: Any) -> bool:
    """Whether values, in lists or arrays, are numbers all of them; symbols are not."""
    if isinstance(values, list | tuple):
        return all(map(is_plain, values))
    if isinstance(values, np.ndarray):
        return values.dtype != object or all(map(is_plain, values.flat))
    return isinstance(values, int | float | np.number)


def just_above(number: float) -> float:
    """The next number above one: to be at least that is to be above it."""
    return math.nextafter(number, math.inf)


class Cells:
    """Constants by cell. In compiled C it is one array, in which cells are found by bisection.

    Args:
        starts: where the cells begin along each axis, (n,) each, in order; the first reaches down to minus infinity,
            the last up to infinity.
        constants: of each cell, shape (n, ..., columns).

    Attributes:
        starts, constants: as given, as numbers.
    """

    def __init__(self, starts: Sequence[Iterable[float]], constants: ArrayLike) -> None:
        self.starts = tuple(tuple(map(float, axis)) for axis in starts)
        self.constants: NDArray[np.float64] = np.array(constants, dtype=float)
        self._rows = self.constants.reshape(-1, self.constants.shape[-1]).tolist()

    def find(self, *places: Any) -> list[Any]:
        """The constants of the cell that a place is in, (columns,); of NaN those of the first.

        Args:
            places: where, along each axis: numbers or symbols.
        """
        for place in places:
            if not isinstance(place, int | float | np.number):
                found: list[Any] = place.cells(self, places)
                return found
        row = 0
        for axis, place in zip(self.starts, places, strict=True):
            row = row * len(axis) + (0 if math.isnan(place) else bisect_right(axis, place, 1) - 1)
        return list(self._rows[row])
