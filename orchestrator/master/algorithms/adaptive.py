"""Communication steps as long as a tolerance lets them be, by step doubling.

Each step is taken once whole and, from the same saved state, in two halves; the difference estimates the error of the
coupling: of second order in a step where inputs are held, of a higher one where they are continued. The halves are kept
(Hairer, Norsett and Wanner 1993, section II.4).

What happens in the last half, a ball that hits the ground, neither of them sees: an input is that of a step's begin. So
a step that would be accepted is taken whole once more, with the inputs of its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...errors import CouplingError, FmuError, LostError, RunError, StoppedError
from ...fmi import Interface, Variable
from ...wiring import is_direct
from ..exchange import Exchange

_SAFETY, _SMALLEST, _LARGEST = 0.9, 0.2, 5.0
"""How a step may change: of the step that the error estimate asks for, and by which factors at most."""
_AT_END = {1: 3.0, 2: 1.8, 3: 1.9}
"""How many times their error the two halves differ from a step with the inputs of the end, by order, on a smooth
course: polynomials through former points have the error constants 1/2, 5/12, 3/8; with the end -1/2, -1/12, -1/24."""
_ROUNDING = 1e-9
"""Part of a step that is not worth a step of its own."""


def is_watched(interface: Interface, variable: Variable) -> bool:
    """Whether the error of an output counts: not where it shows the inputs of the begin, however short the step is."""
    if (variable.type, variable.variability) != ("Real", "continuous"):
        return False
    return variable.dependencies is None or not is_direct(interface, variable)


@dataclass
class Tally:
    """How the steps went: how many were ``accepted`` and ``rejected``, and the ``shortest`` and ``longest`` in s."""

    accepted: int = 0
    rejected: int = 0
    shortest: float = math.inf
    longest: float = 0.0


@dataclass(frozen=True)
class _Point:
    """A point to come back to: saved states, values, and what is remembered beside them."""

    states: Sequence[Any]
    values: Sequence[Any]
    memory: Any


@dataclass
class Adaptive:
    """Chooses communication steps.

    Attributes:
        exchange: the values.
        sweep: takes one step of given time and length, both in s, with the inputs of its begin or, ``ended``, with the
            present ones as those of its end; a newer state may be given up again.
        watched: places of the values whose error counts. tolerances: relative and absolute, by place.
        longest, shortest: bounds of the step in s.
        order: of the coupling's error over the whole run.
        save, restore: what is remembered beside states and values.
    """

    exchange: Exchange
    sweep: Callable[[float, float, bool], None]
    watched: Sequence[int]
    tolerances: Sequence[tuple[float, float]]
    longest: float
    shortest: float
    order: int = 1
    save: Callable[[], Any] = lambda: None
    restore: Callable[[Any], None] = lambda saved: None
    length: float = 0.0
    tally: Tally = field(default_factory=Tally)

    def advance(self, time: float, until: float) -> float:
        """Take one step from ``time`` that does not pass ``until``; the time it ends at, all in s.

        Raises:
            CouplingError: the error is too large at the shortest step.
            FmuError: an FMU failed even then.
        """
        begin = self._keep()
        kept = [begin]
        wanted = min(self.length or self.longest, self.longest)
        try:
            while True:
                end, length = _fit(time, wanted, until)
                is_shortest = length <= self.shortest * (1.0 + _ROUNDING)
                try:
                    error, place = self._take(time, end, kept)
                except RunError as failure:  # of a shorter step they may be capable
                    if is_shortest or isinstance(failure, StoppedError) or _is_fatal(failure):
                        raise
                    error, place = math.inf, -1
                ideal = _SAFETY * error ** (-1.0 / (self.order + 1)) if error > 0.0 else _LARGEST
                factor = min(_LARGEST, max(_SMALLEST, ideal))
                if error <= 1.0:
                    self._accept(length, wanted, factor)
                    return end
                self.tally.rejected += 1
                if is_shortest:
                    self._fail(time, length, error, place)
                self._go_to(begin)
                wanted = max(self.shortest, length * min(factor, _SAFETY))
        finally:
            for point in kept:
                self._forget(point)

    def _take(self, time: float, end: float, kept: list[_Point]) -> tuple[float, int]:
        """Take a step in two halves; its error as `_error` has it, and the place of the value that has it."""
        length, middle = end - time, 0.5 * (time + end)
        self.sweep(time, length, False)
        whole = self._seen()
        self._go_to(kept[0])
        self.sweep(time, middle - time, False)
        self.sweep(middle, end - middle, False)
        halves = self._seen()
        found = self._error(whole, halves, 2.0**self.order - 1.0)
        if found[0] <= 1.0:
            kept.append(self._keep())
            self._go_to(kept[0], values=False)
            self.sweep(time, length, True)
            found = max(found, self._error(self._seen(), halves, _AT_END[self.order]))
            self._go_to(kept[-1])
        return found

    def _keep(self) -> _Point:
        """The present point, to come back to."""
        states = [slave.save() for slave in self.exchange.slaves.values()]
        return _Point(states, list(self.exchange.values), self.save())

    def _go_to(self, point: _Point, *, values: bool = True) -> None:
        for slave, state in zip(self.exchange.slaves.values(), point.states, strict=True):
            slave.restore(state)
        if values:
            self.exchange.values[:] = point.values
        self.restore(point.memory)

    def _forget(self, point: _Point) -> None:
        for slave, state in zip(self.exchange.slaves.values(), point.states, strict=True):
            slave.forget(state)

    def _seen(self) -> list[float]:
        return [self.exchange.values[k] for k in self.watched]

    def _error(self, other: Sequence[float], kept: Sequence[float], times: float) -> tuple[float, int]:
        """The largest error of the kept values relative to its bound, and the place of the value that has it.

        Args:
            other: the same values by another way.
            kept: those that are kept.
            times: how many times their error the distance is.
        """
        worst, where = 0.0, -1
        for k, coarse, fine in zip(self.watched, other, kept, strict=True):
            relative, absolute = self.tolerances[k]
            bound = absolute + relative * max(abs(fine), abs(coarse)) + 1e-300
            error = abs(fine - coarse) / times / bound
            if not error <= worst:
                worst, where = (error, k) if math.isfinite(error) else (math.inf, k)
        return worst, where

    def _accept(self, length: float, wanted: float, factor: float) -> None:
        self.tally.accepted += 1
        self.tally.shortest = min(self.tally.shortest, length)
        self.tally.longest = max(self.tally.longest, length)
        # A step that was cut short to land on a point says little of how long the next may be.
        self.length = min(self.longest, max(length * factor, wanted if factor >= 1.0 else self.shortest))

    def _fail(self, time: float, length: float, error: float, place: int) -> None:
        relative, absolute = self.tolerances[place]
        name = self.exchange.signals[place]
        raise CouplingError(
            f"t = {time:g} s: {name} cannot be kept within its tolerance ({relative:g} relative, {absolute:g} "
            f"absolute): its error is {error:.3g} times as large at the shortest step, {length:g} s; loosen "
            f"simulation.tolerance, or this signal's in [simulation.tolerances], or allow a smaller simulation.min_step"
        )


def _is_fatal(failure: RunError) -> bool:
    """Whether an FMU may not be called any more."""
    return isinstance(failure, LostError) or (isinstance(failure, FmuError) and failure.status == "fatal")


def _fit(time: float, wanted: float, until: float) -> tuple[float, float]:
    """End and length of a step that lands on ``until`` where it comes near, without a tiny rest."""
    left = until - time
    if left <= wanted * (1.0 + _ROUNDING):
        return until, left
    if left < 2.0 * wanted:
        wanted = 0.5 * left
    return time + wanted, time + wanted - time


def describe(tally: Tally) -> dict[str, Any]:
    """For the record of the run."""
    shortest = None if math.isinf(tally.shortest) else tally.shortest
    return {
        "accepted": tally.accepted,
        "rejected": tally.rejected,
        "shortest_step": shortest,
        "longest_step": tally.longest,
    }
