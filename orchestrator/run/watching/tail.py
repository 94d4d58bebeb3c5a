"""The last communication points of a run, of the signals that are watched, whatever is recorded of them."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

POINTS = 4096
"""What a coupling that diverges does in its last steps is seen in as many."""


class Tail:
    """Keeps the last blocks that hold enough points; seen as signals by name.

    Args:
        names: of the columns.
        step: communication step in s.
    """

    def __init__(self, names: Sequence[str], step: float) -> None:
        self._places = {name: k for k, name in enumerate(names)}
        self.step = step
        self._blocks: deque[tuple[NDArray[np.float64], NDArray[np.float64]]] = deque()
        self._count = 0

    def see(self, time: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Take a block in, and let go of what is too long ago."""
        self._blocks.append((time, values))
        self._count += len(time)
        while self._count - len(self._blocks[0][0]) >= POINTS:
            self._count -= len(self._blocks.popleft()[0])

    @property
    def time(self) -> NDArray[np.float64]:
        """The points in s."""
        return np.concatenate([np.empty(0), *(time for time, _ in self._blocks)])

    def names(self) -> Collection[str]:
        """The signals."""
        return self._places.keys()

    def __getitem__(self, name: str, /) -> NDArray[np.float64]:
        place = self._places[name]
        return np.concatenate([np.empty(0), *(values[:, place] for _, values in self._blocks)])
