"""`Spacing`: which values of which rows are left blank, because their signals are recorded less often than others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, final

import numpy as np

from ...master import Rows
from ...names import matching
from ...system import Stepping


@final
class Spacing:
    """Rows of which some values are blank: NaN, or no text.

    Args:
        columns: the signals of a row, in their order behind the time.
        kinds: their FMI types.
        apart: by signal, in each of how many rows it has a value; those that are not named, in every one.
    """

    def __init__(self, columns: Sequence[str], kinds: Sequence[str], apart: Mapping[str, int]) -> None:
        places = defaultdict(list)
        for k, name in enumerate(columns, 1):
            places[apart.get(name, 1)].append(k)
        self._places = {every: np.array(found) for every, found in places.items() if every > 1}
        self._blank = {k: "" if kind == "String" else np.nan for k, kind in enumerate(kinds, 1)}

    def blank(self, first: int, rows: Any, *, whole: bool) -> Rows:
        """Blank what is not due in some rows, which are changed.

        Args:
            first: the number of the first of them.
            rows: they themselves.
            whole: whether all of the last one is due.
        """
        numbers = np.arange(first, first + len(rows))
        for every, places in self._places.items():
            left = np.flatnonzero(numbers % every)
            left = left[left < len(rows) - 1] if whole else left
            if isinstance(rows, np.ndarray):
                rows[np.ix_(left, places)] = np.nan
                continue
            for row in left:
                for place in places:
                    rows[row][place] = self._blank[place]
        return rows  # type: ignore[no-any-return]


def kept_signals(names: Sequence[str], stepping: Stepping) -> dict[str, Any]:
    """What `Recording` is told of the signals that are kept: which, and in each of how many rows they have a value."""
    patterns, record = stepping.record_only, stepping.record or stepping.step
    if not patterns:
        return {}
    kept: dict[str, Any] = {"only": {*matching(names, patterns)}}
    if isinstance(patterns, dict):
        apart: dict[str, int] = {}
        for pattern, each in patterns.items():
            apart |= {name: round(each / record) for name in matching(names, [pattern]) if name not in apart}
        kept["apart"] = apart
    return kept
