"""How time advances: initialization until connected values agree, then communication steps.

How a step is taken is the algorithm's; here is the loop over steps, with what happens between them. A point in time is
always ``start + k * step``, never a running sum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from ..errors import FmuError, RunError
from ..fmi import Slave
from ..fmi.binding import Watch
from ..times import slack
from ..wiring import Link
from .algebraic import LoopSolver, find_feeders, find_loops
from .algorithms import ALGORITHMS, Explicit, FixedStep, Programmed, VariableStep
from .compiled import CompiledLoop
from .coupling import Coupling
from .events import Schedule
from .exchange import types_of
from .initialization import settle
from .observer import Observer, Rows, Table
from .settings import DEFAULT, Settings
from .varying import Span, VaryingLoop


class Master:
    """Runs instantiated models.

    Args:
        slaves: the instances by name, instantiated, in the sequence in which they are recorded.
        sequence: their names in the order in which a Gauss-Seidel sweep steps them.
        links: scalar connections.
        starts: start values by instance and scalar name.
        algorithm: the name of one of `ALGORITHMS`.
        settings: how it couples beyond that.
    """

    def __init__(
        self,
        slaves: Mapping[str, Slave],
        sequence: Sequence[str],
        links: Sequence[Link],
        starts: Mapping[str, Mapping[str, Any]],
        algorithm: str,
        *,
        settings: Settings = DEFAULT,
    ) -> None:
        self.slaves = slaves
        chosen = ALGORITHMS[algorithm]
        self.coupling = Coupling(
            slaves,
            sequence,
            links,
            settings,
            is_sweeping=chosen.is_sweeping,
            is_of_end=chosen.is_of_end,
        )
        self.algorithm = chosen(self.coupling)
        self.exchange = self.coupling.exchange
        self.signals = self.exchange.signals
        self.values = self.exchange.values
        self.kinds = self.exchange.kinds
        self._starts = starts
        self._stop_time = 0.0
        self._schedule: Schedule | None = None
        self._compiled: CompiledLoop | None = None
        self._varying: VaryingLoop | None = None
        self._watch = Watch(slaves.values())

    def begin_again(
        self, slaves: Mapping[str, Slave], starts: Mapping[str, Mapping[str, Any]], settings: Settings
    ) -> bool:
        """Be as new, for another run of the same instances and connections; False where a new one has to be made.

        What the compiled kernel steps leaves nothing behind but values; what was made for it is kept.

        Args:
            slaves: the instances, reset.
            starts: start values.
            settings: how the run couples.
        """
        stepping = settings.stepping
        is_plain = isinstance(self.algorithm, Explicit) and not (settings.events or stepping.extrapolation)
        is_plain = is_plain and not stepping.refresh and stepping.algebraic_loops != "solve"
        if self._compiled is None or not is_plain or slaves != self.slaves or settings != self.coupling.settings:
            return False
        self._starts, self.coupling.steps = starts, 0
        self.exchange.clear()
        self._watch = Watch(slaves.values())
        return True

    @property
    def steps(self) -> int:
        """Communication steps taken."""
        return self.coupling.steps

    @property
    def time(self) -> float:
        """The communication point that has been reached, in s."""
        return self.coupling.time

    def _make_loop_solver(self, unsettled: Sequence[int]) -> LoopSolver | None:
        """For the loops that the FMUs' dependencies tell of or allow, and those that exchange did not settle."""
        interfaces, exchange = self.coupling.interfaces, self.exchange
        signals = {signal for loop in find_loops(interfaces, exchange.every_link, doubtful=True) for signal in loop}
        places = {k for k, signal in enumerate(self.signals) if signal in signals}
        places.update(unsettled)
        feeders = find_feeders(interfaces, exchange.every_link, {exchange.owners[k] for k in places})
        ordered = [slave for slave in self.coupling.sequence if slave.name in feeders]
        return LoopSolver(exchange, sorted(places), ordered) if places else None

    # ---------------------------------------------------------------- initialization

    def initialize(self, start_time: float, stop_time: float, *, may_go_on: bool = False) -> None:
        """Set start values and let connected values settle; time zero is that consistent state.

        Args:
            start_time: in s.
            stop_time: in s.
            may_go_on: whether the run may be resumed beyond its stop time, of which the models are then not told.

        Raises:
            FmuError: a model failed.
            ScenarioError: the connected values do not settle.
        """
        self.coupling.time, self._stop_time = start_time, stop_time
        for slave in self.slaves.values():
            slave.setup(start_time, math.inf if may_go_on else stop_time)
            self._set_starts(slave)
        for slave in self.slaves.values():
            slave.enter_initialization()
        for slave in self.slaves.values():
            self.exchange.read(slave, start_time)
        unsettled = settle(self.exchange, self.coupling.sequence, start_time)
        for slave in self.slaves.values():
            slave.exit_initialization()
        for slave in self.slaves.values():
            self.exchange.read_finite(slave, start_time)
        coupling, settings = self.coupling, self.coupling.settings
        if settings.stepping.algebraic_loops == "solve":
            coupling.loops = self._make_loop_solver(unsettled)
        if settings.events:
            self._schedule = Schedule(settings, self.exchange, start_time)
            self._let_happen(0.0, lambda: None)
        if coupling.extrapolator is not None:
            coupling.extrapolator.begin(start_time)
        self.exchange.remember()
        self._compile()

    def _set_starts(self, slave: Slave) -> None:
        given = self._starts.get(slave.name, {})
        variables = slave.interface.variables
        for kind in types_of(variables[name].type for name in given):
            names = [name for name in given if variables[name].type == kind]
            slave.channel(kind, names).set([given[name] for name in names])

    # ---------------------------------------------------------------- stepping

    def run(
        self,
        start_time: float,
        step: float,
        count: int,
        every: float,
        observe: Observer,
        *,
        first: int = 0,
        until: int | None = None,
        table: Table | None = None,
    ) -> bool:
        """Take communication steps; True unless the observer stopped the run.

        The compiled kernel takes them where it can, with identical results.

        Args:
            start_time: in s.
            step: in s.
            count: number of the last communication point of the run, counted from 0.
            every: a row is due after every so many steps, and after the last; with steps of varying length they need
                not be whole, and 0 means after each.
            observe: given the rows.
            first: number of the communication point to begin at.
            until: number of the one to end at now; ``count`` by default.
            table: where the compiled kernel keeps rows, if it takes the steps: those that are observed are there then.

        Raises:
            FmuError: a model failed, or a value is not finite; instance, variable and time are named.
            CouplingError: what is exchanged does not settle, or cannot be kept within its tolerance.
        """
        end = count if until is None else until
        if not self._watch.is_needed:
            return self._run(start_time, step, (first, end, count), every, observe, table=table)
        try:
            return self._run(start_time, step, (first, end, count), every, self._watching(observe), table=table)
        finally:
            self._watch.look(at_once=True)

    def _run(
        self,
        start_time: float,
        step: float,
        points: tuple[int, int, int],
        every: float,
        observe: Observer,
        *,
        table: Table | None,
    ) -> bool:
        first, end, count = points
        table = None if "String" in self.kinds else table
        if isinstance(self.algorithm, VariableStep):
            return self._run_variably(start_time, step, (end, count), every, observe)
        self.coupling.steps = first
        while self.steps < end:
            stop = end
            if self._schedule is not None:
                stop = int(min(end, self._schedule.next_point(start_time, step, self.steps)))
            refresher, into = self.coupling.refresher, None if self._compiled is None else table
            if refresher is not None and not refresher.is_decided:  # who refuses shows in the first step
                stop, into = self.steps + 1, table
            take = self._run_in_python if self._compiled is None else partial(self._compiled.run, table=table)
            observed = self._eventful(step, stop, observe, None if into is None else into.kept.tolist())
            if into is not None and self._compiled is None:
                observed = into.keeping(observed)
            if not take(start_time, step, (self.steps, stop, count), int(every), observed):
                return False
            self._compile()
        return True

    def _compile(self) -> None:
        """Let the compiled kernel take the steps from here on, if it can."""
        if isinstance(self.algorithm, Programmed) and self._compiled is None:
            self._compiled = CompiledLoop.of(self.coupling, self.algorithm)

    def _watching(self, observe: Observer) -> Observer:
        """An observer before whom what the instances share is looked at."""

        def see(steps: int, rows: Rows) -> bool:
            self._watch.look()
            return observe(steps, rows)

        return see

    def _eventful(self, step: float, stop: int, observe: Observer, kept: Sequence[int] | None) -> Observer:
        """An observer before whom the events at the last point happen, so that the row of that point shows them.

        Args:
            step: in s.
            stop: the number of that point.
            observe: whom to tell.
            kept: places of the values that rows have; None for all.
        """
        schedule = self._schedule
        if schedule is None:
            return observe

        def see(steps: int, rows: Rows) -> bool:
            if steps == stop and self._let_happen(slack(step, self.time), lambda: observe(steps, rows)):
                self.exchange.remember()
                if len(rows) and rows[-1][0] == self.time:
                    rows[-1][1:] = self.values if kept is None else [self.values[k] for k in kept]  # type: ignore[index]
            return observe(steps, rows)

        return see

    def _let_happen(self, late: float, keep: Callable[[], object]) -> bool:
        """Events at this point; whether there were any. Then what is continued begins anew, and loops are solved anew.

        Args:
            late: by how many s an event may be due later.
            keep: called before a model's failure is passed on, which is none of the step before.
        """
        schedule = self._schedule
        try:
            if schedule is None or not schedule.apply(self.time, self.steps, late):
                return False
            if self.coupling.extrapolator is not None:
                self.coupling.extrapolator.restart()
            if self.exchange.history:  # what was noted of this point is of before
                self.exchange.history.pop()
            self.coupling.settle(self.time)
        except RunError:
            keep()
            raise
        return True

    def _run_in_python(
        self, start_time: float, step: float, points: tuple[int, int, int], every: int, observe: Observer
    ) -> bool:
        assert isinstance(self.algorithm, FixedStep)
        coupling, take, (first, stop, count) = self.coupling, self.algorithm.take, points
        for k in range(first, stop):
            time = start_time + k * step
            take(k, time, step)
            coupling.settle(time + step)
            self.exchange.remember()
            coupling.steps = k + 1
            coupling.time = start_time + coupling.steps * step
            due = coupling.steps % every == 0 or coupling.steps == count
            if not self._tell(observe, due):
                return False
        return True

    def _tell(self, observe: Observer, is_due: bool) -> bool:
        return observe(self.steps, [[self.time, *self.values]] if is_due else ())

    def rescue(self) -> None:
        """Tell the observer what is known of steps that do not return any more; called in another thread."""
        loop = self._compiled or self._varying
        if loop is not None:
            loop.rescue()

    def terminate(self) -> None:
        """End the run properly: every model may write what it keeps, also where another fails to.

        Raises:
            FmuError: the first failure.
        """
        first: FmuError | None = None
        for slave in self.slaves.values():
            try:
                slave.terminate()
            except FmuError as error:
                first = first or error
        if first is not None:
            raise first

    def _run_variably(
        self, start_time: float, step: float, points: tuple[int, int], every: float, observe: Observer
    ) -> bool:
        assert isinstance(self.algorithm, VariableStep)
        last, schedule = self._stop_time, self._schedule
        end = last if points[0] == points[1] else min(last, start_time + points[0] * step)
        if self._varying is None:
            next_time = (lambda: math.inf) if schedule is None else schedule.next_time
            self._varying = VaryingLoop(self.coupling, self.algorithm, self._let_happen, next_time)
        return self._varying.run(Span(start_time, step, last, every), end, observe)

    # ---------------------------------------------------------------- the record, and checkpoints

    def save(self) -> dict[str, Any]:
        """What is carried from one communication point to the next beside the FMUs' states, as JSON-ready values."""
        return {
            "steps": self.steps,
            "time": self.time,
            "values": list(self.values),
            "history": [list(row) for row in self.exchange.history],
            "events": self._schedule and self._schedule.save(),
            "extrapolation": self.coupling.extrapolator and self.coupling.extrapolator.save(),
            "algorithm": self.algorithm.save(),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on where `save` was called; the FMUs' states have been restored."""
        self.coupling.steps, self.coupling.time = int(saved["steps"]), float(saved["time"])
        if len(saved["values"]) != len(self.values):
            raise ValueError(f"{len(saved['values'])} values of {len(self.values)}")
        self.values[:] = saved["values"]
        self.exchange.history.clear()
        self.exchange.history.extend(saved["history"])
        if self._schedule is not None:
            self._schedule.restore(saved["events"])
        if self.coupling.extrapolator is not None:
            self.coupling.extrapolator.restore(saved["extrapolation"])
        self.algorithm.restore(saved["algorithm"])

    def report(self) -> dict[str, Any]:
        """How the coupling went, for the record of the run; empty where there is nothing to tell."""
        found: dict[str, Any] = {}
        loops = self.coupling.loops
        if loops is not None:
            found["algebraic_loop"] = {
                "signals": loops.signals,
                "solutions": loops.solutions,
                "worst_residual": loops.residual,
            }
        if self.coupling.extrapolator is not None and (report := self.coupling.extrapolator.report()):
            found["extrapolation"] = report
        if self.coupling.refresher is not None:
            found["refresh"] = self.coupling.refresher.report()
        if report := self.algorithm.report():
            found[self.algorithm.name] = report
        if self._schedule is not None:
            found["events"] = self._schedule.happened
        return found
