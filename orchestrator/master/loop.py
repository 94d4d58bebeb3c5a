"""How time advances: initialization until connected values agree, then communication steps.

The explicit algorithms, and the loop over steps with what happens between them; `iterative` and `adaptive` are files of
their own, and so is the compiled loop. A point in time is always ``start + k * step``, never a running sum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import CouplingError, FmuError, RunError
from ..fmi import Slave
from ..system import Algorithm
from ..wiring import Link
from .algebraic_loops import LoopSolver, find_feeders, find_loops
from .algorithms import adaptive, iterative
from .compiled import CompiledLoop, can_run
from .events import LATE, Schedule
from .exchange import Exchange, types_of
from .extrapolation import Extrapolator
from .initialization import settle
from .settings import DEFAULT, Settings

_SOLVED = 1e-9
"""Relative residual up to which an algebraic loop counts as solved."""
_ROUNDING = 1e-9
_TOLERANCE = {"iterative": 1e-8, "adaptive": 1e-4}
_SHORTEST = 2.0**-20

Rows = Sequence[Sequence[Any]] | NDArray[np.float64]
Observer = Callable[[int, Rows], bool]
"""Called after one or more steps with how many were taken and the rows (time, values) that were due; False stops."""


class Master:
    """Runs instantiated models.

    Args:
        slaves: the instances by name, instantiated, in the sequence in which they are recorded.
        sequence: their names in the order in which a Gauss-Seidel sweep steps them.
        links: scalar connections.
        starts: start values by instance and scalar name.
        algorithm: ``"gauss-seidel"`` (set, step, get per instance), ``"jacobi"`` (all set, all step, all get),
            ``"iterative"`` (repeated until it agrees) or ``"adaptive"`` (sweeps of varying length).
        settings: how it couples beyond that.
    """

    def __init__(
        self,
        slaves: Mapping[str, Slave],
        sequence: Sequence[str],
        links: Sequence[Link],
        starts: Mapping[str, Mapping[str, Any]],
        algorithm: Algorithm,
        *,
        settings: Settings = DEFAULT,
    ) -> None:
        self.slaves = slaves
        self.algorithm = algorithm
        self.settings = settings
        self.sequence = [slaves[name] for name in sequence]
        self.steps = 0
        """Communication steps taken."""
        self.time = 0.0
        """The communication point that has been reached, in s."""
        self._starts = starts
        self._stop_time = 0.0
        self._length = 0.0
        """Step in s that an adaptive run begins with, where it goes on."""
        interfaces = {name: slave.interface for name, slave in slaves.items()}
        blocks = iterative.find_blocks(interfaces, links) if algorithm == "iterative" else None
        self.exchange = Exchange(
            slaves,
            links,
            sweeping=algorithm != "jacobi",
            parted=set(settings.rates) | set(blocks.sampled if blocks else ()),
        )
        self.signals = self.exchange.signals
        self.values = self.exchange.values
        self.kinds = self.exchange.kinds
        order, ended = settings.extrapolation, blocks is not None
        self._extrapolator = Extrapolator(self.exchange, links, order, ended=ended) if order else None
        self._iterative = None if blocks is None else self._make_iterative(blocks)
        self.loops: LoopSolver | None = None
        self._schedule: Schedule | None = None
        self._compiled: CompiledLoop | None = None
        self.adaptive: adaptive.Adaptive | None = None

    def _make_iterative(self, blocks: iterative.Blocks) -> iterative.Iterative:
        how = self.settings
        options = how.max_iterations, how.relaxation, how.acceleration
        return iterative.Iterative(self.exchange, blocks, self._write, self._tolerances("iterative"), *options)

    def _tolerances(self, algorithm: str) -> list[tuple[float, float]]:
        """Relative and absolute tolerance of each value."""
        given = self.settings.tolerance
        tolerance = _TOLERANCE[algorithm] if given is None else given
        found = []
        for (instance, name), signal in zip(self.exchange.places, self.signals, strict=True):
            nominal = self.slaves[instance].interface.variables[name].nominal
            ways = self.settings.tolerances
            array = f"{instance}.{name.rpartition('[')[0]}"
            own = ways.get(signal) or ways.get(array) or (tolerance, tolerance * abs(nominal or 1.0))
            found.append((float(own[0]), float(own[1])))
        return found

    def _make_loop_solver(self, unsettled: Sequence[int]) -> LoopSolver | None:
        """For the loops that the FMUs' dependencies tell of or allow, and those that exchange did not settle."""
        interfaces = {name: slave.interface for name, slave in self.slaves.items()}
        signals = {signal for loop in find_loops(interfaces, self.exchange.links, doubtful=True) for signal in loop}
        places = {k for k, signal in enumerate(self.signals) if signal in signals}
        places.update(unsettled)
        feeders = find_feeders(interfaces, self.exchange.links, {self.exchange.owners[k] for k in places})
        ordered = [slave for slave in self.sequence if slave.name in feeders]
        return LoopSolver(self.exchange, sorted(places), ordered) if places else None

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
        self.time, self._stop_time = start_time, stop_time
        for slave in self.slaves.values():
            slave.setup(start_time, math.inf if may_go_on else stop_time)
            self._set_starts(slave)
        for slave in self.slaves.values():
            slave.enter_initialization()
        for slave in self.slaves.values():
            self.exchange.read(slave, start_time)
        unsettled = settle(self.exchange, self.sequence, start_time)
        for slave in self.slaves.values():
            slave.exit_initialization()
        for slave in self.slaves.values():
            self.exchange.read_finite(slave, start_time)
        if self.settings.algebraic_loops == "solve":
            self.loops = self._make_loop_solver(unsettled)
        if self.settings.events:
            self._schedule = Schedule(self.settings.events, self.exchange, start_time, self.settings.rates)
            self._let_happen(0.0, lambda: None)
        if self._extrapolator is not None:
            self._extrapolator.begin(start_time)
        self.exchange.remember()
        self._compiled = CompiledLoop(self) if can_run(self) else None

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
    ) -> bool:
        """Take communication steps; True unless the observer stopped the run.

        The compiled kernel takes them where it can, with identical results.

        Args:
            start_time: in s.
            step: in s.
            count: number of the last communication point of the run, counted from 0.
            every: a row is due after every so many steps, and after the last; with ``adaptive`` they need not be
                whole, and 0 means after each that it takes.
            observe: given the rows.
            first: number of the communication point to begin at.
            until: number of the one to end at now; ``count`` by default.

        Raises:
            FmuError: a model failed, or a value is not finite; instance, variable and time are named.
            CouplingError: what is exchanged does not settle, or cannot be kept within its tolerance.
        """
        end = count if until is None else until
        if self.algorithm == "adaptive":
            return self._run_adaptively(start_time, step, (end, count), every, observe)
        self.steps = first
        while self.steps < end:
            stop = end
            if self._schedule is not None:
                stop = int(min(end, self._schedule.next_point(start_time, step, self.steps)))
            take = self._compiled.run if self._compiled is not None else self._run_in_python
            if not take(start_time, step, (self.steps, stop, count), int(every), self._eventful(step, stop, observe)):
                return False
        return True

    def _eventful(self, step: float, stop: int, observe: Observer) -> Observer:
        """An observer before whom the events at the last point happen, so that the row of that point shows them."""
        schedule = self._schedule
        if schedule is None:
            return observe

        def see(steps: int, rows: Rows) -> bool:
            if steps == stop and self._let_happen(LATE * step, lambda: observe(steps, rows)):
                if self.exchange.depth:
                    self.exchange.history[-1] = list(self.values)
                if len(rows) and rows[-1][0] == self.time:
                    rows[-1][1:] = self.values  # type: ignore[index]
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
            if self._extrapolator is not None:
                self._extrapolator.restart()
            if self.loops is not None:
                self._solve_loops(self.time)
        except RunError:
            keep()
            raise
        return True

    def _run_in_python(
        self, start_time: float, step: float, points: tuple[int, int, int], every: int, observe: Observer
    ) -> bool:
        first, stop, count = points
        advance = {"gauss-seidel": self._gauss_seidel, "jacobi": self._jacobi, "iterative": self._iterate}
        take = advance[self.algorithm]
        for k in range(first, stop):
            time = start_time + k * step
            take(k, time, step)
            if self.loops is not None:
                self._solve_loops(time + step)
            self.exchange.remember()
            self.steps = k + 1
            self.time = start_time + self.steps * step
            due = self.steps % every == 0 or self.steps == count
            if not self._tell(observe, due):
                return False
        return True

    def _tell(self, observe: Observer, is_due: bool) -> bool:
        return observe(self.steps, [[self.time, *self.values]] if is_due else ())

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

    def _write(self, name: str, time: float, length: float, *, ended: bool = False) -> None:
        if self._extrapolator is None:
            self.exchange.write(name, time)
        else:
            self._extrapolator.write(name, time, length, ended=ended)

    def _gauss_seidel(self, k: int, time: float, step: float) -> None:
        exchange, rates = self.exchange, self.settings.rates
        for slave in self.sequence:
            rate = rates.get(slave.name, 1)
            if k % rate == 0:
                self._write(slave.name, time, rate * step)
                slave.step(time, rate * step)
            self._read(slave, k, rate, time + step) if rate > 1 else exchange.read_finite(slave, time + step)

    def _jacobi(self, k: int, time: float, step: float) -> None:
        rates = self.settings.rates
        stepping = [slave for name, slave in self.slaves.items() if k % rates.get(name, 1) == 0]
        for slave in stepping:
            self._write(slave.name, time, rates.get(slave.name, 1) * step)
        for slave in stepping:
            slave.step(time, rates.get(slave.name, 1) * step)
        for name, slave in self.slaves.items():
            rate = rates.get(name, 1)
            self._read(slave, k, rate, time + step) if rate > 1 else self.exchange.read_finite(slave, time + step)

    def _read(self, slave: Slave, k: int, rate: int, end: float) -> None:
        """Of an instance with a step of its own: direct outputs act at once, the others are of its step's end."""
        if k % rate == 0:
            self.exchange.read_finite(slave, end, direct=True)
        if k % rate == rate - 1:
            self.exchange.read_finite(slave, end, direct=False)

    def _iterate(self, k: int, time: float, step: float) -> None:
        assert self._iterative is not None
        self._iterative.advance(time, step)

    def _solve_loops(self, time: float) -> None:
        assert self.loops is not None
        left = self.loops.solve(time)
        if not left <= _SOLVED:
            names = ", ".join(self.loops.signals[:6])
            raise CouplingError(
                f"t = {time:g} s: the algebraic loop through {names} has no solution near its last one: it is left "
                f"with a relative residual of {left:.3g}; take a smaller step, or put a component with memory into it"
            )

    # ---------------------------------------------------------------- adaptive

    def _run_adaptively(
        self, start_time: float, step: float, points: tuple[int, int], every: float, observe: Observer
    ) -> bool:
        last, late = self._stop_time, _ROUNDING * step
        end = last if points[0] == points[1] else min(last, start_time + points[0] * step)
        stepper = self.adaptive = self.adaptive or self._make_adaptive(step)
        while self.time < end:
            row = last
            if every:  # the next point at which a row is due
                done = math.floor((self.time - start_time) / (every * step) + _ROUNDING)
                row = start_time + (done + 1) * every * step
                row = row if row < last - late else last
            due = math.inf if self._schedule is None else self._schedule.next_time()
            self.time = stepper.advance(self.time, due if due < row - late else row)
            self.steps += 1
            is_due = not every or self.time == row
            self._let_happen(late, partial(self._tell, observe, is_due))
            if not self._tell(observe, is_due):
                return False
        return True

    def _make_adaptive(self, step: float) -> adaptive.Adaptive:
        interfaces = {name: slave.interface for name, slave in self.slaves.items()}
        watched = [
            k
            for (instance, name), k in self.exchange.places.items()
            if adaptive.is_watched(interfaces[instance], interfaces[instance].variables[name])
        ]
        memory = self._extrapolator
        return adaptive.Adaptive(
            self.exchange,
            self._sweep,
            watched,
            self._tolerances("adaptive"),
            longest=step,
            shortest=step * _SHORTEST if self.settings.min_step is None else self.settings.min_step,
            order=1 + self.settings.extrapolation,
            length=self._length,
            save=memory.save if memory else lambda: None,
            restore=memory.restore if memory else lambda saved: None,
        )

    def _sweep(self, time: float, length: float, ended: bool) -> None:
        """A Gauss-Seidel sweep that may be taken back; ``ended``: the values are those of the step's end."""
        for slave in self.sequence:
            self._write(slave.name, time, length, ended=ended)
            slave.step(time, length, final=False)
            self.exchange.read_finite(slave, time + length)
        if self.loops is not None:
            self._solve_loops(time + length)

    # ---------------------------------------------------------------- the record, and checkpoints

    def save(self) -> dict[str, Any]:
        """What is carried from one communication point to the next beside the FMUs' states, as JSON-ready values."""
        return {
            "steps": self.steps,
            "time": self.time,
            "values": list(self.values),
            "history": [list(row) for row in self.exchange.history],
            "events": self._schedule and self._schedule.save(),
            "extrapolation": self._extrapolator and self._extrapolator.save(),
            "length": self.adaptive.length if self.adaptive is not None else 0.0,
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on where `save` was called; the FMUs' states have been restored."""
        self.steps, self.time = int(saved["steps"]), float(saved["time"])
        self.values[:] = saved["values"]
        self.exchange.history.clear()
        self.exchange.history.extend(saved["history"])
        if self._schedule is not None:
            self._schedule.restore(saved["events"])
        if self._extrapolator is not None:
            self._extrapolator.restore(saved["extrapolation"])
        self._length = float(saved["length"])

    def report(self) -> dict[str, Any]:
        """How the coupling went, for the record of the run; empty where there is nothing to tell."""
        found: dict[str, Any] = {}
        if self.loops is not None:
            found["algebraic_loop"] = {
                "signals": self.loops.signals,
                "solutions": self.loops.solutions,
                "worst_residual": self.loops.residual,
            }
        if self._iterative:
            found["iterative"] = iterative.describe(self._iterative.tally)
        if self.adaptive is not None:
            found["adaptive"] = adaptive.describe(self.adaptive.tally)
        if self._schedule is not None:
            found["events"] = self._schedule.happened
        return found
