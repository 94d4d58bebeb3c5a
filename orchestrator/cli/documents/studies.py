"""The documents of commands about studies: study, replay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...study.analysis import Sensitivity, Summary
from ...study.campaign import Replayed, Study
from .runs import RunDocument, run_document


@dataclass(frozen=True)
class StudyDocument:
    """A study.

    Attributes:
        done: how many runs are there, of `runs` in all. broken: how many of them failed or could not be run.
        verdicts: of each requirement, how many of each kind. summary: how often they hold, how metrics are spread.
        sensitivities: what the parameters do to each output.
        directory: with runs.parquet, one row a run. interrupted: whether a signal ended it before its time.
        report: the page that was made of it.
    """

    scenario: str
    title: str
    preset: str | None
    runs: int
    done: int
    broken: int
    interrupted: bool
    verdicts: dict[str, dict[str, int]]
    summary: Summary
    sensitivities: list[Sensitivity]
    directory: str
    figures: list[str]
    report: str | None


def study_document(study: Study, figures: Sequence[Path], report: Path | None) -> StudyDocument:
    """The document of a study.

    Args:
        study: that was run.
        figures: that were drawn of it.
        report: the page that was made.
    """
    told = study.told
    return StudyDocument(
        str(told["scenario"]),
        str(told["title"]),
        told.get("preset"),
        told["runs"],
        len(study),
        study.broken,
        bool(study.signal),
        {name: dict(counts) for name, counts in study.verdicts.items()},
        study.summary(),
        study.sensitivities(),
        str(study.directory),
        [str(path) for path in figures],
        None if report is None else str(report),
    )


@dataclass(frozen=True)
class ReplayDocument:
    """A run of a study, run again.

    Attributes:
        number: of the run. changes: what is set in it.
        differences: what is not the same as in the study, to the bit; none where all is.
    """

    number: int
    changes: dict[str, Any]
    differences: list[str]
    notes: list[str]
    run: RunDocument


def replay_document(again: Replayed) -> ReplayDocument:
    """The document of a replay."""
    return ReplayDocument(again.number, dict(again.changes), again.differences, again.notes, run_document(again.run))
