"""Algebraic loops: what values must be that depend on themselves at one instant.

They are solved for through set and get alone, by Newton's method (`roots`) with the FMUs' directional derivatives where
they give them and finite differences where not. The compiled loop does the same (``native/algebraic/solving.c``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import CouplingError, FmuError, LostError
from ...fmi import Slave
from ...times import digits
from ..exchange import Exchange
from .roots import SETTLED, SOLVED, Vector, find_root, relative

_DIFFERENCE = 1e-7
"""Relative step of finite differences: the square root of the rounding error, and a little more."""
_ATTEMPTS = 8
"""How often what is no real number may change with the solution, and once more for each of them."""
_BEGINS = 4
"""From how many values it is begun: where it leads nowhere, once more from what the last ones lead to."""
_REFUSALS = ("", "error", "discard")
"""Statuses by which an FMU gives no directional derivatives, and still lives."""
NUMBERS = 3
"""How often it was solved, the worst mismatch that was left at any point, and the one that was left last."""
_SOLUTIONS, _WORST, _LEFT = range(NUMBERS)


class LoopSolver:
    """Solves for values that depend on themselves.

    Args:
        exchange: whose values they are.
        places: where the unknown values stand. What is no real number among them follows from the others: each solution
            is passed on until it changes nothing any more.
        feeders: instances that pass on at once what others give, in their order: they are brought up to date first.

    Attributes:
        reals: places of the unknown real numbers. others: and of what else is passed on.
        instances: those that give or take them. rows: of each the numbers of the real ones that it gives.
        attempts: how often others may change. numbers: what is counted; the compiled loop goes on with them.
    """

    def __init__(self, exchange: Exchange, places: Sequence[int], feeders: Sequence[Slave] = ()) -> None:
        self._exchange, self.feeders = exchange, feeders
        self.reals = [k for k in places if exchange.kinds[k] == "Real"]
        self.others = [k for k in places if exchange.kinds[k] != "Real"]
        self.signals = [exchange.signals[k] for k in places]
        self.attempts = _ATTEMPTS + len(self.others)
        self.numbers = np.zeros(NUMBERS)
        at = frozenset(places)
        owners = {exchange.owners[k] for k in places}
        owners |= {link.target[0] for link in exchange.every_link if exchange.places[link.source] in at}
        self.instances = [slave for name, slave in exchange.slaves.items() if name in owners]
        self.rows = {
            slave.name: [n for n, k in enumerate(self.reals) if exchange.owners[k] == slave.name]
            for slave in self.instances
        }
        self._fixed: list[Any] = []
        self._reached = np.zeros(len(self.reals))

    def use(self, numbers: Vector) -> None:
        """Count from now on in another array, which has what the present one has."""
        self.numbers = numbers

    @property
    def residual(self) -> float:
        """The worst relative mismatch that was left at any point."""
        return float(self.numbers[_WORST])

    @property
    def left(self) -> float:
        """The relative mismatch that was left last."""
        return float(self.numbers[_LEFT])

    @property
    def solutions(self) -> int:
        """How often it had to be solved."""
        return int(self.numbers[_SOLUTIONS])

    def name_of(self, row: int) -> str:
        """The variable of an instance that one of the unknown real numbers is."""
        place = self.reals[row]
        return self._exchange.signals[place].removeprefix(f"{self._exchange.owners[place]}.")

    def solve(self, time: float) -> float:
        """Find the values at a time in s, beginning at the present ones, and leave them in the exchange and as inputs.

        Returns:
            The largest mismatch that is left, relative to the value's size above 1; infinite if there are no values.

        Raises:
            FmuError: an FMU failed.
        """
        values = self._exchange.values
        for slave in self.feeders:
            self._exchange.write(slave.name, time)
            self._exchange.read(slave, time)
        for _ in range(self.attempts):
            self._fixed = [values[k] for k in self.others]
            with np.errstate(all="ignore"):
                left = self._solve(time)
            if self._fixed == [values[k] for k in self.others]:
                break
        else:
            left = math.inf
        self.numbers[_WORST], self.numbers[_LEFT] = max(self.residual, left), left
        return left

    def failure(self, time: float) -> CouplingError:
        """What to say of a solution at a time in s that leaves too much."""
        names = ", ".join(self.signals[:6])
        return CouplingError(
            f"t = {digits(time)} s: the algebraic loop through {names} has no solution near its "
            f"last one: it is left "
            f"with a relative residual of {self.left:.3g}; take a smaller step, or put a component with memory into it"
        )

    def _solve(self, time: float) -> float:
        """The same for the real numbers, with the others as they are fixed."""

        def evaluate(candidate: Vector) -> Vector:
            return self._mismatch(candidate, time)

        given = np.array([self._exchange.values[k] for k in self.reals], dtype=np.float64)
        given[~np.isfinite(given)] = 0.0
        mismatch = evaluate(given)
        left = relative(mismatch, self._reached)
        if left <= SETTLED:
            return left
        self.numbers[_SOLUTIONS] += 1.0
        for attempt in range(_BEGINS):
            if attempt > 0:
                given = self._reached
                if not np.isfinite(given).all():
                    break
                mismatch = evaluate(given)
            found, left, is_shown = find_root(evaluate, lambda at: self._jacobian(at, time), given, mismatch)
            if not is_shown:
                evaluate(found)
            if left <= SOLVED:
                break
        return left

    def _place(self, candidate: Vector) -> None:
        """Put values where they stand, beside the others as they are fixed."""
        values = self._exchange.values
        for place, value in zip(self.reals, candidate.tolist(), strict=True):
            values[place] = value
        for place, other in zip(self.others, self._fixed, strict=True):
            values[place] = other

    def _mismatch(self, candidate: Vector, time: float) -> Vector:
        """Outputs that the candidate values lead to, minus the candidate."""
        exchange = self._exchange
        self._place(candidate)
        for slave in self.instances:
            exchange.write(slave.name, time)
        for slave in self.instances:
            exchange.read(slave, time)
        self._reached = np.array([exchange.values[k] for k in self.reals], dtype=np.float64)
        return self._reached - candidate

    def _jacobian(self, candidate: Vector, time: float) -> Vector:
        """Derivatives of the mismatch, one column for each unknown, at the values at which it was evaluated last."""
        self._place(candidate)
        jacobian = -np.eye(len(self.reals))
        for slave in self.instances:
            rows = self.rows[slave.name]
            if not rows:
                continue
            for column, place in enumerate(self.reals):
                seeds = self._seeds(slave.name, place)
                if not seeds:
                    continue
                slopes = self._directional(slave, rows, seeds)
                if slopes is None:
                    slopes = self._differences(slave, rows, place, time)
                jacobian[rows, column] += slopes
        return jacobian

    def _seeds(self, name: str, place: int) -> dict[str, float]:
        """By how much inputs of an instance move with a value."""
        seeds = {}
        for feed in self._exchange.feeds[name]:
            for k, source in enumerate(feed.sources):
                if source == place and feed.is_real and feed.ages[k] is None:
                    change = feed.changes[k] if feed.changes else None
                    factor = change.scale if change is not None and change.active else 1.0
                    seeds[feed.targets[k]] = feed.scales[k] * factor
        return seeds

    def _directional(self, slave: Slave, rows: Sequence[int], seeds: Mapping[str, float]) -> Vector | None:
        """What the FMU itself says; None where it says nothing."""
        if not slave.interface.directional_derivatives or self._exchange.output_changes:
            return None
        unknowns = [self.name_of(n) for n in rows]
        try:
            return np.array(slave.directional_derivatives(unknowns, list(seeds), list(seeds.values())))
        except FmuError as error:
            if isinstance(error, LostError) or error.status not in _REFUSALS:
                raise
            return None  # it promised too much; differences do as well

    def _differences(self, slave: Slave, rows: Sequence[int], place: int, time: float) -> Vector:
        exchange = self._exchange
        kept = list(exchange.values)
        moved = kept[place] + _DIFFERENCE * max(1.0, abs(kept[place]))
        exchange.values[place] = moved
        exchange.write(slave.name, time)
        exchange.read(slave, time)
        reached = np.array([exchange.values[self.reals[n]] for n in rows])
        exchange.values[:] = kept
        exchange.write(slave.name, time)
        return np.asarray((reached - self._reached[list(rows)]) / (moved - kept[place]))
