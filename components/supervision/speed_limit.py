"""A speed limit in steps, over time since departure or over position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..maths import where

_ROUNDING = 1e-6
"""s or m: a limit holds up to and with the place it changes at (Liu & Hou 2020, eq. 64), whatever is rounded."""

LIMITS = ((0.0, 19.6), (25.0, 22.6), (100.0, 19.6), (110.0, 22.6), (160.0, 19.6))
"""Liu & Hou 2020, eq. 64, over time in s and m/s."""

LIMITS_BY_PLACE = ((0.0, 19.6), (264.4, 22.6), (1904.3, 19.6), (2096.0, 22.6), (3177.8, 19.6))
"""The same limits where the default reference is at those times, in m and m/s."""


@dataclass(frozen=True)
class SpeedLimit:
    """Steps of a limit: each begins after its place and holds up to and with the next one's."""

    begins: tuple[float, ...]
    values: tuple[float, ...]

    def at(self, place: Any) -> Any:
        """The limit in m/s at a time or position; ahead of the first step that of the first."""
        result: Any = self.values[0]
        for begin, value in zip(self.begins, self.values, strict=True):
            result = where(place > begin + _ROUNDING, value, result)
        return result


def read_limits(rows: Any) -> SpeedLimit:
    """A limit from its table of [begin, speed] pairs.

    Raises:
        ValueError: unusable rows; the message says which.
    """
    if isinstance(rows, str) or not isinstance(rows, Sequence) or not rows:
        raise ValueError("speed limits are a list of [begin, speed] pairs, at least one")
    begins: list[float] = []
    values: list[float] = []
    for index, row in enumerate(rows, 1):
        if isinstance(row, str) or not isinstance(row, Sequence) or len(row) != 2:
            raise ValueError(f"speed limit {index} must be a pair of begin and speed (m/s), not {row!r}")
        if any(isinstance(x, bool) or not isinstance(x, int | float) for x in row) or row[1] < 0:
            raise ValueError(f"speed limit {index} must be a pair of numbers, the speed not negative: {row!r}")
        if begins and row[0] <= begins[-1]:
            raise ValueError(f"speed limit {index} begins at {row[0]:g}, not after the one before it at {begins[-1]:g}")
        begins.append(float(row[0]))
        values.append(float(row[1]))
    return SpeedLimit(tuple(begins), tuple(values))
