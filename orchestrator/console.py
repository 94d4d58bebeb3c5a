"""What the command line prints: tables of metrics, verdicts and published values, interfaces, and progress."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from .interface import Interface
from .metrics import COMFORT_TITLE, Comparison, Metric
from .published import PublishedRow
from .requirements import Verdict
from .run import Progress as OnProgress
from .run import Run

_COLOURS = {
    "pass": "green",
    "fail": "red",
    "inconclusive": "yellow",
    "reproduced": "green",
    "missed": "red",
    "not judged": "dim",
}
_PIPE_WIDTH = 160
_SIDE_BY_SIDE = 8


def console(stderr: bool = False) -> Console:
    """A console as wide as the terminal; wide enough for the tables where the output is a file or a pipe."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, width=None if stream.isatty() else _PIPE_WIDTH, highlight=False, soft_wrap=False)


@contextmanager
def progress(title: str, quiet: bool) -> Iterator[OnProgress | None]:
    """A progress bar on a terminal, one line per 10 % otherwise, nothing when quiet."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[reached]}"))
        with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=console(stderr=True)) as bar:
            task = bar.add_task(title, total=None, reached="")

            def show(time: float, stop: float) -> None:
                bar.update(task, completed=time, total=stop, reached=f"{time:.6g} of {stop:.6g} s")

            yield show
    else:
        yield _lines(title)


def _lines(title: str) -> OnProgress:
    told = 0

    def show(time: float, stop: float) -> None:
        nonlocal told
        while told < int(10.0 * time / stop + 1e-9):
            told += 1
            print(f"{title}: {10 * told} % of {stop:g} s", file=sys.stderr, flush=True)

    return show


def show_run(out: Console, outcome: Run, comparisons: Sequence[Comparison] = ()) -> None:
    """The end of a run: metrics, requirements, published values."""
    for table in metrics_tables(outcome.metrics, comparisons):
        out.print(table)
    if outcome.requirements:
        out.print(requirements_table(outcome.requirements))
        out.print("Requirements are judged at the recorded points.", style="dim")
    if outcome.published:
        out.print(published_table(outcome.published))


def metrics_tables(metrics: Sequence[Metric], comparisons: Sequence[Comparison] = ()) -> Iterator[Table]:
    """Single values one a row; values per index side by side, where they fit and nothing is to be compared."""
    wide = [m for m in metrics if not comparisons and 1 < len(m.values) <= _SIDE_BY_SIDE]
    long = [m for m in metrics if m not in wide]
    if long:
        yield _captioned(_long_table(long, comparisons), long)
    if wide:
        yield _captioned(_wide_table(wide), wide)


def _captioned(table: Table, metrics: Sequence[Metric]) -> Table:
    if any(m.comfort for m in metrics):
        table.caption, table.caption_justify = f"Levels: {COMFORT_TITLE}.", "left"
    return table


def _long_table(metrics: Sequence[Metric], comparisons: Sequence[Comparison]) -> Table:
    """One row a value; with comparisons, the value at half the step and the difference beside it."""
    table = Table(title="Metrics", title_justify="left", title_style="bold")
    table.add_column("metric")
    table.add_column("value", justify="right")
    halved = {(c.name, c.index): c for c in comparisons}
    if comparisons:
        table.add_column("at half the step", justify="right")
        table.add_column("difference", justify="right")
    for metric in metrics:
        for index in metric.values:
            name = metric.name if index is None else f"{metric.name}[{index}]"
            row = [name, metric.text(index)]
            if comparisons:
                other = halved.get((metric.name, index))
                row += ["", ""] if other is None else [f"{other.other:.6g}", f"{other.difference:+.3g}"]
            table.add_row(*map(Text, row))
        if metric.problem:
            table.add_row("", Text(metric.problem, style="yellow"))
    return table


def _wide_table(metrics: Sequence[Metric]) -> Table:
    indices = sorted({index for m in metrics for index in m.values if index is not None})
    table = Table(title="Metrics by index", title_justify="left", title_style="bold")
    table.add_column("metric")
    for index in indices:
        table.add_column(Text(f"[{index}]"), justify="right", header_style="bold")
    for metric in metrics:
        table.add_row(*map(Text, [metric.name, *(metric.text(i) if i in metric.values else "" for i in indices)]))
    return table


def requirements_table(verdicts: Sequence[Verdict]) -> Table:
    """One row a requirement: verdict, signed margin, worst time."""
    table = Table(title="Requirements", title_justify="left", title_style="bold")
    for column in ("requirement", "verdict", "margin", "worst at"):
        table.add_column(column, justify="right" if column in ("margin", "worst at") else "left")
    table.add_column("text", overflow="fold")
    for v in verdicts:
        place = "" if v.time is None else f"{v.time:g} s"
        place += "" if v.index is None else f", i = {v.index}"
        margin = "" if v.margin is None else f"{v.margin:.4g}"
        text = v.text + (f" ({v.reason})" if v.reason else "")
        table.add_row(Text(v.name), _verdict(v.verdict), margin, place, Text(text))
    return table


def published_table(rows: Sequence[PublishedRow], commands: Sequence[str] = ()) -> Table:
    """Measured beside published; ``commands`` adds a column that says how to see it."""
    table = Table(title="Published values", title_justify="left", title_style="bold")
    table.add_column("claim", overflow="fold")
    for column in ("published", "measured", "tolerance"):
        table.add_column(column, justify="right")
    table.add_column("verdict")
    table.add_column("status")
    table.add_column("command" if commands else "where", overflow="fold")
    for k, row in enumerate(rows):
        unit = f" {row.unit}" if row.unit else ""
        verdict = _verdict(row.verdict)
        if row.verdict == "not judged" and row.reason:
            verdict.append(f" ({row.reason})")
        table.add_row(
            Text(f"{row.metric}: {row.claim}" if row.claim else row.metric),
            "in words" if row.published is None else f"{row.published:g}{unit}",
            f"{row.measured:.6g}{unit}",
            "" if row.tolerance is None else f"{row.tolerance:g}",
            verdict,
            row.status,
            Text(commands[k] if commands else row.where),
        )
    return table


def _verdict(word: str) -> Text:
    return Text(word, style=_COLOURS.get(word, ""))


def interface_table(interface: Interface) -> Table:
    """Every variable of an FMU: causality, unit, start, what an output depends on directly."""
    table = Table(title="Variables", title_justify="left", title_style="bold")
    for column in ("name", "type", "causality", "unit", "start"):
        table.add_column(column, justify="right" if column == "start" else "left")
    table.add_column("depends directly on", overflow="fold")
    table.add_column("description", overflow="fold")
    inputs = {v.name for v in interface.of("input")}
    for v in interface.variables.values():
        causality = v.causality + (f", {v.variability}" if v.causality == "parameter" else "")
        if v.name in interface.optional_inputs:
            causality += ", optional"
        depends = ""
        if v.causality == "output":
            depends = "not said" if v.dependencies is None else ", ".join(sorted(v.dependencies & inputs)) or "no input"
        start = "" if v.start is None else str(v.start)
        table.add_row(*map(Text, (v.name, v.type, causality, v.unit or "", start, depends, v.description)))
    return table
