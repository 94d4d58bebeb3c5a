"""One run, from a system to results, metrics, verdicts and files."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import world
from ..errors import FigureError, RailcosimError, RecordError, ScenarioError
from ..evaluation import Signals, judge_values
from ..figures import draw
from ..fmi import Kind, Workspace
from ..fmi.binding import forget_paths
from ..master import check_threads
from ..system import Instance, System
from ..times import digits
from . import checkpoint
from . import record as record_file
from .checking import Checked, check
from .checkpoint import check_serializable
from .directory import RunDirectory
from .outcome import Run
from .pacing import RealTime
from .recording import ROWS_FILE, SEEN_FILE, Telling, finish_rows, remove_rows
from .session import Job, Progress, Session, rows_before

_log = logging.getLogger(__name__)


def run(
    system: System,
    *,
    stop_time: float | None = None,
    step: float | None = None,
    algorithm: str | None = None,
    kind: Kind = "auto",
    output: str | Path | None = None,
    figures: bool = True,
    threads: int = 1,
    checkpoint_every: float | None = None,
    real_time: RealTime | None = None,
    progress: Progress | None = None,
) -> Run:
    """Run a system.

    Args:
        system: from `load`, or built by hand.
        stop_time: overrides the system's, in s.
        step: overrides the system's, in s.
        algorithm: overrides the system's.
        kind: how components become models: ``"native"`` or ``"python"`` FMUs, ``"plain"`` Python objects in this
            process; ``"auto"`` takes native where it can.
        output: directory for results, metrics and figures; without one everything stays in memory.
        figures: whether to draw the system's figures (only with an output directory).
        threads: how many threads step the instances in parallel, with compiled FMUs and an algorithm that can
            (``jacobi``); results are the same to the bit. Where they cannot act that is an error.
        checkpoint_every: distance in s of the points from which `resume` can go on; needs an output directory.
        real_time: how the run keeps pace with the clock; without it, it goes as fast as it can.
        progress: called at every per cent of the run and at least ten times a second.

    Raises:
        ScenarioError: the system cannot run; all problems are listed.
        FmuError: a model failed. What was computed until then is on disk, and in the error's ``run``.
        CouplingError: what the models exchange does not settle; as above.
    """
    system = _override(system, stop_time, step, algorithm)
    outcome = execute(
        system,
        kind=kind,
        output=output,
        figures=figures,
        threads=threads,
        checkpoint_every=checkpoint_every,
        real_time=real_time,
        progress=progress,
    )
    return _raised(outcome)


def _raised(outcome: Run) -> Run:
    """The outcome of a run, unless that is a failure."""
    if outcome.error is not None and outcome.status == "failed":
        outcome.error.run = outcome  # type: ignore[attr-defined]
        raise outcome.error
    return outcome


def execute(
    system: System,
    *,
    kind: Kind = "auto",
    output: str | Path | None = None,
    figures: bool = True,
    threads: int = 1,
    checkpoint_every: float | None = None,
    real_time: RealTime | None = None,
    progress: Progress | None = None,
    writing: Telling | None = None,
) -> Run:
    """As `run`, but a model that fails ends the run with ``status = "failed"`` instead of raising.

    ``writing`` is told how many of how many rows of results.csv are written.
    """
    place = RunDirectory(Path(output)) if output is not None else None
    _check_distance(checkpoint_every)
    if checkpoint_every is not None and place is None:
        raise ScenarioError("checkpoints are files: name an output directory for them")
    return _execute(system, Job(kind, place, threads, checkpoint_every, None, progress, writing, real_time), figures)


def resume(
    directory: str | Path,
    *,
    stop_time: float | None = None,
    figures: bool = True,
    threads: int = 1,
    checkpoint_every: float | None = None,
    real_time: RealTime | None = None,
    progress: Progress | None = None,
    scenario: System | None = None,
    trust: bool = True,
) -> Run:
    """Go on with a run from its last checkpoint, bit-identically with one that was never interrupted.

    Args:
        directory: of the run, which was given ``checkpoint_every``.
        stop_time: another end in s, later than the checkpoint.
        figures: whether to draw the system's figures.
        threads: how many threads step the instances in parallel.
        checkpoint_every: distance of further checkpoints in s; as before by default.
        real_time: as `run` has it.
        progress: as `run` has it.
        scenario: the scenario of the run, from `load`, to be sure that it is a run of that.
        trust: whether Python code that only the checkpoint names is imported; else that which `scenario` names.

    Raises:
        ScenarioError: there is no checkpoint that fits.
        FmuError, CouplingError: as `run` has it.
    """
    outcome = go_on(
        directory,
        stop_time=stop_time,
        figures=figures,
        threads=threads,
        checkpoint_every=checkpoint_every,
        real_time=real_time,
        progress=progress,
        scenario=scenario,
        trust=trust,
    )
    return _raised(outcome)


def go_on(
    directory: str | Path,
    *,
    stop_time: float | None = None,
    figures: bool = True,
    threads: int = 1,
    checkpoint_every: float | None = None,
    real_time: RealTime | None = None,
    progress: Progress | None = None,
    writing: Telling | None = None,
    scenario: System | None = None,
    trust: bool = True,
) -> Run:
    """As `resume`, but a model that fails ends the run with ``status = "failed"`` instead of raising.

    ``writing`` is told how many of how many rows of results.csv are written.
    """
    directory = Path(directory)
    _check_distance(checkpoint_every)
    checkpoint.read_checkpoint(directory)  # a folder without one is left as it is
    with RunDirectory(directory) as place:
        point = checkpoint.read_checkpoint(directory)
        if scenario is not None or not trust:
            point.check_code(directory, scenario, trust=trust)
        place.identity = point.run
        system = _override(point.system, stop_time, None, None)
        if not system.stepping.stop_time > point.time:
            raise ScenarioError(
                f"{directory}: its checkpoint is at t = {digits(point.time)} s; it cannot go on to an earlier stop "
                f"time, {digits(system.stepping.stop_time)} s"
            )
        every = checkpoint_every if checkpoint_every is not None else point.every
        return _execute(system, Job(point.kind, place, threads, every, point, progress, writing, real_time), figures)


def _check_distance(checkpoint_every: float | None) -> None:
    if checkpoint_every is not None and not 0.0 < checkpoint_every < math.inf:
        raise ScenarioError(f"checkpoints: their distance must be a positive number of s, not {checkpoint_every!r}")


def _check_threads(checked: Checked, threads: int) -> None:
    problems = check_threads(checked.system, checked.models, checked.wiring, threads)
    if problems:
        raise ScenarioError(problems)


def _execute(system: System, job: Job, figures: bool) -> Run:
    place = job.place
    begin = world.perf_counter()
    with ExitStack() as held, Workspace() as workspace:
        try:
            checked = check(system, workspace, job.kind)
            _check_threads(checked, job.threads)
            if checked.large:  # said before it fills a disk
                _log.warning(checked.large)
            if job.begin is not None and place is not None:
                job.begin.check(checked.models, place.path)
            if job.checkpoint_every is not None:
                check_serializable(checked.models)
            if place is not None:
                held.enter_context(place)
                place.identity = place.identity or record_file.identity_of(checked, job.kind)
            session = Session(checked, job, rows_before(job))
            if place is not None:
                _open_directory(place, checked, job)
            outcomes: list[Run] = []
            session.run(begin, lambda: outcomes.append(_completed(session, figures)))
        finally:
            forget_paths(workspace.folder)
        outcome = outcomes[-1]
        later = [note for note in session.disturbances() if note not in outcome.notes]
        if later:  # while instances were given back
            outcome.notes += later
            if place is not None:
                record_file.add(place.path, notes=_all_notes(outcome))
    session.interruption.pass_on()
    return outcome


def _completed(session: Session, figures: bool) -> Run:
    """What came out, judged, written down and drawn."""
    checked, job = session.checked, session.job
    place = job.place
    directory = None if place is None else place.given
    outcome = Run(checked.system, session.results(), session.status, checked, error=session.error, directory=directory)
    outcome.signal = session.interruption.number
    outcome.coupling, outcome.seconds = session.coupling, session.seconds
    outcome.findings = session.findings(outcome.results)
    if outcome.error is not None and outcome.status == "failed":
        for finding in outcome.findings:
            if finding.kind == "diverging":
                outcome.error.explain(finding.message)
    outcome.notes += session.disturbances()
    evaluate(outcome, session.judged(outcome.results))
    if place is not None and job.begin is not None and not outcome.results.points:  # what there was is all there is
        record_file.add(place.path, status=outcome.status, error=outcome.error and str(outcome.error))
    elif place is not None:
        _write(outcome, session, place)
        if figures and outcome.results.points and not isinstance(outcome.error, RecordError):
            _draw(outcome, place)
    return outcome


def _write(outcome: Run, session: Session, place: RunDirectory) -> None:
    """Write the record down, then the text of the results; where there is no room for it the run has failed."""
    job = session.job
    try:
        resumed = None if job.begin is None else job.begin.time
        record_file.finish(place, outcome, job.kind, session.rows, resumed=resumed)
        if outcome.results.points and (place.path / ROWS_FILE).exists():
            finish_rows(place.path, job.writing)
        if job.checkpoint_every is None:
            remove_rows(place.path / SEEN_FILE)
    except OSError as error:
        if outcome.error is None:
            outcome.error = RecordError(f"{error.filename or place.given} cannot be written: {error.strerror or error}")
        outcome.status = "failed"
        with suppress(OSError, ValueError):  # for this there may be no room either
            record_file.add(place.path, status=outcome.status, error=str(outcome.error))


def _draw(outcome: Run, place: RunDirectory) -> None:
    """Draw the figures of a run whose record is complete: one that cannot be drawn is no more than a note."""
    try:
        outcome.figures = draw(outcome.system.judged.figures, outcome.results, place.path)
    except FigureError as error:
        outcome.figures = error.drawn
        outcome.notes += map(str, error.problems)
    record_file.add(place.path, figures=[path.name for path in outcome.figures], notes=_all_notes(outcome))


def _all_notes(outcome: Run) -> list[str]:
    """Those of the system, and those of the run."""
    return [*outcome.checked.notes, *outcome.notes]


def evaluate(outcome: Run, seen: Signals) -> None:
    """Fill in metrics, verdicts and known values from what was seen at every point."""
    system = outcome.system
    if not seen.points:
        return
    judge = outcome.checked.judge
    run = judge.prepared(seen)
    outcome.metrics, outcome.requirements = judge.metrics(run), judge.verdicts(run)
    came = system.provenance
    outcome.published, outcome.references = (
        judge_values(
            entries,
            outcome.metrics,
            came.preset,
            came.modified,
            default_preset=came.default_preset,
            completed=outcome.status == "completed",
        )
        for entries in (system.judged.published, system.judged.references)
    )


def at_half_the_step(system: System) -> System:
    """The same at half the step, recorded at the same points; longer steps of instances' own stay."""
    return _override(
        system.changed(record=system.stepping.record or system.stepping.step), None, 0.5 * system.stepping.step, None
    )


def _override(system: System, stop_time: float | None, step: float | None, algorithm: str | None) -> System:
    changes: dict[str, Any] = {}
    if stop_time is not None and stop_time != system.stepping.stop_time:
        changes["stop_time"] = stop_time
    if step is not None and step != system.stepping.step:
        changes.update(step=step, rescaled_from=system.provenance.rescaled_from or system.stepping.step)
        changes["instances"] = {name: _rescaled(x, system.stepping.step, step) for name, x in system.instances.items()}
        if system.stepping.record is not None and system.stepping.record < step:
            changes["record"] = None
    if algorithm is not None and algorithm != system.stepping.algorithm:
        changes["algorithm"] = algorithm
    if not changes:
        return system
    options = {"--stop": stop_time, "--step": step, "--algorithm": algorithm}
    given = {option: str(value) for option, value in options.items() if value is not None}
    return system.changed(**changes, modified=True, command=_with_options(system.provenance.command, given))


def _with_options(command: tuple[str, ...], given: Mapping[str, str]) -> tuple[str, ...]:
    """A command with other values of options; none where none is known."""
    kept = [pair for pair in zip(command[1::2], command[2::2], strict=True) if pair[0] not in given]
    return command and (command[0], *(word for pair in (*kept, *given.items()) for word in pair))


def _rescaled(instance: Instance, before: float, step: float) -> Instance:
    """A step and a sample time that were given as the old step follow the new one."""
    if instance.step == before:
        instance = replace(instance, step=step)
    if instance.start.get("sample_time") == before:
        instance = replace(instance, start={**instance.start, "sample_time": step})
    return instance


def _open_directory(place: RunDirectory, checked: Checked, job: Job) -> None:
    try:
        record_file.write(place, checked, job.kind, anew=job.begin is None)
    except OSError as error:
        raise RailcosimError(f"the output directory {place.given} cannot be used: {error.strerror or error}") from error
