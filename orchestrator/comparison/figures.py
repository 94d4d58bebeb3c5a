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
    COLOURS,
    DASHES,
    STYLE,
    Curve,
    bands_of,
    curves_of,
    draw_band,
    file_name,
    level_of,
    panels_of,
    set_ranges,
    texts_of,
    x_label_of,
    y_label_of,
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
    import matplotlib as mpl  # noqa: PLC0415
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    paths: list[Path] = []
    for figure in figures:
        path = directory / file_name("", figure["title"], paths)
        panels = panels_of(figure)
        shared = all(panel.get("x") == panels[0].get("x") for panel in panels)
        with mpl.rc_context(STYLE):
            height = 4.4 if len(panels) == 1 else 0.7 + 2.6 * len(panels)
            canvas = Figure(figsize=(9.0, height), dpi=100, layout="constrained")
            FigureCanvasAgg(canvas)
            canvas.suptitle(figure["title"], x=0.01, ha="left", fontsize=11.5, fontweight="bold")
            axes = canvas.subplots(len(panels), 1, sharex=shared, squeeze=False)[:, 0]
            drawn = [
                _draw_panel(ax, panel, runs, not shared or ax is axes[-1])
                for ax, panel in zip(axes, panels, strict=True)
            ]
            if any(drawn):
                canvas.savefig(path, metadata={"Software": None})
                paths.append(path)
    return paths


def _draw_panel(ax: Axes, panel: Mapping[str, Any], runs: Mapping[str, Results], x_label: bool) -> bool:
    names = list(runs)
    lines: list[_Line] = []
    for k, results in enumerate(runs.values()):
        for curve in _known_curves(panel, results):
            same = [one for one in lines if one.curve.label == curve.label]
            # A setpoint that all variants share is drawn once.
            if not any(_equal(one.curve, curve) for one in same):
                lines.append(_Line(k, curve))
    if not lines:
        ax.set_visible(False)
        return False
    labels = list(dict.fromkeys(line.curve.label for line in lines))
    by_variant = len(labels) == 1 or len(names) > len(DASHES)
    scale = float(panel.get("scale", 1.0))
    for line in lines:
        style = _style(line.variant, labels.index(line.curve.label), len(labels), by_variant)
        ax.plot(line.curve.x, scale * line.curve.y, **style)
    first = next(iter(runs.values()))
    for band in bands_of(panel):
        draw_band(ax, [scale * level_of(end, first) for end in band])
    ax.set_title(panel.get("title", ""))
    ax.set_ylabel(panel.get("y_label", y_label_of(panel, [line.curve for line in lines])))
    if x_label:
        ax.set_xlabel(panel.get("x_label", x_label_of(panel, first)))
    set_ranges(ax, panel)
    _legend(ax, labels, names, {line.variant for line in lines}, by_variant)
    return True


def _style(variant: int, label: int, labels: int, by_variant: bool) -> dict[str, Any]:
    if by_variant:
        return {"color": COLOURS[variant % len(COLOURS)], "linestyle": DASHES[variant // len(COLOURS) % 4]}
    return {"color": _colour(label, labels), "linestyle": DASHES[variant % 4], "linewidth": _WIDTHS[variant % 4]}


def _colour(label: int, labels: int) -> Any:
    if labels <= len(COLOURS):
        return COLOURS[label]
    import matplotlib as mpl  # noqa: PLC0415

    return mpl.colormaps["viridis"](0.92 * label / (labels - 1))


def _legend(ax: Axes, labels: Sequence[str], names: Sequence[str], drawn: set[int], by_variant: bool) -> None:
    """Curves by colour, then variants by dashes; variants by colour where there is one curve each."""
    from matplotlib.lines import Line2D  # noqa: PLC0415

    handles = []
    if not by_variant:
        handles += [Line2D([], [], color=_colour(k, len(labels)), label=x) for k, x in enumerate(labels)]
    for k, name in enumerate(names):
        if k in drawn:
            style = _style(k, 0, 1, by_variant) | ({} if by_variant else {"color": "#444444"})
            handles.append(Line2D([], [], label=name, **style))
    ax.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.02),
        borderaxespad=0.0,
        handlelength=2.6,
        ncols=1 + (len(handles) - 1) // 14,
    )


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
