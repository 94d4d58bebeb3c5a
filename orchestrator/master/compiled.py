"""The bridge to the compiled step loop: blocks of steps by an algorithm's plan, and what happens when an FMU fails.

The kernel is an optional extension: without it, or for what it does not do (components as Python objects), steps are
taken in Python with identical results.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import world
from ..errors import FmuError, LostError, RunError
from ..fmi.binding import DISCARD, LoadedSlave
from ..fmi.guard import GUARD, NOTE_SIZE, NOTES, own_note, said
from ..isolation import IsolatedSlave, Ride
from .algorithms import Programmed, Repeated
from .coupling import Coupling
from .observer import Observer, Table
from .plans import APART, CHANGES, CONTROL, PLACE, SIZES, SWING, Kind, Plan, is_able

try:
    from . import kernel
except ImportError:  # installed without a C compiler
    kernel = None  # type: ignore[assignment]

HAS_KERNEL = kernel is not None
_look: Any = getattr(kernel, "look", None)
HAS_THREADS = HAS_KERNEL and bool(kernel.HAS_THREADS)
_BLOCK_SECONDS = 0.05
"""Wall time a block is meant to take: short enough for Ctrl-C and a progress bar, long enough to cost nothing."""
_GROWTH = 256
"""How many times longer than the last a block may be: the first is a single step, of which nothing is known."""
MOST_VALUES = 4_000_000
"""Numbers a block may record, so that its buffer stays small."""


_FIXED = np.zeros(0, CONTROL)
"""Steps do not vary."""


def _check_layout(found: int) -> None:
    """Raise unless the kernel was compiled from the sources that stand beside this file."""
    if found != reduce(lambda total, size: 31 * total + size & 0x7FFFFFFF, SIZES, NOTE_SIZE + SWING.itemsize):
        raise RuntimeError(
            "the compiled step loop (orchestrator/master/kernel) is of another version than its Python files: install "
            "the package again (`pip install -e . --no-deps` in a checkout)"
        )


if HAS_KERNEL:
    _check_layout(getattr(kernel, "LAYOUT", 0))
    if GUARD:
        kernel.watch(GUARD)


def changes_of(plan: Plan) -> NDArray[np.void]:
    """What events make of values now: another number, or of a text another one."""
    rows = []
    for slot, place, kind in plan.changes:
        what = slot.scale, slot.offset, slot.slope, slot.since
        if kind == "String":
            assert plan.wide.texts is not None
            what = 0.0, plan.wide.texts.number(slot.text), 0.0, 0.0
        rows.append((slot.active, place, kind == "Real", *what))
    return np.array(rows, dtype=CHANGES)


class CompiledLoop:
    """An algorithm's plan for the kernel."""

    @classmethod
    def of(cls, coupling: Coupling, algorithm: Programmed) -> CompiledLoop | None:
        """One that takes these steps, where the kernel is there and can do all that is asked for."""
        repeated = [name for part in algorithm.program() if isinstance(part, Repeated) for name in part.batch.names]
        able = kernel is not None and is_able(coupling, repeated)
        return cls(coupling, algorithm) if able else None

    def __init__(self, coupling: Coupling, algorithm: Programmed) -> None:
        self._coupling, self._algorithm = coupling, algorithm
        self._exchange = coupling.exchange
        is_shared = kernel.HAS_THREADS and algorithm.takes_threads and "String" not in self._exchange.kinds
        is_shared = is_shared and coupling.refresher is None and coupling.loops is None
        is_shared = is_shared and not any(isinstance(slave, IsolatedSlave) for slave in coupling.slaves.values())
        threads = max(1, min(coupling.settings.threads, len(coupling.slaves))) if is_shared else 1
        self.plan = Plan(coupling, [algorithm.program()], threads=threads)
        self._under_way: tuple[Table, Observer, float, float] | None = None
        self._note = 0

    def run(
        self,
        start_time: float,
        step: float,
        points: tuple[int, int, int],
        every: int,
        observe: Observer,
        *,
        table: Table | None = None,
    ) -> bool:
        """Take communication steps in blocks; True unless the observer stopped the run.

        Args:
            start_time: in s.
            step: in s.
            points: numbers of the communication points to begin at, to stop at, and of the run's last.
            every: a row is due after every so many steps, and after the last.
            observe: given the rows.
            table: where they are kept, if there is no text among them; without one they may go when they were observed.

        Raises:
            FmuError: a model failed, or a value is not finite.
        """
        coupling, exchange, wide = self._coupling, self._exchange, self.plan.wide
        done, stop, count = points
        self._note = own_note()
        self.plan.follow()
        places = np.zeros(self.plan.threads, PLACE)
        places["failed"] = -1
        disturbed = np.zeros(len(self.plan.operations), np.int64)
        values = wide.packed(exchange.values)
        history, newest = self._unrolled(len(values))
        changes = changes_of(self.plan)
        self.plan.courses.load()
        goes_on, block = True, 1
        most = max(1, MOST_VALUES // (len(values if table is None else table.kept) + 1)) * every
        while done < stop and goes_on:
            block = min(block, stop - done, most)
            due = _rows_due(done, block, every, count)
            into = Table(range(len(exchange.values)), due) if table is None else table
            cells = into.room(due)
            self._under_way = into, observe, start_time, step
            for ride in self.plan.rides:
                ride.board()
            for ride in self.plan.rides:
                ride.begin()
            begin = world.perf_counter()
            taken, written, newest = kernel.run(
                *(
                    *self.plan.arrays,
                    changes,
                    into.kept,
                    values,
                    history,
                    newest,
                    cells,
                    into.count,
                    places,
                    disturbed,
                    _FIXED,
                    wide.texts and wide.texts.table,
                ),
                *(every, start_time, step, done, block, count),
            )
            seconds = world.perf_counter() - begin
            self._under_way = None
            done += taken
            self._tell_disturbers(disturbed, done, places)
            coupling.steps, coupling.time = done, start_time + done * step
            for slave in coupling.slaves.values():  # at events they are called in Python
                slave.time = coupling.time
            exchange.values[:] = wide.unpacked(values)
            self.plan.courses.store()
            self._algorithm.note_steps(taken)
            if taken:
                self._roll(history, newest)
                goes_on = observe(done, wide.told(into.filled(written)))
            if goes_on:
                self._go_on(places, start_time + done * step, step)
            block = longer(taken, seconds)
            if wide.texts is not None and wide.texts.are_many and not places["begin"].any():
                wide.texts.begin_anew()
                values, changes = wide.packed(exchange.values), changes_of(self.plan)
                history, newest = self._unrolled(len(values))
        self.plan.forget_arrays()
        for ride in self.plan.rides if goes_on else ():
            ride.settle()
        return goes_on

    def rescue(self) -> None:
        """Tell the observer of the rows that the block under way has written, which does not return any more."""
        if self._under_way is None:
            return
        table, observe, start_time, step = self._under_way
        written = int(NOTES.note(self._note)[3])
        if written:
            rows = self.plan.wide.told(table.filled(written))
            time, *values = np.asarray(rows[-1], dtype=object).tolist()
            self._coupling.steps, self._coupling.time = round((time - start_time) / step), time
            for place, value in zip(table.kept.tolist(), values, strict=True):
                self._exchange.values[place] = value
            observe(self._coupling.steps, rows)

    def _tell_disturbers(self, disturbed: NDArray[np.int64], done: int, places: NDArray[np.void]) -> None:
        """Note who did it, in a step that was left up to what failed first: without threads there is nothing after."""
        failed = min((self.plan.rank(n) for n in places["failed"].tolist() if n >= 0), default=None)
        for operation in np.flatnonzero(disturbed).tolist():
            slave = self.plan.culprits[operation][0]
            if isinstance(slave, LoadedSlave) and (
                disturbed[operation] <= done or (failed is not None and self.plan.rank(operation) <= failed)
            ):
                slave.mend()
                disturbed[operation] = 0

    def _unrolled(self, width: int) -> tuple[NDArray[np.float64], int]:
        """The recorded points that delayed connections look back on, as the kernel's ring, and its newest row."""
        kept = list(self._exchange.history)
        rows = [*[kept[0]] * (self._exchange.depth - len(kept)), *kept] if kept else []
        packed = np.array([self.plan.wide.packed(row) for row in rows], dtype=np.float64)
        return packed.reshape(len(rows), width), max(0, len(rows) - 1)

    def _roll(self, history: NDArray[np.float64], newest: int) -> None:
        if len(history):
            self._exchange.history.extend(map(self.plan.wide.unpacked, np.roll(history, -newest - 1, axis=0)))

    def _go_on(self, places: NDArray[np.void], time: float, step: float) -> None:
        """After the first failure of a step let its part of the step go on; those after it wait for their turn."""
        failed: list[int] = places["failed"].tolist()
        if max(failed) >= 0:
            waiting = (n for n, operation in enumerate(failed) if operation >= 0)
            part = min(waiting, key=lambda n: self.plan.rank(failed[n]))
            try:
                again = self._see_to(failed[part], int(places[part]["status"]), time, step)
            except BaseException:
                self._leave_alone(place for n, place in enumerate(places) if n != part and place["failed"] >= 0)
                raise
            places[part] = failed[part] + (not again), -1, 0

    def _leave_alone(self, places: Iterable[np.void]) -> None:
        """Let those that have failed as well, in other threads, know it: some must not be given back as others are."""
        for place in places:
            slave, call = self.plan.culprits[place["failed"]]
            status = int(place["status"])
            assert isinstance(slave, LoadedSlave)
            if status >> 32 > 0:
                slave.lose(call)
            else:
                slave.settle(status)

    def _see_to(self, failed: int, status: int, time: float, step: float) -> bool:
        """See to an operation that failed, as `_recover` says; states that were saved are given back."""
        try:
            if failed in self.plan.iterations:
                self.plan.iterations[failed].give_up(time, step)
                return False
            if failed in self.plan.algebra.solving:
                raise self.plan.algebra.solving[failed].failure(time + step)
            return self._recover(failed, status, time, step)
        except RunError as failure:
            told = failure
            slave = self.plan.culprits[failed][0]
            is_before = isinstance(slave, Ride) and slave.failed in ("save", "restore")  # and told in the round
            if failed in self.plan.rounds and isinstance(failure, FmuError) and not is_before:
                told = self.plan.rounds[failed].explain(failure, time, step)
            self.plan.forget(time)
            if told is failure:
                raise
            raise told from failure

    def _recover(self, failed: int, status: int, time: float, step: float) -> bool:
        """Go on where an FMU discarded a step that it takes in parts; raise what happens in Python otherwise.

        True where the operation that failed is to be done again.
        """
        slave, call = self.plan.culprits[failed]
        assert slave is not None
        kind, _, period, phase = self.plan.operations[failed]
        is_late = self.plan.late[failed]
        is_of_end = "Get" in call if kind < Kind.SAVE else kind != Kind.SAVE
        when = time + (period - phase) * step if is_of_end or (kind == Kind.SET and is_late) else time
        if kind == Kind.STEP and 0 <= status <= DISCARD and isinstance(slave, LoadedSlave):  # or it ended early
            slave.resume(time, period * step, status, final=not is_late)
            return False
        owner = self._coupling.slaves[slave.name]
        owner.time = when
        if kind == Kind.SET and 0 <= status <= 1:  # a number that its type does not hold
            self._exchange.is_at_point = is_late
            self._exchange.write(slave.name, when)
        if status >> 32 > 0 and not isinstance(slave, Ride):  # a call that was left, how, and with which exit code
            raise slave.lose(said(call, status >> 32, (status & 0x7FFFFFFF) - (status & 0x80000000)))
        try:
            if not isinstance(slave, Ride):
                slave.check(call, status)
            elif not 0 <= status <= 1:
                return slave.recover(call, status, when, apart=kind in APART)
        except FmuError as error:
            is_refusal = kind == Kind.SLOPES and (not isinstance(slave, Ride) or slave.failed == "interpolate")
            is_over = error.status == "fatal" or isinstance(error, LostError)
            if not is_refusal or is_over or self._coupling.extrapolator is None:
                raise
            self._coupling.extrapolator.refuse(slave.name, error, time)
            self.plan.courses.load()
            return False
        self._exchange.check_finite(owner)
        return False


def _rows_due(done: int, block: int, every: int, count: int) -> int:
    """How many of the next steps are recorded: every so many, and the last."""
    end = done + block
    return end // every - done // every + int(end == count and count % every != 0)


def is_there() -> bool:
    """Whether there is a kernel."""
    return kernel is not None


def run_kernel(*arguments: Any) -> tuple[int, int, int]:
    """What kernel.pyi says of ``run``."""
    found: tuple[int, int, int] = kernel.run(*arguments)
    return found


def longer(taken: int, seconds: float) -> int:
    """How many steps the next block may have, after one of so many that took a wall time in s."""
    return max(1, int(taken * min(_BLOCK_SECONDS / max(seconds, 1e-9), _GROWTH)))


def note_swings(swings: NDArray[np.void], number: int, values: NDArray[np.float64]) -> None:
    """Take the next values of a signal in, whose `SWING` has this number; without the kernel nothing is noted."""
    if HAS_KERNEL:
        _look(swings, number, np.ascontiguousarray(values))
