"""Numbers that a source gives, drawn where they belong: a line at an x or a y, or a point.

A mark is ``{ x = 100, label = "about 100 s (stated)" }``, with ``x``, ``y`` or both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ExpressionError
from ..evaluation import FUNCTIONS, Signals, parse
from ..problems import Problem, suggestion
from .panels import marks_of, numbers_in
from .sparse import check_sparse

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARK_KEYS = ("x", "y", "label")
_COLOUR = "#7A1FA2"


def mark_problems(panel: Mapping[str, Any]) -> Iterator[Problem]:
    """What is wrong with the marks of a panel, but for the names in their expressions."""
    marks = panel.get("marks", [])
    if not isinstance(marks, list) or len(marks) != len(marks_of(panel)):
        yield Problem("", "marks must be a list of tables", 'write marks = [{ x = 100, label = "stated" }]')
        return
    for mark in marks_of(panel):
        for key in mark:
            if key not in _MARK_KEYS:
                near = suggestion(key, _MARK_KEYS) or f"there are {', '.join(_MARK_KEYS)}"
                yield Problem("", f"unknown key '{key}' in a mark", near)
        if not any(key in mark for key in ("x", "y")):
            yield Problem("", "a mark needs x, y or both")
        for key in ("x", "y"):
            if key in mark and not (isinstance(mark[key], str) or _is_number(mark[key])):
                yield Problem("", f"{key} of a mark must be a number or an expression")
        if "label" in mark and not isinstance(mark["label"], str):
            yield Problem("", "label of a mark must be text")


def mark_texts(panel: Mapping[str, Any]) -> list[str]:
    """The expressions in the marks of a panel."""
    return [mark[key] for mark in marks_of(panel) for key in ("x", "y") if isinstance(mark.get(key), str)]


def draw_marks(ax: Axes, panel: Mapping[str, Any], signals: Signals, scale: float) -> None:
    """Draw the marks of a panel, each with its label; y is scaled as the curves are."""
    for mark in marks_of(panel):
        x, y = (number(mark[key], signals) if key in mark else None for key in ("x", "y"))
        y = None if y is None else scale * y
        style: Any = {"color": _COLOUR, "linewidth": 1.1, "linestyle": (0, (1, 1.5)), "zorder": 1.6}
        text: Any = {"color": _COLOUR, "fontsize": 8, "textcoords": "offset points", "annotation_clip": True}
        text["bbox"] = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6}
        label = mark.get("label", "")
        if x is not None and y is not None:
            ax.plot([x], [y], "o", color=_COLOUR, markersize=6, markerfacecolor="none", markeredgewidth=1.4, zorder=5)
            ax.annotate(label, (x, y), xytext=(8, 0), ha="left", va="center", **text)
        elif y is not None:
            ax.axhline(y, **style)
            side: Any = ax.get_yaxis_transform()
            ax.annotate(label, (0.995, y), xycoords=side, xytext=(0, 2), ha="right", va="bottom", **text)
        elif x is not None:
            ax.axvline(x, **style)
            side = ax.get_xaxis_transform()
            ax.annotate(label, (x, 0.08), xycoords=side, xytext=(4, 0), ha="left", va="bottom", **text)


def filled_title(panel: Mapping[str, Any], signals: Signals, others: Sequence[Signals] = ()) -> str:
    """The title of a panel with the numbers of its run, and of other runs where they differ."""
    title = str(panel.get("title", ""))
    for text in numbers_in(title):
        found = [f"{number(text, signals):.4g}"]
        for other in others:
            with suppress(ExpressionError):  # a swapped model need not have it
                found.append(f"{number(text, other):.4g}")
        title = title.replace(f"{{{text}}}", " / ".join(dict.fromkeys(found)))
    return title


def number(value: str | float, signals: Signals) -> float:
    """The number that a level, a mark or a part of a title stands for.

    Raises:
        ExpressionError: it varies over time, or a signal in it has no value in some rows.
    """
    found: Any = value
    if isinstance(value, str):
        expression = parse(value, FUNCTIONS)
        check_sparse(expression, signals)
        found = expression.evaluate(signals)
    if isinstance(found, np.ndarray) and found.ndim:
        raise ExpressionError(Problem("", f"'{value}' varies over time", "draw it as an entry of y"))
    return float(found)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
