"""Maps over two parameters, and lines over one: where a requirement holds, and what came out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....figures import legend
from .axes import BROKEN, FAIL, PASS, Axis, folded, name_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
MARKS = {"pass": ("o", PASS, "holds"), "fail": ("X", FAIL, "broken"), "": ("+", BROKEN, "no verdict")}
_MOST_POINTS = 3000
"""Runs that are drawn one by one; of more, the means of small squares are."""
_SQUARES = 40
_MOST_WRITTEN = 64
"""Cells that have their number written into them."""
_EMPTY = "#dddddd"


def is_cellular(x: Axis, y: Axis) -> bool:
    """Whether both parameters have points, so that runs fall into cells."""
    return bool(x.dimension.values and y.dimension.values)


def draw_verdicts(ax: Axes, x: Axis, y: Axis, verdicts: NDArray[Any]) -> None:
    """Where a requirement holds: the share of passes in each cell, or each run by itself.

    Args:
        ax: what to draw into.
        x: the parameter along.
        y: the parameter upwards.
        verdicts: of each run, `"pass"`, `"fail"` or something else.
    """
    judged = np.where(verdicts == "pass", 1.0, np.where(verdicts == "fail", 0.0, np.nan))
    if is_cellular(x, y):
        means = _means(x, y, judged)
        drawn = _cells(ax, x, y, means, cmap=_shares(), vmin=0.0, vmax=1.0)
        if np.isin(means[np.isfinite(means)], (0.0, 1.0)).all():
            legend(ax, _patches(means))
        else:
            ax.figure.colorbar(drawn, ax=ax, label="share of runs in which it holds", pad=0.02)
            _write(ax, x, y, means, lambda share: f"{share:.0%}")
    else:
        rng = np.random.default_rng(1)
        draw_marks(ax, x.spread(rng), y.spread(rng), verdicts)
        legend(ax)
    x.put_on(ax, "x")
    y.put_on(ax, "y")


def draw_values(ax: Axes, x: Axis, y: Axis, values: Array, *, label: str, is_margin: bool) -> None:
    """What came out: the mean in each cell, each run by itself, or the means in small squares of many runs.

    Args:
        ax: what to draw into.
        x: the parameter along.
        y: the parameter upwards.
        values: of each run; NaN where there is none.
        label: of the values.
        is_margin: whether values below 0 are bad.
    """
    there = np.isfinite(values)
    colours = _colours(values[there], is_margin)
    if is_cellular(x, y):
        means = _means(x, y, np.where(there, values, np.nan))
        drawn = _cells(ax, x, y, means, **colours)
        _write(ax, x, y, means, lambda value: f"{value:.3g}")
    elif there.sum() <= _MOST_POINTS:
        rng = np.random.default_rng(1)
        across, up = x.spread(rng), y.spread(rng)
        order = np.argsort(-np.abs(values[there])) if is_margin else slice(None)  # those near 0 on top
        ax.scatter(across[~there], up[~there], marker="+", color=BROKEN, s=24, linewidths=0.8)
        drawn = ax.scatter(
            across[there][order], up[there][order], c=values[there][order], s=_size(len(values)), **colours
        )
    else:
        inside = np.where(there, values, np.nan)
        drawn = _squares(ax, x, y, inside, **colours)
    x.put_on(ax, "x")
    y.put_on(ax, "y")
    ax.set_title(folded(label, 44))
    ax.figure.colorbar(drawn, ax=ax, pad=0.02, extend=_extend(values[there], colours))


def draw_line(ax: Axes, x: Axis, values: Array, verdicts: NDArray[Any] | None, *, label: str) -> None:
    """What came out over the only parameter there is; by verdict where it is a margin.

    Args:
        ax: what to draw into.
        x: the parameter.
        values: of each run; NaN where there is none.
        verdicts: of each run; None for a metric.
        label: of the values.
    """
    if x.dimension.values and not x.is_text:
        points = x.points()
        means = [values[x.values == point].mean() for point in points]
        ax.plot(points, means, color="#999999", linewidth=1.0, zorder=1)
    across = x.spread(np.random.default_rng(1))
    if verdicts is None:
        ax.scatter(across, values, s=_size(len(values)), color=PASS, linewidths=0)
    else:
        ax.axhline(0.0, color="black", linewidth=0.9)
        draw_marks(ax, across, values, verdicts)
        legend(ax)
    x.put_on(ax, "x")
    name_axis(ax, "y", label, small=False)


def draw_marks(ax: Axes, across: Array, up: Array, verdicts: NDArray[Any], *, scale: float = 1.0) -> None:
    """Runs as marks by their verdict, told apart by form and colour; what is broken lies on top."""
    known = np.where(np.isin(verdicts.astype(str), ("pass", "fail")), verdicts.astype(str), "")
    for rank, word in enumerate(("", "pass", "fail")):
        mine = known == word
        mark, colour, name = MARKS[word]
        if mine.any():
            size = _size(len(verdicts)) * scale * (1.0 if word == "pass" else 1.6)
            lines: Any = {"linewidths": 0.8 if mark == "+" else 0.0}
            ax.scatter(
                across[mine],
                up[mine],
                marker=mark,
                color=colour,
                s=size,
                zorder=2 + rank / 10,
                label=f"{name} ({mine.sum()})",
                alpha=0.9,
                rasterized=len(verdicts) > _MOST_POINTS,
                **lines,
            )


def _size(count: int) -> float:
    return float(np.clip(12_000 / max(count, 1), 6.0, 36.0))


def _means(x: Axis, y: Axis, values: Array) -> Array:
    """The mean of each cell, (rows of y, columns of x); NaN where it has no value."""
    across, up = np.searchsorted(x.points(), x.values), np.searchsorted(y.points(), y.values)
    there = np.isfinite(values)
    shape = (len(y.dimension.values), len(x.dimension.values))
    sums, counts = np.zeros(shape), np.zeros(shape)
    np.add.at(sums, (up[there], across[there]), values[there])
    np.add.at(counts, (up[there], across[there]), 1)
    means: Array = np.divide(sums, counts, out=np.full(shape, np.nan), where=counts > 0)
    return means


def _cells(ax: Axes, x: Axis, y: Axis, means: Array, **colours: Any) -> Any:
    ax.set_facecolor(_EMPTY)
    ax.grid(False)
    lines: Any = {"edgecolors": "white", "linewidth": 0.6} if means.size <= 900 else {}
    return ax.pcolormesh(x.edges(), y.edges(), np.ma.masked_invalid(means), **colours, **lines)


def _write(ax: Axes, x: Axis, y: Axis, means: Array, shown: Any) -> None:
    """The number of each cell into it, where there are few."""
    if means.size > _MOST_WRITTEN or means.shape[1] > 10:
        return
    (mesh,) = ax.collections
    shades = mesh.to_rgba(means)
    for (row, column), value in np.ndenumerate(means):
        if np.isfinite(value):
            light = float(shades[row, column, :3] @ (0.299, 0.587, 0.114))
            place = (x.points()[column], y.points()[row])
            ax.annotate(
                shown(value), place, ha="center", va="center", fontsize=8, color="black" if light > 0.5 else "white"
            )


def _squares(ax: Axes, x: Axis, y: Axis, values: Array, **colours: Any) -> Any:
    there = np.isfinite(values)
    borders = [_borders(x), _borders(y)]
    inside = (x.values[there], y.values[there])
    sums, *_ = np.histogram2d(*inside, bins=borders, weights=values[there])
    counts, *_ = np.histogram2d(*inside, bins=borders)
    means = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
    ax.grid(False)
    return ax.pcolormesh(*borders, np.ma.masked_invalid(means.T), **colours)


def _borders(axis: Axis) -> Array:
    if axis.dimension.values:
        return axis.edges()
    low, high = axis.values.min(), axis.values.max()
    return np.geomspace(low, high, _SQUARES + 1) if axis.is_log else np.linspace(low, high, _SQUARES + 1)


def _colours(values: Array, is_margin: bool) -> dict[str, Any]:
    """The scale of colours: about 0 for margins, whose few outliers do not wash out the rest."""
    if not len(values):
        return {"cmap": "viridis"}
    if is_margin:
        limit = float(np.quantile(np.abs(values), 0.95)) or 1.0
        return {"cmap": "RdBu", "vmin": -limit, "vmax": limit}
    low, high = (float(q) for q in np.quantile(values, (0.02, 0.98)))
    return {"cmap": "viridis", "vmin": low, "vmax": high if high > low else low + 1.0}


def _extend(values: Array, colours: dict[str, Any]) -> str:
    """At which ends of the scale there are values beyond."""
    if "vmin" not in colours:
        return "neither"
    low, high = bool((values < colours["vmin"]).any()), bool((values > colours["vmax"]).any())
    return "both" if low and high else "min" if low else "max" if high else "neither"


def _shares() -> Any:
    """From all broken over grey to all pass."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("shares", [FAIL, "#f2f2f2", PASS])


def _patches(means: Array) -> list[Any]:
    """What the colours of cells mean that have but one verdict each."""
    from matplotlib.patches import Patch

    return [
        Patch(color=colour, label=name)
        for (_, colour, name), there in (
            (MARKS["pass"], (means == 1).any()),
            (MARKS["fail"], (means == 0).any()),
            (("", _EMPTY, "no verdict"), np.isnan(means).any()),
        )
        if there
    ]
