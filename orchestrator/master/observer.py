"""Who is told of the steps as they are taken, and where their values are kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = Sequence[Sequence[Any]] | NDArray[np.float64]
"""Of each the time in s, and all values; or those that are kept, if it is rows of a `Table`."""
Observer = Callable[[int, Rows], bool]
"""Called after one or more steps with how many were taken and the rows that were due; False stops."""
_FEWEST = 1024
"""Rows that there is room for at least."""


class Table:
    """Values over time, column by column, where the compiled step loop writes them: nothing is moved afterwards.

    Rows that are not written yet take no memory.

    Args:
        kept: which values of a row, by their place; its columns are the time and these.
        rows: how many there will be, as far as that is known.

    Attributes:
        count: how many rows there are.
    """

    def __init__(self, kept: Iterable[int], rows: int = 0) -> None:
        self.kept = np.array(list(kept), dtype=np.int64)
        self.count = 0
        try:
            self._cells = self._made(max(rows, _FEWEST))
        except (MemoryError, ValueError):  # more than there is; let it grow until it is no more
            self._cells = self._made(_FEWEST)

    def _made(self, rows: int) -> NDArray[np.float64]:
        return np.empty((len(self.kept) + 1, rows))

    def room(self, rows: int) -> NDArray[np.float64]:
        """All columns as they are, shape (columns, room), with room for so many rows behind those that there are."""
        end = self.count + rows
        if end > self._cells.shape[1]:
            larger = self._made(max(end, 2 * self._cells.shape[1]))
            larger[:, : self.count] = self._cells[:, : self.count]
            self._cells = larger
        return self._cells

    def filled(self, rows: int) -> NDArray[np.float64]:
        """So many rows have been written into the room: a view of them, shape (rows, columns)."""
        begin, self.count = self.count, self.count + rows
        return self._cells[:, begin : self.count].T

    def append(self, rows: NDArray[np.float64]) -> None:
        """Add rows that have its columns, shape (n, columns)."""
        cells = self.room(len(rows))
        cells[:, self.count : self.count + len(rows)] = rows.T
        self.count += len(rows)

    def keeping(self, observe: Observer) -> Observer:
        """An observer who keeps rows of all values here, and shows to another what is kept."""

        def see(steps: int, rows: Rows) -> bool:
            if len(rows):
                self.append(np.array(rows, dtype=np.float64)[:, [0, *(self.kept + 1)]])
            return observe(steps, self._cells[:, self.count - len(rows) : self.count].T)

        return see

    def columns(self) -> NDArray[np.float64]:
        """A view of what there is, shape (columns, count)."""
        return self._cells[:, : self.count]
