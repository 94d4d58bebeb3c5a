"""The curves of a panel, out of recorded signals, with their labels and those of the axes.

A panel draws expressions over time, over another expression, or over a plain variable (a function plot).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError
from ..evaluation import FUNCTIONS, Expression, Reference, Signals, parse, unit_of, valued
from ..problems import Problem
from .outline import MOST_POINTS, outlined
from .panels import texts_of
from .sparse import check_sparse

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Curve:
    """One line.

    Attributes:
        x, y: of shape (T,).
        label: what the legend says of it. family: what it says where it has no room for each line of an entry.
        entry: which entry of `y` it comes from. member: which of its lines it is. alone: the only one.
        unit: of y.
        thing: whom it is of, whatever it shows: the numbers of the train, of a gap those of the train behind it; of a
            line that is alone its label.
        signals: what it is computed of. plain: whether it is the one of them as it stands.
    """

    x: Array
    y: Array
    label: str
    entry: int
    member: int
    alone: bool
    unit: str
    family: str = ""
    thing: str | tuple[int, ...] = ""
    signals: frozenset[str] = frozenset()
    plain: bool = False


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
    for drawn_over in [parse(x, FUNCTIONS)] if isinstance(x, str) else []:
        check_sparse(drawn_over, signals)
    check_sparse(expression, signals)
    names = [*signals.names(), *signals.parameters]
    constants = _constants(x)
    drawn: list[tuple[Array, Array, str, str, frozenset[str]]] = []
    for index in expression.instances(names):
        if x is None and signals.points > MOST_POINTS:
            across, y = outlined(expression, signals, index)
        else:
            y = np.atleast_2d(np.asarray(expression.evaluate(signals, index, **constants), dtype=np.float64))
            across = _across(x, signals, index, constants)
            _check_rows(x, across, y, text)
            if isinstance(x, Mapping):
                _check_swept(x, y, expression, signals, index)
            y = np.broadcast_to(y, (y.shape[0], across.shape[-1]))
            across = np.broadcast_to(across, y.shape)
        resolved = expression.resolve(names, index)
        recorded = [name for each in resolved for name in each if name in signals.names()]
        beside = parse(x, FUNCTIONS).resolve(names, index) if isinstance(x, str) else []
        recorded += [name for each in beside for name in each if name in signals.names()]
        blank = bool(np.isnan(y).any() or np.isnan(across).any()) and any(
            valued(signals[name]) is not None for name in recorded
        )
        unit = unit_of(expression, signals, index)
        drawn += [
            (
                *_filled(across[row], y[row], blank=blank),
                _label(expression, resolved, index, row, len(y)),
                unit,
                _own(resolved, row, len(y)),
            )
            for row in range(len(y))
        ]
    alone, family = len(drawn) == 1, re.sub(r"\W*\{i\}", "", label) or _short(text)
    things = _things([own for _, _, own, *_ in drawn])
    plain = isinstance(expression.tree, Reference)
    curves = []
    for member, (abscissa, y, own, unit, of) in enumerate(drawn):
        named = _named(label, own, alone, member)
        thing = named if alone else things[member]
        curves.append(Curve(abscissa, y, named, entry, member, alone, unit, family, thing, of, plain))
    return curves


def _filled(x: Array, y: Array, *, blank: bool) -> tuple[Array, Array]:
    """A line through the points that there are, where some are blank because a signal is recorded less often."""
    there = ~(np.isnan(x) | np.isnan(y)) | (not blank)
    return x[there], y[there]


def _own(resolved: list[list[str]], row: int, rows: int) -> frozenset[str]:
    """The signals of one of several rows: of a slice its own, of everything else all."""
    return frozenset(
        name for names in resolved for name in ([names[row]] if len(names) == rows and rows > 1 else names)
    )


def _things(labels: Sequence[str]) -> list[tuple[int, ...]]:
    """The numbers in the lines' own labels, without those that all of them share.

    Of a range of numbers the last counts: a gap belongs to the train behind it.
    """
    found = [
        tuple(int(number.split("–")[-1].split(",")[-1]) for number in re.findall(r"\d+(?:[–,]\d+)*", label))
        for label in labels
    ]
    if len(set(map(len, found))) != 1:
        return [(k + 1,) for k in range(len(found))]
    telling = [k for k, numbers in enumerate(zip(*found, strict=True)) if len(set(numbers)) > 1]
    things = [tuple(numbers[k] for k in telling) for numbers in found]
    return things if len(set(things)) == len(things) else [(k + 1,) for k in range(len(found))]


def _constants(x: Any, more: int = 0) -> dict[str, Any]:
    """The variable of a function and its values, so many more than are asked for."""
    return {x["name"]: np.linspace(x["from"], x["to"], x.get("points", 400) + more)} if isinstance(x, Mapping) else {}


def _check_swept(x: Mapping[str, Any], y: Array, expression: Expression, signals: Signals, index: int | None) -> None:
    """A signal has its values at points in time, and may by chance have as many as a function is drawn at."""
    points = x.get("points", 400)
    if y.shape[-1] == signals.points == points:
        y = np.atleast_2d(expression.evaluate(signals, index, **_constants(x, more=1)))
        points += 1
    if y.shape[-1] not in (1, points):
        message = f"'{expression.text}' runs over time, but is drawn over {x['name']}"
        remedy = "draw a function of it, of parameters and of single numbers such as max(...) of a signal"
        raise ExpressionError(Problem("", message, remedy))


def _across(x: Any, signals: Signals, index: int | None, constants: Mapping[str, Any]) -> Array:
    if isinstance(x, Mapping):
        return np.asarray(constants[x["name"]])
    if x is None:
        return signals.time
    values = np.asarray(parse(x, FUNCTIONS).evaluate(signals, index), dtype=np.float64)
    if not values.ndim:
        raise ExpressionError(Problem("", f"x = '{x}' is a single number", "draw over a signal"))
    return values


def _check_rows(x: Any, across: Array, y: Array, text: str) -> None:
    if across.ndim > 1 and len(across) not in (1, len(y)):
        what = f"x = '{x}' has {len(across)} rows and y = '{text}' has {len(y)}"
        raise ExpressionError(Problem("", what, "draw over one signal, or over as many"))


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
    numbers = [re.findall(r"\[([-\d, ]+)\]", name) for name in families if name.startswith(f"{array}[")]
    first = sorted({tuple(map(int, found[0].split(","))) for found in numbers})
    own = "–".join(",".join(map(str, index)) for index in first)
    return _verbatim(" ".join([array.replace(".", " "), own, *numbers[0][1:]]))


def _short(text: str) -> str:
    """`gust acceleration` for a plain signal, the expression otherwise."""
    plain = re.fullmatch(r"[\w.\[\]:,-]+", text)
    if not plain:
        return _verbatim(text)
    return text.removesuffix(".value").replace("[:]", "").replace("[i]", "").replace(".", " ")


def _verbatim(text: str) -> str:
    """A name as it is: between dollars, matplotlib would set mathematics."""
    return text.replace("$", r"\$")


def _variable(text: str) -> str:
    """`speed` for a plain signal, nothing for a formula."""
    tree = parse(text, FUNCTIONS).tree
    if not isinstance(tree, Reference):
        return ""
    return _verbatim(next(name for name, _ in reversed(tree.parts) if name).replace("_", " "))


def bracketed(unit: str) -> str:
    """A unit as an axis shows it: m/s2 as [m/s²]."""
    return f"[{re.sub(r'(?<=[a-z])([23])', lambda match: '²³'[int(match[0]) - 2], unit)}]" if unit else ""


def y_label_of(panel: Mapping[str, Any], curves: Sequence[Curve]) -> str:
    """The variable all entries share, and the unit they share."""
    units = {curve.unit for curve in curves}
    variables = {_variable(text) for text in texts_of(panel["y"])} - {"value"}
    shared = [
        next(iter(variables)) if len(variables) == 1 else "",
        bracketed(next(iter(units))) if len(units) == 1 else "",
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
    return f"{_variable(x) or x} {bracketed(unit)}".rstrip()
