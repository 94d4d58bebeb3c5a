"""One run, from a system to results, metrics, verdicts and files."""

from __future__ import annotations

import signal
import threading
import time as clock
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import record as record_file
from .archive import Workspace
from .binary import forget_paths
from .check import Checked, check
from .errors import RailcosimError, RunError, StoppedError
from .loading import Kind
from .master import Master, Observer, Rows, Settings
from .metrics import Metric, evaluate_metrics
from .plots import draw
from .published import PublishedRow, judge
from .requirements import Verdict, judge_requirements
from .results import Recorder, Results
from .slave import Slave
from .system import Algorithm, Instance, System

Status = Literal["completed", "terminated", "interrupted", "failed"]
Progress = Callable[[float, float], None]
"""Called now and then with the time reached and the stop time, both in s."""


@dataclass
class Run:
    """What came out of a run; ``run["train[1].speed"]`` is a recorded signal over ``run.time``.

    Attributes:
        results: recorded signals. metrics, requirements, published: evaluated tables.
        status: ``"completed"``, ``"terminated"`` (an FMU asked for the end), ``"interrupted"`` or ``"failed"``; error:
            why it failed or ended early.
        checked: models, wiring, order, and the notes a user should read.
        directory: where the files are, if there are any. figures: those that were drawn.
        coupling: how the master's iterations, step sizes, loops and events went, where there were any.
        seconds: wall time of ``setup`` and ``stepping``, and the number of communication ``steps``.
    """

    system: System
    results: Results
    status: Status
    checked: Checked
    metrics: list[Metric] = field(default_factory=list)
    requirements: list[Verdict] = field(default_factory=list)
    published: list[PublishedRow] = field(default_factory=list)
    figures: list[Path] = field(default_factory=list)
    error: RunError | None = None
    coupling: dict[str, Any] = field(default_factory=dict)
    directory: Path | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def time(self) -> NDArray[np.float64]:
        """Recorded points in s."""
        return self.results.time

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.results[name]

    def names(self) -> Collection[str]:
        """All recorded signals."""
        return self.results.names()

    @property
    def failed(self) -> bool:
        """Whether a requirement failed or a published value was missed."""
        return any(v.verdict == "fail" for v in self.requirements) or any(p.verdict == "missed" for p in self.published)


def run(
    system: System,
    *,
    stop_time: float | None = None,
    step: float | None = None,
    algorithm: Algorithm | None = None,
    kind: Kind = "auto",
    output: str | Path | None = None,
    figures: bool = True,
    threads: int = 1,
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
        threads: how many threads step the instances in parallel, with ``jacobi`` and compiled FMUs; results are the
            same to the bit.
        progress: called at every per cent of the run and at least ten times a second.

    Raises:
        ScenarioError: the system cannot run; all problems are listed.
        FmuError: a model failed. What was computed until then is on disk, and in the error's ``run``.
        CouplingError: what the models exchange does not settle; as above.
    """
    system = _override(system, stop_time, step, algorithm)
    outcome = execute(system, kind=kind, output=output, figures=figures, threads=threads, progress=progress)
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
    progress: Progress | None = None,
) -> Run:
    """As `run`, but a model that fails ends the run with ``status = "failed"`` instead of raising."""
    directory = Path(output) if output is not None else None
    begin = clock.perf_counter()
    with Workspace() as workspace:
        try:
            checked = check(system, workspace, kind)
            system = checked.system
            if directory is not None:
                _open_directory(directory, system, checked, kind)
            outcome = _simulate(system, checked, directory, progress, begin, threads=threads)
        finally:
            forget_paths(workspace.folder)
    outcome.directory = directory
    evaluate(outcome)
    if directory is not None:
        if figures and len(outcome.results):
            outcome.figures = draw(system.figures, outcome.results, directory)
        record_file.finish(directory, outcome, kind)
    return outcome


def evaluate(outcome: Run) -> None:
    """Fill in metrics, verdicts and published values from what was recorded."""
    system, results = outcome.system, outcome.results
    if not len(results):
        return
    outcome.metrics = evaluate_metrics(system.metrics, results)
    outcome.requirements = judge_requirements(system.requirements, results)
    outcome.published = judge(
        system.published,
        outcome.metrics,
        system.preset,
        system.modified,
        default_preset=system.default_preset,
        completed=outcome.status == "completed",
    )


def _override(system: System, stop_time: float | None, step: float | None, algorithm: Algorithm | None) -> System:
    changes: dict[str, Any] = {}
    if stop_time is not None and stop_time != system.stop_time:
        changes["stop_time"] = stop_time
    if step is not None and step != system.step:
        changes.update(step=step, rescaled_from=system.rescaled_from or system.step)
        changes["instances"] = {name: _rescaled(x, system.step, step) for name, x in system.instances.items()}
        if system.record is not None and system.record < step:
            changes["record"] = None
    if algorithm is not None and algorithm != system.algorithm:
        changes["algorithm"] = algorithm
    return replace(system, **changes, modified=True) if changes else system


def _rescaled(instance: Instance, before: float, step: float) -> Instance:
    """A sample time that was given as the old step follows the new one."""
    if instance.start.get("sample_time") != before:
        return instance
    return replace(instance, start={**instance.start, "sample_time": step})


def _open_directory(directory: Path, system: System, checked: Checked, kind: Kind) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
        record_file.write(directory, system, checked, kind)
    except OSError as error:
        raise RailcosimError(f"the output directory {directory} cannot be used: {error.strerror or error}") from error


def _simulate(
    system: System,
    checked: Checked,
    directory: Path | None,
    progress: Progress | None,
    begin: float,
    *,
    threads: int,
) -> Run:
    slaves: dict[str, Slave] = {}
    outcome = Run(system, _results(system, checked, None, "failed"), "failed", checked)
    outcome.seconds = {"setup": 0.0, "stepping": 0.0, "steps": 0}
    recorder: Recorder | None = None
    master: Master | None = None
    with _interruptible() as stopped:
        try:
            for name, model in checked.models.items():
                slaves[name] = model.instantiate(name)
            wiring = checked.wiring
            settings = Settings.of(system, threads)
            master = Master(
                slaves, checked.order.sequence, wiring.links, wiring.starts, system.algorithm, settings=settings
            )
            master.initialize(system.start_time, system.stop_time)
            recorder = Recorder(master.signals, master.kinds, directory)
            recorder.extend([[system.start_time, *master.values]])
            outcome.seconds["setup"] = clock.perf_counter() - begin
            observe = _observer(system, master, recorder, progress, stopped)
            outcome.status = "completed" if _step(system, master, observe, outcome.seconds) else "interrupted"
            master.terminate()
        except StoppedError as error:
            outcome.status, outcome.error = "terminated", error
        except RunError as error:
            outcome.status, outcome.error = "failed", error
        except KeyboardInterrupt:  # a second Ctrl-C
            outcome.status = "interrupted"
        except BaseException as error:  # initial values that do not settle
            if directory is not None:
                record_file.abandon(directory, error)
            raise
        finally:
            if recorder is not None:
                recorder.close()
            if master is not None:
                outcome.coupling = master.report()
            for slave in slaves.values():
                slave.free()
    outcome.results = _results(system, checked, recorder, outcome.status)
    return outcome


def _step(system: System, master: Master, observe: Observer, seconds: dict[str, float]) -> bool:
    """The communication steps, with their wall time noted however they end."""
    count = round((system.stop_time - system.start_time) / system.step)
    every = round(system.record / system.step) if system.record is not None else int(system.algorithm != "adaptive")
    begin = clock.perf_counter()
    try:
        return master.run(system.start_time, system.step, count, every, observe)
    finally:
        seconds.update(stepping=clock.perf_counter() - begin, steps=master.steps)


def _observer(
    system: System, master: Master, recorder: Recorder, progress: Progress | None, stopped: threading.Event
) -> Observer:
    last = system.stop_time - 0.5 * system.step
    percent = 0.01 * (system.stop_time - system.start_time)
    shown, told = clock.monotonic(), 0

    def observe(k: int, rows: Rows) -> bool:
        nonlocal shown, told
        recorder.extend(rows)
        time = master.time
        if stopped.is_set() and time < last and not (len(rows) and rows[-1][0] == time):
            recorder.extend([[time, *master.values]])  # the point at which the run was stopped
        reached = int((time - system.start_time) / percent + 1e-9)
        if progress is not None and (reached > told or clock.monotonic() - shown > 0.1 or time >= last):
            shown, told = clock.monotonic(), reached
            progress(time, system.stop_time)
        return not stopped.is_set()

    return observe


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """Turn Ctrl-C into an event that is looked at between steps: never inside an FMU, and nothing is lost."""
    stopped = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stopped
        return
    before = signal.getsignal(signal.SIGINT)

    def stop(*_: Any) -> None:
        stopped.set()
        signal.signal(signal.SIGINT, before)  # a second Ctrl-C does not wait

    signal.signal(signal.SIGINT, stop)
    try:
        yield stopped
    finally:
        signal.signal(signal.SIGINT, before)


def _results(system: System, checked: Checked, recorder: Recorder | None, status: Status) -> Results:
    time, columns = (np.empty(0), {}) if recorder is None else recorder.columns()
    units, parameters = {}, {}
    for instance, model in checked.models.items():
        starts = checked.wiring.starts[instance]
        for variable in model.interface.variables.values():
            name = f"{instance}.{variable.name}"
            if variable.unit is not None:
                units[name] = variable.unit
            if variable.causality == "parameter":
                parameters[name] = starts.get(variable.name, variable.start)
    return Results(
        columns,
        time,
        units=units,
        parameters=parameters,
        step=system.step,
        stop_time=system.stop_time,
        completed=status == "completed",
        figures=system.figures,
    )
