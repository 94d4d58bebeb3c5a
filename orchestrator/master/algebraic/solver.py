"""Algebraic loops: where values depend on themselves at one instant, and what they must be there.

A loop is found in the dependencies that the FMUs list, or by exchange that does not settle. It is solved through set
and get alone, by Newton's method in the form of Powell's hybrid (MINPACK, through SciPy), with the FMUs' directional
derivatives where they give them and finite differences where not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import FmuError
from ...fmi import Slave
from ..exchange import Exchange

_DIFFERENCE = 1e-7
"""Relative step of finite differences: the square root of the rounding error, and a little more."""
_ATTEMPTS = 8
"""How often what is no real number may change with the solution."""


class LoopSolver:
    """Solves for values that depend on themselves.

    Args:
        exchange: whose values they are.
        places: where the unknown values stand. What is no real number among them follows from the others: each solution
            is passed on until it changes nothing any more.
        feeders: instances that pass on at once what others give, in their order: they are brought up to date first.
    """

    def __init__(self, exchange: Exchange, places: Sequence[int], feeders: Sequence[Slave] = ()) -> None:
        self._exchange, self._feeders = exchange, feeders
        self._places = [k for k in places if exchange.kinds[k] == "Real"]
        self._others = [k for k in places if exchange.kinds[k] != "Real"]
        self.signals = [exchange.signals[k] for k in places]
        self.residual = 0.0
        """The worst relative mismatch that was left at any point."""
        self.solutions = 0
        """How often it had to be solved."""
        at = frozenset(places)
        owners = {exchange.owners[k] for k in places}
        owners |= {link.target[0] for link in exchange.every_link if exchange.places[link.source] in at}
        self._instances = [slave for name, slave in exchange.slaves.items() if name in owners]
        self._outputs = {
            slave.name: [n for n, k in enumerate(self._places) if exchange.owners[k] == slave.name]
            for slave in self._instances
        }

    def solve(self, time: float) -> float:
        """Find the values at a time in s, beginning at the present ones, and leave them in the exchange and as inputs.

        Returns:
            The largest mismatch that is left, relative to the value's size above 1; infinite if there are no values.

        Raises:
            FmuError: an FMU failed.
        """
        values, left = self._exchange.values, math.inf
        for slave in self._feeders:
            self._exchange.write(slave.name, time)
            self._exchange.read(slave, time)
        for _ in range(_ATTEMPTS):
            left = self._solve(time)
            if not self._others:
                break
            reals = np.array([values[k] for k in self._places], dtype=np.float64)
            others = [values[k] for k in self._others]
            left = max(left, _relative(self._mismatch(reals, time), reals))
            if others != [values[k] for k in self._others]:
                left = math.inf
            elif left <= _AGREE:
                break
        self.residual = max(self.residual, left)
        return left

    def _solve(self, time: float) -> float:
        """The same for the real numbers, whatever the others are."""
        values = self._exchange.values
        given = np.array([values[k] for k in self._places], dtype=np.float64)
        given[~np.isfinite(given)] = 0.0
        found = given + self._mismatch(given, time)
        left = _relative(found - given, found)
        if not left <= _SETTLED:
            from scipy import optimize

            self.solutions += 1
            with np.errstate(all="ignore"):
                solution = optimize.root(
                    self._mismatch, given, args=(time,), jac=self._jacobian, method="hybr", options={"xtol": 1e-14}
                ).x
            left = self._remaining(solution, time)
            found = solution + self._mismatch(solution, time)
        for place, value in zip(self._places, found, strict=True):
            values[place] = float(value)
        return left

    def _remaining(self, solution: NDArray[np.float64], time: float) -> float:
        """The larger of the relative mismatch and of Newton's next correction.

        A small mismatch alone proves nothing: x = x + 1 has one at any x that is large enough.
        """
        if not np.isfinite(solution).all():
            return math.inf
        mismatch = self._mismatch(solution, time)
        try:
            correction = np.linalg.solve(self._jacobian(solution, time), mismatch)
        except np.linalg.LinAlgError:
            return math.inf
        return max(_relative(mismatch, solution), _relative(np.asarray(correction, dtype=np.float64), solution))

    def _mismatch(self, candidate: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Outputs that the candidate values lead to, minus the candidate."""
        exchange = self._exchange
        for place, value in zip(self._places, candidate, strict=True):
            exchange.values[place] = float(value)
        for slave in self._instances:
            exchange.write(slave.name, time)
        for slave in self._instances:
            exchange.read(slave, time)
        return np.array([exchange.values[k] for k in self._places]) - candidate

    def _jacobian(self, candidate: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Derivatives of the mismatch, one column for each unknown."""
        base = candidate + self._mismatch(candidate, time)
        for place, value in zip(self._places, candidate, strict=True):
            self._exchange.values[place] = float(value)
        jacobian = -np.eye(len(self._places))
        for slave in self._instances:
            rows = self._outputs[slave.name]
            if not rows:
                continue
            for column, place in enumerate(self._places):
                seeds = self._seeds(slave.name, place)
                if not seeds:
                    continue
                slopes = self._directional(slave, rows, seeds)
                if slopes is None:
                    slopes = self._differences(slave, rows, place, time, base=base)
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

    def _directional(self, slave: Slave, rows: Sequence[int], seeds: Mapping[str, float]) -> NDArray[np.float64] | None:
        """What the FMU itself says; None where it says nothing."""
        if not slave.interface.directional_derivatives or self._exchange.output_changes:
            return None
        unknowns = [self.signals[n].removeprefix(f"{slave.name}.") for n in rows]
        try:
            return np.array(slave.directional_derivatives(unknowns, list(seeds), list(seeds.values())))
        except FmuError:  # it promised too much; differences do as well
            return None

    def _differences(
        self, slave: Slave, rows: Sequence[int], place: int, time: float, *, base: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        exchange = self._exchange
        kept = list(exchange.values)
        moved = kept[place] + _DIFFERENCE * max(1.0, abs(kept[place]))
        exchange.values[place] = moved
        exchange.write(slave.name, time)
        exchange.read(slave, time)
        reached = np.array([exchange.values[self._places[n]] for n in rows])
        exchange.values[:] = kept
        exchange.write(slave.name, time)
        return np.asarray((reached - base[list(rows)]) / (moved - kept[place]))


_AGREE = 1e-9
"""Relative mismatch up to which what is no real number is taken to fit the real ones."""
_SETTLED = 1e-13
"""Relative mismatch below which nothing is solved."""


def _relative(difference: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    largest = np.max(np.abs(difference) / np.maximum(1.0, np.abs(values)), initial=0.0)
    return float(largest) if math.isfinite(largest) else math.inf
