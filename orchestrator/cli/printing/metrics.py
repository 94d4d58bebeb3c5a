"""Metrics as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...evaluation import COMFORT_TITLE, Metric, MetricChange, comfort_levels
from .console import say
from .tables import SIDE_BY_SIDE, fits, number, prefixed, show_reasons, table


def show_metrics(out: Console, metrics: Sequence[Metric], comparisons: Sequence[MetricChange] = ()) -> None:
    """Single values one a row; values per index side by side, where they fit and nothing is to be compared."""
    wide = [m for m in metrics if not comparisons and not m.problem and 1 < len(m.values) <= SIDE_BY_SIDE]
    beside = _wide_table(wide) if wide else None
    if beside and not fits(out, beside):
        wide, beside = [], None
    long = [m for m in metrics if m not in wide]
    if long:
        out.print(_long_table(long, comparisons))
    if beside:
        out.print(beside)
    if any(m.comfort for m in metrics):
        say(out, f"In brackets, levels: {COMFORT_TITLE}.", "dim")
    show_reasons(
        out, "no value", ((m.name, m.problem.removeprefix(f"'{m.expression}': ")) for m in metrics if m.problem)
    )


def _number(value: float, metric: Metric, scale: float) -> str:
    if metric.comfort and math.isfinite(value):
        return f"{value:.3f} ({', '.join(map(str, comfort_levels(value)))})"
    return number(value, metric.unit, scale, truth=metric.truth)


def _long_table(metrics: Sequence[Metric], comparisons: Sequence[MetricChange]) -> Table:
    """One row a value; with comparisons, the value at half the step and the difference beside it."""
    more = ("at half the step", "difference") if comparisons else ()
    made = table("Metrics", ("metric", "value", *more, "unit"), right=("value", *more), fold=("metric",))
    halved = {(c.name, c.index): c for c in comparisons}
    for metric in metrics:
        scale, unit = prefixed(metric.unit, metric.values.values())
        for index, value in metric.values.items():
            name = metric.name if index is None else f"{metric.name}[{index}]"
            row = [name, _number(value, metric, scale)]
            if comparisons:
                other = halved.get((metric.name, index))
                halves = other and [_number(other.other, metric, scale), f"{other.difference / scale:+.3g}"]
                row += halves or ["", ""]
            made.add_row(*map(Text, [*row, unit]))
    return made


def _wide_table(metrics: Sequence[Metric]) -> Table:
    indices = sorted({index for m in metrics for index in m.values if index is not None})
    names = [f"[{index}]" for index in indices]
    made = table("Metrics by index", ("metric", *names, "unit"), right=names)
    for metric in metrics:
        scale, unit = prefixed(metric.unit, metric.values.values())
        cells = [_number(metric.values[i], metric, scale) if i in metric.values else "" for i in indices]
        made.add_row(*map(Text, [metric.name, *cells, unit]))
    return made
