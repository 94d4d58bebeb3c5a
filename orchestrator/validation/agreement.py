"""How far rows of outputs agree, column by column."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from ..errors import FmuError

Rows = Sequence[Sequence[Any]]

ROUNDING = 1e-9
"""Deviations up to here, as a part of a column's size, are of rounding: of a sum in another order, say."""

_SHOWN = 8
"""Values of a row that are shown."""


def compare(expected: Rows, found: Rows, where: str) -> float:
    """How far rows deviate at most, as a part of their columns' size; refuse what is more than rounding.

    Raises:
        FmuError: they are other rows.
    """
    sizes = [_size(column) for column in zip(*expected, strict=True)]
    worst = 0.0
    for k, (a, b) in enumerate(zip(expected, found, strict=True)):
        parts = [_part(x, y, size) for x, y, size in zip(a, b, sizes, strict=True)]
        worst = max([worst, *parts])
        if worst > ROUNDING:
            raise FmuError(f"other outputs {where}: at step {k + 1}, {_shown(a, b, parts)}")
    return worst


def _shown(expected: Sequence[Any], found: Sequence[Any], parts: Sequence[float]) -> str:
    """What became of a row; of a long one only a few that changed, for there may be a million."""
    if len(expected) <= _SHOWN:
        return f"{expected!r} became {found!r}"
    changed = [k for k, part in enumerate(parts) if part > ROUNDING]
    few = ", ".join(f"number {k + 1} from {expected[k]!r} to {found[k]!r}" for k in changed[:_SHOWN])
    return f"{len(changed)} of {len(parts)} changed: {few}{', ...' if len(changed) > _SHOWN else ''}"


def typical_deviation(expected: Rows, found: Rows) -> float:
    """How far the worst column deviates in half of the rows, as a part of its range; of numbers alone."""
    columns = zip(zip(*expected, strict=True), zip(*found, strict=True), strict=True)
    return max((_typical(a, b) for a, b in columns if a and isinstance(a[0], float)), default=0.0)


def _typical(expected: Sequence[float], found: Sequence[float]) -> float:
    # A column that hardly moves deviates by a part of its size.
    size = max(max(expected) - min(expected), 0.1 * _size(expected))
    return median(abs(a - b) for a, b in zip(expected, found, strict=True)) / size


def _size(column: Sequence[Any]) -> float:
    return max((abs(x) for x in column if isinstance(x, int | float)), default=0.0) or 1.0


def _part(a: Any, b: Any, size: float) -> float:
    if a == b:
        return 0.0
    return abs(a - b) / size if isinstance(a, float) else 1.0
