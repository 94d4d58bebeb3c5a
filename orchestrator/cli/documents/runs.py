"""The documents of commands that run a scenario: run, reproduce."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...evaluation import ComparedValue, Metric, MetricChange, Verdict, compare_metrics, count_values
from ...run import Finding, Run, Status, StepCheck


@dataclass(frozen=True)
class RunDocument:
    """A run: what ran and how, what was found, and where the files are.

    Attributes:
        modified: whether it is changed from what the scenario and its preset say.
        time_reached, start_time, stop_time, step: in s.
        kinds: of the model of each instance. seconds: of wall time for set-up and stepping, and the number of steps.
        findings: what no train can do, and what controllers said of themselves.
        metrics: values by index, that of a metric without one under "". requirements: each with its signed margin.
        published, references: values known before, beside what was measured; "not judged" of a run that was modified.
        half_step: each metric beside its value at half the step, and step_check: what is said of the step, both with
            --verify-step.
        directory: with all files. figures, report: those that were drawn.
    """

    scenario: str
    title: str
    preset: str | None
    modified: bool
    status: Status
    time_reached: float | None
    start_time: float
    stop_time: float
    step: float
    algorithm: str
    seed: int
    kinds: dict[str, str]
    seconds: dict[str, float]
    notes: list[str]
    findings: list[Finding]
    metrics: list[Metric]
    requirements: list[Verdict]
    published: list[ComparedValue]
    references: list[ComparedValue]
    half_step: list[MetricChange]
    step_check: StepCheck | None
    directory: str | None
    figures: list[str]
    report: str | None


def run_document(
    outcome: Run, second: Run | None = None, step_check: StepCheck | None = None, report: Path | None = None
) -> RunDocument:
    """The document of a run.

    Args:
        outcome: the run.
        second: the same at half the step.
        step_check: what it shows, where it completed.
        report: the page that was made.
    """
    origin, stepping = outcome.system.provenance, outcome.system.stepping
    compared = compare_metrics(outcome.metrics, second.metrics) if second is not None and step_check is not None else ()
    return RunDocument(
        scenario=origin.name,
        title=origin.title,
        preset=origin.preset,
        modified=origin.modified,
        status=outcome.status,
        time_reached=outcome.time_reached,
        start_time=stepping.start_time,
        stop_time=stepping.stop_time,
        step=stepping.step,
        algorithm=stepping.algorithm,
        seed=outcome.system.seed,
        kinds={name: model.kind for name, model in outcome.checked.models.items()},
        seconds=outcome.seconds,
        notes=[*outcome.checked.notes, *outcome.notes],
        findings=outcome.findings,
        metrics=outcome.metrics,
        requirements=outcome.requirements,
        published=outcome.published,
        references=outcome.references,
        half_step=list(compared),
        step_check=step_check,
        directory=None if outcome.directory is None else str(outcome.directory),
        figures=[str(path) for path in outcome.figures],
        report=None if report is None else str(report),
    )


@dataclass(frozen=True)
class CaseDocument:
    """A published case: the command that shows it, what was found in its run, and known values beside measured ones."""

    command: str
    status: Status
    findings: list[Finding]
    published: list[ComparedValue]
    references: list[ComparedValue]


@dataclass(frozen=True)
class ReproduceDocument:
    """All published cases, and how many values of each origin have which verdict."""

    cases: list[CaseDocument]
    counts: dict[str, dict[str, int]]


def reproduce_document(cases: Sequence[CaseDocument]) -> ReproduceDocument:
    """The document of cases that were run."""
    every = [row for case in cases for row in (*case.published, *case.references)]
    return ReproduceDocument(list(cases), {origin: dict(counts) for origin, counts in count_values(every).items()})
