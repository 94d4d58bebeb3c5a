"""Pictures of an optimisation: how the best came down, or the Pareto front."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...figures import COLOURS, legend, page
from .optimization import Optimization

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MISSED = "#999999"


def draw_optimization(found: Optimization, directory: Path, name: str) -> Path:
    """Draw the runs of an optimisation: one objective over the runs, several against the first.

    Args:
        found: what came out.
        directory: for the file; it exists.
        name: of the scenario.

    Returns:
        the file.
    """
    texts = list(found.objectives.values())
    several = len(texts) > 1
    path = directory / ("pareto.png" if several else "progress.png")
    what = "Pareto front" if several else f"Least {texts[0]}"
    count = max(1, len(texts) - 1)
    size = (8.5, 4.4 if count == 1 else 0.7 + 2.8 * count)
    with page(f"{what} of {name}: {found.runs} runs", count, path, size=size) as axes:
        for k, ax in enumerate(axes, 1):
            if several:
                _draw_front(ax, found, k)
                ax.set_xlabel(texts[0])
                ax.set_ylabel(texts[k])
            else:
                _draw_progress(ax, found)
                ax.set_ylabel(texts[0])
            legend(ax)
    return path


def _values(found: Optimization, k: int) -> NDArray[np.float64]:
    """One objective over all runs."""
    return np.array([found.values(evaluation)[k] for evaluation in found.evaluations])


def _draw_runs(ax: Axes, found: Optimization, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Dots where requirements hold, which is given back, and crosses where they do not."""
    held = np.array([found.is_held(evaluation) for evaluation in found.evaluations])
    ax.plot(x[held], y[held], "o", color=COLOURS[0], markersize=3.5, alpha=0.6, label="requirements hold")
    missed = ~held & np.isfinite(x) & np.isfinite(y)
    if missed.any():
        ax.plot(x[missed], y[missed], "x", color=_MISSED, markersize=4, alpha=0.7, label="a requirement fails")
    return held


def _draw_progress(ax: Axes, found: Optimization) -> None:
    values = _values(found, 0)
    runs = np.arange(len(values), dtype=np.float64)
    held = _draw_runs(ax, found, runs, values)
    best = np.fmin.accumulate(np.where(held, values, np.nan))
    ax.step(runs, best, where="post", color=COLOURS[1], label="best so far")
    ax.set_xlabel("run")


def _draw_front(ax: Axes, found: Optimization, k: int) -> None:
    x, y = _values(found, 0), _values(found, k)
    _draw_runs(ax, found, x, y)
    front = np.array([found.values(evaluation) for evaluation in found.best]).reshape(-1, len(found.objectives))
    style = "o-" if len(found.objectives) == 2 else "o"  # of more than two, a line would say what is not so
    ax.plot(front[:, 0], front[:, k], style, color=COLOURS[1], markersize=5, linewidth=1.0, label="not beaten")
    ax.plot(x[:1], y[:1], "D", color=COLOURS[6], markersize=6, fillstyle="none", label="nominal")
