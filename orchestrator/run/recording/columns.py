"""Recorded columns by name, in memory or in a file, as a whole or of some points alone."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .binary import RowsFile


class Columns(Mapping[str, NDArray[Any]]):
    """A mapping from names, ``time`` among them, to arrays over all points."""

    @property
    @abstractmethod
    def points(self) -> int:
        """How many there are."""

    @abstractmethod
    def part(self, first: int, last: int) -> Mapping[str, NDArray[Any]]:
        """The columns at the points from a number up to another, which is not among them."""


class InMemory(Columns):
    """Columns that are there."""

    def __init__(self, columns: Mapping[str, NDArray[Any]] | Iterable[tuple[str, NDArray[Any]]]) -> None:
        self._columns = dict(columns)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def points(self) -> int:
        """How many there are."""
        return len(next(iter(self._columns.values()), ()))

    def part(self, first: int, last: int) -> Mapping[str, NDArray[Any]]:
        """Views of them."""
        return _Views(self, first, last)


class _Views(Mapping[str, NDArray[Any]]):
    def __init__(self, whole: Mapping[str, NDArray[Any]], first: int, last: int) -> None:
        self._whole, self._chosen = whole, slice(first, last)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._whole[name][self._chosen]

    def __iter__(self) -> Iterator[str]:
        return iter(self._whole)

    def __len__(self) -> int:
        return len(self._whole)


class InFile(Columns):
    """Columns of a file, each read anew when it is asked for.

    Args:
        rows: the file, which is open as long as this is there.
    """

    def __init__(self, rows: RowsFile) -> None:
        self._rows = rows
        self._places = {name: k for k, name in enumerate(rows.columns)}

    @property
    def points(self) -> int:
        """How many there are."""
        return self._rows.count

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._rows.column(self._places[name])

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def part(self, first: int, last: int) -> Mapping[str, NDArray[Any]]:
        """Read once, for all columns."""
        return _Part(self._rows, self._places, self._rows.part(first, last))


class _Part(Mapping[str, NDArray[Any]]):
    def __init__(self, rows: RowsFile, places: Mapping[str, int], table: NDArray[np.float64]) -> None:
        self._rows, self._places, self._table = rows, places, table

    def __getitem__(self, name: str) -> NDArray[Any]:
        place = self._places[name]
        return self._rows.words.decode(place, np.ascontiguousarray(self._table[:, place]))

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)
