"""A study in words: how far it has got, which requirements hold how often, how metrics are spread, what matters."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...bars import progress_bar
from ...study.analysis import SHARES, Estimate, Influence, Kept, Sensitivity, Spread, Summary
from ..lines import and_figures, counted, tell
from .console import open_console, say
from .progress import show_compilations, tell_pool
from .tables import SIDE_BY_SIDE, fits, table

if TYPE_CHECKING:
    from ...study.campaign import Pool, Study

_MOST_OUTPUTS = 4
_MOST_PARAMETERS = 8
_NAME = 16
"""Letters that a name has at least, in a narrow terminal too."""


def show_summary(out: Console, summary: Summary, sensitivities: Iterable[Sensitivity] = ()) -> None:
    """The summary of a study, and what its parameters do to what came out.

    Args:
        out: where to.
        summary: of the study.
        sensitivities: the outputs of interest first; only the first few are taken.
    """
    statuses = ", ".join(f"{count} {status}" for status, count in summary.statuses.items())
    say(out, f"{summary.runs} runs: {statuses}" if summary.runs else "no runs", "bold")
    for run, error in summary.broken:
        say(out, f"run {run}: {error}", "bold red")
    if summary.requirements:
        out.print(_requirements(summary.requirements))
        _say_lacking(out, "unjudged", {one.name: one.unjudged for one in summary.requirements})
    if summary.metrics:
        wide = _metrics(summary.metrics)
        out.print(wide if fits(out, wide) else _metrics(summary.metrics, narrow=True))
        _say_lacking(out, "without a value", {one.name: one.missing for one in summary.metrics})
    if summary.requirements or summary.metrics:
        say(out, summary.note, "dim")
    for made in islice((made for made in sensitivities if made.influences), _MOST_OUTPUTS):
        out.print(_influences(made))
        left = len(made.influences) - _MOST_PARAMETERS
        explained = "" if math.isnan(made.explained) else f"ranks explain {made.explained:.0%} of its variance"
        rest = f"{left} weaker parameters are left out" if left > 0 else ""
        method = f"shares by {made.method}" if made.method else ""
        width = f"± for {summary.level:.0%}"
        say(out, "; ".join(filter(None, (f"{made.runs} runs", method, width, explained, rest))), "dim")


def _say_lacking(out: Console, what: str, counts: Mapping[str, int]) -> None:
    """Under a table: of how many runs there is nothing, the same number of several rows once."""
    rows: dict[int, list[str]] = {}
    for name, count in counts.items():
        rows.setdefault(count, []).append(name)
    for count, names in rows.items():
        if count:
            which = ", ".join(names) if len(names) <= SIDE_BY_SIDE else f"{len(names)} rows"
            say(out, f"{what}: {count} run{'s' * (count > 1)} ({which})", "dim")


def _named(title: str, first: str, others: Sequence[str]) -> Table:
    """A table of names with numbers beside them; a name takes several lines before a number is cut."""
    made = table(title, (first, *others), right=others, fold=(first,))
    made.columns[0].min_width = _NAME
    return made


def _requirements(kept: Sequence[Kept]) -> Table:
    made = _named("Requirements", "requirement", ("pass", "of those judged", "least margin", "in run", "median"))
    for one in kept:
        judged = one.passed + one.failed
        colour = "bold red" if one.failed else "green" if judged else "dim"
        run = one.margin.least_run if one.margin.count else next(iter(one.failing), -1)
        median = one.margin.quantiles[SHARES.index(0.5)].value
        made.add_row(
            Text(one.name),
            f"{one.passed} of {judged}",
            Text(_percent(one.rate), style=colour),
            _number(one.margin.least),
            "-" if run < 0 else str(run),
            _number(median),
        )
    return made


def _metrics(spreads: Sequence[Spread], *, narrow: bool = False) -> Table:
    shares = [f"{share:.0%}" for share in SHARES]
    ends = ("least", "largest") if narrow else ("least (run)", "largest (run)")
    made = _named("Metrics", "metric", ("mean", *([] if narrow else ["sd"]), *shares, *ends))
    for one in spreads:
        quantiles = [_number(q.value) for q in one.quantiles]
        if narrow:
            made.add_row(Text(one.name), _number(one.mean.value), *quantiles, _number(one.least), _number(one.largest))
            continue
        pairs = ((one.least, one.least_run), (one.largest, one.largest_run))
        runs = ["-" if run < 0 else f"{_number(value)} ({run})" for value, run in pairs]
        made.add_row(Text(one.name), _between(one.mean), _number(one.sd), *quantiles, *runs)
    return made


def _influences(found: Sensitivity) -> Table:
    heads = {"alone": "first", "with others": "total", "rank correlation": "correlation", "regression": "regression"}
    shown = {head: name for head, name in heads.items() if any(_is_known(one, name) for one in found.influences)}
    made = _named(f"What matters for {found.output}", "parameter", tuple(shown))
    for one in found.influences[:_MOST_PARAMETERS]:
        made.add_row(Text(one.name), *(_share(getattr(one, name)) for name in shown.values()))
    return made


def _is_known(one: Influence, name: str) -> bool:
    return not math.isnan(getattr(one, name).value)


def _percent(estimate: Estimate) -> str:
    """A proportion with its interval in brackets, where it has one."""
    if math.isnan(estimate.value):
        return "-"
    value, low, high = (f"{100 * x:.1f}" for x in estimate)
    return f"{value}%" if math.isnan(estimate.low) else f"{value}% [{low}, {high}]"


def _between(estimate: Estimate) -> str:
    value, low, high = map(_number, estimate)
    return value if math.isnan(estimate.low) else f"{value} [{low}, {high}]"


def _share(estimate: Estimate) -> str:
    """A number of the size of 1, with half the width of its interval."""
    if math.isnan(estimate.value):
        return "-"
    half = "" if math.isnan(estimate.low) else f" ±{(estimate.high - estimate.low) / 2:.2f}"
    return f"{estimate.value + 0.0:.2f}{half}".replace("-0.00", "0.00")


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value + 0.0:.4g}"  # no -0


@dataclass
class ShownRuns:
    """What is told of a study while it goes on.

    Attributes:
        progress: is called with how many runs are done, of how many, and how many failed.
        begun: is called with the workers once they are there.
    """

    progress: Callable[[int, int, int], None]
    begun: Callable[[Pool], None]


@contextmanager
def show_runs(title: str, quiet: bool) -> Iterator[ShownRuns]:
    """A progress bar with an estimate on a terminal, one line per 10 % otherwise, nothing when quiet."""
    if quiet:
        yield ShownRuns(lambda *_: None, lambda _: None)
    elif sys.stderr.isatty():
        with progress_bar(title, console=open_console(stderr=True)) as bar:

            def show(done: int, count: int, failed: int) -> None:
                runs = f"{done} of {counted(count, 'run')}{f', {failed} failed' if failed else ''}"
                bar.count(done, count, runs)

            yield ShownRuns(show, tell_pool)
    else:
        with show_compilations(quiet):
            yield ShownRuns(_lines(title), tell_pool)


def show_study(study: Study, quiet: bool, figures: int = 0) -> None:
    """The end of a study, verdicts and files last; when quiet, only what went wrong, on stderr."""
    out = open_console(stderr=quiet)
    count, told = study.told["runs"], study.told
    if not quiet:
        say(out, str(told["title"] or told["scenario"]), "bold")
        show_summary(out, study.summary(), study.sensitivities())
        out.print()
    failing = [name for name, verdicts in study.verdicts.items() if verdicts["fail"]]
    line = f"{len(study)} of {counted(count, 'run')}"
    line += f", {study.broken} failed" if study.broken else ""
    line += f"; not always held: {', '.join(failing)}" if failing else "; all requirements held" * bool(study.verdicts)
    is_bad = study.failed or len(study) < count
    if is_bad or not quiet:
        say(out, line, "bold red" if is_bad else "green")
    if len(study) < count:
        say(out, f"to go on: the same command with --resume -o {study.directory}", whole=True)
    if not quiet:
        files = "runs.parquet, study.json" + ", series.parquet" * bool(told["how"].get("record"))
        say(out, f"Files in {study.directory}: {files}{and_figures(figures)}", whole=True)


def _lines(title: str) -> Callable[[int, int, int], None]:
    told: int | None = None

    def show(done: int, count: int, failed: int) -> None:
        nonlocal told
        tenth = 10 * done // count
        told = 10 * (done - 1) // count if told is None else told
        if tenth > told:
            told = tenth
            tell(f"{title}: {10 * tenth} % of {counted(count, 'run')}{f', {failed} failed' if failed else ''}")

    return show
