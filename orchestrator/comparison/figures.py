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
    Curve,
    Palette,
    colour_and_dashes,
    curves_of,
    draw_curves,
    file_name,
    heading,
    legend,
    member_colour,
    page,
    panels_of,
    ranks,
    share_x,
    texts_of,
)
from ..run import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTHS = (2.4, 1.9, 1.6, 1.3)


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
    wanted = [(figure, [_lines(panel, runs) for panel in panels_of(figure)]) for figure in figures]
    wanted = [(figure, found) for figure, found in wanted if any(found)]
    palette = Palette(map(_curves, (found for _, found in wanted)))
    for figure, found in wanted:
        path = directory / file_name("", figure, paths)
        panels = panels_of(figure)
        shared = share_x(panels)
        height = 4.4 if len(panels) == 1 else 0.7 + 2.6 * len(panels)
        size, dpi, colours = (9.0, height), figure.get("dpi"), _colours(_curves(found), palette)
        with page(heading(figure), len(panels), path, size=size, share_x=shared, dpi=dpi) as axes:
            above: list[Any] = []
            for ax, panel, lines in zip(axes, panels, found, strict=True):
                x_label = not shared or ax is axes[-1]
                above = _draw_panel(ax, panel, lines, runs, x_label=x_label, colours=colours, above=above)
        paths.append(path)
    return paths


def _curves(figure: Sequence[Sequence[_Line]]) -> list[list[Curve]]:
    return [[line.curve for line in panel] for panel in figure]


def _colours(figure: Sequence[Sequence[Curve]], palette: Palette) -> dict[Any, Any]:
    """The colour of each thing in a figure; what is alone beside families is grey, as in the figures of a run."""
    found = ranks(figure)
    colours: dict[Any, Any] = {}
    for panel in figure:
        families = any(not curve.alone for curve in panel)
        for c in panel:
            if isinstance(c.thing, tuple):
                colours[c.thing] = member_colour(c, found)
            else:
                colours.setdefault(c.thing, "#444444" if families else COLOURS[palette.place(c.thing) % len(COLOURS)])
    return colours


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
    ax: Axes,
    panel: Mapping[str, Any],
    lines: Sequence[_Line],
    runs: Mapping[str, Results],
    *,
    x_label: bool,
    colours: Mapping[Any, Any],
    above: list[Any],
) -> list[Any]:
    """Draw one panel; its legend is left out where the one above says the same. Returns what has been said."""
    if not lines:
        ax.set_visible(False)
        return above
    names = list(runs)
    labels = {line.curve.label: colours[line.curve.thing] for line in lines}
    by_variant = len(labels) == 1 or len(names) > len(DASHES)
    styled = [(line.curve, _style(line.variant, labels[line.curve.label], by_variant)) for line in lines]
    first, *others = runs.values()
    draw_curves(ax, panel, styled, first, x_label=x_label, others=others)
    drawn = {line.variant for line in lines}
    said = [labels, drawn, by_variant]
    if said != above:
        _legend(ax, labels, names, drawn, by_variant)
    return said


def _style(variant: int, colour: Any, by_variant: bool) -> dict[str, Any]:
    """First variants are widest: where lines hide each other, all show through the gaps of the next."""
    if by_variant:
        return {**colour_and_dashes(variant), "linestyle": DASHES[variant % 4], "linewidth": _WIDTHS[variant % 4]}
    return {"color": colour, "linestyle": DASHES[variant % 4], "linewidth": _WIDTHS[variant % 4]}


def _legend(ax: Axes, labels: Mapping[str, Any], names: Sequence[str], drawn: set[int], by_variant: bool) -> None:
    """Curves by colour, then variants by dashes; variants by colour where there is one curve each."""
    from matplotlib.lines import Line2D

    handles = []
    if not by_variant:
        handles += [Line2D([], [], color=colour, label=label) for label, colour in labels.items()]
    for k, name in enumerate(names):
        if k in drawn:
            handles.append(Line2D([], [], label=name, **_style(k, "#444444", by_variant)))
    legend(ax, handles, handlelength=2.6)


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
