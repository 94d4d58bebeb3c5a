"""Implicit coupling: a communication step is repeated from saved states until what is exchanged agrees at its end.

Only instances that depend on each other within the step, in a cycle, are repeated; the others step once, sources before
receivers, with the values of the step's end. Sampled components are no part of that: they act on the values of the
step's begin, and step first.

What two repetitions give cannot agree better than the FMUs solve their own equations: the tolerance is not below theirs
unless one is given. Where there is nothing that agrees, as where a threshold flips, the system says whether that ends
the run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...errors import FmuError
from ...fmi import Interface
from ...system import System
from ...times import digits
from ...wiring import Link, Wiring, condensed, derive_order, graph_of, in_sequence
from ..coupling import Coupling
from .algorithm import Batch, Fit, Operation, Programmed, Repeated
from .iteration import Iteration
from .refusals import cannot, listed

_TOLERANCE = 1e-8
"""Relative tolerance of what is exchanged, where the system gives none."""
_TOLD = 100
"""How many steps that went on unsettled are told one by one."""


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


class Iterative(Programmed):
    """Steps of coupled instances are repeated from saved states until what is exchanged agrees at their end."""

    name = "iterative"
    solves_loops = True
    is_of_end = True

    def __init__(self, coupling: Coupling) -> None:
        super().__init__(coupling)
        settings, exchange = coupling.settings, coupling.exchange
        self.exchange = exchange
        self.blocks = find_blocks(coupling.interfaces, exchange.every_link)
        self.tolerances = coupling.tolerances(_TOLERANCE, own_tolerances(self.blocks, coupling.interfaces))
        self._iterations = {
            group: Iteration(exchange, *self._find_exchanged(group), self.tolerances, settings.stepping)
            for group in self.blocks.continuous
            if not self.blocks.cyclic.isdisjoint(group)
        }
        self._program = self.program()
        self._steps = 0

    @classmethod
    def fit(cls, system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Fit:
        """States must be saved where steps are repeated."""
        blocks = find_blocks(interfaces, wiring.every_link)
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

    def _find_exchanged(self, group: Sequence[str]) -> tuple[list[int], int]:
        """Places of the values that one of the group gives to another or itself, and how many have to be guessed.

        These come first: they are needed before their source has stepped.
        """
        at = {name: k for k, name in enumerate(group)}
        passed = {
            (self.exchange.places[source], at[source[0]] >= at[target[0]])
            for source, target in ((link.source, link.target) for link in self.exchange.every_link if not link.delay)
            if source[0] in at and target[0] in at
        }
        guessed = {k for k, early in passed if early}
        return [*sorted(guessed), *sorted({k for k, _ in passed} - guessed)], len(guessed)

    def program(self) -> Sequence[Batch | Repeated]:
        """Sampled components; groups, repeated or not; and what the sampled ones show of the step's end."""
        whole = (Operation.SET, Operation.STEP, Operation.GET)
        early = (Operation.SET, Operation.STEP, Operation.GET_DIRECT)
        found: list[Batch | Repeated] = [Batch(early, (name,)) for name in self.blocks.sampled]
        for group in self.blocks.continuous:
            iteration = self._iterations.get(group)
            found += (
                [Batch(whole, (name,)) for name in group]
                if iteration is None
                else [Repeated(Batch(whole, group), iteration)]
            )
        return [*found, Batch((Operation.GET_REST,), self.blocks.sampled)]

    def take(self, number: int, time: float, length: float) -> None:
        """Take a step, as `FixedStep.take` says."""
        for part in self._program:
            if isinstance(part, Repeated):
                self._repeat(part, time, length)
                continue
            for operation in part.operations:
                for name in part.names:
                    self._do(operation, name, time, length, final=True)
        self._steps += 1

    def note_steps(self, count: int) -> None:
        """So many steps have been taken by the compiled loop."""
        self._steps += count

    def _do(self, operation: Operation, name: str, time: float, length: float, *, final: bool) -> None:
        slave = self.exchange.slaves[name]
        if operation == Operation.SET:
            self.coupling.write(name, time, length)
        elif operation == Operation.STEP:
            slave.step(time, length, final=final)
        else:
            direct = {Operation.GET_DIRECT: True, Operation.GET_REST: False}.get(operation)
            self.exchange.read_finite(slave, time + length, direct=direct)

    def _repeat(self, part: Repeated, time: float, length: float) -> None:
        names, iteration = part.batch.names, part.iteration
        slaves = [self.exchange.slaves[name] for name in names]
        states = [slave.save() for slave in slaves]
        try:
            iteration.begin()
            agrees: bool | None = False
            while agrees is False:
                if iteration.round:
                    for slave, state in zip(slaves, states, strict=True):
                        slave.restore(state)
                iteration.begin_round()
                try:
                    for name in names:
                        for operation in part.batch.operations:
                            self._do(operation, name, time, length, final=False)
                except FmuError as failure:
                    told = iteration.explain(failure, time, length)
                    if told is failure:
                        raise
                    raise told from failure
                agrees = iteration.end_round()
            if agrees is None:
                iteration.give_up(time, length)
        finally:
            for slave, state in zip(slaves, states, strict=True):
                slave.forget(state)

    def report(self) -> dict[str, Any]:
        """Iterations and the worst residual."""
        counted = [iteration.counted() for iteration in self._iterations.values()]
        mean = sum(each[0] for each in counted) / self._steps if self._steps else 0.0
        most, worst = max((each[1] for each in counted), default=0), max((each[2] for each in counted), default=0.0)
        begins = sorted(time for iteration in self._iterations.values() for time in iteration.unsettled)
        told = ""
        if begins:
            told = f"; {len(begins)} of {self._steps} steps went on unsettled, the first from t = {digits(begins[0])} s"
        return {
            "iterations_per_step": mean,
            "most_iterations": most,
            "worst_residual_per_tolerance": worst,
            "unsettled": len(begins),
            "first_unsettled": begins[:_TOLD],
            "summary": f"{mean:.3g} iterations per step, at most {most}; worst residual {worst:.2g} of "
            f"the tolerance{told}",
        }


def own_tolerances(blocks: Blocks, interfaces: Mapping[str, Interface]) -> dict[str, float]:
    """The coarsest tolerance of an FMU's own solver in each cycle where that is above the usual, by instance."""
    found = {}
    for group in blocks.continuous:
        coarsest = max(interfaces[name].default_tolerance or 0.0 for name in group)
        if _TOLERANCE < coarsest < 1.0 and not blocks.cyclic.isdisjoint(group):
            found.update(dict.fromkeys(group, coarsest))
    return found
