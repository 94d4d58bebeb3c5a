"""The figures of a scenario (`[[figures]]`) as PNG files."""

import itertools
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ExpressionError, ScenarioError
from ..evaluation import FUNCTIONS, Signals, parse
from ..problems import Problem
from .curves import Curve, curves_of, x_label_of, y_label_of
from .panels import bands_of, panels_of, share_x
from .style import DASHES, colour, colour_and_dashes, legend, page

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(figures: Sequence[Mapping[str, Any]], signals: Signals, directory: Path, prefix: str = "") -> list[Path]:
    """Draw every figure into `directory`, named after its title.

    Returns:
        The files, in order.

    Raises:
        ScenarioError: some figures could not be drawn; the others were.
    """
    paths: list[Path] = []
    problems: list[Problem] = []
    for figure in figures:
        path = directory / file_name(prefix, figure["title"], paths)
        try:
            _draw_one(figure, signals, path)
        except ExpressionError as error:
            problems += error.at(f"figure '{figure['title']}' was not drawn")
        except ValueError as error:  # mathematics in a label that matplotlib cannot set
            problems.append(Problem(f"figure '{figure['title']}' was not drawn", str(error)))
        else:
            paths.append(path)
    if problems:
        raise ScenarioError(problems)
    return paths


def file_name(prefix: str, title: str, taken: Sequence[Path]) -> str:
    """A plain ASCII name out of a title; numbered where two titles give the same."""
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode().lower()
    stem = prefix + (re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:80] or "figure")
    names = {path.name for path in taken}
    tries = itertools.chain([stem], (f"{stem}-{number}" for number in itertools.count(2)))
    return next(f"{name}.png" for name in tries if f"{name}.png" not in names)


def _draw_one(figure: Mapping[str, Any], signals: Signals, path: Path) -> None:
    panels = panels_of(figure)
    shared = share_x(panels)
    height = 4.0 if len(panels) == 1 else 0.7 + 2.3 * len(panels)
    with page(figure["title"], len(panels), path, size=(8.5, height), share_x=shared) as axes:
        above: dict[str, Any] = {}
        for ax, panel in zip(axes, panels, strict=True):
            above = _draw_panel(ax, panel, signals, above, x_label=not shared or ax is axes[-1])


def _draw_panel(
    ax: "Axes", panel: Mapping[str, Any], signals: Signals, above: dict[str, Any], x_label: bool
) -> dict[str, Any]:
    """Draw one panel. Its legend (label: line style) is left out where the one above says the same; returns it."""
    curves = curves_of(panel, signals)
    styles = [_line(curve, curves) for curve in curves]
    draw_curves(ax, panel, zip(curves, styles, strict=True), signals, x_label=x_label)
    said = {curve.label: style for curve, style in zip(curves, styles, strict=True)}
    if said.items() <= above.items():
        return above
    if len(curves) > 1 or "label" in panel:
        legend(ax, len(curves))
    return said


def draw_curves(
    ax: "Axes",
    panel: Mapping[str, Any],
    styled: Iterable[tuple[Curve, Mapping[str, Any]]],
    signals: Signals,
    *,
    x_label: bool,
) -> None:
    """Draw a panel without its legend: curves, bands, labels, ranges.

    Args:
        ax: to draw into.
        panel: the table.
        styled: curves, each with what matplotlib is to know of its line.
        signals: what bands and x are expressions of.
        x_label: whether x is labelled here.
    """
    scale = float(panel.get("scale", 1.0))
    curves = []
    for curve, style in styled:
        ax.plot(curve.x, scale * curve.y, label=curve.label, **style)
        curves.append(curve)
    for band in bands_of(panel):
        _draw_band(ax, [scale * _level(end, signals) for end in band])
    ax.set_title(panel.get("title", ""))
    ax.set_ylabel(panel.get("y_label", y_label_of(panel, curves)))
    if x_label:
        ax.set_xlabel(panel.get("x_label", x_label_of(panel, signals)))
    _set_ranges(ax, panel)


def _set_ranges(ax: "Axes", panel: Mapping[str, Any]) -> None:
    """Give the axes the ranges the panel asks for; y is scaled to what can be seen."""
    ax.margins(x=0.01)
    if "x_range" in panel:
        low, high = panel["x_range"]
        ax.set_xlim(low, high)
        lines = [np.asarray(line.get_data(), dtype=np.float64) for line in ax.get_lines()]
        seen = [y[(x >= low) & (x <= high) & np.isfinite(y)] for x, y in lines if x.size > 2]
        values = np.concatenate([*seen, np.empty(0)])
        if values.size and np.ptp(values) > 0:  # matplotlib would scale to what lies outside, too
            margin = 0.05 * np.ptp(values)
            ax.set_ylim(values.min() - margin, values.max() + margin)
    if "y_range" in panel:
        ax.set_ylim(*panel["y_range"])


def _draw_band(ax: "Axes", levels: list[float]) -> None:
    """Draw a level, or two with what lies between."""
    if len(levels) == 2:
        ax.axhspan(*levels, color="#777777", alpha=0.10, linewidth=0, zorder=0.5)
    for level in levels:
        ax.axhline(level, color="#777777", linewidth=1.0, linestyle=(0, (6, 3)), zorder=1.5)


def _level(end: str | float, signals: Signals) -> float:
    """The number that an end of a band stands for."""
    value = parse(end, FUNCTIONS).evaluate(signals) if isinstance(end, str) else end
    if isinstance(value, np.ndarray):
        raise ExpressionError(Problem("", f"the band '{end}' varies over time", "draw it as an entry of y"))
    return float(value)


def _line(curve: Curve, curves: Sequence[Curve]) -> dict[str, Any]:
    """Colour by member (train), dashes by entry; single lines beside families are black and dashed."""
    families = [c.entry for c in curves if not c.alone]
    if not families:
        return colour_and_dashes(curve.entry)
    order = list(dict.fromkeys(families))
    if curve.alone:
        lone = list(dict.fromkeys(c.entry for c in curves if c.alone)).index(curve.entry)
        return {"color": "#444444", "linestyle": DASHES[1 + lone % 3], "linewidth": 1.3}
    members = max(c.member for c in curves) + 1
    return {"color": colour(curve.member, members), "linestyle": DASHES[order.index(curve.entry) % 4]}
