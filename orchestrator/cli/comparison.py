"""A comparison as it is printed: a column for each variant, the best value of a row in green."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from ..comparison import Comparison, Row
from . import console

_PLAIN: Any = {"box": None, "pad_edge": False, "padding": (0, 2, 0, 0), "header_style": "underline"}
_BEST = "bold green"
_VERDICT = {"pass": "green", "fail": "bold red", "inconclusive": "yellow"}


def show_comparison(comparison: Comparison, quiet: bool) -> None:
    """The tables, then who won how often, and what failed; when quiet, only what failed, on stderr."""
    out = console.console(stderr=quiet)
    if not quiet:
        _show_tables(out, comparison)
    for variant in comparison.variants:
        if variant.status != "completed":
            reason = f": {variant.error}" if variant.error else ""
            console.say(out, f"{variant.name}: {variant.status}{reason}", "bold red")
    for name, verdicts in comparison.verdicts().items():
        failed = [v for v, verdict in zip(comparison.names, verdicts, strict=True) if verdict == "fail"]
        if failed:
            console.say(out, f"requirement {name} fails: {', '.join(failed)}", "bold red")
    if not quiet and comparison.directory is not None:
        count = len(comparison.figures)
        figures = f", {count} figure{'s' * (count > 1)}" if count else ""
        folders = ", ".join(f"{v.directory.name}/" for v in comparison.variants if v.run and v.directory)
        console.say(out, f"Files in {comparison.directory}: compare.json, compare.csv{figures}; {folders}", whole=True)


def _show_tables(out: Console, comparison: Comparison) -> None:
    notes = [note for v in comparison.variants if v.run for note in v.run.checked.notes]
    for note in dict.fromkeys(console.folded(notes)):
        console.say(out, f"note: {note}", "yellow")
    heads = comparison.names
    table = _metrics(comparison, heads)
    if Measurement.get(out, out.options.update(width=sys.maxsize), table).maximum > out.width:
        heads = [f"({k})" for k in range(1, len(heads) + 1)]
        for head, name in zip(heads, comparison.names, strict=True):
            console.say(out, f"{head} {name}")
        table = _metrics(comparison, heads)
    if comparison.rows:
        out.print(table)
    if comparison.verdicts():
        out.print(_verdicts(comparison, heads))
    out.print()
    decided = sum(row.better != "none" for row in comparison.rows)
    if len(comparison.variants) > 1 and decided:
        won = ", ".join(f"{name} {count}" for name, count in zip(comparison.names, comparison.wins(), strict=True))
        console.say(out, f"best alone, of {decided} rows in which less or more is better: {won}")


def _table(title: str, first: str, heads: Sequence[str], *more: str) -> Table:
    table = Table(title=f"\n{title}", title_justify="left", title_style="bold", **_PLAIN)
    table.add_column(Text(first), overflow="fold")
    for head in heads:
        table.add_column(Text(head), justify="right", no_wrap=True)
    for head in more:
        table.add_column(Text(head), no_wrap=True)
    return table


def _metrics(comparison: Comparison, heads: Sequence[str]) -> Table:
    table = _table("Metrics", "metric", heads, "unit", "better", "winner")
    for row in comparison.rows:
        cells = [Text(_number(x, row), style=_BEST if k in row.winners else "") for k, x in enumerate(row.values)]
        direction = "" if row.better == "none" else row.better
        best = ", ".join(heads[k] for k in row.winners)
        table.add_row(Text(row.name), *cells, Text(row.unit), direction, Text(best, style="green"))
    return table


def _verdicts(comparison: Comparison, heads: Sequence[str]) -> Table:
    table = _table("Requirements", "requirement", heads)
    for name, verdicts in comparison.verdicts().items():
        table.add_row(Text(name), *(Text(verdict, style=_VERDICT.get(verdict, "")) for verdict in verdicts))
    return table


def _number(value: float, row: Row) -> str:
    if math.isnan(value):
        return "-"
    if math.isinf(value) and row.unit == "s":
        return "never"
    return f"{value:.6g}"
