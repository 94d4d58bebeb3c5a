"""What the command line prints: tables of metrics, verdicts and published values, interfaces, and progress."""

from __future__ import annotations

import math
import os
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Literal

from rich.console import Console
from rich.measure import Measurement
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ..evaluation import COMFORT_TITLE, Metric, MetricChange, PublishedRow, Verdict, comfort_levels, compare_metrics
from ..fmi import Interface, Variable
from ..problems import Problem
from ..run import CHECKPOINT_FILE as CHECKPOINT
from ..run import Progress as OnProgress
from ..run import Run

_COLOURS = {
    "pass": "green",
    "fail": "bold red",
    "inconclusive": "yellow",
    "reproduced": "green",
    "missed": "bold red",
    "not judged": "dim",
}
_PLAIN: Any = {"box": None, "pad_edge": False, "padding": (0, 2, 0, 0), "header_style": "underline"}
_PIPE_WIDTH = 160
_SIDE_BY_SIDE = 8
_SMALLEST_CLAIM = 16


def console(stderr: bool = False) -> Console:
    """A console as wide as the terminal, or as ``COLUMNS`` says; wide enough for tables in a file or a pipe."""
    stream = sys.stderr if stderr else sys.stdout
    follow = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return Console(stderr=stderr, width=None if follow else _PIPE_WIDTH, highlight=False)


def say(out: Console, text: str, style: str = "", *, whole: bool = False) -> None:
    """Print a line; it is folded on a terminal only, and not even there if it has to be copied ``whole``."""
    out.print(Text(text, style=style), soft_wrap=whole or not out.is_terminal)


# -------------------------------------------------------------------- progress


@contextmanager
def progress(title: str, quiet: bool, start: float = 0.0, reached: float | None = None) -> Iterator[OnProgress | None]:
    """A progress bar on a terminal, one line per 10 % otherwise, nothing when quiet.

    Args:
        title: what is running.
        quiet: whether to show nothing.
        start: where the run begins, in s.
        reached: how far it has got already, in s; nothing is said of that.
    """
    if quiet:
        yield None
    elif sys.stderr.isatty():
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[reached]}"))
        out = console(stderr=True)
        with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=out, transient=True) as bar:
            task = bar.add_task(title, total=None, reached="")

            def show(time: float, stop: float) -> None:
                bar.update(task, completed=time - start, total=stop - start, reached=f"{time:.6g} of {stop:.6g} s")

            yield show
    else:
        yield _lines(title, start, start if reached is None else reached)


def _lines(title: str, start: float, reached: float) -> OnProgress:
    told = 0

    def show(time: float, stop: float) -> None:
        nonlocal told
        done, before = (int(10.0 * (t - start) / (stop - start) + 1e-9) for t in (time, reached))
        told = max(told, before)
        while told < done:
            told += 1
            print(f"{title}: {10 * told} % of {stop - start:g} s", file=sys.stderr, flush=True)

    return show


# -------------------------------------------------------------------- problems


def folded(problems: Iterable[Problem | str]) -> list[str]:
    """Problems that differ in an instance's index only, told once: four trains make one mistake, not four.

    A problem knows its kind; of notes, which are sentences, every number in brackets counts as an index.
    """
    alike: dict[str, list[Problem | str]] = {}
    for problem in problems:
        kind = problem.kind if isinstance(problem, Problem) else re.sub(r"(?<=\w)\[\d+\]", "[i]", problem)
        alike.setdefault(kind, []).append(problem)
    return [
        str(first) + (f" (and {len(rest)} more like it, for other indices)" if rest else "")
        for first, *rest in alike.values()
    ]


def _reasons(out: Console, word: str, reasons: Iterable[tuple[str, str]]) -> None:
    """Under a table: why some of its rows have no value or verdict, each reason once."""
    by_reason: dict[str, list[str]] = {}
    for name, reason in reasons:
        by_reason.setdefault(reason, []).append(name)
    for reason, names in by_reason.items():
        shown = ", ".join(dict.fromkeys(names)) if len(names) <= _SIDE_BY_SIDE else f"{len(names)} rows"
        say(out, f"{word}: {reason} ({shown})", "yellow" if word == "no value" else "dim")


def _table(title: str, *columns: str, right: Sequence[str] = (), fold: Sequence[str] = ()) -> Table:
    table = Table(title=f"\n{title}", title_justify="left", title_style="bold", **_PLAIN)
    for column in columns:
        justify: Literal["left", "right"] = "right" if column in right else "left"
        table.add_column(column, justify=justify, overflow="fold", no_wrap=column not in fold)
    return table


# -------------------------------------------------------------------- the end of a run


def _kinds(outcome: Run) -> str:
    """What the models are: all native, or how many of which kind."""
    names = {"native": "native FMU", "python": "Python FMU", "plain": "Python object", "fmu": "given FMU"}
    kinds = [names[model.kind] for model in outcome.checked.models.values()]
    return ", ".join(f"{kinds.count(kind)} {kind}{'s' * (kinds.count(kind) > 1)}" for kind in dict.fromkeys(kinds))


def show_run(outcome: Run, second: Run | None, quiet: bool) -> None:
    """The end of a run, verdicts and files last; when quiet, only what went wrong, on stderr."""
    system, out = outcome.system, console(stderr=quiet)
    if not quiet:
        _show_head(out, outcome)
        if outcome.status != "failed":
            other = second.metrics if second is not None and second.status == "completed" else None
            show_metrics(out, outcome.metrics, () if other is None else compare_metrics(outcome.metrics, other))
            if outcome.requirements:
                show_requirements(out, outcome.requirements)
        if outcome.published and outcome.status == "completed":
            show_published(out, by_source(outcome.published))
        out.print()
    for note in outcome.notes:
        say(out, f"note: {note}", "bold red")
    if outcome.status != "completed":
        reached = float(outcome.time[-1]) if len(outcome.time) else system.start_time
        why = f": {outcome.error}" if outcome.status == "terminated" else ""
        say(out, f"{outcome.status} at t = {reached:g} s of {system.stop_time:g} s{why}", "bold red")
        if outcome.directory is not None and (outcome.directory / CHECKPOINT).is_file():
            say(out, f"to go on from the last checkpoint: orchestrate run --resume {outcome.directory}", whole=True)
    else:
        for line, bad in summary(outcome.requirements, outcome.published):
            if bad or not quiet:
                say(out, line, "bold red" if bad else "green")
    if second is not None and second.status != "completed":
        say(out, f"the run at half the step was {second.status}: nothing is compared", "bold red")
    if not quiet:
        count = len(outcome.figures)
        figures = f", {count} figure{'s' * (count > 1)}" if count else ""
        say(out, f"Files in {outcome.directory}: results.csv, units.json, metrics.json, run.json{figures}", whole=True)


def _coupling(how: Mapping[str, Any]) -> Iterator[str]:
    """How iterations, step sizes and loops went, and how many events there were."""
    if loop := how.get("algebraic_loop"):
        signals, residual = len(loop["signals"]), loop["worst_residual"]
        yield f"algebraic loop through {signals} signals: worst relative residual {residual:.2g}"
    if it := how.get("iterative"):
        yield (
            f"{it['iterations_per_step']:.3g} iterations per step, at most {it['most_iterations']}; worst residual "
            f"{it['worst_residual_per_tolerance']:.2g} of the tolerance"
        )
    if steps := how.get("adaptive"):
        yield (
            f"{steps['accepted']} steps accepted, {steps['rejected']} rejected, between "
            f"{steps['shortest_step'] or 0.0:.3g} and {steps['longest_step']:.3g} s long"
        )
    if "events" in how:
        count = sum(what["phase"] == "begin" for what in how["events"])
        yield f"{count} event{'s' * (count != 1)}, listed in run.json"


def _show_head(out: Console, outcome: Run) -> None:
    """What ran, how, and what a user should know of it before reading numbers."""
    system, seconds = outcome.system, outcome.seconds
    say(out, system.title or system.name, "bold")
    facts = [
        (system.preset or "as it stands") + (", modified" if system.modified else ""),
        f"{len(system.instances)} instances",
        _kinds(outcome),
        system.algorithm,
        f"step {system.step:g} s",
    ]
    if outcome.status == "completed":
        facts.append(
            f"{seconds['steps']:g} steps in {seconds['stepping']:.2f} s after {seconds['setup']:.2f} s of set-up"
        )
    say(out, "; ".join(facts), "dim")
    for line in _coupling(outcome.coupling):
        say(out, line, "dim")
    if system.description:
        say(out, system.description, "yellow" if "WARNING" in system.description else "")
    for note in folded(outcome.checked.notes):
        say(out, f"note: {note}", "yellow")


# -------------------------------------------------------------------- metrics


def show_metrics(out: Console, metrics: Sequence[Metric], comparisons: Sequence[MetricChange] = ()) -> None:
    """Single values one a row; values per index side by side, where they fit and nothing is to be compared."""
    wide = [m for m in metrics if not comparisons and not m.problem and 1 < len(m.values) <= _SIDE_BY_SIDE]
    table = _wide_table(wide) if wide else None
    if table and Measurement.get(out, out.options.update(width=sys.maxsize), table).maximum > out.width:
        wide, table = [], None
    long = [m for m in metrics if m not in wide]
    if long:
        out.print(_long_table(long, comparisons))
    if table:
        out.print(table)
    if any(m.comfort for m in metrics):
        say(out, f"In brackets, levels: {COMFORT_TITLE}.", "dim")
    _reasons(out, "no value", ((m.name, m.problem.removeprefix(f"'{m.expression}': ")) for m in metrics if m.problem))


def _number(value: float, metric: Metric) -> str:
    if math.isnan(value):
        return "-"
    if math.isinf(value) and metric.unit == "s":
        return "never"
    if metric.comfort and math.isfinite(value):
        return f"{value:.3f} ({', '.join(map(str, comfort_levels(value)))})"
    return f"{value:.6g}"


def _long_table(metrics: Sequence[Metric], comparisons: Sequence[MetricChange]) -> Table:
    """One row a value; with comparisons, the value at half the step and the difference beside it."""
    more = ("at half the step", "difference") if comparisons else ()
    table = _table("Metrics", "metric", "value", *more, "unit", right=("value", *more), fold=("metric",))
    halved = {(c.name, c.index): c for c in comparisons}
    for metric in metrics:
        for index, value in metric.values.items():
            name = metric.name if index is None else f"{metric.name}[{index}]"
            row = [name, _number(value, metric)]
            if comparisons:
                other = halved.get((metric.name, index))
                row += ["", ""] if other is None else [_number(other.other, metric), f"{other.difference:+.3g}"]
            table.add_row(*map(Text, [*row, metric.unit]))
    return table


def _wide_table(metrics: Sequence[Metric]) -> Table:
    indices = sorted({index for m in metrics for index in m.values if index is not None})
    names = [f"[{index}]" for index in indices]
    table = _table("Metrics by index", "metric", right=names)
    for name in names:
        table.add_column(Text(name), justify="right", no_wrap=True)
    table.add_column("unit")
    for metric in metrics:
        cells = [_number(metric.values[i], metric) if i in metric.values else "" for i in indices]
        table.add_row(*map(Text, [metric.name, *cells, metric.unit]))
    return table


# -------------------------------------------------------------------- verdicts


def show_requirements(out: Console, verdicts: Sequence[Verdict]) -> None:
    """One row a requirement: verdict, signed margin, worst time."""
    columns = ("requirement", "verdict", "margin", "worst at", "text")
    table = _table("Requirements", *columns, right=("margin", "worst at"), fold=("requirement", "text"))
    for v in verdicts:
        place = "" if v.time is None else f"{v.time:g} s"
        place += "" if v.index is None else f", i = {v.index}"
        margin = "" if v.margin is None else f"{v.margin:.4g}"
        table.add_row(*map(Text, (v.name,)), _verdict(v.verdict), margin, place, Text(" ".join(v.text.split())))
    out.print(table)
    _reasons(out, "because", ((v.name, v.reason) for v in verdicts if v.reason))
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
        _reasons(out, word, ((row.metric, row.reason) for row in rows if row.verdict == word and row.reason))


def _published_table(heads: Sequence[str], widths: Sequence[int], rows: Sequence[PublishedRow]) -> Table:
    table = Table(show_header=not rows, **_PLAIN)
    for head, width in zip(heads, widths, strict=True):
        numeric = head in ("published", "measured", "tolerance")
        table.add_column(head, justify="right" if numeric else "left", overflow="fold", width=width)
    for row in rows:
        *texts, verdict = _published_cells(row)
        table.add_row(*map(Text, texts), _verdict(verdict))
    return table


def _published_cells(row: PublishedRow) -> list[str]:
    return [
        f"{row.metric}: {row.claim}" if row.claim else row.metric,
        "in words" if row.published is None else f"{row.published:.8g}",
        "-" if math.isnan(row.measured) else f"{row.measured:.6g}",
        "" if row.tolerance is None else f"{row.tolerance:g}",
        row.unit,
        row.verdict,
    ]


def _verdict(word: str) -> Text:
    return Text(word, style=_COLOURS.get(word, ""))


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
    named = [name for name, verdict in rows if verdict == bad]
    open_ = Counter(verdict for _, verdict in rows if verdict in ("inconclusive", "not judged"))
    text += f"; {bad}: {', '.join(named)}" if named else ""
    return text + "".join(f"; {count} {verdict}" for verdict, count in open_.items()), bool(named)


# -------------------------------------------------------------------- interfaces


def show_interface(out: Console, interface: Interface) -> None:
    """Every variable of an FMU by causality: unit, start, and what an output depends on directly."""
    for causality, title in (
        ("parameter", "Parameters"),
        ("calculatedParameter", "Calculated parameters"),
        ("structuralParameter", "Structural parameters (they keep their values)"),
        ("input", "Inputs"),
        ("output", "Outputs"),
        ("local", "Local variables"),
        ("independent", "Independent variable"),
    ):
        variables = interface.of(causality)
        if variables:
            out.print(_variables(title, variables, interface))


def _variables(title: str, variables: Sequence[Variable], interface: Interface) -> Table:
    starts = any(v.start is not None for v in variables)
    outputs = title == "Outputs"
    columns = ["name", "type", "unit", *(["start"] if starts else []), "description"]
    columns += ["depends directly on"] if outputs else []
    table = _table(title, *columns, right=("start",), fold=("name", "description", "depends directly on"))
    places = {v.name: k for k, v in enumerate(interface.of("input"))}
    for v in variables:
        cells = [v.name, v.fmi_type or v.type, v.unit or ""]
        cells += ["" if v.start is None else _start(v.start)] if starts else []
        hint = "optional" if v.name in interface.optional_inputs else ""
        hint = "tunable" if v.causality == "parameter" and v.variability == "tunable" else hint
        hint = ", ".join([*([hint] if hint else []), *(f"{name} = {value}" for name, value in v.choices)])
        cells += [f"{v.description} ({hint})".strip() if hint else v.description]
        if outputs:
            cells.append(_dependencies(v, places))
        table.add_row(*map(Text, cells))
    return table


def _dependencies(output: Variable, inputs: Mapping[str, int]) -> str:
    if output.dependencies is None:
        return "not said"
    return ", ".join(sorted(output.dependencies & inputs.keys(), key=inputs.__getitem__)) or "no input"


def _start(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.10g}" if isinstance(value, float) else str(value)
