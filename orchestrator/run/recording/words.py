"""Texts among recorded values: a row holds the number of a text, and which text that is stands here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Words:
    """The texts of a run by column, each under the number of its first appearance there.

    Args:
        columns: those that hold texts, by place.
        known: the texts of each in their order, if there are some.
    """

    def __init__(self, columns: Iterable[int], known: Mapping[int, Sequence[str]] | None = None) -> None:
        listed = {} if known is None else known
        self._numbers = {k: {word: n for n, word in enumerate(listed.get(k, ()))} for k in columns}

    def __len__(self) -> int:
        return sum(map(len, self._numbers.values()))

    @property
    def columns(self) -> list[int]:
        """Those that hold texts, by place."""
        return list(self._numbers)

    @property
    def known(self) -> dict[int, list[str]]:
        """The texts of each column, in their order."""
        return {k: list(numbers) for k, numbers in self._numbers.items()}

    def encode(self, rows: Sequence[Sequence[Any]]) -> NDArray[np.float64]:
        """Rows of numbers and texts as an array of numbers."""
        if not self._numbers:
            return np.array(rows, dtype=np.float64)
        plain = [list(row) for row in rows]
        for k, numbers in self._numbers.items():
            for row in plain:
                row[k] = numbers.setdefault(row[k], len(numbers))
        return np.array(plain, dtype=np.float64)

    def table(self, rows: NDArray[np.float64]) -> list[NDArray[Any]]:
        """All columns of some rows, as `decode` has them."""
        return [self.decode(k, column) for k, column in enumerate(np.ascontiguousarray(rows.T))]

    def decode(self, column: int, numbers: NDArray[np.float64]) -> NDArray[Any]:
        """What a column holds: its texts, or the numbers themselves where it has none."""
        if column not in self._numbers:
            return numbers
        words = np.array([*self._numbers[column], ""], dtype=object)[:-1]  # never an array of arrays
        return np.asarray(words[numbers.astype(np.intp)])
