"""Implicit coupling: a communication step is repeated from saved states until what is exchanged agrees at its end.

Only instances that depend on each other within the step, in a cycle, are repeated; the others step once, sources before
receivers, with the values of the step's end. Sampled components are no part of that: they act on the values of the
step's begin, and step first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from ...errors import CouplingError, FmuError, StoppedError
from ...fmi import Interface
from ...system import Acceleration
from ...wiring import Link, derive_order
from ..exchange import Exchange

Vector = NDArray[np.float64]
_DEPTH = 5
"""Former iterates that Anderson's method combines."""


@dataclass(frozen=True)
class Blocks:
    """How a system is stepped: ``sampled`` first, then ``continuous`` groups, of which those of several iterate."""

    sampled: tuple[str, ...]
    continuous: tuple[tuple[str, ...], ...]
    cyclic: frozenset[str]


def find_blocks(interfaces: Mapping[str, Interface], links: Iterable[Link]) -> Blocks:
    """Sampled components in the order of a sweep; the others in groups that depend on each other, in their order."""
    sampled = [name for name, interface in interfaces.items() if interface.sampled]
    links = [link for link in links if not link.delay]
    inner = [link for link in links if {link.source[0], link.target[0]} <= set(sampled)]
    sweep = derive_order(sampled, inner).sequence
    graph = nx.DiGraph()
    graph.add_nodes_from(name for name in interfaces if name not in sweep)
    ends = [(link.source[0], link.target[0]) for link in links]
    graph.add_edges_from((a, b) for a, b in ends if a in graph and b in graph)
    rank = {name: k for k, name in enumerate(interfaces)}
    condensed = nx.condensation(graph)
    groups = [
        tuple(sorted(condensed.nodes[g]["members"], key=rank.__getitem__))
        for g in nx.lexicographical_topological_sort(
            condensed, key=lambda g: min(rank[n] for n in condensed.nodes[g]["members"])
        )
    ]
    cyclic = frozenset(n for group in groups for n in group if len(group) > 1 or graph.has_edge(n, n))
    return Blocks(sweep, tuple(groups), cyclic)


@dataclass
class Tally:
    """How the iterations went.

    Communication ``steps``, ``iterations`` in all and at ``most``, the worst ``residual`` in units of the tolerance.
    """

    steps: int = 0
    iterations: int = 0
    most: int = 0
    residual: float = 0.0


@dataclass
class Iterative:
    """Takes communication steps that agree at their end.

    Attributes:
        exchange: the values; its sampled components' outputs are parted into direct ones and others.
        blocks: how the system is stepped.
        write: sets the inputs of an instance for a step (name, time, length).
        tolerances: relative and absolute, by place of the value.
        max_iterations, relaxation, acceleration: of the fixed-point iteration; relaxation is the first one of Aitken's
            and the mixing of Anderson's.
    """

    exchange: Exchange
    blocks: Blocks
    write: Callable[[str, float, float], None]
    tolerances: Sequence[tuple[float, float]]
    max_iterations: int = 50
    relaxation: float = 1.0
    acceleration: Acceleration = "anderson"
    tally: Tally = field(default_factory=Tally)

    def __post_init__(self) -> None:
        self._exchanged = {
            group: self._find_exchanged(group)
            for group in self.blocks.continuous
            if not self.blocks.cyclic.isdisjoint(group)
        }

    def _find_exchanged(self, group: Sequence[str]) -> tuple[list[int], list[int]]:
        """Places of the values that one of the group gives to another or itself.

        First those that are needed before their source has stepped, and have to be guessed; then the others.
        """
        owners, at = self.exchange.owners, {name: k for k, name in enumerate(group)}
        passed = {
            (k, at[owners[k]] >= at[name])
            for name in group
            for feed in self.exchange.feeds[name]
            for k, age in zip(feed.sources, feed.ages, strict=True)
            if age is None and owners[k] in at
        }
        guessed = {k for k, early in passed if early}
        return sorted(guessed), sorted({k for k, _ in passed} - guessed)

    def advance(self, time: float, length: float) -> None:
        """Take one step from ``time`` of ``length``, both in s.

        Raises:
            CouplingError: it does not converge.
            FmuError: an FMU failed.
        """
        exchange, end = self.exchange, time + length
        for name in self.blocks.sampled:
            self.write(name, time, length)
            exchange.slaves[name].step(time, length)
            exchange.read_finite(exchange.slaves[name], end, direct=True)
        for group in self.blocks.continuous:
            if group in self._exchanged:
                self._iterate(group, time, length)
            else:
                self._sweep(group, time, length, final=True)
        for name in self.blocks.sampled:
            exchange.read_finite(exchange.slaves[name], end, direct=False)
        self.tally.steps += 1

    def _sweep(self, group: Sequence[str], time: float, length: float, *, final: bool) -> None:
        for name in group:
            self.write(name, time, length)
            self.exchange.slaves[name].step(time, length, final=final)
            self.exchange.read_finite(self.exchange.slaves[name], time + length)

    def _iterate(self, group: tuple[str, ...], time: float, length: float) -> None:
        exchange, (guessed, passed) = self.exchange, self._exchanged[group]
        slaves = [exchange.slaves[name] for name in group]
        reals = [k for k in (*guessed, *passed) if exchange.kinds[k] == "Real"]
        others = [k for k in (*guessed, *passed) if exchange.kinds[k] != "Real"]
        unknowns = slice(sum(exchange.kinds[k] == "Real" for k in guessed))
        states = [slave.save() for slave in slaves]
        try:
            next_guess = _ACCELERATIONS[self.acceleration](self.relaxation)
            wrong: list[int] = []
            sizes: list[float] = []
            error = scale = np.zeros(0)
            for count in range(1, self.max_iterations + 1):
                if count > 1:
                    for slave, state in zip(slaves, states, strict=True):
                        slave.restore(state)
                guess = np.array([exchange.values[k] for k in reals], dtype=np.float64)
                flags = [exchange.values[k] for k in others]
                try:
                    self._sweep(group, time, length, final=False)
                except FmuError as failure:
                    if count == 1 or isinstance(failure, StoppedError):
                        raise
                    said = str(failure).partition("\n")[0]
                    raise self._failure((time, length), wrong, error, sizes, said) from failure
                reached = np.array([exchange.values[k] for k in reals], dtype=np.float64)
                distance = np.abs(reached - guess)
                error = distance / self._scale(reals, guess, reached)
                if count == 1:  # the size of each value, for the method that combines them
                    scale = self._scale(reals, guess, reached)
                sizes.append(_largest(distance / scale))
                wrong = [reals[k] for k in np.argsort(error)[::-1] if error[k] > 1.0]
                wrong += [k for k, flag in zip(others, flags, strict=True) if flag != exchange.values[k]]
                if not wrong:
                    self._count(count, _largest(error))
                    return
                u = unknowns
                following = next_guess(guess[u] / scale[u], reached[u] / scale[u]) * scale[u]
                if not np.isfinite(following).all() or sizes[-1] > _HOPELESS * max(sizes[0], 1.0):
                    break
                for k, value in zip(reals[u], following, strict=True):
                    exchange.values[k] = float(value)
            raise self._failure((time, length), wrong, error, sizes)
        finally:
            for slave, state in zip(slaves, states, strict=True):
                slave.forget(state)

    def _scale(self, places: Sequence[int], a: Vector, b: Vector) -> Vector:
        bounds = np.array([self.tolerances[k] for k in places]).reshape(-1, 2)
        return np.asarray(bounds[:, 1] + bounds[:, 0] * np.maximum(np.abs(a), np.abs(b)) + 1e-300)

    def _count(self, iterations: int, worst: float) -> None:
        self.tally.iterations += iterations
        self.tally.most = max(self.tally.most, iterations)
        self.tally.residual = max(self.tally.residual, worst)

    def _failure(
        self, step: tuple[float, float], wrong: Sequence[int], error: Vector, sizes: Sequence[float], failure: str = ""
    ) -> CouplingError:
        """What to say of iterations that led nowhere.

        Args:
            step: its begin and its length in s.
            wrong: places of the values that disagree.
            error: by how much those do that are real, in units of the tolerance.
            sizes: how far apart values were at most, for each iteration.
            failure: what an FMU failed of in the one after them, if it did.
        """
        names = ", ".join(self.exchange.signals[k] for k in wrong[:_SHOWN])
        grows = bool(failure) or sizes[-1] > _GROWN * sizes[0]
        worst = _largest(error)
        what = f"still disagree by {worst:.3g} times the tolerance" if worst > 1.0 else "still change"
        if failure:
            what += f", and with the next guess an FMU fails ({failure})"
        ways = ["a smaller step"]
        ways += [] if grows else ["more simulation.max_iterations"]
        ways += [] if self.acceleration == "anderson" else ['simulation.acceleration = "anderson"']
        return CouplingError(
            f"t = {step[0]:g} s: the coupling through {names} {'diverges' if grows else 'does not converge'}: after "
            f"{len(sizes)} iterations of the step of {step[1]:g} s they {what}; take {', '.join(ways)} or a smaller "
            "simulation.relaxation"
        )


def _largest(errors: Vector) -> float:
    return float(errors.max(initial=0.0))


_HOPELESS, _GROWN = 1e12, 10.0
"""How many times farther apart than at first values are that nothing will bring together, or that are getting away."""
_SHOWN = 3


# -------------------------------------------------------------------- from what was tried to what is tried next


def _relaxed(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Part of the way, or more than all of it."""
    return lambda guess, reached: guess + relaxation * (reached - guess)


def _aitken(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Aitken's dynamic relaxation (Irons and Tuck 1969; Küttler and Wall 2008, eq. 44)."""
    factor, before = relaxation, None

    def following(guess: Vector, reached: Vector) -> Vector:
        nonlocal factor, before
        residual = reached - guess
        if before is not None:
            change = residual - before
            size = float(change @ change)
            if size > 0.0:
                factor *= -float(before @ change) / size
        before = residual
        return np.asarray(guess + factor * residual)

    return following


def _anderson(relaxation: float) -> Callable[[Vector, Vector], Vector]:
    """Anderson's method (Anderson 1965; Walker and Ni 2011, algorithm AA): the best combination of former iterates."""
    guesses: list[Vector] = []
    residuals: list[Vector] = []

    def following(guess: Vector, reached: Vector) -> Vector:
        residual = reached - guess
        guesses.append(guess)
        residuals.append(residual)
        del guesses[: -_DEPTH - 1], residuals[: -_DEPTH - 1]
        if len(residuals) == 1:
            return np.asarray(guess + relaxation * residual)
        steps = np.diff(np.array(guesses), axis=0).T
        changes = np.diff(np.array(residuals), axis=0).T
        if not np.isfinite(changes).all():
            return np.full_like(guess, np.nan)
        weights = np.linalg.lstsq(changes, residual, rcond=1e-14)[0]
        return np.asarray(guess + relaxation * residual - (steps + relaxation * changes) @ weights)

    return following


_ACCELERATIONS: Mapping[str, Callable[[float], Callable[[Vector, Vector], Vector]]] = {
    "none": _relaxed,
    "aitken": _aitken,
    "anderson": _anderson,
}


def describe(tally: Tally) -> dict[str, Any]:
    """For the record of the run."""
    mean = tally.iterations / tally.steps if tally.steps else 0.0
    return {"iterations_per_step": mean, "most_iterations": tally.most, "worst_residual_per_tolerance": tally.residual}
