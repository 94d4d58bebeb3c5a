"""A row of a study again, as a single run with all that belongs to one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ....fmus.references import file_and_class
from ...errors import ScenarioError
from ...evaluation import value_name
from ...run import Progress, Run, Telling, execute
from ...system import System
from ..rows import margins
from ..structure import Runner
from .parcel import moved, moved_options, packed
from .study import Study


@dataclass(frozen=True)
class Replayed:
    """A row of a study, run again.

    Attributes:
        number: of the row. changes: how the run differs from the scenario. run: what came out.
        differences: what of the row is not the same to the bit, a sentence each; empty as it should be.
        notes: what of the tools has changed since, and may be why.
    """

    number: int
    changes: Mapping[str, Any]
    run: Run
    differences: list[str]
    notes: list[str]


def replay(
    directory: str | Path,
    number: int,
    *,
    output: str | Path | None = None,
    scenario: str | None = None,
    trust: bool = True,
    figures: bool = True,
    progress: Progress | None = None,
    writing: Telling | None = None,
) -> Replayed:
    """Run a row of a study again as a single run, to the same bits.

    Args:
        directory: of the study.
        number: of the run.
        output: the directory for results; ``run-417`` in that of the study by default.
        scenario: that of the study, where it stands elsewhere by now, or to be sure that it is a study of that.
        trust: whether Python code is imported that the study alone names; else that which `scenario` names.
        figures: whether to draw the scenario's figures.
        progress: as `execute` has it.
        writing: likewise.

    Raises:
        ScenarioError: there is no such row, or its scenario, or a file of it, is not what it was.
    """
    study = Study.load(directory)
    row = study.row(number)
    told = study.told

    def where(file: str) -> str | None:
        return file if file in told["files"] else None

    how = moved_options(told["how"], told["folder"], where)
    changes = {key: moved(value, told["folder"], where) for key, value in study.plan.changes(number).items()}
    if scenario is not None:
        how["scenario"] = scenario
    with Runner(**how) as runner:
        system = runner.load(changes)
    if not trust:
        _refuse_code(study, system, "" if scenario is None else system.provenance.path)
    kind = how.get("kind", "auto")
    notes = _changed_since(study, how, system)
    target = Path(directory) / f"run-{number}" if output is None else output
    run = execute(system, kind=kind, output=target, figures=figures, progress=progress, writing=writing)
    return Replayed(number, changes, run, list(_differences(row, run)), notes)


def _refuse_code(study: Study, system: System, scenario: str) -> None:
    """Refuse to import Python code that nobody names but the study.

    Raises:
        ScenarioError: naming it.
    """
    named = system.provenance.named
    strange = {
        one.model: None
        for one in system.instances.values()
        if file_and_class(one.model)[0] and (not scenario or one.model in named)
    }
    if strange:
        raise ScenarioError(
            f"{study.directory}: the study alone names Python code that would be imported: {', '.join(strange)}; name "
            "its scenario as well, or read that code and --trust it"
        )


def _changed_since(study: Study, how: Mapping[str, Any], system: System) -> list[str]:
    """What of the tools is not what it was.

    Raises:
        ScenarioError: a file of the system is not.
    """
    parcel = packed(how, [system], how.get("kind", "auto"))
    known = {*study.told["contents"]}
    other = [file for file, digest in parcel.files.items() if digest not in known]
    if other:
        raise ScenarioError(
            f"{', '.join(other)}: not what the study in {study.directory} was run with; put back what stood there"
        )
    return [
        f"{one.reference} is another FMU than it was: railcosim, or what it is compiled with, has changed"
        for one in parcel.components
        if one.digest not in known
    ]


def _differences(row: Mapping[str, Any], run: Run) -> Iterator[str]:
    """What of a row a run does not have to the bit."""
    found: dict[str, Any] = {"status": run.status, "error": str(run.error or "")}
    found |= {f"metric.{value_name(one.name, k)}": value for one in run.metrics for k, value in one.values.items()}
    found |= {f"verdict.{one.name}": one.verdict for one in run.requirements}
    found |= {f"margin.{name}": value for name, value in margins(run.requirements).items()}
    for name, value in found.items():
        was = row.get(name)
        if was != value and not (_is_nothing(was) and _is_nothing(value)):
            yield f"{name} was {was!r}, and is {value!r}"


def _is_nothing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))
