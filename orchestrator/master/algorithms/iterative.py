"""Implicit coupling: a communication step is repeated from saved states until what is exchanged agrees at its end.

Only instances that depend on each other within the step, in a cycle, are repeated; the others step once, sources before
receivers, with the values of the step's end. Sampled components are no part of that: they act on the values of the
step's begin, and step first.

What two repetitions give cannot agree better than the FMUs solve their own equations: the tolerance is not below theirs
unless one is given. Where there is nothing that agrees, as where a threshold flips, the system says whether that ends
the run.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...errors import CouplingError, FmuError, StoppedError
from ...fmi import Interface
from ...system import System
from ...times import digits
from ...wiring import Link, Wiring, condensed, derive_order, graph_of, in_sequence
from ..coupling import Coupling
from .acceleration import ACCELERATIONS, Vector
from .algorithm import Fit, FixedStep
from .refusals import cannot, listed

_TOLERANCE = 1e-8
"""Relative tolerance of what is exchanged, where the system gives none."""


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
    others = dict.fromkeys(name for name in interfaces if name not in sweep)
    ends = [(link.source[0], link.target[0]) for link in links]
    graph = graph_of(((a, b) for a, b in ends if a in others and b in others), others)
    rank = {name: k for k, name in enumerate(interfaces)}
    sequence = in_sequence(condensed(graph), key=lambda group: min(rank[name] for name in group))
    groups = tuple(tuple(sorted(group, key=rank.__getitem__)) for group in sequence)
    cyclic = frozenset(n for group in groups for n in group if len(group) > 1 or n in graph[n])
    return Blocks(sweep, groups, cyclic)


@dataclass
class Tally:
    """How the iterations went.

    Communication ``steps``, ``iterations`` in all and at ``most``, the worst ``residual`` in units of the tolerance,
    and the begins in s of steps that were taken ``unsettled``.
    """

    steps: int = 0
    iterations: int = 0
    most: int = 0
    residual: float = 0.0
    unsettled: list[float] = field(default_factory=list)


class Iterative(FixedStep):
    """Steps of coupled instances are repeated from saved states until what is exchanged agrees at their end."""

    name = "iterative"
    solves_loops = True
    is_of_end = True

    def __init__(self, coupling: Coupling) -> None:
        super().__init__(coupling)
        settings, exchange = coupling.settings, coupling.exchange
        self.exchange, self.tally = exchange, Tally()
        self.blocks = find_blocks(coupling.interfaces, exchange.links)
        self.tolerances = coupling.tolerances(_TOLERANCE, own_tolerances(self.blocks, coupling.interfaces))
        self.unsettled = settings.stepping.unsettled
        self.max_iterations = settings.stepping.max_iterations
        self.relaxation, self.acceleration = settings.stepping.relaxation, settings.stepping.acceleration
        self._exchanged = {
            group: self._find_exchanged(group)
            for group in self.blocks.continuous
            if not self.blocks.cyclic.isdisjoint(group)
        }

    @classmethod
    def fit(cls, system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Fit:
        """States must be saved where steps are repeated."""
        blocks = find_blocks(interfaces, wiring.links)
        lost = cannot(
            [name for name in interfaces if name in blocks.cyclic and not interfaces[name].can_save_state],
            "in a cycle, and the state that iterative comes back to cannot be saved (canGetAndSetFMUstate is false)",
            "choose gauss-seidel or jacobi, or break the cycle by a delay",
        )
        notes = []
        able = sorted(name for name in blocks.cyclic if interfaces[name].interpolates_inputs)
        if able and not system.stepping.extrapolation:
            notes.append(f"{listed(able)} can interpolate inputs: extrapolation = 1 makes iterative second order there")
        own = own_tolerances(blocks, interfaces)
        if own and system.stepping.tolerance is None:
            coarse = f"{listed(sorted(own))} agree to a tolerance of {max(own.values()):g}, at most"
            notes.append(f"{coarse}: that of their own solvers (DefaultExperiment)")
        steps = []
        if blocks.sampled:
            steps.append(f"steps first, at the values of the step's begin: {', '.join(blocks.sampled)}")
        for group in blocks.continuous:
            repeated = not blocks.cyclic.isdisjoint(group)
            steps.append(f"{'repeats until they agree' if repeated else 'steps once'}: {', '.join(group)}")
        return Fit(list(lost), notes, steps)

    # ---------------------------------------------------------------- on the way

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

    def take(self, number: int, time: float, length: float) -> None:
        """Take a step, as `FixedStep.take` says."""
        exchange, end = self.exchange, time + length
        for name in self.blocks.sampled:
            self.coupling.write(name, time, length)
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
            self.coupling.write(name, time, length)
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
            next_guess = ACCELERATIONS[self.acceleration](self.relaxation)
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
            if not self._goes_on_with(reals, reached, sizes, time):
                raise self._failure((time, length), wrong, error, sizes)
        finally:
            for slave, state in zip(slaves, states, strict=True):
                slave.forget(state)

    def _goes_on_with(self, places: Sequence[int], reached: Vector, sizes: Sequence[float], time: float) -> bool:
        """Whether the last iterate, of which the FMUs' states are, may stand though nothing settled; note it if so."""
        if self.unsettled == "stop" or not np.isfinite(reached).all() or sizes[-1] > _GROWN * sizes[0]:
            return False
        for k, value in zip(places, reached, strict=True):
            self.exchange.values[k] = float(value)
        self._count(len(sizes), 0.0)
        self.tally.unsettled.append(time)
        return True

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
        enough = 0.0
        if worst > 1.0 and not grows:
            enough = _rounded_up(max(sizes[-_LAST:]) * max(self.tolerances[k][0] for k in wrong))
        ways = ["a smaller step"]
        ways += [f"simulation.tolerance = {enough:g}"] if 0.0 < enough < _LOOSE else []
        ways += [] if grows else ["more simulation.max_iterations"]
        ways += [] if self.acceleration == "anderson" else ['simulation.acceleration = "anderson"']
        return CouplingError(
            f"t = {digits(step[0])} s: the coupling through {names} "
            f"{'diverges' if grows else 'does not converge'}: after "
            f"{len(sizes)} iterations of the step of {digits(step[1])} s they {what}; take "
            f"{', '.join(ways)} or a smaller "
            "simulation.relaxation"
        )

    def report(self) -> dict[str, Any]:
        """Iterations and the worst residual."""
        tally = self.tally
        mean = tally.iterations / tally.steps if tally.steps else 0.0
        return {
            "iterations_per_step": mean,
            "most_iterations": tally.most,
            "worst_residual_per_tolerance": tally.residual,
            "unsettled": len(tally.unsettled),
            "first_unsettled": tally.unsettled[:_TOLD],
            "summary": f"{mean:.3g} iterations per step, at most {tally.most}; worst residual {tally.residual:.2g} of "
            f"the tolerance{self._unsettled()}",
        }

    def _unsettled(self) -> str:
        """What to say of steps that were taken though nothing agreed."""
        begins = self.tally.unsettled
        if not begins:
            return ""
        return (
            f"; {len(begins)} of {self.tally.steps} steps went on unsettled, the first from t = {digits(begins[0])} s"
        )


def own_tolerances(blocks: Blocks, interfaces: Mapping[str, Interface]) -> dict[str, float]:
    """The coarsest tolerance of an FMU's own solver in each cycle where that is above the usual, by instance."""
    found = {}
    for group in blocks.continuous:
        coarsest = max(interfaces[name].default_tolerance or 0.0 for name in group)
        if _TOLERANCE < coarsest < 1.0 and not blocks.cyclic.isdisjoint(group):
            found.update(dict.fromkeys(group, coarsest))
    return found


def _rounded_up(value: float) -> float:
    """The next number with one digit that is not less."""
    if not 0.0 < value < math.inf:
        return 0.0
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit) * unit


def _largest(errors: Vector) -> float:
    return float(errors.max(initial=0.0))


_HOPELESS, _GROWN = 1e12, 10.0
"""How many times farther apart than at first values are that nothing will bring together, or that are getting away."""
_LAST, _LOOSE = 5, 0.01
"""Iterations whose distances tell how near they get, and the tolerance from which on none is advised."""
_SHOWN, _TOLD = 3, 100
