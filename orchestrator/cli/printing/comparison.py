"""Comparisons as they are printed.

Of variants with a column for each, the best value of a row in green; of recorded results those signals that leave the
tubes around the reference.
"""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...comparison import Comparison, RecordedComparison
from ..lines import and_figures
from .console import open_console, say, show_notes
from .findings import show_findings
from .tables import fits, number, prefixed, show_reasons, table, verdict

_BEST = "bold green"
_MOST = 20
"""Signals that are shown of those that leave their tubes."""
_LISTED = 6


def show_comparison(comparison: Comparison, quiet: bool) -> None:
    """What was found, the tables, who won how often, and what failed; when quiet, else only what failed, on stderr."""
    out = open_console(stderr=quiet)
    for variant in comparison.variants:
        show_findings(variant.run.findings if variant.run else (), variant.name)
        if variant.spoiled:
            say(open_console(), f"{variant.name}: wins nothing, because of what was found", "bold red")
    if not quiet:
        _show_tables(out, comparison)
    for variant in comparison.variants:
        if variant.status != "completed":
            reason = f": {variant.error}" if variant.error else ""
            say(out, f"{variant.name}: {variant.status}{reason}", "bold red")
    for name, verdicts in comparison.verdicts().items():
        failed = [v for v, word in zip(comparison.names, verdicts, strict=True) if word == "fail"]
        if failed:
            say(out, f"requirement {name} fails: {', '.join(failed)}", "bold red")
    if not quiet and comparison.directory is not None:
        folders = ", ".join(f"{v.directory.name}/" for v in comparison.variants if v.run and v.directory)
        files = f"compare.json, compare.csv{and_figures(len(comparison.figures))}"
        say(out, f"Files in {comparison.directory}: {files}; {folders}", whole=True)


def _show_tables(out: Console, comparison: Comparison) -> None:
    notes = [note for v in comparison.variants if v.run for note in v.run.checked.notes]
    show_notes(out, notes)
    heads = comparison.names
    metrics = _metrics(comparison, heads)
    if not fits(out, metrics):
        heads = [f"({k})" for k in range(1, len(heads) + 1)]
        for head, name in zip(heads, comparison.names, strict=True):
            say(out, f"{head} {name}")
        metrics = _metrics(comparison, heads)
    if comparison.rows:
        out.print(metrics)
        show_reasons(out, "no value", ((row.name, row.problem) for row in comparison.rows if row.problem))
    if comparison.verdicts():
        out.print(_verdicts(comparison, heads))
    out.print()
    decided = sum(row.better != "none" for row in comparison.rows)
    if len(comparison.variants) > 1 and decided:
        won = ", ".join(f"{name} {count}" for name, count in zip(comparison.names, comparison.wins(), strict=True))
        say(out, f"best alone, of {decided} rows in which less or more is better: {won}")


def _metrics(comparison: Comparison, heads: Sequence[str]) -> Table:
    made = table("Metrics", ("metric", *heads, "unit", "better", "winner"), right=heads, fold=("metric",))
    for row in comparison.rows:
        scale, unit = prefixed(row.unit, row.values)
        texts = [number(value, row.unit, scale, truth=row.truth) for value in row.values]
        cells = [Text(text, style=_BEST if k in row.winners else "") for k, text in enumerate(texts)]
        direction = "" if row.better == "none" else row.better
        best = ", ".join(heads[k] for k in row.winners)
        made.add_row(Text(row.name), *cells, Text(unit), direction, Text(best, style="green"))
    return made


def _verdicts(comparison: Comparison, heads: Sequence[str]) -> Table:
    made = table("Requirements", ("requirement", *heads), right=heads, fold=("requirement",))
    for name, verdicts in comparison.verdicts().items():
        made.add_row(Text(name), *map(verdict, verdicts))
    return made


def show_recorded(comparison: RecordedComparison, quiet: bool) -> None:
    """A table and a line for each of the results; when quiet, the lines of those that depart alone."""
    out = open_console(stderr=quiet)
    for one in comparison.tested:
        outside = [row for row in one.deviations if not row.inside]
        if not quiet:
            show_notes(out, one.notes)
            _tell(out, f"{comparison.reference} alone has", one.lacking)
            _tell(out, f"{one.name} alone has", one.more)
            heads = ("furthest away", "may be", "at s", "points outside")
            made = table(
                f"{one.name} against {comparison.reference}",
                ("signal", *heads, "unit", ""),
                right=heads,
                fold=("signal",),
            )
            for row in outside[:_MOST] or one.deviations[:1]:
                told = row.departure
                numbers = (f"{told.distance:.4g}", f"{row.tube.height:.4g}", f"{told.at:.6g}")
                counted = f"{told.outside} of {told.points}"
                made.add_row(row.signal, *numbers, counted, row.unit, verdict("pass" if row.inside else "fail"))
            out.print(made)
            out.print()
        if one.same and quiet:
            continue
        inside = f"{len(one.deviations) - len(outside)} of {len(one.deviations)} signals stay in their tubes"
        say(out, f"{one.name}: {inside}", "green" if one.same else "bold red")
        if one.short:
            say(out, f"{one.name}: {one.short}", "bold red")
    if not quiet and comparison.directory is not None:
        files = f"compare.json, compare.csv{and_figures(len(comparison.figures))}"
        say(out, f"Files in {comparison.directory}: {files}", whole=True)


def _tell(out: Console, head: str, names: Sequence[str]) -> None:
    if names:
        more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
        say(out, f"{head} {', '.join(names[:_LISTED])}{more}", "dim")
