"""A comparison as it is printed: a column for each variant, the best value of a row in green."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...comparison import Comparison
from ..lines import and_figures
from .console import open_console, say, show_notes
from .findings import show_findings
from .tables import fits, number, prefixed, show_reasons, table, verdict

_BEST = "bold green"


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
