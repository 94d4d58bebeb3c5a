"""The end of a run: what ran and how, its metrics and verdicts, and where the files are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console

from ....fmus.references import file_and_class
from ...evaluation import BAD, compare_metrics
from ...run import CHECKPOINT_FILE, Finding, Run, StepChange, StepCheck
from ...times import digits
from ..lines import and_figures, counted
from .console import open_console, say, show_notes
from .findings import show_findings
from .metrics import show_metrics
from .tables import prefixed
from .verdicts import by_source, in_one_line, not_judged_at_all, show_requirements, show_values, summary

if TYPE_CHECKING:
    from ..documents import CaseDocument

_OWN = "References (our own integrations)"
_SHOWN = 3
"""How many values beyond their bounds are named."""


def show_run(outcome: Run, second: Run | None, step: StepCheck | None, quiet: bool) -> None:
    """The end of a run, findings first, verdicts and files last; when quiet, else only what went wrong, on stderr.

    Args:
        outcome: the run.
        second: the same at half the step, where that was asked for.
        step: what it shows, where it completed.
        quiet: whether to say only what was found and what went wrong.
    """
    system, out = outcome.system, open_console(stderr=quiet)
    show_findings(outcome.findings)
    if second is not None:
        show_findings(_others(second, outcome), "at half the step")
    if not quiet:
        _show_head(out, outcome)
        _show_tables(out, outcome, second if step is not None else None)
        out.print()
    if outcome.status != "completed":
        reached = float(outcome.time[-1]) if len(outcome.time) else system.stepping.start_time
        why = f": {outcome.error}" if outcome.status == "terminated" else ""
        say(
            out,
            f"{outcome.status} at t = {digits(reached)} s of {digits(system.stepping.stop_time)} s{why}",
            "bold red",
        )
        if outcome.directory is not None and (outcome.directory / CHECKPOINT_FILE).is_file():
            own = " --trust" if any(file_and_class(one.model)[0] for one in system.instances.values()) else ""
            command = f"orchestrate run --resume {outcome.directory}{own}"
            say(out, f"to go on from the last checkpoint: {command}", whole=True)
    else:
        for line, bad in summary(outcome.requirements, [*outcome.published, *outcome.references]):
            if bad or not quiet:
                say(out, line, "bold red" if bad else "green")
    if step is not None and (step.verdict != "fine" or not quiet):
        say(out, _step_line(step), "green" if step.verdict == "fine" else "bold red")
    elif second is not None and step is None:
        say(out, f"the run at half the step was {second.status}: nothing is compared", "bold red")
    if not quiet:
        files = f"results.csv, units.json, metrics.json, run.json{and_figures(len(outcome.figures))}"
        say(out, f"Files in {outcome.directory}: {files}", whole=True)


def show_reproduced(cases: Sequence[CaseDocument], quiet: bool) -> None:
    """What sources say beside what is measured; when quiet, only what is missed, and one line."""
    out, every = open_console(), [row for case in cases for row in (*case.published, *case.references)]
    missed = {
        case.command: [row for row in (*(case.published if quiet else ()), *case.references) if row.verdict in BAD]
        for case in cases
    }
    missed = {command: rows for command, rows in missed.items() if rows}
    published = {case.command: case.published for case in cases if case.published}
    for case in () if quiet else cases:
        show_findings(case.findings, case.command.removeprefix("orchestrate run "), out)
    if published and not quiet:
        show_values(out, "Published values", published)
    if missed:
        show_values(out, "Missed" if quiet else "References that are missed", missed)
    if quiet:
        kinds = Counter(finding.kind for case in cases for finding in case.findings)
        found_too = "".join(f"; {count} {kind}" for kind, count in kinds.items())
        say(out, in_one_line(every) + found_too, "bold red" if any(row.verdict in BAD for row in every) else "green")
    for line, worse in () if quiet else summary([], every):
        say(out, line, "bold red" if worse else "green")


def _show_tables(out: Console, outcome: Run, second: Run | None) -> None:
    """Metrics, requirements, and values known before."""
    if outcome.status != "failed":
        compared = () if second is None else compare_metrics(outcome.metrics, second.metrics)
        show_metrics(out, outcome.metrics, compared)
        if outcome.requirements:
            show_requirements(out, outcome.requirements)
    for title, rows in (("Published values", outcome.published), (_OWN, outcome.references)):
        if rows and outcome.status == "completed" and not not_judged_at_all(rows):
            show_values(out, title, by_source(rows))


def _step_line(found: StepCheck) -> str:
    """The verdict on the step, with what decides it."""
    line = f"the step of {digits(found.step)} s is {found.verdict}"
    beyond = found.beyond
    if not beyond and not found.requirements:
        worst = next(iter(found.changes), None)
        if found.verdict == "not judged":
            return f"{line}: there are no metrics and no requirements"
        if worst is None or not worst.change:
            return f"{line}: half of it changes no metric and no requirement's verdict"
        return f"{line}: half of it changes {worst.name} most, by {_of_allowed(worst)}"
    told = [f"{change.name} by {_of_allowed(change)}" for change in beyond[:_SHOWN]]
    told += [f"the verdict of requirement {name}" for name in found.requirements]
    more = f", and {counted(len(beyond) - _SHOWN, 'more value')}" if len(beyond) > _SHOWN else ""
    return f"{line}: half of it changes {', '.join(told)}{more}"


def _of_allowed(change: StepChange) -> str:
    scale, unit = prefixed(change.unit, [change.change, change.allowed])
    return f"{abs(change.change) / scale:.2g} of {change.allowed / scale:.2g} {unit}".rstrip() + " allowed"


def _others(second: Run, first: Run) -> list[Finding]:
    """The findings of a run that another does not have, however they differ in numbers."""
    known = {(finding.kind, finding.signal) for finding in first.findings}
    return [finding for finding in second.findings if (finding.kind, finding.signal) not in known]


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
        f"step {digits(system.stepping.step)} s",
    ]
    if outcome.status == "completed":
        facts.append(
            f"{seconds['steps']:g} steps in {seconds['stepping']:.2f} s after {seconds['setup']:.2f} s of set-up"
        )
    say(out, "; ".join(facts), "dim")
    for line in _coupling(outcome.coupling):
        say(out, line, "dim")
    if text := system.provenance.description:
        before = "before the changes: " if system.provenance.modified else ""
        say(out, before + text, "yellow" if "WARNING" in text else "")
    show_notes(out, [*outcome.checked.notes, *outcome.notes])


def _kinds(outcome: Run) -> str:
    """What the models are: all native, or how many of which kind."""
    names = {"native": "native FMU", "python": "Python FMU", "plain": "Python object", "fmu": "given FMU"}
    kinds = [names[model.kind] for model in outcome.checked.models.values()]
    return ", ".join(counted(kinds.count(kind), kind) for kind in dict.fromkeys(kinds))
