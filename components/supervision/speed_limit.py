"""A speed limit in steps, over time since departure or over position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..lookup.cells import Cells, just_above
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
        return self._by_step.find(place)[0]

    def lowest(self, rear: Any, front: Any) -> Any:
        """The lowest limit in m/s between two places, the rear one's included."""
        return self._by_steps.find(rear, front)[0]

    @cached_property
    def _starts(self) -> list[float]:
        return [just_above(begin + _ROUNDING) for begin, _ in self.steps]

    @cached_property
    def _by_step(self) -> Cells:
        return Cells([self._starts], [[speed] for _, speed in self.steps])

    @cached_property
    def _by_steps(self) -> Cells:
        """From the step of the rear to that of the front."""
        speeds, count = [speed for _, speed in self.steps], range(len(self.steps))
        rows = [[[min(speeds[r : max(r, f) + 1])] for f in count] for r in count]
        return Cells([self._starts, self._starts], rows)


STEPS = Table(
    "speed limit",
    [Column("begin", after="begin"), Column("speed", "m/s", sign="non-negative", within=(0.0, FASTEST))],
    whole=SpeedLimit,
    by_place=True,
)
