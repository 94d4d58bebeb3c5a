"""The figures of a scenario (`[[figures]]`) as files."""

import itertools
import json
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import world
from ..errors import ExpressionError, FigureError, ScenarioError
from ..evaluation import Signals
from ..problems import Problem
from .checking import check_figures
from .curves import Curve, curves_of, x_label_of, y_label_of
from .marks import draw_marks, filled_title, number
from .palette import Palette, member_colour, ranks
from .panels import FORMATS, bands_of, heading, panels_of, share_x
from .style import DASHES, colour, colour_and_dashes, legend, page, room, wrapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARGIN = 0.7
"""What stands left of a panel, in inches."""
_HIDDEN = 0.25
"""Which part of a line must be hidden by another before they get dashes and widths."""


def draw(figures: Sequence[Mapping[str, Any]], signals: Signals, directory: Path, prefix: str = "") -> list[Path]:
    """Draw every figure into `directory`, named after its title.

    Returns:
        The files, in order.

    Raises:
        FigureError: some figures could not be drawn; the others were.
    """
    paths: list[Path] = []
    problems: dict[int, list[Problem]] = {}
    found: dict[int, list[list[Curve]]] = {}
    for k, figure in enumerate(figures):
        try:
            found[k] = [curves_of(panel, signals) for panel in panels_of(figure)]
        except ExpressionError as error:
            problems[k] = error.at(_not_drawn(figure))
    palette = Palette(found.values())
    for k, curves in found.items():
        path = directory / file_name(prefix, figures[k], paths)
        try:
            _draw_one(figures[k], curves, signals, palette, path)
        except ExpressionError as error:
            problems[k] = error.at(_not_drawn(figures[k]))
        except Exception as error:  # matplotlib has many reasons, a full disk is another
            problems[k] = [Problem(_not_drawn(figures[k]), f"{type(error).__name__}: {error}")]
        else:
            paths.append(path)
    if problems:
        raise FigureError([problem for k in sorted(problems) for problem in problems[k]], paths)
    return paths


def remove_drawn(record: Path) -> None:
    """Remove the figures that the record of earlier results lists, in every format: they show something else."""
    try:
        names = json.loads(world.read_text(record, encoding="utf-8"))["figures"]
        stems = [name.rpartition(".")[0] for name in names if Path(name).name == name]
    except (OSError, ValueError, LookupError, TypeError, AttributeError):  # there is none, or it is not ours
        return
    for stem, ending in itertools.product(filter(None, stems), FORMATS):
        world.unlink(record.with_name(f"{stem}.{ending}"), missing_ok=True)


def _not_drawn(figure: Mapping[str, Any]) -> str:
    return f"figure '{figure['title']}' was not drawn"


def file_name(prefix: str, figure: Mapping[str, Any], taken: Sequence[Path]) -> str:
    """A plain ASCII name out of a figure's title, in its format; numbered where two titles give the same."""
    plain = unicodedata.normalize("NFKD", figure["title"]).encode("ascii", "ignore").decode().lower()
    stem = prefix + (re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:80] or "figure")
    names = {path.stem for path in taken}
    tries = itertools.chain([stem], (f"{stem}-{number}" for number in itertools.count(2)))
    return f"{next(name for name in tries if name not in names)}.{figure.get('format', FORMATS[0])}"


def _draw_one(
    figure: Mapping[str, Any], curves: Sequence[Sequence[Curve]], signals: Signals, palette: Palette, path: Path
) -> None:
    panels = panels_of(figure)
    shared = share_x(panels)
    height = 4.0 if len(panels) == 1 else 0.7 + 2.3 * len(panels)
    size, dpi = (8.5, height), figure.get("dpi")
    styles = _styles(curves, palette, room(len(panels), height))
    with page(heading(figure), len(panels), path, size=size, share_x=shared, dpi=dpi) as axes:
        above: dict[str, Any] = {}
        for ax, panel, styled in zip(axes, panels, styles, strict=True):
            draw_curves(ax, panel, styled, signals, x_label=not shared or ax is axes[-1])
            above = _legend(ax, panel, [style for _, style in styled], above)


def _legend(
    ax: "Axes", panel: Mapping[str, Any], styles: Sequence[Mapping[str, Any]], above: dict[str, Any]
) -> dict[str, Any]:
    """Say what the lines are, but where the legend above says the same; returns what has been said."""
    said = {style["label"]: {**style} for style in styles if not style["label"].startswith("_")}
    if said.items() <= above.items():
        return above
    if len(styles) > 1 or "label" in panel:
        legend(ax)
    return said


def plot(expressions: Sequence[str], signals: Signals, ax: "Axes | None" = None) -> "Axes":
    """Draw expressions over time, as a panel of a figure would show them.

    Args:
        expressions: of signals.
        signals: the run.
        ax: to draw into; those of a new figure by default.

    Raises:
        ScenarioError: an expression speaks of what is not there.
    """
    panel: dict[str, Any] = {"y": list(expressions)}
    problems = check_figures([{"title": "plot", **panel}], [*signals.names(), *signals.parameters])
    if problems:
        raise ScenarioError(problems)
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.subplots()[1]
    curves = curves_of(panel, signals)
    there = len(ax.get_lines())  # of another run: its curves keep their colours to themselves
    styles = ({"color": colour(there + k, there + len(curves))} for k in range(len(curves)))
    draw_curves(ax, panel, zip(curves, styles, strict=True), signals, x_label=True)
    ax.legend()
    return ax


def draw_curves(
    ax: "Axes",
    panel: Mapping[str, Any],
    styled: Iterable[tuple[Curve, Mapping[str, Any]]],
    signals: Signals,
    *,
    x_label: bool,
    others: Sequence[Signals] = (),
) -> None:
    """Draw a panel without its legend: curves, bands, marks, labels, ranges.

    Args:
        ax: to draw into.
        panel: the table.
        styled: curves, each with what matplotlib is to know of its line.
        signals: what bands, marks and x are expressions of.
        x_label: whether x is labelled here.
        others: signals of other runs that curves are of: where they differ, numbers in the title are given for each.
    """
    scale = float(panel.get("scale", 1.0))
    curves = []
    for curve, style in styled:
        ax.plot(curve.x, scale * curve.y, **{"label": curve.label, **style})
        curves.append(curve)
    for axis, set_scale in (("x", ax.set_xscale), ("y", ax.set_yscale)):
        if panel.get(f"{axis}_log"):
            set_scale("log", nonpositive="mask")
    for band in bands_of(panel):
        _draw_band(ax, [scale * number(end, signals) for end in band])
    title = filled_title(panel, signals, others)
    drawing: Any = ax.figure
    ax.set_title(wrapped(title, drawing.get_figwidth() - _MARGIN))
    ax.set_ylabel(panel.get("y_label", y_label_of(panel, curves)))
    if x_label:
        ax.set_xlabel(panel.get("x_label", x_label_of(panel, signals)))
    _set_ranges(ax, panel)
    draw_marks(ax, panel, signals, scale)


def _set_ranges(ax: "Axes", panel: Mapping[str, Any]) -> None:
    """Give the axes the ranges the panel asks for; y is scaled to what can be seen."""
    ax.margins(x=0.01)
    if "x_range" in panel:
        low, high = panel["x_range"]
        ax.set_xlim(low, high)
        lines = [np.asarray(line.get_data(), dtype=np.float64) for line in ax.get_lines()]
        seen = [y[(x >= low) & (x <= high) & np.isfinite(y)] for x, y in lines if x.size > 2]
        values = np.concatenate([*seen, np.empty(0)])
        if values.size and np.ptp(values) > 0 and not panel.get("y_log"):  # matplotlib would scale to what lies outside
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


def _styles(
    figure: Sequence[Sequence[Curve]], palette: Palette, lines: int
) -> list[list[tuple[Curve, dict[str, Any]]]]:
    """How each curve of a figure looks; `lines` is what a legend has room for beside a panel."""
    found, hidden = ranks(figure), any(map(_hide, figure))
    made = []
    for panel in figure:
        families = list(dict.fromkeys(c.entry for c in panel if not c.alone))
        whole = len(families) > 1 and len(panel) > lines
        lone = [c.entry for c in panel if c.alone]
        styles = []
        for curve in panel:
            if not families:
                style = colour_and_dashes(palette.place(curve.label))
                if hidden and len(lone) > 1:
                    style |= _over(lone.index(curve.entry), len(lone), palette.place(curve.label))
            elif curve.alone:
                style = {"color": "#444444", "linestyle": DASHES[1 + lone.index(curve.entry) % 3], "linewidth": 1.3}
            elif whole:
                style = colour_and_dashes(families.index(curve.entry))
            else:
                dashes = DASHES[families.index(curve.entry) % 4]
                style = {"color": member_colour(curve, found), "linestyle": dashes}
            label = curve.label if curve.alone or not whole else curve.family if not curve.member else "_"
            styles.append((curve, {**style, "label": label}))
        made.append(styles)
    return made


def _over(k: int, count: int, place: int) -> dict[str, Any]:
    """The k-th of lines that hide each other: the first is widest, and all show through the gaps of the others."""
    return {"linewidth": 2.8 - 1.6 * k / (count - 1), "linestyle": DASHES[1 + (place - 1) % 3] if place else "-"}


def _hide(panel: Sequence[Curve]) -> bool:
    """Whether lines that are told apart by colour alone run within each other for a quarter of the panel."""
    alone = [curve for curve in panel if curve.alone]
    if len(alone) < len(panel):
        return False
    values = np.concatenate([curve.y[np.isfinite(curve.y)] for curve in alone] or [np.empty(0)])
    near = 0.01 * np.ptp(values) if values.size else 0.0
    return any(
        a.y.shape == b.y.shape
        and (both := np.isfinite(a.y) & np.isfinite(b.y)).any()
        and (np.abs(a.y[both] - b.y[both]) <= near).mean() > _HIDDEN
        for a, b in itertools.combinations(alone, 2)
    )
