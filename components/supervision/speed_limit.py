"""A speed limit in steps, over time since departure or over position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..maths import logical_and, minimum, where
from ..tables import FASTEST, Column, Table

_ROUNDING = 1e-6
"""s or m: a limit holds up to and with the place it changes at (Liu & Hou 2020, eq. 64), whatever is rounded."""

LIMITS = ((0.0, 19.6), (25.0, 22.6), (100.0, 19.6), (110.0, 22.6), (160.0, 19.6))
"""Liu & Hou 2020, eq. 64, over time in s and m/s."""

LIMITS_BY_PLACE = ((0.0, 19.6), (264.4, 22.6), (1904.3, 19.6), (2096.0, 22.6), (3177.8, 19.6))
"""The same limits where the default reference is at those times, in m and m/s."""


@dataclass(frozen=True)
class SpeedLimit:
    """Steps of a limit, begin and speed in m/s: each begins after its place and holds up to and with the next one's."""

    steps: Sequence[tuple[float, float]]

    def at(self, place: Any) -> Any:
        """The limit in m/s at a time or position; ahead of the first step that of the first."""
        result: Any = self.steps[0][1]
        for begin, speed in self.steps:
            result = where(place > begin + _ROUNDING, speed, result)
        return result

    def lowest(self, rear: Any, front: Any) -> Any:
        """The lowest limit in m/s between two places, the rear one's included."""
        result = self.at(rear)
        for begin, speed in self.steps:
            entered = logical_and(front > begin + _ROUNDING, rear <= begin + _ROUNDING)
            result = where(entered, minimum(result, speed), result)
        return result


STEPS = Table(
    "speed limit",
    [Column("begin", after="begin"), Column("speed", "m/s", sign="non-negative", within=(0.0, FASTEST))],
    whole=SpeedLimit,
    by_place=True,
)
