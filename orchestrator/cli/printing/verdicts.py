"""Verdicts: requirements, published values, and both in a line or two."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...evaluation import PublishedRow, Verdict
from .console import say
from .tables import PLAIN, show_reasons, table, verdict

_SMALLEST_CLAIM = 16


def show_requirements(out: Console, verdicts: Sequence[Verdict]) -> None:
    """One row a requirement: verdict, signed margin, worst time."""
    columns = ("requirement", "verdict", "margin", "worst at", "text")
    made = table("Requirements", columns, right=("margin", "worst at"), fold=("requirement", "text"))
    for v in verdicts:
        place = "" if v.time is None else f"{v.time:g} s"
        place += "" if v.index is None else f", i = {v.index}"
        margin = "" if v.margin is None else f"{v.margin:.4g}"
        made.add_row(Text(v.name), verdict(v.verdict), margin, place, Text(" ".join(v.text.split())))
    out.print(made)
    show_reasons(out, "because", ((v.name, v.reason) for v in verdicts if v.reason))
    say(out, "Requirements are judged at the recorded points.", "dim")


def show_published(out: Console, groups: Mapping[str, Sequence[PublishedRow]]) -> None:
    """Measured beside published, in groups with a line above each: where the values stand, or how to see them."""
    rows = [row for group in groups.values() for row in group]
    heads = ["claim", "published", "measured", "tolerance", "unit", "verdict"]
    lines = [heads, *map(_published_cells, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(heads))]
    widths[0] = max(min(widths[0], out.width - sum(widths[1:]) - 2 * len(heads)), _SMALLEST_CLAIM)
    say(out, "\nPublished values", "bold")
    out.print(_published_table(heads, widths, []))
    for title, group in groups.items():
        say(out, title, "dim italic")
        out.print(_published_table(heads, widths, group))
    for word in ("not judged", "missed"):
        show_reasons(out, word, ((row.metric, row.reason) for row in rows if row.verdict == word and row.reason))


def _published_table(heads: Sequence[str], widths: Sequence[int], rows: Sequence[PublishedRow]) -> Table:
    made = Table(show_header=not rows, **PLAIN)
    for head, width in zip(heads, widths, strict=True):
        numeric = head in ("published", "measured", "tolerance")
        made.add_column(head, justify="right" if numeric else "left", overflow="fold", width=width)
    for row in rows:
        *texts, word = _published_cells(row)
        made.add_row(*map(Text, texts), verdict(word))
    return made


def _published_cells(row: PublishedRow) -> list[str]:
    return [
        f"{row.metric}: {row.claim}" if row.claim else row.metric,
        "in words" if row.published is None else f"{row.published:.8g}",
        "-" if math.isnan(row.measured) else f"{row.measured:.6g}",
        "" if row.tolerance is None else f"{row.tolerance:g}",
        row.unit,
        row.verdict,
    ]


def by_source(rows: Sequence[PublishedRow]) -> dict[str, list[PublishedRow]]:
    """Published values by what kind they are and where they stand."""
    groups: dict[str, list[PublishedRow]] = {}
    for row in rows:
        groups.setdefault(f"{row.status}: {row.where}" if row.where else row.status, []).append(row)
    return groups


def summary(requirements: Sequence[Verdict], published: Sequence[PublishedRow]) -> list[tuple[str, bool]]:
    """The verdicts in a line or two, and whether each line is bad news: ``2 of 3 requirements pass; fail: spacing``."""
    lines = []
    if requirements:
        done = f"{sum(v.verdict == 'pass' for v in requirements)} of {len(requirements)} requirements pass"
        lines.append(_counted(done, [(v.name, v.verdict) for v in requirements], "fail"))
    if published:
        done = f"{sum(p.verdict == 'reproduced' for p in published)} of {len(published)} published values reproduced"
        lines.append(_counted(done, [(p.metric, p.verdict) for p in published], "missed"))
    return lines


def _counted(text: str, rows: Sequence[tuple[str, str]], bad: str) -> tuple[str, bool]:
    named = [name for name, word in rows if word == bad]
    open_ = Counter(word for _, word in rows if word in ("inconclusive", "not judged"))
    text += f"; {bad}: {', '.join(named)}" if named else ""
    return text + "".join(f"; {count} {word}" for word, count in open_.items()), bool(named)
