"""A scatter matrix: every parameter against every other, and against what came out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from .axes import FAIL, PASS, Axis, fences, name_axis
from .maps import draw_marks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Column = tuple[str, Array, Axis | None]
"""One row and column of the matrix: its label, where to draw each run, and its axis where it is a parameter."""


def columns_of(axes: Sequence[Axis], outputs: Sequence[tuple[str, Array]]) -> list[Column]:
    """Rows and columns of the matrix: parameters, then what came out."""
    rng = np.random.default_rng(1)
    inputs: list[Column] = [(axis.dimension.name, axis.spread(rng), axis) for axis in axes]
    return inputs + [(name, np.where(np.isfinite(values), values, np.nan), None) for name, values in outputs]


def draw_matrix(panels: Sequence[Axes], columns: Sequence[Column], verdicts: NDArray[Any]) -> None:
    """Draw into the lower half of a square of panels, and remove the upper.

    Args:
        panels: (n * n,), row by row.
        columns: (n,), at least two.
        verdicts: of each run, by which the marks are told apart.
    """
    count = len(columns)
    for place, ax in enumerate(panels):
        row, column = divmod(place, count)
        if column > row:
            ax.remove()
            continue
        if row == column:
            _draw_spread(ax, columns[row], verdicts)
        else:
            draw_marks(ax, columns[column][1], columns[row][1], verdicts, scale=0.35)
            _put(ax, columns[row], "y", is_outer=column == 0)
        _put(ax, columns[column], "x", is_outer=row == count - 1)
        if row != column and column > 0:
            ax.tick_params(labelleft=False)
        if row < count - 1:
            ax.tick_params(labelbottom=False)
    figure: Any = panels[0].figure
    handles, labels = panels[count].get_legend_handles_labels()
    made = figure.legend(handles, labels, loc="upper right", markerscale=2.0, borderaxespad=1.2)
    made.set_in_layout(False)  # it stands in the empty half


def _draw_spread(ax: Axes, column: Column, verdicts: NDArray[Any]) -> None:
    """How runs are spread over one column, by verdict."""
    _, values, axis = column
    there = np.isfinite(values)
    if there.any():
        bins: Any = np.linspace(*fences(values[there]), 21) if np.ptp(values[there]) else 20
        if axis is not None and axis.dimension.values:
            bins, values = axis.edges(), axis.values
        elif axis is not None and axis.is_log:
            bins = np.geomspace(values[there].min(), values[there].max(), 21)
        failing = verdicts == "fail"
        parts = [values[there & failing], values[there & ~failing]]
        ax.hist(parts, bins=bins, stacked=True, color=[FAIL, PASS])
    ax.set_yticks([])
    ax.grid(False)


def _put(ax: Axes, column: Column, side: Literal["x", "y"], *, is_outer: bool) -> None:
    label, values, axis = column
    if axis is not None:
        axis.put_on(ax, side, label=is_outer, small=True)
        return
    ax.locator_params(side, nbins=3)
    finite = values[np.isfinite(values)]
    if len(finite):
        low, high = fences(finite)
        pad = 0.05 * (high - low) or 0.5
        getattr(ax, f"set_{side}lim")(low - pad, high + pad)
    if is_outer:
        name_axis(ax, side, label, small=True)
