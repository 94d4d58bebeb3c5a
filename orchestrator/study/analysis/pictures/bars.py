"""Histograms of margins, and bars of influence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....figures import COLOURS
from ..influence import Influence, Sensitivity
from ..summary import Kept
from .axes import FAIL, PASS, fences, folded

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_PARAMETERS = 12


def draw_margins(ax: Axes, kept: Kept, margins: NDArray[np.float64], *, label: str) -> None:
    """How the margins of a requirement are spread: what is broken apart from what holds.

    Args:
        ax: what to draw into.
        kept: how often it holds.
        margins: of each run; those that are not finite are left out.
        label: of the margins, with their unit.
    """
    finite = margins[np.isfinite(margins)]
    inner = fences(finite)
    low, high = min(inner[0], 0.0), max(inner[1], 0.0)
    width = (high - low or 1.0) / min(40, 8 + math.isqrt(len(finite)))
    edges: Any = np.arange(math.floor(low / width), math.floor(high / width) + 2) * width  # 0 is one of them
    seen = np.clip(finite, edges[0], edges[-1])  # the first and the last take what lies beyond
    ax.hist(seen[finite < 0], bins=edges, color=FAIL)
    ax.hist(seen[finite >= 0], bins=edges, color=PASS)
    beyond = [
        f"{count} {side}"
        for side, count in (("below", (finite < edges[0]).sum()), ("above", (finite > edges[-1]).sum()))
        if count
    ]
    ax.axvline(0.0, color="black", linewidth=0.9)
    judged = kept.passed + kept.failed
    text = f"holds in {kept.passed} of {judged} runs"
    if not math.isnan(kept.rate.low):
        text += f": {kept.rate.value:.1%} ({kept.rate.low:.1%} to {kept.rate.high:.1%})"
    lost = len(margins) - len(finite)
    ax.set_title(folded(kept.name, 60) + f"\n{text}" + (f"; {lost} without a margin" if lost else ""), fontsize=9)
    ax.set_xlabel(f"{label}; {' and '.join(beyond)} what is shown, in the outermost bars" if beyond else label)
    ax.set_ylabel("runs")
    ax.locator_params("y", integer=True, nbins=4)


def draw_influences(ax: Axes, found: Sensitivity, *, label: str) -> None:
    """How much of an output's variance each parameter makes: alone, and with the others where that is known.

    Args:
        ax: what to draw into.
        found: what the parameters do.
        label: of the output.
    """
    shown = found.influences[:MOST_PARAMETERS][::-1]
    kinds = [("total", "with others", COLOURS[4]), ("first", "alone", COLOURS[0])]
    kinds = [kind for kind in kinds if any(_is_known(one, kind[0]) for one in shown)]
    if len(kinds) < 2:
        kinds.insert(0, ("of_ranks", "rank correlation²", COLOURS[2]))
    height = 0.76 / len(kinds)
    for k, (name, what, colour) in enumerate(kinds):
        places = np.arange(len(shown)) + (k - (len(kinds) - 1) / 2) * height
        estimates = [getattr(one, name) for one in shown]
        values = np.array([one.value for one in estimates])
        widths = np.array([[one.value - one.low, one.high - one.value] for one in estimates]).T
        errors: Any = {"error_kw": {"elinewidth": 0.9, "capsize": 2, "ecolor": "#333333"}}
        if np.isfinite(widths).any():
            errors["xerr"] = np.nan_to_num(np.maximum(widths, 0.0))
        ax.barh(places, np.nan_to_num(values), height * 0.92, color=colour, label=what, **errors)
    ax.set_yticks(range(len(shown)), [folded(one.name, 34) for one in shown])
    ax.grid(False, axis="y")
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.set_xlim(-0.1, 1.1)
    ax.set_title(folded(label, 70))


def _is_known(one: Influence, name: str) -> bool:
    return not math.isnan(getattr(one, name).value)


def height_of(found: Sequence[Sensitivity]) -> float:
    """How high a page of bars is, in inches: for parameters by their number."""
    return 1.0 + sum(0.75 + 0.33 * min(len(one.influences), MOST_PARAMETERS) for one in found)
