"""`Seen`: what those look at who judge a run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .columns import Columns


@dataclass(frozen=True)
class Seen:
    """What a run leaves behind for those who judge it: signals at every communication point, as `Signals` has them.

    Attributes:
        columns: the signals that were kept, and `time`. all_names: those that a single run would record.
    """

    columns: Columns
    all_names: Collection[str]
    step: float
    completed: bool
    stop_time: float
    units: Mapping[str, str]
    parameters: Mapping[str, float | int | bool | str]

    @property
    def time(self) -> NDArray[np.float64]:
        """Points in s."""
        return self.columns["time"]

    @property
    def points(self) -> int:
        """How many there are."""
        return self.columns.points

    def part(self, first: int, last: int) -> Mapping[str, NDArray[Any]]:
        """The signals that were kept, at some points."""
        return self.columns.part(first, last)

    def names(self) -> Collection[str]:
        """All that a single run would record."""
        return self.all_names

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]
