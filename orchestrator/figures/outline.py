"""Curves of runs with more points than a figure can show: looked at in parts, of which the extremes are kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..evaluation import Expression, Node, Part, Scope, Signals, evaluate, parts_of

Array = NDArray[np.float64]

MOST_POINTS = 1 << 16
"""Up to so many are all drawn."""
_PIECES = 4000
"""Into which the points of a curve are divided beyond that: more than a figure is wide in pixels."""


def outlined(expression: Expression, signals: Signals, index: int | None) -> tuple[Array, Array]:
    """An expression over time, of which each piece is drawn by its smallest and its greatest value.

    Args:
        expression: which varies over time, or not.
        signals: the run.
        index: the value of the free index.

    Returns:
        The times in s and the values of each row, both of shape (n, points).
    """

    def see(tree: Node, scope: Scope) -> tuple[Array, Array]:
        parts = [_extremes(part, evaluate(tree, scope.of(part)), signals.points) for part in parts_of(signals, beyond)]
        times, values = zip(*parts, strict=True)
        return np.concatenate(times, axis=1), np.concatenate(values, axis=1)

    beyond = expression.reaches
    return expression.apply(see, signals, index)


def _extremes(part: Part, value: NDArray[np.float64], points: int) -> tuple[Array, Array]:
    own = slice(part.overlap, part.points - part.beyond)
    time, rows = part.time[own], np.atleast_2d(np.asarray(value, dtype=np.float64))
    rows = np.broadcast_to(rows, (len(rows), part.points))[:, own]
    pieces = np.array_split(np.arange(len(time)), max(1, round(_PIECES * len(time) / points)))
    places = [
        np.concatenate([np.sort([piece[low[piece].argmin()], piece[high[piece].argmax()]]) for piece in pieces])
        for low, high in zip(*(np.where(np.isnan(rows), beyond, rows) for beyond in (np.inf, -np.inf)), strict=True)
    ]
    return time[places], np.take_along_axis(rows, np.array(places), axis=1)
