"""Communication steps as long as a tolerance lets them be, by step doubling.

Each step is taken once whole and, from the same saved state, in two halves; the difference estimates the error of the
coupling: of second order in a step where inputs are held, of a higher one where they are continued. The halves are kept
(Hairer, Norsett and Wanner 1993, section II.4).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .errors import CouplingError
from .exchange import Exchange

_SAFETY, _SMALLEST, _LARGEST = 0.9, 0.2, 5.0
"""How a step may change: of the step that the error estimate asks for, and by which factors at most."""
_ROUNDING = 1e-9
"""Part of a step that is not worth a step of its own."""


@dataclass
class Tally:
    """How the steps went: how many were ``accepted`` and ``rejected``, and the ``shortest`` and ``longest`` in s."""

    accepted: int = 0
    rejected: int = 0
    shortest: float = math.inf
    longest: float = 0.0


@dataclass
class Adaptive:
    """Chooses communication steps.

    Attributes:
        exchange: the values.
        sweep: takes one step of given time and length, both in s; a newer state may be given up again.
        watched: places of the values whose error counts. tolerances: relative and absolute, by place.
        longest, shortest: bounds of the step in s.
        order: of the coupling's error over the whole run.
        save, restore: what is remembered beside states and values.
    """

    exchange: Exchange
    sweep: Callable[[float, float], None]
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
            FmuError: an FMU failed.
        """
        exchange = self.exchange
        slaves = list(exchange.slaves.values())
        values, memory = list(exchange.values), self.save()
        states = [slave.save() for slave in slaves]

        def go_back() -> None:
            for slave, state in zip(slaves, states, strict=True):
                slave.restore(state)
            exchange.values[:] = values
            self.restore(memory)

        wanted = min(self.length or self.longest, self.longest)
        try:
            while True:
                end, length = _fit(time, wanted, until)
                self.sweep(time, length)
                whole = [exchange.values[k] for k in self.watched]
                go_back()
                middle = time + 0.5 * length
                self.sweep(time, 0.5 * length)
                self.sweep(middle, end - middle)
                error, place = self._error(whole)
                ideal = _SAFETY * error ** (-1.0 / (self.order + 1)) if error > 0.0 else _LARGEST
                factor = min(_LARGEST, max(_SMALLEST, ideal))
                if error <= 1.0:
                    self._accept(length, wanted, factor)
                    return end
                self.tally.rejected += 1
                if length <= self.shortest * (1.0 + _ROUNDING):
                    self._fail(time, length, error, place)
                go_back()
                wanted = max(self.shortest, length * min(factor, _SAFETY))
        finally:
            for slave, state in zip(slaves, states, strict=True):
                slave.forget(state)

    def _error(self, whole: Sequence[float]) -> tuple[float, int]:
        """The largest error relative to its bound, and the place of the value that has it."""
        worst, where = 0.0, -1
        for k, coarse in zip(self.watched, whole, strict=True):
            fine = self.exchange.values[k]
            relative, absolute = self.tolerances[k]
            bound = absolute + relative * max(abs(fine), abs(coarse)) + 1e-300
            error = abs(fine - coarse) / (2.0**self.order - 1.0) / bound
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
