"""The end of a run: what ran and how, its metrics and verdicts, and where the files are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Console

from ...evaluation import compare_metrics
from ...run import CHECKPOINT_FILE, Run
from .console import and_figures, counted, open_console, say, show_notes
from .metrics import show_metrics
from .verdicts import by_source, show_published, show_requirements, summary


def show_run(outcome: Run, second: Run | None, quiet: bool) -> None:
    """The end of a run, verdicts and files last; when quiet, only what went wrong, on stderr."""
    system, out = outcome.system, open_console(stderr=quiet)
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
        reached = float(outcome.time[-1]) if len(outcome.time) else system.stepping.start_time
        why = f": {outcome.error}" if outcome.status == "terminated" else ""
        say(out, f"{outcome.status} at t = {reached:g} s of {system.stepping.stop_time:g} s{why}", "bold red")
        if outcome.directory is not None and (outcome.directory / CHECKPOINT_FILE).is_file():
            say(out, f"to go on from the last checkpoint: orchestrate run --resume {outcome.directory}", whole=True)
    else:
        for line, bad in summary(outcome.requirements, outcome.published):
            if bad or not quiet:
                say(out, line, "bold red" if bad else "green")
    if second is not None and second.status != "completed":
        say(out, f"the run at half the step was {second.status}: nothing is compared", "bold red")
    if not quiet:
        files = f"results.csv, units.json, metrics.json, run.json{and_figures(len(outcome.figures))}"
        say(out, f"Files in {outcome.directory}: {files}", whole=True)


def _coupling(how: Mapping[str, Any]) -> Iterator[str]:
    """How iterations, step sizes and loops went, and how many events there were."""
    if loop := how.get("algebraic_loop"):
        signals, residual = len(loop["signals"]), loop["worst_residual"]
        yield f"algebraic loop through {signals} signals: worst relative residual {residual:.2g}"
    yield from (report["summary"] for report in how.values() if "summary" in report)
    if "events" in how:
        count = sum(what["phase"] == "begin" for what in how["events"])
        yield f"{counted(count, 'event')}, listed in run.json"


def _show_head(out: Console, outcome: Run) -> None:
    """What ran, how, and what a user should know of it before reading numbers."""
    system, seconds = outcome.system, outcome.seconds
    say(out, system.provenance.title or system.provenance.name, "bold")
    facts = [
        (system.provenance.preset or "as it stands") + (", modified" if system.provenance.modified else ""),
        f"{len(system.instances)} instances",
        _kinds(outcome),
        system.stepping.algorithm,
        f"step {system.stepping.step:g} s",
    ]
    if outcome.status == "completed":
        facts.append(
            f"{seconds['steps']:g} steps in {seconds['stepping']:.2f} s after {seconds['setup']:.2f} s of set-up"
        )
    say(out, "; ".join(facts), "dim")
    for line in _coupling(outcome.coupling):
        say(out, line, "dim")
    if system.provenance.description:
        say(out, system.provenance.description, "yellow" if "WARNING" in system.provenance.description else "")
    show_notes(out, outcome.checked.notes)


def _kinds(outcome: Run) -> str:
    """What the models are: all native, or how many of which kind."""
    names = {"native": "native FMU", "python": "Python FMU", "plain": "Python object", "fmu": "given FMU"}
    kinds = [names[model.kind] for model in outcome.checked.models.values()]
    return ", ".join(counted(kinds.count(kind), kind) for kind in dict.fromkeys(kinds))
