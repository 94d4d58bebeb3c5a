"""Quantile bands over time: what a signal does in most runs, and in all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .axes import FAIL, PASS, name_axis

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_BANDS = ((0.0, 1.0, 0.12, "all runs"), (0.05, 0.95, 0.25, "90 % of runs"), (0.25, 0.75, 0.45, "half of the runs"))


def aligned(series: pd.DataFrame, signal: str) -> tuple[Array, Array, Array]:
    """A signal of all runs at the same times: those of the run with most points, linear between a run's own.

    Args:
        series: `run`, `time` and a column a signal, the runs one after the other.
        signal: one of its columns.

    Returns:
        runs (n,), times (m,), values (n, m); NaN beyond the end of a run that ended early.
    """
    runs, starts, counts = np.unique(series["run"].to_numpy(), return_index=True, return_counts=True)
    times = series["time"].to_numpy(dtype=float)
    values = series[signal].to_numpy(dtype=float)
    longest = starts[counts.argmax()]
    common = times[longest : longest + counts.max()]
    if (counts == counts[0]).all() and (times.reshape(len(runs), -1) == common).all():
        return runs, common, values.reshape(len(runs), -1)
    table = np.array(
        [
            np.interp(common, times[first : first + count], values[first : first + count], right=np.nan)
            for first, count in zip(starts, counts, strict=True)
        ]
    )
    return runs, common, table


def draw_bands(ax: Axes, series: pd.DataFrame, signal: str, *, label: str, worst: int | None = None) -> None:
    """Draw the bands of one signal, its median, and one run.

    Args:
        ax: what to draw into.
        series: as for `aligned`.
        signal: one of its columns.
        label: of the signal, with its unit.
        worst: a run that is drawn as well; None for none.
    """
    runs, times, values = aligned(series, signal)
    seen = np.isfinite(values).any(axis=0)
    times, table = times[seen], values[:, seen]
    for low, high, alpha, name in _BANDS:
        below, above = np.nanquantile(table, (low, high), axis=0)
        ax.fill_between(times, below, above, color=PASS, alpha=alpha, linewidth=0, label=name)
    ax.plot(times, np.nanmedian(table, axis=0), color=PASS, label="median")
    if worst is not None and worst in runs:
        (own,) = values[runs == worst]
        ax.plot(times, own[seen], color=FAIL, linewidth=1.2, linestyle="--", label=f"worst run ({worst})")
    ax.set_ylim(*_limits(table))
    name_axis(ax, "y", label, small=False)
    ax.margins(x=0)


def _limits(table: Array) -> tuple[float, float]:
    """Between what a signal is drawn: all of it, but for runs that leave the others far behind."""
    below, above = np.nanquantile(table, (0.05, 0.95), axis=0)
    low, high = float(below.min()), float(above.max())
    low, high = max(float(np.nanmin(table)), 2 * low - high), min(float(np.nanmax(table)), 2 * high - low)
    pad = 0.05 * (high - low) or 0.5
    return low - pad, high + pad
