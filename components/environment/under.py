"""What of a line is under a train: the steps that the mean of a value over the train's length passes through."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from ..lookup.cells import Cells

_MARGIN = 1e-6
"""m: beyond rounding; a step counts its whole share before it is given up, and none when it is taken up."""

Steps = Sequence[tuple[Any, Any]]
"""Begin in m and change of each."""


def changes(positions: Sequence[float], values: Sequence[float]) -> Steps:
    """The steps of a value by section."""
    pairs = zip(positions[1:], itertools.pairwise(values), strict=True)
    return [(begin, value - before) for begin, (before, value) in pairs if value != before]


class Under:
    """The steps under a train by where its front is, and the value that those behind it sum up to, from first to last.

    Args:
        positions: begins of the sections in m. values: in each. length: of the train in m.
    """

    def __init__(self, positions: tuple[float, ...], values: tuple[float, ...], length: float) -> None:
        steps = changes(positions, values)
        begins = [begin - _MARGIN for begin, _ in steps]
        ends = [begin + length + _MARGIN for begin, _ in steps]
        starts = [-math.inf, *sorted({*begins, *ends})]
        passed = [bisect_right(ends, start) for start in starts]
        most = max(bisect_right(begins, start) - behind for start, behind in zip(starts, passed, strict=True))
        sums = list(itertools.accumulate((change for _, change in steps), initial=values[0]))
        padded = [*steps, *[(0.0, 0.0)] * most]
        rows = [[sums[k], *itertools.chain(*padded[k : k + most])] for k in passed]
        self._cells = Cells([starts], rows)

    def at(self, position: Any) -> tuple[Any, Steps]:
        """The sum behind a train whose front is at the position, and the begins and changes of the steps under it."""
        behind, *found = self._cells.find(position)
        return behind, list(zip(found[::2], found[1::2], strict=True))


under = lru_cache(Under)
"""Made once of the same."""
