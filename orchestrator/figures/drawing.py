"""The figures of a scenario (`[[figures]]`) as PNG files.

A figure is a title and a panel, or several `panels` above one another. A panel draws expressions over time, over
another expression, or over a plain variable (a function plot). matplotlib is imported where it is used: importing it
costs more than most commands take.
"""

import itertools
import re
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, ScenarioError
from ..evaluation import FUNCTIONS, Expression, Reference, Signals, parse, unit_of
from ..problems import Problem, suggestion

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

PANEL_KEYS = ("title", "y", "x", "label", "x_label", "y_label", "x_range", "y_range", "bands", "scale")
FUNCTION_KEYS = ("name", "from", "to", "points")
MAX_POINTS = 100_000
# Okabe and Ito 2008, told apart by colour-blind readers too; without their yellow, too pale for a line.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
DASHES = ("-", "--", ":", "-.")
STYLE: Any = {  # matplotlib's own type for this is a list of every key it knows
    "font.size": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelcolor": "black",
    "ytick.labelcolor": "black",
}


@dataclass(frozen=True)
class Curve:
    """One line: x and y of shape (T,), its label, which entry of `y` it comes from and which of its lines it is."""

    x: Array
    y: Array
    label: str
    entry: int
    member: int
    alone: bool  # the only line of its entry
    unit: str


def check_figures(
    figures: Sequence[Mapping[str, Any]], names: Collection[str], every_step: bool = True
) -> list[Problem]:
    """Every problem of the [[figures]] that can be found before a run.

    `names` are the signals to be recorded and the parameters; `every_step` says whether each step is recorded.
    """
    problems: list[Problem] = []
    for number, figure in enumerate(figures, 1):
        place = f"[[figures]] entry {number} ({figure.get('title', 'no title')})"
        if not isinstance(figure.get("title"), str) or not figure["title"].strip():
            problems.append(Problem(place, "title is missing", "it also names the file"))
        panels = figure.get("panels")
        if panels is None:
            problems += [problem.at(place) for problem in _panel_problems(figure, names, every_step)]
            continue
        if not isinstance(panels, list) or not panels or not all(isinstance(panel, Mapping) for panel in panels):
            problems.append(Problem(place, "panels must be a list of tables, each with y"))
            continue
        strange = [key for key in figure if key not in ("title", "x", "x_label", "x_range", "panels")]
        problems += [Problem(place, f"'{key}' belongs into the panels") for key in strange]
        for which, panel in enumerate(panels_of(figure), 1):
            inner = f"{place}, panel {which}"
            problems += [problem.at(inner) for problem in _panel_problems(panel, names, every_step)]
    return problems


def _panel_problems(panel: Mapping[str, Any], names: Collection[str], every_step: bool) -> Iterator[Problem]:
    valid = (*PANEL_KEYS, "panels")
    for key in panel:
        if key not in valid:
            near = suggestion(key, valid) or f"there are {', '.join(valid)}"
            yield Problem("", f"unknown key '{key}'", near)
    yield from _shape_problems(panel)
    function = panel.get("x")
    variable = (str(function.get("name")),) if isinstance(function, Mapping) else ()
    texts = [*texts_of(panel.get("y")), *texts_of(function)]
    texts += [end for band in bands_of(panel) for end in band if isinstance(end, str)]
    for text in texts:
        try:
            expression = parse(text, FUNCTIONS)
        except ExpressionError as error:
            yield from error.problems
            continue
        yield from expression.check(names, variable)
        if expression.calls("at_sample") and not every_step:
            yield Problem(f"'{text}'", "at_sample needs every communication step recorded", "set record = step")


def _shape_problems(panel: Mapping[str, Any]) -> Iterator[Problem]:
    """Values of the wrong kind."""
    if not texts_of(panel.get("y")):
        remedy = 'give the expressions to draw, as in y = ["train[:].speed", "target.value"]'
        yield Problem("", "y is missing", remedy)
    labels = panel.get("label")
    if labels is not None and len(texts_of(labels)) != len(texts_of(panel.get("y"))):
        yield Problem("", "label must be a list of texts, one for each entry of y")
    for key in ("x_label", "y_label", "title"):
        if key in panel and not isinstance(panel[key], str):
            yield Problem("", f"{key} must be text")
    for key in ("x_range", "y_range"):
        if key in panel and not _is_range(panel[key]):
            yield Problem("", f"{key} must be two rising numbers, as in {key} = [0, 90]")
    if "scale" in panel and not (_is_number(panel["scale"]) and panel["scale"] != 0):
        yield Problem("", "scale must be a number other than 0")
    elif "scale" in panel and "y_label" not in panel:
        yield Problem("", "scale needs y_label, which says the unit that is drawn")
    bands = panel.get("bands", [])
    if not isinstance(bands, list) or not all(map(_is_band, bands)):
        yield Problem("", "bands must be a list of levels and [low, high] pairs, each a number or an expression")
    x = panel.get("x")
    if isinstance(x, Mapping):
        yield from _function_problems(x)
    elif x is not None and not isinstance(x, str):
        function = '{ name = "d", from = 0, to = 1, points = 400 }'
        yield Problem("", f"x must be an expression, or {function} for a function plot")


def _function_problems(x: Mapping[str, Any]) -> Iterator[Problem]:
    for key in x:
        if key not in FUNCTION_KEYS:
            near = suggestion(key, FUNCTION_KEYS) or "there are name, from, to, points"
            yield Problem("", f"unknown key '{key}' in x", near)
    name = x.get("name")
    if not isinstance(name, str) or not name.isidentifier() or name in {"i", "count", "time", "pi"}:
        yield Problem("", "x.name must be a plain word that is not taken, such as d")
    if not _is_range([x.get("from"), x.get("to")]):
        yield Problem("", "x.from and x.to must be two rising numbers")
    points = x.get("points", 400)
    if not isinstance(points, int) or not 2 <= points <= MAX_POINTS:
        yield Problem("", f"x.points must be a whole number from 2 to {MAX_POINTS}")


def texts_of(value: Any) -> list[str]:
    """A text, or a list of texts, as a list; nothing when it is something else."""
    values = value if isinstance(value, list) else [value]
    return values if all(isinstance(x, str) for x in values) else []


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))


def _is_range(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)) and value[0] < value[1]


def _is_band(band: Any) -> bool:
    ends = band if isinstance(band, list) else [band]
    return len(ends) in {1, 2} and all(isinstance(end, str) or _is_number(end) for end in ends)


def bands_of(panel: Mapping[str, Any]) -> list[list[Any]]:
    """The bands of a panel, one or two ends each."""
    bands = panel.get("bands", [])
    return [band if isinstance(band, list) else [band] for band in bands] if isinstance(bands, list) else []


def panels_of(figure: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The panels of a figure; what the figure says of x holds for all of them."""
    if "panels" not in figure:
        return [{key: value for key, value in figure.items() if key != "title"}]
    common = {key: figure[key] for key in ("x", "x_label", "x_range") if key in figure}
    return [{**common, **panel} for panel in figure["panels"]]


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
    import matplotlib as mpl  # noqa: PLC0415
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    panels = panels_of(figure)
    shared = all(panel.get("x") == panels[0].get("x") for panel in panels)
    height = 4.0 if len(panels) == 1 else 0.7 + 2.3 * len(panels)
    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=(8.5, height), dpi=100, layout="constrained")
        FigureCanvasAgg(canvas)
        canvas.suptitle(figure["title"], x=0.01, ha="left", fontsize=11.5, fontweight="bold")
        axes = canvas.subplots(len(panels), 1, sharex=shared, squeeze=False)[:, 0]
        above: dict[str, Any] = {}
        for ax, panel in zip(axes, panels, strict=True):
            above = _draw_panel(ax, panel, signals, above, x_label=not shared or ax is axes[-1])
        canvas.savefig(path, metadata={"Software": None})


def _draw_panel(
    ax: "Axes", panel: Mapping[str, Any], signals: Signals, above: dict[str, Any], x_label: bool
) -> dict[str, Any]:
    """Draw one panel. Its legend (label: line style) is left out where the one above says the same; returns it."""
    curves = curves_of(panel, signals)
    scale = float(panel.get("scale", 1.0))
    styles = [_line(curve, curves) for curve in curves]
    legend = {curve.label: style for curve, style in zip(curves, styles, strict=True)}
    for curve, style in zip(curves, styles, strict=True):
        ax.plot(curve.x, scale * curve.y, label=curve.label, **style)
    for band in bands_of(panel):
        draw_band(ax, [scale * level_of(end, signals) for end in band])
    ax.set_title(panel.get("title", ""))
    ax.set_ylabel(panel.get("y_label", y_label_of(panel, curves)))
    if x_label:
        ax.set_xlabel(panel.get("x_label", x_label_of(panel, signals)))
    set_ranges(ax, panel)
    if legend.items() <= above.items():
        return above
    if len(curves) > 1 or "label" in panel:
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0.0, ncols=1 + (len(curves) - 1) // 14)
    return legend


def set_ranges(ax: "Axes", panel: Mapping[str, Any]) -> None:
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


def draw_band(ax: "Axes", levels: list[float]) -> None:
    """Draw a level, or two with what lies between."""
    if len(levels) == 2:
        ax.axhspan(*levels, color="#777777", alpha=0.10, linewidth=0, zorder=0.5)
    for level in levels:
        ax.axhline(level, color="#777777", linewidth=1.0, linestyle=(0, (6, 3)), zorder=1.5)


def level_of(end: str | float, signals: Signals) -> float:
    """The number that an end of a band stands for."""
    value = parse(end, FUNCTIONS).evaluate(signals) if isinstance(end, str) else end
    if isinstance(value, np.ndarray):
        raise ExpressionError(Problem("", f"the band '{end}' varies over time", "draw it as an entry of y"))
    return float(value)


def _line(curve: Curve, curves: Sequence[Curve]) -> dict[str, Any]:
    """Colour by member (train), dashes by entry; single lines beside families are black and dashed."""
    families = [c.entry for c in curves if not c.alone]
    if not families:
        return {"color": COLOURS[curve.entry % len(COLOURS)], "linestyle": DASHES[curve.entry // len(COLOURS) % 4]}
    order = list(dict.fromkeys(families))
    if curve.alone:
        lone = list(dict.fromkeys(c.entry for c in curves if c.alone)).index(curve.entry)
        return {"color": "#444444", "linestyle": DASHES[1 + lone % 3], "linewidth": 1.3}
    members = max(c.member for c in curves) + 1
    if members <= len(COLOURS):
        colour: Any = COLOURS[curve.member]
    else:
        import matplotlib as mpl  # noqa: PLC0415

        colour = mpl.colormaps["viridis"](0.92 * curve.member / (members - 1))
    return {"color": colour, "linestyle": DASHES[order.index(curve.entry) % 4]}


def curves_of(panel: Mapping[str, Any], signals: Signals) -> list[Curve]:
    """All lines of a panel, labelled so that several families can be told apart."""
    labels = texts_of(panel.get("label")) if "label" in panel else []
    curves = []
    for entry, text in enumerate(texts_of(panel["y"])):
        curves += _entry(panel.get("x"), text, labels[entry] if labels else "", entry, signals)
    families = {curve.entry for curve in curves if not curve.alone}
    if labels or len(families) < 2:
        return curves
    what = [_variable(text) or f"({text})" for text in texts_of(panel["y"])]  # "train 1" alone would be ambiguous
    return [c if c.alone else replace(c, label=f"{c.label} {what[c.entry]}") for c in curves]


def _entry(x: Any, text: str, label: str, entry: int, signals: Signals) -> list[Curve]:
    """The lines of one entry of `y`: one a row or value of i."""
    expression = parse(text, FUNCTIONS)
    names = [*signals.names(), *signals.parameters]
    constants: dict[str, Any] = {}
    if isinstance(x, Mapping):
        constants[x["name"]] = np.linspace(x["from"], x["to"], x.get("points", 400))
    drawn: list[tuple[Array, Array, str, str]] = []
    for index in expression.instances(names):
        y = np.atleast_2d(np.asarray(expression.evaluate(signals, index, **constants), dtype=np.float64))
        across = _across(x, signals, index, constants)
        y = np.broadcast_to(y, (y.shape[0], across.shape[-1]))
        across = np.broadcast_to(across, y.shape)
        resolved = expression.resolve(names, index)
        unit = unit_of(expression, signals, index)
        drawn += [
            (across[row], y[row], _label(expression, resolved, index, row, len(y)), unit) for row in range(len(y))
        ]
    alone = len(drawn) == 1
    return [
        Curve(abscissa, y, _named(label, own, alone, member), entry, member, alone, unit)
        for member, (abscissa, y, own, unit) in enumerate(drawn)
    ]


def _across(x: Any, signals: Signals, index: int | None, constants: Mapping[str, Any]) -> Array:
    if isinstance(x, Mapping):
        return np.asarray(constants[x["name"]])
    if x is None:
        return signals.time
    values = np.asarray(parse(x, FUNCTIONS).evaluate(signals, index), dtype=np.float64)
    if not values.ndim:
        raise ExpressionError(Problem("", f"x = '{x}' is a single number", "draw over a signal"))
    return values


def _named(label: str, own: str, alone: bool, member: int) -> str:
    """The user's label, told apart by number: `{i}` in it stands for the numbers of the line's signals."""
    if not label:
        return own
    numbers = ", ".join(re.findall(r"\d+(?:–\d+)?", own)) or str(member + 1)
    return label.replace("{i}", numbers) if "{i}" in label or alone else f"{label} {numbers}"


def _label(expression: Expression, resolved: list[list[str]], index: int | None, row: int, rows: int) -> str:
    """`train 2` for one of a family, `train 1–2` for a gap between two, the text itself for a single line."""
    families = [
        names[row] if reference.stacked and len(names) == rows else names[0]
        for reference, names in zip(expression.references, resolved, strict=True)
        if names and (reference.stacked if index is None else reference.uses_index)
    ]
    if not families:
        return _short(expression.text)
    array = families[0].partition("[")[0]
    numbers = [re.findall(r"\[([\d,]+)\]", name) for name in families if name.startswith(f"{array}[")]
    first = sorted({tuple(map(int, found[0].split(","))) for found in numbers})
    own = "–".join(",".join(map(str, index)) for index in first)
    return " ".join([array.replace(".", " "), own, *numbers[0][1:]])


def _short(text: str) -> str:
    """`gust acceleration` for a plain signal, the expression otherwise."""
    plain = re.fullmatch(r"[\w.\[\]:,-]+", text)
    return text.removesuffix(".value").replace("[:]", "").replace("[i]", "").replace(".", " ") if plain else text


def _variable(text: str) -> str:
    """`speed` for a plain signal, nothing for a formula."""
    tree = parse(text, FUNCTIONS).tree
    return tree.parts[-1][0].replace("_", " ") if isinstance(tree, Reference) else ""


def _bracketed(unit: str) -> str:
    """A unit as an axis shows it: m/s2 as [m/s²]."""
    return f"[{re.sub(r'(?<=[a-z])([23])', lambda match: '²³'[int(match[0]) - 2], unit)}]" if unit else ""


def y_label_of(panel: Mapping[str, Any], curves: Sequence[Curve]) -> str:
    """The variable all entries share, and the unit they share."""
    units = {curve.unit for curve in curves}
    variables = {_variable(text) for text in texts_of(panel["y"])} - {"value"}
    shared = [
        next(iter(variables)) if len(variables) == 1 else "",
        _bracketed(next(iter(units))) if len(units) == 1 else "",
    ]
    return " ".join(filter(None, shared))


def x_label_of(panel: Mapping[str, Any], signals: Signals) -> str:
    """The variable and unit along x."""
    x = panel.get("x")
    if isinstance(x, Mapping):
        return str(x["name"])
    if x is None:
        return "time [s]"
    expression = parse(x, FUNCTIONS)
    index = expression.instances([*signals.names(), *signals.parameters])[0]
    unit = unit_of(expression, signals, index)
    return f"{_variable(x) or x} {_bracketed(unit)}".rstrip()
