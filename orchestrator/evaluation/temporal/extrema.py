"""The least of every window of an array, and the recursion of `until`, without a loop over points."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.int64]


def least(values: Array, first: Places, last: Places) -> Array:
    """The least value of each window; inf where it is empty, NaN where it holds one.

    Windows of 2**k to 2**(k+1) - 1 values are covered by two of 2**k, whose least values are found by doubling: a
    window's length costs its logarithm, and lengths may differ, as they do where steps do.

    Args:
        values: shape (n,).
        first: where the windows begin, shape (m,).
        last: where they end, that one excluded.
    """
    found = np.full(first.shape, np.inf)
    lengths = last - first
    longest, width, level = int(lengths.max(initial=0)), 1, values
    while width <= longest:
        chosen = lengths >= width
        if 2 * width <= longest:
            chosen &= lengths < 2 * width
        if chosen.all():
            found = np.minimum(level[first], level[last - width])
        elif chosen.any():
            found[chosen] = np.minimum(level[first[chosen]], level[last[chosen] - width])
        level = np.minimum(level[:-width], level[width:])
        width *= 2
    return found


def clamped(low: Array, high: Array, begin: float) -> Array:
    """y[k] = max(low[k], min(high[k], y[k-1])) with y[-1] = begin, in linear time.

    NaN goes on through all that follows. Such steps one after another are one of their kind again: they are joined in
    about sqrt(n) pieces side by side, then from piece to piece.
    """
    count = len(low)
    width = max(int(np.sqrt(count)), 1)
    pieces = -(-count // width)
    lows, highs = np.full(pieces * width, -np.inf), np.full(pieces * width, np.inf)
    lows[:count], highs[:count] = low, high
    lows, highs = (np.ascontiguousarray(x.reshape(pieces, width).T) for x in (lows, highs))
    for k in range(1, width):
        lows[k] = np.maximum(lows[k], np.minimum(highs[k], lows[k - 1]))
    highs = np.minimum.accumulate(highs, axis=0)
    before = np.empty(pieces)
    for k in range(pieces):
        before[k] = begin
        begin = float(np.maximum(lows[-1, k], np.minimum(highs[-1, k], begin)))
    return np.asarray(np.maximum(lows, np.minimum(highs, before)).T.ravel()[:count])
