"""What the tables have in common: look, verdicts, numbers, and the reasons that stand below them."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from .console import say

_COLOURS = {
    "pass": "green",
    "fail": "bold red",
    "inconclusive": "yellow",
    "reproduced": "green",
    "missed": "bold red",
    "departs": "yellow",
    "departs no more": "bold red",
    "not judged": "dim",
    "warning": "yellow",
    "skipped": "dim",
}
_PREFIXES = ((1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"))
_PREFIXED = {**dict.fromkeys(("J", "N", "W", "Pa", "V", "A", "Hz"), 1e3), "m": 1e6}
"""The units that take a prefix, each with the size from which on it does."""
PLAIN: Any = {"box": None, "pad_edge": False, "padding": (0, 2, 0, 0), "header_style": "underline"}
_GAP, _NARROWEST = 2, 12
"""Between columns; and what a column that may take several lines has at least, before rows are shown by themselves."""
SIDE_BY_SIDE = 8
"""How many columns, or names in a line, a reader still takes in."""


class _Foldable(Table):
    """A table that is shown row by row where it has no room: a column of two letters is none, nor half a number."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        widths = [
            min(_NARROWEST if column.overflow == "fold" else sys.maxsize, max(cell_len(str(cell)) for cell in cells))
            for column in self.columns
            if (cells := [column.header, *column.cells])
        ]
        if sum(widths) + _GAP * (len(widths) - 1) <= options.max_width:
            yield from super().__rich_console__(console, options)
            return
        if self.title:
            yield Text.assemble(self.title, style="bold")
        for row in zip(*(column.cells for column in self.columns), strict=True):
            for k, (column, cell) in enumerate(zip(self.columns, row, strict=True)):
                head = f"  {column.header}: " if str(column.header) else "  "
                if str(cell):
                    yield Text.assemble(head if k else "", cell)


def table(title: str, columns: Sequence[str], *, right: Sequence[str] = (), fold: Sequence[str] = ()) -> Table:
    """An empty table.

    Args:
        title: above it; may be empty.
        columns: their heads.
        right: which of them are aligned to the right.
        fold: which of them may take several lines a row.
    """
    made = _Foldable(title=Text(f"\n{title}", style="bold") if title else None, title_justify="left", **PLAIN)
    for head in columns:
        wraps = head in fold
        made.add_column(
            Text(head),
            justify="right" if head in right else "left",
            overflow="fold" if wraps else "ellipsis",
            no_wrap=not wraps,
        )
    return made


def fits(out: Console, made: Table) -> bool:
    """Whether a table can be shown without folding anything."""
    return Measurement.get(out, out.options.update(width=sys.maxsize), made).maximum <= out.width


def verdict(word: str) -> Text:
    """A verdict in its colour."""
    return Text(word, style=_COLOURS.get(word, ""))


def prefixed(unit: str, values: Iterable[float]) -> tuple[float, str]:
    """What to divide by so that the largest of some values needs no exponent, and the unit that goes with it."""
    smallest = _PREFIXED.get(unit, math.inf)
    size = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if size < smallest:
        return 1.0, unit
    return next((scale, prefix + unit) for scale, prefix in _PREFIXES if size >= scale)


def number(value: float, unit: str, scale: float = 1.0, *, truth: bool = False) -> str:
    """A metric's value, divided by `scale`, or its `truth`; no time is ``never``, and no value a dash."""
    if math.isnan(value):
        return "-"
    if truth:
        return "true" if value else "false"
    return "never" if math.isinf(value) and unit == "s" else f"{value / scale:.6g}"


def show_reasons(out: Console, word: str, reasons: Iterable[tuple[str, str]]) -> None:
    """Under a table: why some of its rows have no value or verdict, each reason once."""
    by_reason: dict[str, list[str]] = {}
    for name, reason in reasons:
        by_reason.setdefault(reason, []).append(name)
    for reason, names in by_reason.items():
        shown = ", ".join(dict.fromkeys(names)) if len(names) <= SIDE_BY_SIDE else f"{len(names)} rows"
        say(out, f"{word}: {reason} ({shown})", "yellow" if word == "no value" else "dim")
