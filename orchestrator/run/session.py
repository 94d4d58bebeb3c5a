"""One simulation of a checked system: instances, master and recorder from the first to the last communication point."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import world
from ..errors import RollbackError, RunError, StoppedError
from ..evaluation import Signals
from ..fmi import Interface, Kind, Slave
from ..fmi.guard import run_guarded
from ..isolation import become_known
from ..master import ALGORITHMS, Master, Rows
from ..times import slack
from . import record as record_file
from .assembly import assembled
from .checking import Checked
from .checkpoint import Checkpoint
from .crew import Crew
from .directory import RunDirectory
from .ending import Interruption
from .outcome import Status
from .pacing import Pacer, RealTime
from .recording import Due, Recording, Results, Telling, check_stored, kept_signals
from .watching import Finding, Watching

Progress = Callable[[float, float], None]
"""Called now and then with the time reached and the stop time, both in s."""


@dataclass(frozen=True)
class Job:
    """How a system is to be run.

    Attributes:
        kind: how components become models.
        place: where the files go; None keeps everything in memory.
        threads: that step instances in parallel.
        checkpoint_every: distance of checkpoints in s, if there are any.
        begin: the checkpoint to begin at, if the run goes on.
        progress: told of how far it has got.
        writing: told of how far results.csv has got.
        real_time: how it keeps pace with the clock, if it does.
    """

    kind: Kind
    place: RunDirectory | None = None
    threads: int = 1
    checkpoint_every: float | None = None
    begin: Checkpoint | None = None
    progress: Progress | None = None
    writing: Telling | None = None
    real_time: RealTime | None = None


class Session:
    """Simulates.

    Args:
        checked: the system, found fit to run.
        job: how to run it.
        before: how many rows the run's files have, if it goes on (`rows_before`).
        crew: instances that stay loaded from run to run: nothing is watched then, signals are heard elsewhere, and no
            more is kept than the crew wants.

    Attributes:
        status: how it ended; error: why it failed or ended early.
        seconds: wall time of ``setup`` and ``stepping``, and the number of communication ``steps``.
        coupling: how the master's iterations, step sizes, loops and events went.
    """

    def __init__(self, checked: Checked, job: Job, before: Sequence[int] = (0, 0), crew: Crew | None = None) -> None:
        self.checked, self.job = checked, job
        self.system = checked.system
        self.status: Status = "failed"
        self.error: RunError | None = None
        self.seconds: dict[str, float] = {"setup": 0.0, "stepping": 0.0, "steps": 0}
        self.coupling: dict[str, Any] = {}
        self._before = before
        self._recording: Recording | None = None
        self._watching: Watching | None = None
        self._slaves: Mapping[str, Slave] = {}
        self._master: Master | None = None
        self._crew = crew
        self._pacer: Pacer | None = None
        self.interruption = Interruption(self._abandon) if crew is None else crew.interruption
        self._restoring: list[str] = []
        self._is_complete = False

    def run(self, begin: float, complete: Callable[[], None]) -> None:
        """Run from the first to the last point; a failing model is no exception here but a status.

        Args:
            begin: when the set-up began, by the performance counter.
            complete: called when all is recorded and nothing is given back yet: an FMU may end the process then.

        Raises:
            ScenarioError: initial values do not settle.
        """
        place = None if self.job.place is None else self.job.place.path
        with self._listening(), run_guarded(self._lose, place):
            try:
                while not self._attempt(begin, complete):
                    pass
            except BaseException as error:  # initial values that do not settle
                if self.job.place is not None:
                    record_file.abandon(self.job.place.path, error)
                raise
        if not self._is_complete:
            complete()

    def _listening(self) -> AbstractContextManager[None]:
        return self.interruption.listening() if self._crew is None else nullcontext()

    def _attempt(self, begin: float, complete: Callable[[], None]) -> bool:
        """Run; False where it has to be begun anew, with an instance restored after steps that it discards."""
        try:
            with self._ending(), self._assembled() as master:
                self._slaves, self._master = master.slaves, master
                with self._ending():
                    self._simulate(master, begin)
                complete()
                self._is_complete = True
        except RollbackError as error:
            self._restoring.append(error.instance)
            return False
        return True

    def _assembled(self) -> AbstractContextManager[Master]:
        if self._crew is not None:
            return self._crew.assembled(self.checked, self._restoring)
        return assembled(
            self.checked,
            threads=self.job.threads,
            restoring=self._restoring,
            stopped=lambda: self.interruption.is_asked_for,
        )

    def _lose(self, error: RunError) -> None:
        """An FMU is about to end the process: keep what there is."""
        self._save("failed", str(error))

    def _abandon(self, why: str) -> None:
        """The process is about to end, because an FMU does not return: keep what there is."""
        self._save("interrupted", why)

    def _save(self, status: Status, why: str) -> None:
        """Bring to the disk what was recorded, and how the run has ended, unless all that is done."""
        if self._is_complete or self.job.place is None:
            return
        if self._recording is not None and self._master is not None:
            self._master.rescue()
            self._recording.flush()
        record_file.add(self.job.place.path, status=status, error=why)

    @contextmanager
    def _ending(self) -> Iterator[None]:
        """Make a status of what ends a run."""
        try:
            yield
        except RollbackError:
            raise
        except StoppedError as error:
            self.status, self.error = "terminated", error
        except RunError as error:
            self.status, self.error = "failed", error
        except KeyboardInterrupt:  # a second Ctrl-C
            self.status = "interrupted"

    def _simulate(self, master: Master, begin: float) -> None:
        try:
            self._begin(master)
            self.seconds["setup"] = world.perf_counter() - begin
            self.status = "completed" if self._step(master) else "interrupted"
        finally:
            if self._recording is not None:
                self._recording.close()
            self.coupling = master.report() | ({"real_time": self._pacer.report()} if self._pacer else {})
            if self._restoring:
                names = ", ".join(self._restoring)
                told = f"{names} discards steps, and is restored before it goes on: the run was begun anew for that"
                self.coupling["rollback"] = {"instances": list(self._restoring), "summary": told}
        master.terminate()
        if self.status == "completed":
            become_known(self.checked.models.values())

    def disturbances(self) -> list[str]:
        """What FMUs have done to the process, a sentence each."""
        return [
            f"{name} ({slave.interface.model}) {'; '.join(slave.disturbed)}; isolate it to keep that to itself"
            for name, slave in self._slaves.items()
            if slave.disturbed
        ]

    def _begin(self, master: Master) -> None:
        """Bring instances to their initial state, or that of the checkpoint, and the rows up to there."""
        system = self.system
        master.initialize(
            system.stepping.start_time, system.stepping.stop_time, may_go_on=self.job.checkpoint_every is not None
        )
        crew = self._crew
        if crew is None:
            self._watching = Watching(system, self._interfaces, self.checked.wiring, master.signals)
        place, begin = self.job.place, self.job.begin
        directory, identity = (None, "") if place is None else (place.path, place.identity)
        if begin is not None and self._watching is not None:
            begin.restore(master)
            self._watching.restore(begin.seen)
        recording = Recording(
            master.signals,
            master.kinds,
            self._judged,
            directory,
            identity=identity,
            before=self._before,
            expected=0 if ALGORITHMS[system.stepping.algorithm].varies_step else self._count + 1,
            **kept_signals(master.signals, system.stepping) if crew is None else {"only": crew.only},
        )
        if begin is None or directory is None:
            first = [[system.stepping.start_time, *master.values]]
            recording.see(first, first)
            if self._watching is not None:
                self._watching.see(first)
        else:
            recording.go_on(directory, record_file.read(directory), begin.marks)
        self._recording = recording

    @property
    def _count(self) -> int:
        """Communication steps of the system's length."""
        stepping = self.system.stepping
        return round((stepping.stop_time - stepping.start_time) / stepping.step)

    @property
    def _row_every(self) -> float:
        """After how many steps a point is a result; 0 after each of varying length."""
        stepping = self.system.stepping
        varies = ALGORITHMS[stepping.algorithm].varies_step
        if stepping.record is None:
            return 0.0 if varies else 1.0
        every = stepping.record / stepping.step
        return every if varies else float(round(every))

    @property
    def _judged(self) -> Collection[str] | None:
        """The signals that metrics and requirements look at; None where every point of all is a result."""
        every_point = self._row_every == (0.0 if ALGORITHMS[self.system.stepping.algorithm].varies_step else 1.0)
        if every_point and (self._crew is not None or not self.system.stepping.record_only):
            return None
        return self.checked.judge.needed_signals if self._crew is None else self._crew.kept

    def _step(self, master: Master) -> bool:
        """The communication steps, with checkpoints between them; True unless they were interrupted."""
        system, every, count = self.system, self.job.checkpoint_every, self._count
        varies, row_every = ALGORITHMS[system.stepping.algorithm].varies_step, self._row_every
        stride = count if every is None else max(1, round(every / system.stepping.step))
        # Every point is watched; of steps of one length those that are recorded are picked out of all.
        told_every, kept_every = (row_every, 1) if varies else (1, int(row_every))
        observe = self._observer(master, Due(kept_every, count), -1 if varies else count)
        assert self._recording is not None
        table = None if varies or (self._crew is None and system.stepping.record_only) else self._recording.lend()
        begin, before = world.perf_counter(), master.steps
        if self.job.real_time is not None:
            self._pacer = Pacer(self.job.real_time, master.time, lambda: self.interruption.is_asked_for)
        pacer = self._pacer
        try:
            while True:
                late = slack(system.stepping.step, system.stepping.start_time, master.time)
                passed = math.floor((master.time - system.stepping.start_time + late) / system.stepping.step)
                until = min(count, (passed // stride + 1) * stride)
                until = min(until, passed + (pacer.due(master.time, system.stepping.step) if pacer else stride))
                points = {"first": master.steps, "until": until}
                times = system.stepping.start_time, system.stepping.step
                if not master.run(*times, count, told_every, observe, **points, table=table):
                    return False
                if pacer is not None:
                    pacer.meet_all(range(passed + 1, until + 1), system.stepping.start_time, system.stepping.step)
                if until == count:
                    return True
                if until % stride == 0:
                    self._keep(master)
        finally:
            self.seconds.update(stepping=world.perf_counter() - begin, steps=master.steps - before)

    def _observer(self, master: Master, due: Due, count: int) -> Callable[[int, Rows], bool]:
        assert self._recording is not None
        system, interruption, progress = self.system, self.interruption, self.job.progress
        recording, watching = self._recording, self._watching
        last = system.stepping.stop_time - 0.5 * system.stepping.step
        percent = 0.01 * (system.stepping.stop_time - system.stepping.start_time)
        shown, told = world.monotonic(), 0

        def observe(steps: int, rows: Rows) -> bool:
            nonlocal shown, told
            time = master.time
            if steps == count:  # the end is what the user wrote, whatever start + k * step is rounded to
                end: Any = rows[-1]
                end[0] = time = system.stepping.stop_time
            points = rows if len(rows) else [[time, *master.values]]
            kept = due.of(steps, rows)
            if watching is not None:
                watching.see(points)
            recording.see(points, kept, whole=time >= system.stepping.stop_time)
            reached = int((time - system.stepping.start_time) / percent + 1e-9)
            if progress is not None and (reached > told or world.monotonic() - shown > 0.1 or time >= last):
                shown, told = world.monotonic(), reached
                progress(time, system.stepping.stop_time)
            if not interruption.is_asked_for:
                return True
            if time < last and not (len(kept) and kept[-1][0] == time):
                recording.see((), [[time, *master.values]], whole=True)  # the point at which the run was stopped
            return False

        return observe

    def _keep(self, master: Master) -> None:
        """Write a checkpoint of the present point, and first the rows up to it."""
        job, recording = self.job, self._recording
        assert job.place is not None
        assert recording is not None
        assert self._watching is not None
        recording.flush(sync=True)
        point = Checkpoint.take(
            self.system,
            self.checked.models,
            master,
            kind=job.kind,
            marks=recording.marks,
            every=job.checkpoint_every,
            seen=self._watching.save(),
            run=job.place.identity,
        )
        point.write(job.place.path)

    @property
    def _interfaces(self) -> dict[str, Interface]:
        return {name: model.interface for name, model in self.checked.models.items()}

    @property
    def recording(self) -> Recording | None:
        """What was kept; None where it failed before its first point."""
        return self._recording

    def findings(self, results: Results) -> list[Finding]:
        """What was found on the way, given what was recorded."""
        return [] if self._watching is None else self._watching.findings(results, self.error)

    @property
    def rows(self) -> list[int]:
        """How many results are on the disk, and their checksum."""
        return [0, 0] if self._recording is None else self._recording.marks[0]

    def judged(self, results: Results) -> Signals:
        """What metrics and requirements look at: every communication point."""
        return results if self._recording is None else self._recording.judged(results)

    def results(self) -> Results:
        """What was recorded."""
        recording = self._recording
        columns: Mapping[str, Any] = {"time": np.empty(0)} if recording is None else recording.columns()
        parameters: dict[str, Any] = dict(self.checked.wiring.left)
        for instance, model in self.checked.models.items():
            starts = self.checked.wiring.starts[instance]
            for variable in model.interface.of("parameter"):
                parameters[f"{instance}.{variable.name}"] = starts.get(variable.name, variable.start)
        return Results(
            columns,
            None,
            units=self.checked.units,
            parameters=parameters,
            step=self.system.stepping.step,
            stop_time=self.system.stepping.stop_time,
            completed=self.status == "completed",
            figures=self.system.judged.figures,
        )


def rows_before(job: Job) -> list[int]:
    """How many rows the files of a run that goes on have, beyond its checkpoint too.

    Raises:
        ScenarioError: the results are not those of the checkpoint.
    """
    if job.begin is None or job.place is None:
        return [0, 0]
    return check_stored(job.place.path, record_file.read(job.place.path), job.begin.marks)
