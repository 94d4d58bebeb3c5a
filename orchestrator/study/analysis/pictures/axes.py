"""Parameters as axes: numbers as they are, or by their logarithm where they were drawn so; words side by side."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from ...design import Dimension
from ..influence import codes

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
PASS, FAIL, BROKEN = "#0072B2", "#D55E00", "#777777"
"""Of runs that keep a requirement, break it, or gave no verdict."""
_MOST_TEXTS = 20
_LETTERS = 18
_REACH = 1.5
"""How far a picture goes beyond what nine of ten numbers lie between, in widths of that."""


class Axis:
    """One parameter as an axis of pictures.

    Args:
        frame: a row a run.
        dimension: the parameter.

    Attributes:
        dimension: as above. values: where each run stands on it, (runs,).
    """

    def __init__(self, frame: pd.DataFrame, dimension: Dimension) -> None:
        self.dimension = dimension
        self.values = codes(frame[dimension.name], dimension)

    @property
    def is_text(self) -> bool:
        """Whether its values are words."""
        return not self.dimension.is_numeric

    @property
    def is_log(self) -> bool:
        """Whether it was drawn evenly by its logarithm."""
        return self.dimension.law is not None and self.dimension.law.name == "loguniform"

    def points(self) -> Array:
        """Its values, ascending, of a list or grid; empty of a distribution."""
        return np.arange(len(self.dimension.values), dtype=float) if self.is_text else np.sort(self.dimension.values)

    def edges(self) -> Array:
        """The borders of cells around its points."""
        points = self.points()
        if len(points) == 1:
            return np.array([points[0] - 0.5, points[0] + 0.5])
        between = (points[1:] + points[:-1]) / 2
        return np.concatenate(([2 * points[0] - between[0]], between, [2 * points[-1] - between[-1]]))

    def spread(self, rng: np.random.Generator) -> Array:
        """Where to draw its runs: as they are, but words a little apart, so that runs don't hide one another."""
        return self.values + rng.uniform(-0.28, 0.28, len(self.values)) if self.is_text else self.values

    def put_on(self, ax: Axes, side: Literal["x", "y"], *, label: bool = True, small: bool = False) -> None:
        """Scale, ticks and label of one axis of a picture.

        Args:
            ax: the picture.
            side: ``"x"`` or ``"y"``.
            label: whether its name stands there.
            small: whether the picture is one of many beside one another.
        """
        if self.is_text:
            texts = [folded(str(value), 14 if small else _LETTERS) for value in self.dimension.values]
            places = range(0, len(texts), -(-len(texts) // _MOST_TEXTS))
            axis = getattr(ax, f"{side}axis")
            is_crowded = side == "x" and (small or len(texts) > 4)
            axis.set_ticks(list(places), [texts[k] for k in places], rotation=90 if is_crowded else 0)
            axis.grid(False)
            getattr(ax, f"set_{side}lim")(-0.5, len(texts) - 0.5)
        elif self.is_log:
            _count_by_tens(ax, side)
        else:
            ax.locator_params(side, nbins=3 if small else 5)
        if label:
            name_axis(ax, side, self.dimension.name, small=small)


def name_axis(ax: Axes, side: Literal["x", "y"], name: str, *, small: bool) -> None:
    """Write a name along an axis, in lines that are no longer than it; arguments as for `Axis.put_on`."""
    getattr(ax, f"set_{side}label")(folded(name, 17 if small else 36), fontsize=7.5 if small else None)
    if small:
        ax.tick_params(side, labelsize=7.5)


def _count_by_tens(ax: Axes, side: Literal["x", "y"]) -> None:
    """A logarithmic scale whose ticks are 1, 2 and 5 of each power of ten, as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    getattr(ax, f"set_{side}scale")("log")
    axis = getattr(ax, f"{side}axis")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def fences(values: Array) -> tuple[float, float]:
    """Between what numbers are drawn: all of them, but for outliers far beyond where most are.

    Args:
        values: (n,), finite, at least one.
    """
    low, high = (float(q) for q in np.quantile(values, (0.05, 0.95)))
    reach = _REACH * (high - low)
    return (max(float(values.min()), low - reach), min(float(values.max()), high + reach)) if reach else (low, high)


def folded(text: str, letters: int = _LETTERS) -> str:
    """A name in at most three lines of so many letters, broken after its dots and signs and before its capitals."""
    lines = [""]
    for part in re.findall(r".+?(?:[._/ ]+|$|(?<=[a-z0-9])(?=[A-Z]))", text):
        for start in range(0, len(part), letters):
            piece = part[start : start + letters]
            if lines[-1] and len(lines[-1]) + len(piece.rstrip()) > letters:
                lines.append("")
            lines[-1] += piece
    if len(lines) > 3:
        lines = [*lines[:2], f"{lines[2][: letters - 1]}…"]
    return "\n".join(line.strip() for line in lines)
