"""What is wrong with `[[figures]]`, as far as it can be told before a run."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import ExpressionError
from ..evaluation import FUNCTIONS, Names, parse
from ..problems import Problem, suggestion
from .marks import mark_problems, mark_texts
from .panels import FIGURE_KEYS, FORMATS, PANEL_KEYS, X_KEYS, bands_of, numbers_in, panels_of, texts_of
from .sparse import sparse_problems

_FUNCTION_KEYS = ("name", "from", "to", "points")
_SET = ("title", "label", "x_label", "y_label")
"""Keys whose texts are set as matplotlib does it."""
_MAX_POINTS = 100_000
_LEAST_DPI, _MOST_DPI = 20, 1200


def check_figures(
    figures: Sequence[Mapping[str, Any]],
    names: Collection[str],
    every_step: bool = True,
    apart: Collection[str] = (),
) -> list[Problem]:
    """Every problem of the [[figures]] that can be found before a run.

    `names` are the signals to be recorded and the parameters; `every_step` says whether each step is recorded; `apart`
    are the signals that have no value in some rows.
    """
    names = Names.of(names)
    problems: list[Problem] = []
    for number, figure in enumerate(figures, 1):
        place = f"[[figures]] entry {number} ({figure.get('title', 'no title')})"
        if not isinstance(figure.get("title"), str) or not figure["title"].strip():
            problems.append(Problem(place, "title is missing", "it also names the file"))
        problems += [problem.at(place) for problem in _file_problems(figure)]
        problems += [problem.at(place) for problem in _formula_problems(figure)]
        panels = figure.get("panels")
        if panels is None:
            problems += [problem.at(place) for problem in _panel_problems(figure, names, every_step, apart)]
            continue
        if not isinstance(panels, list) or not panels or not all(isinstance(panel, Mapping) for panel in panels):
            problems.append(Problem(place, "panels must be a list of tables, each with y"))
            continue
        strange = [key for key in figure if key not in ("title", *X_KEYS, *FIGURE_KEYS, "panels")]
        problems += [Problem(place, f"'{key}' belongs into the panels") for key in strange]
        for which, panel in enumerate(panels_of(figure), 1):
            inner = f"{place}, panel {which}"
            problems += [problem.at(inner) for problem in _panel_problems(panel, names, every_step, apart)]
    return problems


def _file_problems(figure: Mapping[str, Any]) -> Iterator[Problem]:
    """How the figure is to be written, and what is said of it."""
    if not isinstance(figure.get("remark", ""), str):
        yield Problem("", "remark must be text")
    if figure.get("format", "png") not in FORMATS:
        yield Problem("", f"format must be one of {', '.join(FORMATS)}, not {figure['format']!r}")
    dpi = figure.get("dpi", 100)
    if not (_is_number(dpi) and _LEAST_DPI <= dpi <= _MOST_DPI):
        yield Problem("", f"dpi must be a number from {_LEAST_DPI} to {_MOST_DPI}, not {dpi!r}")


def _formula_problems(table: Mapping[str, Any]) -> Iterator[Problem]:
    """Texts with mathematics between dollars that cannot be set, in a figure, its panels and their marks."""
    for key, value in table.items():
        if isinstance(value, list):
            for inner in value:
                if isinstance(inner, Mapping):
                    yield from _formula_problems(inner)
        if key in _SET:
            for text in texts_of(value):
                error = _formula_error(text)
                if error:
                    yield Problem("", f"{key} cannot be set: {error}", r"write \$ for a dollar sign")


def _formula_error(text: str) -> str:
    if "$" not in text:
        return ""
    from matplotlib.cbook import is_math_text
    from matplotlib.mathtext import MathTextParser

    try:
        if is_math_text(text):
            MathTextParser("path").parse(text)
    except ValueError as error:
        return " ".join(str(error).split())
    return ""


def _panel_problems(
    panel: Mapping[str, Any], names: Collection[str], every_step: bool, apart: Collection[str]
) -> Iterator[Problem]:
    valid = (*PANEL_KEYS, "panels", *FIGURE_KEYS)
    for key in panel:
        if key not in valid:
            near = suggestion(key, valid) or f"there are {', '.join(valid)}"
            yield Problem("", f"unknown key '{key}'", near)
    yield from _shape_problems(panel)
    function = panel.get("x")
    variable = (str(function.get("name")),) if isinstance(function, Mapping) else ()
    texts = [*texts_of(panel.get("y")), *texts_of(function)]
    texts += [end for band in bands_of(panel) for end in band if isinstance(end, str)]
    texts += [*mark_texts(panel), *numbers_in(str(panel.get("title", "")))]
    yield from mark_problems(panel)
    for text in texts:
        try:
            expression = parse(text, FUNCTIONS)
        except ExpressionError as error:
            yield from error.problems
            continue
        problems = expression.check(names, variable)
        yield from problems
        if apart and not problems:
            yield from sparse_problems(expression, names, apart.__contains__)
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
    yield from _axis_problems(panel)
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


def _axis_problems(panel: Mapping[str, Any]) -> Iterator[Problem]:
    for axis in ("x", "y"):
        range_key, log_key = f"{axis}_range", f"{axis}_log"
        logarithmic = panel.get(log_key, False)
        if not isinstance(logarithmic, bool):
            yield Problem("", f"{log_key} must be true or false")
        if range_key in panel and not _is_range(panel[range_key]):
            yield Problem("", f"{range_key} must be two rising numbers, as in {range_key} = [0, 90]")
        elif logarithmic is True and range_key in panel and panel[range_key][0] <= 0:
            yield Problem("", f"{range_key} must be positive on a logarithmic axis")


def _function_problems(x: Mapping[str, Any]) -> Iterator[Problem]:
    for key in x:
        if key not in _FUNCTION_KEYS:
            near = suggestion(key, _FUNCTION_KEYS) or "there are name, from, to, points"
            yield Problem("", f"unknown key '{key}' in x", near)
    name = x.get("name")
    if not isinstance(name, str) or not name.isidentifier() or name in {"i", "count", "time", "pi"}:
        yield Problem("", "x.name must be a plain word that is not taken, such as d")
    if not _is_range([x.get("from"), x.get("to")]):
        yield Problem("", "x.from and x.to must be two rising numbers")
    points = x.get("points", 400)
    if not isinstance(points, int) or not 2 <= points <= _MAX_POINTS:
        yield Problem("", f"x.points must be a whole number from 2 to {_MAX_POINTS}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))


def _is_range(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(_is_number, value)) and value[0] < value[1]


def _is_band(band: Any) -> bool:
    ends = band if isinstance(band, list) else [band]
    return len(ends) in {1, 2} and all(isinstance(end, str) or _is_number(end) for end in ends)
