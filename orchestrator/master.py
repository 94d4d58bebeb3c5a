"""How time advances: initialization until connected values agree, then communication steps.

`Master` is built from a flat plan (which values go where, in which order); the step loop touches nothing else. The
point in time is always ``start + k * step``, never a running sum.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import CompiledLoop, can_run
from .errors import FmuError, ScenarioError
from .interface import Type
from .slave import Channel, Slave
from .system import Algorithm
from .wiring import Link

_SWEEPS = 100
_SHRINKS = 0.8
"""How much smaller each sweep's change must be than the last: slower than that, Newton's method is the better way."""
_AGREE = 1e-12
"""Relative change below which a connected value counts as settled; acyclic systems settle exactly."""
_SOLVED = 1e-9
"""The same after Newton's method, which ends at a residual, not at a fixed point."""

Rows = Sequence[Sequence[Any]] | NDArray[np.float64]
Observer = Callable[[int, Rows], bool]
"""Called after one or more steps with how many were taken and the rows (time, values) that were due; False stops."""


@dataclass(frozen=True)
class Feed:
    """Inputs of one type of one instance: where each value comes from, and how it is changed on the way.

    ``sources`` are indices into the values; ``ages`` say how many recorded points back to look (None: the live value).
    """

    channel: Channel
    sources: tuple[int, ...]
    plain: bool
    scales: tuple[float, ...]
    offsets: tuple[float, ...]
    ages: tuple[int | None, ...]
    is_real: bool


@dataclass(frozen=True)
class Yield:
    """Outputs of one type of one instance, and where they stand among the values."""

    channel: Channel
    kind: Type
    begin: int
    end: int

    @property
    def is_real(self) -> bool:
        """Whether the values are real numbers, which must be finite."""
        return self.kind == "Real"


class Master:
    """Runs instantiated models.

    Args:
        slaves: the instances by name, instantiated, in the sequence in which they are recorded.
        sequence: their names in the order in which a Gauss-Seidel sweep steps them.
        links: scalar connections.
        starts: start values by instance and scalar name.
        algorithm: ``"gauss-seidel"`` (set, step, get per instance) or ``"jacobi"`` (all set, all step, all get).
    """

    def __init__(
        self,
        slaves: Mapping[str, Slave],
        sequence: Sequence[str],
        links: Sequence[Link],
        starts: Mapping[str, Mapping[str, Any]],
        algorithm: Algorithm,
    ) -> None:
        self.slaves = slaves
        self.algorithm = algorithm
        self.signals: list[str] = []
        """Names of the values, in the order in which they are recorded."""
        self.steps = 0
        """Communication steps taken."""
        self._starts = starts
        index: dict[tuple[str, str], int] = {}
        wanted: dict[str, set[str]] = {name: set() for name in slaves}
        incoming: dict[str, list[Link]] = {name: [] for name in slaves}
        for link in links:
            wanted[link.source[0]].add(link.source[1])
            incoming[link.target[0]].append(link)
        self.yields = {name: self._plan_outputs(slave, wanted[name], index) for name, slave in slaves.items()}
        self.values: list[Any] = [0.0] * len(self.signals)
        deepest = max((link.delay for link in links), default=0)
        self.depth = deepest + 1 if deepest else 0
        """How many recorded points delayed connections look back on, the present one included."""
        self._history: deque[list[Any]] = deque(maxlen=self.depth)
        self.feeds = {name: self._plan_inputs(slave, incoming[name], index) for name, slave in slaves.items()}
        self.sequence = [slaves[name] for name in sequence]
        self._compiled: CompiledLoop | None = None

    # ---------------------------------------------------------------- plan

    def _plan_outputs(self, slave: Slave, wanted: Collection[str], index: dict[tuple[str, str], int]) -> list[Yield]:
        """Every output, and whatever else is connected."""
        shown = [v for v in slave.interface.variables.values() if v.causality == "output" or v.name in wanted]
        plan = []
        for kind in _types(v.type for v in shown):
            names = [v.name for v in shown if v.type == kind]
            begin = len(self.signals)
            for name in names:
                index[slave.name, name] = len(self.signals)
                self.signals.append(f"{slave.name}.{name}")
            plan.append(Yield(slave.channel(kind, names), kind, begin, len(self.signals)))
        return plan

    def _plan_inputs(self, slave: Slave, mine: Sequence[Link], index: Mapping[tuple[str, str], int]) -> list[Feed]:
        variables = slave.interface.variables
        plan = []
        for kind in _types(variables[link.target[1]].type for link in mine):
            links = [link for link in mine if variables[link.target[1]].type == kind]
            plan.append(
                Feed(
                    channel=slave.channel(kind, [link.target[1] for link in links]),
                    sources=tuple(index[link.source] for link in links),
                    plain=all((x.scale, x.offset, x.delay) == (1.0, 0.0, 0) for x in links),
                    scales=tuple(link.scale for link in links),
                    offsets=tuple(link.offset for link in links),
                    ages=tuple(self._age(link) for link in links),
                    is_real=kind == "Real",
                )
            )
        return plan

    def _age(self, link: Link) -> int | None:
        """How many recorded points back a delayed connection reads; 0 is the point at the begin of the step.

        A feed-through output recorded at a point was computed from the inputs of the point before: read there, it is
        already one communication point older than the live value of a Gauss-Seidel sweep.
        """
        if not link.delay:
            return None
        return link.delay - 1 if link.direct and self.algorithm == "gauss-seidel" else link.delay

    # ---------------------------------------------------------------- initialization

    def initialize(self, start_time: float, stop_time: float) -> None:
        """Set start values and let connected values settle; time zero is that consistent state.

        Raises:
            FmuError: a model failed.
            ScenarioError: the connected values do not settle.
        """
        for slave in self.slaves.values():
            slave.setup(start_time, stop_time)
            self._set_starts(slave)
        for slave in self.slaves.values():
            slave.enter_initialization()
        for slave in self.slaves.values():
            self._read(slave)
        self._settle()
        for slave in self.slaves.values():
            slave.exit_initialization()
        for slave in self.slaves.values():
            self._read_finite(slave)
        self._remember()
        self._compiled = CompiledLoop(self) if can_run(self) else None

    def _set_starts(self, slave: Slave) -> None:
        given = self._starts.get(slave.name, {})
        variables = slave.interface.variables
        for kind in _types(variables[name].type for name in given):
            names = [name for name in given if variables[name].type == kind]
            slave.channel(kind, names).set([given[name] for name in names])

    def _settle(self) -> None:
        """Exchange until nothing changes; what is left after that is a loop, for Newton's method where it diverges."""
        flushed = len(self.slaves) + 1  # sweeps after which every chain has settled, whatever the order
        begin, last = list(self.values), math.inf
        for count in range(max(_SWEEPS, flushed)):
            before = list(self.values)
            self._sweep()
            change = _largest_change(before, self.values)
            if change <= _AGREE:
                return
            if count >= flushed and not change < _SHRINKS * last:
                break
            last = change
        solve_loops(self, begin, before)

    def _sweep(self) -> None:
        for slave in self.sequence:
            if self.feeds[slave.name]:
                self._write(slave.name)
                self._read(slave)

    # ---------------------------------------------------------------- stepping

    def run(self, start_time: float, step: float, count: int, every: int, observe: Observer) -> bool:
        """Take ``count`` communication steps; True unless the observer stopped the run.

        The compiled kernel takes them where it can, with identical results.

        Args:
            start_time: in s.
            step: in s.
            count: number of steps.
            every: a row is due after every so many steps, and after the last.
            observe: given the rows.

        Raises:
            FmuError: a model failed, or a value is not finite; instance, variable and time are named.
        """
        if self._compiled is not None:
            return self._compiled.run(start_time, step, count, every, observe)
        advance = self._gauss_seidel if self.algorithm == "gauss-seidel" else self._jacobi
        for k in range(count):
            advance(start_time + k * step, step)
            self._remember()
            self.steps = k + 1
            due = self.steps % every == 0 or self.steps == count
            if not observe(self.steps, [[start_time + self.steps * step, *self.values]] if due else ()):
                return False
        return True

    def terminate(self) -> None:
        """End the run properly: every model may write what it keeps."""
        for slave in self.slaves.values():
            slave.terminate()

    def _gauss_seidel(self, time: float, step: float) -> None:
        for slave in self.sequence:
            self._write(slave.name)
            slave.step(time, step)
            self._read_finite(slave)

    def _jacobi(self, time: float, step: float) -> None:
        for name in self.slaves:
            self._write(name)
        for slave in self.slaves.values():
            slave.step(time, step)
        for slave in self.slaves.values():
            self._read_finite(slave)

    def _write(self, name: str) -> None:
        values = self.values
        for feed in self.feeds[name]:
            if feed.plain:
                feed.channel.set([values[k] for k in feed.sources])
            else:
                feed.channel.set(self._changed(feed))

    def _changed(self, feed: Feed) -> list[Any]:
        """Input values with delay, scale and offset applied."""
        result = []
        for k, scale, offset, age in zip(feed.sources, feed.scales, feed.offsets, feed.ages, strict=True):
            value = self.values[k] if age is None else self._aged(age, k)
            result.append(scale * value + offset if feed.is_real and (scale, offset) != (1.0, 0.0) else value)
        return result

    def _aged(self, age: int, k: int) -> Any:
        if not self._history:  # still initializing
            return self.values[k]
        return self._history[max(0, len(self._history) - 1 - age)][k]

    def _remember(self) -> None:
        if self.depth:
            self._history.append(list(self.values))

    def _read(self, slave: Slave) -> None:
        for part in self.yields[slave.name]:
            self.values[part.begin : part.end] = part.channel.get()

    def _read_finite(self, slave: Slave) -> None:
        """Read, and stop before anyone else is given what is not finite, so that the blame falls on its source."""
        for part in self.yields[slave.name]:
            found = part.channel.get()
            self.values[part.begin : part.end] = found
            # One sum instead of one test per value: it is finite unless a value is not (or all are astronomic).
            if part.is_real and not math.isfinite(sum(found)):
                self.check_finite(slave)

    def check_finite(self, slave: Slave) -> None:
        """Raise if a real output of an instance is not finite, naming it."""
        for part in self.yields[slave.name]:
            for k in range(part.begin, part.end):
                if part.is_real and not math.isfinite(self.values[k]):
                    variable = self.signals[k].removeprefix(f"{slave.name}.")
                    raise FmuError(f"output {variable!r} is {self.values[k]!r}", instance=slave.name, time=slave.time)

    @property
    def kinds(self) -> list[Type]:
        """The type of each of the values."""
        return [part.kind for parts in self.yields.values() for part in parts for _ in range(part.begin, part.end)]


def _types(kinds: Any) -> tuple[Type, ...]:
    return tuple(dict.fromkeys(kinds))


def _largest_change(before: Sequence[Any], after: Sequence[Any]) -> float:
    return max(map(_change, before, after), default=0.0)


def _change(a: Any, b: Any) -> float:
    """How far a value has moved, relative to its size above 1; what stays NaN has not moved."""
    if a == b:
        return 0.0
    if isinstance(a, str) or isinstance(b, str):
        return 1.0
    if not math.isfinite(b - a):
        return 0.0 if math.isnan(a) and math.isnan(b) else math.inf
    return float(abs(b - a) / max(1.0, abs(a), abs(b)))


def solve_loops(master: Master, begin: Sequence[Any], before: Sequence[Any]) -> None:
    """Newton's method (SciPy) on the connected real values that repeated exchange does not settle.

    Args:
        master: its last sweep ended in other values than it began with.
        begin: values before any exchange, where the search starts: exchange that diverges leads away from them.
        before: values before the last sweep.

    Raises:
        ScenarioError: no consistent initial values were found; the signals involved and the residual are named.
    """
    from scipy import optimize  # noqa: PLC0415 (a heavy import for a rare case)

    moving = [k for k, (a, b) in enumerate(zip(before, master.values, strict=True)) if _change(a, b) > 0.0]
    unknown = [k for k in moving if isinstance(begin[k], float)]
    names = ", ".join(master.signals[k] for k in moving[:6]) + (", ..." if len(moving) > 6 else "")

    def residual(candidate: Any) -> list[float]:
        for k, value in zip(unknown, candidate, strict=True):
            master.values[k] = float(value)
        master._sweep()
        return [master.values[k] - float(value) for k, value in zip(unknown, candidate, strict=True)]

    master.values[:] = begin
    try:
        start = [begin[k] if math.isfinite(begin[k]) else 0.0 for k in unknown]
        solution = optimize.root(residual, start, method="hybr", tol=1e-13).x if unknown else []
        residual(solution)
        found = list(master.values)
        master._sweep()
    except (FmuError, ValueError, OverflowError) as error:
        raise ScenarioError(f"the initial values of {names} do not settle: {error}") from error
    worst = _largest_change(found, master.values)
    if not worst <= _SOLVED:
        raise ScenarioError(
            f"the initial values of {names} do not settle: they form an algebraic loop for which no solution was found "
            f"(they still change by {worst:.3g} when exchanged); put a component with memory into the loop, or start "
            "the search elsewhere by other start values"
        )
