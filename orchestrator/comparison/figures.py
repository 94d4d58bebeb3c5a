"""A scenario's figures with the curves of several runs in each panel.

Where a panel has one curve, colour tells the variant. Where it has several, colour tells the curve and the dashes the
variant, up to four; beyond that, colour tells the variant alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ScenarioError
from ..figures import (
    DASHES,
    Curve,
    colour,
    colour_and_dashes,
    curves_of,
    draw_curves,
    file_name,
    legend,
    page,
    panels_of,
    share_x,
    texts_of,
)
from ..run import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTHS = (1.9, 1.5, 1.7, 1.4)


@dataclass(frozen=True)
class _Line:
    variant: int
    curve: Curve


def draw_compared(figures: Sequence[Mapping[str, Any]], runs: Mapping[str, Results], directory: Path) -> list[Path]:
    """Draw every figure with the curves of all runs; a curve that a run does not have is left out.

    Args:
        figures: as the scenario has them.
        runs: recorded signals by variant.
        directory: it exists.

    Returns:
        The files.
    """
    paths: list[Path] = []
    for figure in figures:
        path = directory / file_name("", figure["title"], paths)
        panels = panels_of(figure)
        shared = share_x(panels)
        found = [_lines(panel, runs) for panel in panels]
        if not any(found):
            continue
        height = 4.4 if len(panels) == 1 else 0.7 + 2.6 * len(panels)
        with page(figure["title"], len(panels), path, size=(9.0, height), share_x=shared) as axes:
            for ax, panel, lines in zip(axes, panels, found, strict=True):
                _draw_panel(ax, panel, lines, runs, not shared or ax is axes[-1])
        paths.append(path)
    return paths


def _lines(panel: Mapping[str, Any], runs: Mapping[str, Results]) -> list[_Line]:
    """The curves of all runs; a setpoint that all variants share is there once."""
    lines: list[_Line] = []
    for k, results in enumerate(runs.values()):
        for curve in _known_curves(panel, results):
            same = [one for one in lines if one.curve.label == curve.label]
            if not any(_equal(one.curve, curve) for one in same):
                lines.append(_Line(k, curve))
    return lines


def _draw_panel(
    ax: Axes, panel: Mapping[str, Any], lines: Sequence[_Line], runs: Mapping[str, Results], x_label: bool
) -> None:
    if not lines:
        ax.set_visible(False)
        return
    names = list(runs)
    labels = list(dict.fromkeys(line.curve.label for line in lines))
    by_variant = len(labels) == 1 or len(names) > len(DASHES)
    styled = [
        (line.curve, _style(line.variant, labels.index(line.curve.label), len(labels), by_variant)) for line in lines
    ]
    draw_curves(ax, panel, styled, next(iter(runs.values())), x_label=x_label)
    _legend(ax, labels, names, {line.variant for line in lines}, by_variant)


def _style(variant: int, label: int, labels: int, by_variant: bool) -> dict[str, Any]:
    if by_variant:
        return colour_and_dashes(variant)
    return {"color": colour(label, labels), "linestyle": DASHES[variant % 4], "linewidth": _WIDTHS[variant % 4]}


def _legend(ax: Axes, labels: Sequence[str], names: Sequence[str], drawn: set[int], by_variant: bool) -> None:
    """Curves by colour, then variants by dashes; variants by colour where there is one curve each."""
    from matplotlib.lines import Line2D  # noqa: PLC0415

    handles = []
    if not by_variant:
        handles += [Line2D([], [], color=colour(k, len(labels)), label=x) for k, x in enumerate(labels)]
    for k, name in enumerate(names):
        if k in drawn:
            style = _style(k, 0, 1, by_variant) | ({} if by_variant else {"color": "#444444"})
            handles.append(Line2D([], [], label=name, **style))
    legend(ax, len(handles), handles=handles, handlelength=2.6)


def _known_curves(panel: Mapping[str, Any], results: Results) -> list[Curve]:
    """The curves of a panel that a run can give: a swapped model need not have every signal."""
    try:
        return curves_of(panel, results)
    except (ScenarioError, ValueError):
        texts, labels = texts_of(panel["y"]), texts_of(panel.get("label"))
    found: list[Curve] = []
    for k, text in enumerate(texts):
        alone = {**panel, "y": [text]} | ({"label": [labels[k]]} if len(labels) == len(texts) else {})
        try:
            found += curves_of(alone, results)
        except (ScenarioError, ValueError):
            continue
    return found


def _equal(a: Curve, b: Curve) -> bool:
    return bool(np.array_equal(a.x, b.x) and np.array_equal(a.y, b.y, equal_nan=True))
