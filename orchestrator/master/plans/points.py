"""What a plan does at a communication point: values are brought up to date without a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ...fmi.binding import whole_arrays
from ...isolation import Ride
from ..algebraic import NUMBERS, LoopSolver
from ..algorithms import HEAD
from ..coupling import Coupling
from ..exchange import Exchange, Yield
from ..refresh import Refresher
from .courses import Called
from .flattening import parts_of
from .layout import CIRCLE, NOBODY, Kind

Term = tuple[int, int, int, int]
"""Of an input its entry, of an unknown value which it is; its value reference; elements of its array; which of them."""


class Algebra:
    """Who solves algebraic loops, for the kernel.

    Attributes:
        solvers, parties, terms: as ``native/kernel.h`` has them.
        solving: by their operations, who they are. work: where their numbers begin.
    """

    def __init__(self) -> None:
        self.solvers: list[tuple[int, ...]] = []
        self.parties: list[tuple[int, ...]] = []
        self.terms: list[Term] = []
        self.solving: dict[int, LoopSolver] = {}
        self.work: list[tuple[int, LoopSolver]] = []


class Growing(Protocol):
    """What is asked of a plan to which operations are added: see `Plan`."""

    exchange: Exchange
    slaves: dict[str, Called]
    operations: list[tuple[int, int, int, int]]
    loops: list[tuple[float, ...]]
    passed: list[int]
    feeds: list[tuple[str, int, list[int], bool, int]]
    algebra: Algebra
    room: int
    width: int

    def add_operation(self, kind: int, index: int, culprit: tuple[Called | None, str], due: tuple[int, int]) -> None:
        """Add an operation."""

    def add_sets(self, slave: Called, rate: int, *, late: bool) -> None:
        """Set inputs."""

    def add_gets(self, slave: Called, rate: int, direct: bool | None, kind: Kind) -> None:
        """Read outputs."""

    def add_reads(self, kind: Kind, slave: Called, part: Yield, due: tuple[int, int]) -> None:
        """Read outputs of one type, or look at them."""


def add_point(plan: Growing, coupling: Coupling) -> None:
    """Add all that brings values up to date, as `Coupling.settle` does."""
    if coupling.refresher is not None:
        _add_refresh(plan, coupling.refresher)
    if coupling.loops is not None:
        _add_solution(plan, coupling.loops)
        if coupling.refresher is not None:  # what follows from the loops
            _add_refresh(plan, coupling.refresher)


def _add_refresh(plan: Growing, refresher: Refresher) -> None:
    """Add what brings feed-through up to date."""
    for stage, is_circle in refresher.stages:
        names = [name for name in stage if name not in refresher.refused]
        number = len(plan.loops)
        if is_circle:
            plan.loops.append((CIRCLE, len(stage) + 1, plan.room, *[0] * 5, 0.0))
            plan.room += HEAD + 2 * plan.width
            plan.add_operation(Kind.BEGIN, number, NOBODY, (1, 0))
            plan.add_operation(Kind.MARK, number, NOBODY, (1, 0))
        for name in names:
            plan.add_sets(plan.slaves[name], 1, late=True)
            plan.add_gets(plan.slaves[name], 1, None, kind=Kind.READ)
        if is_circle:
            plan.add_operation(Kind.END, number, NOBODY, (1, 0))
        for name in names:
            for part in plan.exchange.yields[name]:
                if part.is_real:
                    plan.add_reads(Kind.LOOK, plan.slaves[name], part, (1, 0))


def _add_solution(plan: Growing, loops: LoopSolver) -> None:
    """Add what solves algebraic loops."""
    algebra, first = plan.algebra, len(plan.operations)
    algebra.solving[first] = loops
    algebra.work.append((plan.room, loops))
    plan.add_operation(Kind.SOLVE, len(algebra.solvers), NOBODY, (1, 0))
    for feeder in loops.feeders:
        plan.add_sets(plan.slaves[feeder.name], 1, late=True)
        plan.add_gets(plan.slaves[feeder.name], 1, None, kind=Kind.READ)
    slaves = [plan.slaves[slave.name] for slave in loops.instances]
    knowns: dict[str, list[Term]] = {}
    ends = [len(plan.operations)]
    for slave in slaves:
        begin = len(plan.feeds)
        plan.add_sets(slave, 1, late=True)
        knowns[slave.name] = [term for feed in plan.feeds[begin:] for term in _inputs(plan, slave, feed)]
        ends.append(len(plan.operations))
    for slave in slaves:
        plan.add_gets(slave, 1, None, kind=Kind.READ)
        ends.append(len(plan.operations))
    count, party = len(slaves), len(algebra.parties)
    for n, slave in enumerate(slaves):
        function, component = (0, 0) if plan.exchange.output_changes else _derivatives(slave)
        own = ends[n], ends[n + 1], ends[count + n], ends[count + n + 1], len(plan.operations)
        names = [loops.name_of(row) for row in loops.rows[slave.name]]
        whole = whole_arrays(names, slave.interface)
        rows = [(row, 0, 1, whole.index(name)) for row, name in zip(loops.rows[slave.name], names, strict=True)]
        asked = [(0, reference, size, 0) for reference, size in _references(slave, whole)]
        counts = len(knowns[slave.name]), len(rows), len(asked)
        if function:
            plan.add_operation(Kind.ASK, len(algebra.parties), (slave, slave.DERIVE), (1, 0))
        algebra.parties.append(
            (function, component, slave.interface.version == "3.0", *own, len(algebra.terms), *counts)
        )
        algebra.terms += [*knowns[slave.name], *rows, *asked]
    n, m = len(loops.reals), len(loops.others)
    algebra.solvers.append(
        (plan.room, len(plan.passed), n, m, loops.attempts, party, count, ends[0], ends[-1], len(plan.operations))
    )
    plan.passed += [*loops.reals, *loops.others]
    plan.room += NUMBERS + 3 * n + n * (9 + 2 * n) + m + plan.width


def _derivatives(slave: Called) -> tuple[int, int]:
    """The function that gives directional derivatives, and what stands for the instance there; 0 if there is none."""
    if not (slave.interface.directional_derivatives and slave.DERIVE in slave.functions):
        return 0, 0
    return slave.add_question() if isinstance(slave, Ride) else slave.addresses(slave.DERIVE)


def _inputs(plan: Growing, slave: Called, feed: tuple[str, int, list[int], bool, int]) -> list[Term]:
    """The real inputs of one feed of an instance, in its order."""
    made, variables, wholes = (
        plan.exchange.feeds[slave.name][feed[1]],
        slave.interface.variables,
        slave.interface.wholes,
    )
    if not made.is_real:
        return []
    places = [k for _, own in parts_of(made.channel) or () for k in own]
    found = []
    for k, name in enumerate(made.targets):
        element = variables[name].element
        whole = (name,) if element is None else wholes[element[0]]
        found.append((feed[4] + places.index(k), variables[whole[0]].reference, len(whole), list(whole).index(name)))
    return found


def _references(slave: Called, whole: Sequence[str]) -> list[tuple[int, int]]:
    """Of variables, each array whole, the value references and how many numbers each of them stands for."""
    found: dict[str, tuple[int, int]] = {}
    for name in whole:
        variable = slave.interface.variables[name]
        if variable.element is None:
            found[name] = variable.reference, 1
        elif not variable.element[1]:
            found[name] = variable.reference, len(slave.interface.wholes[variable.element[0]])
    return list(found.values())
