"""Steps of varying length: the loop over them, and the bridge to the compiled one.

What does not go well in the compiled loop, an FMU that fails or a tolerance that cannot be kept, it leaves: the states
at the begin of that step are restored, and the algorithm takes it in Python, as it takes all where there is no kernel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import world
from ..errors import RunError
from ..fmi.binding import FATAL, LoadedSlave
from ..fmi.guard import NOTES, own_note, said
from ..isolation import Ride
from ..times import slack
from . import compiled
from .algorithms import VariableStep
from .algorithms.adaptive import Adaptive
from .coupling import Coupling
from .observer import Observer, Rows
from .plans import APART, CONTROL, PLACE, Kind, Plan, is_able


@dataclass(frozen=True)
class Span:
    """Of a run: its ``start`` and ``last`` time and longest ``step``, in s; a row is due after ``every`` of these."""

    start: float
    step: float
    last: float
    every: float

    @property
    def late(self) -> float:
        """How far apart two points may be that are meant to be one, in s."""
        return slack(self.step, self.start, self.last)

    def next_row(self, time: float) -> float:
        """The next point at which a row is due, in s; the last where one is due after each step."""
        if not self.every:
            return self.last
        stride = self.every * self.step
        done = math.floor((time - self.start) / stride + self.late / stride)
        row = self.start + (done + 1) * self.every * self.step
        return row if row < self.last - self.late else self.last


class VaryingLoop:
    """Takes steps of varying length.

    Args:
        coupling: the instances and what they exchange.
        algorithm: what chooses the steps.
        happen: lets events happen that are due at the present point, or by so many s later; the other argument is
            called before a failure is passed on.
        next_time: when the next event is due, in s.
    """

    def __init__(
        self,
        coupling: Coupling,
        algorithm: VariableStep,
        happen: Callable[[float, Callable[[], object]], bool],
        next_time: Callable[[], float],
    ) -> None:
        self._coupling, self._algorithm = coupling, algorithm
        self._happen, self._next_time = happen, next_time
        self._blocks: Blocks | None = None
        self._is_refused = False
        """Whether the compiled loop cannot do all that is asked for."""

    def run(self, span: Span, end: float, observe: Observer) -> bool:
        """Take steps up to a time in s; True unless the observer stopped the run.

        Raises:
            FmuError: a model failed, or a value is not finite.
            CouplingError: what is exchanged cannot be kept within its tolerance.
        """
        coupling, late = self._coupling, span.late
        while coupling.time < end:
            due, begin = self._next_time(), coupling.time
            taken = self._take_block(span, end, due, observe)
            if taken is None:
                row = span.next_row(begin)
                time = self._algorithm.advance(begin, due if due < row - late else row, span.step)
                before, values = np.empty((0, 1)), list(coupling.exchange.values)
            else:
                rows, values = taken
                time = float(rows[-1, 0])
                before = rows[:-1] if due <= time + late or span.every else rows
            if len(before) and not self._tell(span, before, observe):
                return False
            if len(before) and before[-1, 0] == time:
                coupling.exchange.values[:] = values
                continue
            is_due = not span.every or time == span.next_row(coupling.time)
            coupling.steps, coupling.time, coupling.exchange.values[:] = coupling.steps + 1, time, values

            def tell(is_due: bool = is_due) -> bool:
                return observe(coupling.steps, [[coupling.time, *coupling.exchange.values]] if is_due else ())

            self._happen(late, tell)
            if not tell():
                return False
        return True

    def rescue(self) -> None:
        """Tell the observer of the rows that the block under way has written, which does not return any more."""
        under_way = self._blocks.written() if self._blocks is not None else None
        if under_way is not None:
            self._tell(*under_way)

    def _take_block(
        self, span: Span, end: float, due: float, observe: Observer
    ) -> tuple[NDArray[np.float64], list[Any]] | None:
        """A block of compiled steps; None where the next step is to be taken in Python."""
        algorithm, refresher = self._algorithm, self._coupling.refresher
        is_decided = isinstance(algorithm, Adaptive) and algorithm.is_decided
        is_decided = is_decided and (refresher is None or refresher.is_decided)
        if self._blocks is None and is_decided and not self._is_refused:
            assert isinstance(algorithm, Adaptive)
            self._blocks = Blocks.of(self._coupling, algorithm)
            self._is_refused = self._blocks is None
        return None if self._blocks is None else self._blocks.take(span, end, due, observe)

    def _tell(self, span: Span, rows: NDArray[np.float64], observe: Observer) -> bool:
        """Tell of points at which there is no event; True unless the observer stops the run."""
        coupling = self._coupling
        for part in [rows] if not span.every else rows[:, None]:
            is_due = not span.every or part[0, 0] == span.next_row(coupling.time)
            told = part if self._blocks is None else self._blocks.told(part)
            coupling.steps += len(part)
            coupling.time, *coupling.exchange.values[:] = np.asarray(told[-1], dtype=object).tolist()
            if not observe(coupling.steps, told if is_due else ()):
                return False  # as Ctrl-C does, the FMUs being at the block's end: nothing but their own ends may follow
        return True


class Blocks:
    """Blocks of compiled steps.

    Args:
        coupling: the instances and what they exchange.
        algorithm: what chooses the steps.
    """

    @classmethod
    def of(cls, coupling: Coupling, algorithm: Adaptive) -> Blocks | None:
        """Where the kernel is there, and can do all that is asked for."""
        if not compiled.is_there() or not is_able(coupling, coupling.slaves):
            return None
        return cls(coupling, algorithm)

    def __init__(self, coupling: Coupling, algorithm: Adaptive) -> None:
        self._coupling, self._algorithm, self._exchange = coupling, algorithm, coupling.exchange
        self._block = 1
        self._failure: BaseException | None = None
        self._is_left = False
        """Whether the next step is for Python."""
        self._under_way: tuple[Span, NDArray[np.float64], Observer] | None = None
        self._note = 0
        self._make()

    def _make(self) -> None:
        """Make the plan, with the connections that there are now."""
        algorithm, places = self._algorithm, self._algorithm.watched
        self._changed_links = self._exchange.changed_links
        self._plan = plan = Plan(self._coupling, algorithm.sections(), refreshing=1, watched=places)
        tolerances = np.array([algorithm.tolerances[place] for place in places]).reshape(-1, 2)
        plan.work[plan.spare : plan.spare + 2 * len(places)] = tolerances.T.ravel()
        self._control = control = np.zeros(1, CONTROL)
        control["value_count"], control["point_count"] = len(self._exchange.values), plan.courses.count
        control["work"] = plan.spare

    def take(
        self, span: Span, end: float, due: float, observe: Observer
    ) -> tuple[NDArray[np.float64], list[Any]] | None:
        """The rows of steps up to a time in s, to an event that is due, or to a jump, and the values at their end.

        None where the next step is for Python.

        Raises:
            RunError: what the step failed of that comes next.
            KeyboardInterrupt: it was waited for no more.
        """
        if self._failure is not None:
            raise self._failure
        if self._is_left:
            self._is_left = False
            return None
        if self._changed_links != self._exchange.changed_links:
            self._make()
        coupling, plan, control = self._coupling, self._plan, self._control[0]
        texts = plan.wide.texts
        if texts is not None and texts.are_many:
            texts.begin_anew()
        values = plan.wide.packed(self._exchange.values)
        for name, value in (("time", coupling.time), ("end", end), ("due", due), ("late", span.late), ("jump", -1)):
            control[name] = value
        for name in ("start", "step", "last", "every"):
            control[name] = getattr(span, name)
        self._algorithm.give(control, span.step)
        count = len(self._exchange.values)
        rows = np.empty((count + 1, max(1, min(self._block, compiled.MOST_VALUES // (count + 1)))))
        places, disturbed = np.array([(0, -1, 0)], PLACE), np.zeros(len(plan.operations), np.int64)
        plan.courses.load()
        for ride in plan.rides:
            ride.board()
        for ride in plan.rides:
            ride.begin()
        self._note, self._under_way = own_note(), (span, rows, observe)
        begin = world.perf_counter()
        taken, *_ = compiled.run_kernel(
            *(*plan.arrays, compiled.changes_of(plan), np.arange(count), values, np.empty(0), 0, rows, 0, places),
            *(disturbed, self._control, texts and texts.table, 1, 0.0, 0.0, 0, 0, 0),
        )
        self._block = compiled.longer(max(taken, 1), world.perf_counter() - begin)
        self._under_way = None
        plan.courses.store()
        self._algorithm.take(control)
        for culprit in {plan.culprits[n][0] for n in np.flatnonzero(disturbed).tolist()}:
            assert isinstance(culprit, LoadedSlave)
            culprit.mend()
        for slave in coupling.slaves.values():
            slave.time = float(control["time"])
        found = plan.wide.unpacked(values)
        if places["failed"][0] >= 0 or plan.holds_states:
            self._leave(*places[0].tolist()[1:])
            self._exchange.values[:] = found
        plan.forget_arrays()
        return (rows[:, :taken].T, found) if taken else self.take(span, end, due, observe)

    def _leave(self, failed: int, status: int) -> None:
        """Let Python take the step that was left, from its begin; or raise next time what it failed of for good."""
        time = float(self._control["time"][0])
        try:
            if failed >= 0:
                self._check(failed, status)
            self._plan.come_back(time)
            self._is_left = True
        except (RunError, KeyboardInterrupt) as failure:
            self._failure = failure
            while self._plan.holds_states:  # an FMU may refuse to take more than one back
                with suppress(RunError):
                    self._plan.forget(time)

    def _check(self, failed: int, status: int) -> None:
        """Raise if an FMU was lost, or gives no state back: what else may fail is tried again."""
        slave, call = self._plan.culprits[failed]
        if slave is None:  # nothing was called: a loop has no solution
            return
        kind, late = self._plan.operations[failed][0], self._plan.late[failed]
        is_of_end = kind in (Kind.GET, Kind.READ, Kind.ASK) or (kind == Kind.SET and late)
        when = float(self._control["called_at"][0] + is_of_end * self._control["called_for"][0])
        rides = self._plan.rides
        if isinstance(slave, Ride):
            rides = [slave, *rides]
        else:
            slave.time = when
            if status >> 32 > 0:
                raise slave.lose(said(call, status >> 32, (status & 0x7FFFFFFF) - (status & 0x80000000)))
            if status == FATAL or kind == Kind.FORGET:
                slave.check(call, status)
            slave.settle(status)
        for ride in rides:  # they may have failed as well
            ride.leave(when, apart=kind in APART)

    def told(self, rows: NDArray[np.float64]) -> Rows:
        """Rows as an observer takes them."""
        return self._plan.wide.told(rows)

    def written(self) -> tuple[Span, NDArray[np.float64], Observer] | None:
        """The rows that the block under way has written, of which run, and for whom; None where there are none."""
        if self._under_way is None:
            return None
        span, rows, observe = self._under_way
        count = int(NOTES.note(self._note)[3])
        return (span, rows[:, :count].T, observe) if count else None
