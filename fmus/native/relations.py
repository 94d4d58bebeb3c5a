"""What model exchange asks of equations: choices that stay as they are between events, and what tells when to change.

A comparison of anything that moves in continuous time becomes a *mode*, a truth that is kept from event to event; of a
table, or of ``floor``, the place is kept that was looked up. What both branches agree on where they meet (the smaller
and the larger of two, and what is cut off) needs no event: it is continuous, and is left as it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import casadi as ca

from ...components.component import Component
from ...components.declarations import State
from ...components.lookup.cells import Cells
from ..variables import scalar_variables
from . import calls
from .ccode import called_in, function
from .trace import Expressions, Traced, directional, expressions, simplification

Kind = Literal["LESS", "NOT_ABOVE", "BEFORE", "AFTER", "PIECE", "TIME_PIECE"]
"""Of modes: ``a < b``, ``a <= b``; time before or after something that does not move; the piece that a place is in."""
_FAR = 1e300
"""Where pieces end that do not."""
_AHEAD = 2e-12
"""How far a piece of time is looked up ahead, so that the event at its end, whatever the rounding, is past it: further
than what the runtime takes for the same time (`HYSTERESIS` of exchange.c), so that no end that is ahead is left out."""


class Mode(NamedTuple):
    """One mode: its kind, and whether it has an event indicator of its own."""

    kind: Kind
    indicated: bool


@dataclass(frozen=True)
class Exchange:
    """What model exchange adds to a traced component.

    Attributes:
        code: the C functions ``<prefix>_frozen_outputs`` and ``_frozen_derivatives``, of modes too, their derivatives
            along a direction, ``_frozen_directional``, and ``_relations``: two numbers for each mode, of a comparison
            how far it is from changing and the size of what is compared; of one with time when it changes; of a piece
            how far it is to its end (of a piece of time, its end), and the place. Those that would compute nothing are
            left out; without modes there are none.
        modes: what each is.
    """

    code: str
    modes: tuple[Mode, ...]

    def indicators(self, component: Component) -> int:
        """The number of event indicators: of modes, then of states with a standstill."""
        return sum(mode.indicated for mode in self.modes) + len(_standing(component))


def exchange(component: Component, prefix: str, traced: Traced, held: Sequence[bool]) -> Exchange:
    """Make modes of the choices in a component's outputs and rates.

    Args:
        component: built.
        prefix: beginning of the C functions' names.
        traced: its equations as C, beside which the code will stand.
        held: for each scalar output, whether it is held from sample to sample: its choices need no events.
    """
    with simplification(False):
        found = expressions(component)
        fresh = [ca.SX(0.0) if hold else cell for cell, hold in zip(found.outputs, held, strict=True)]
        column = ca.densify(ca.vertcat(*fresh, *found.derivatives))
        compiled = ca.Function("f", [found.clock, found.values], [column], {"cse": True})
        freezer = _Freezer(found, component, compiled)
        frozen = freezer.results(column.shape[0])
        functions = {
            "frozen_outputs": frozen[: len(fresh)],
            "frozen_derivatives": frozen[len(fresh) :],
            "relations": freezer.relations,
        }
        arguments = [("clock", found.clock), ("values", found.values), ("modes", ca.vertcat(*freezer.modes))]
        code: dict[str, None] = {}
        for name, results in functions.items():
            if freezer.modes and results:
                code |= dict.fromkeys(function(f"{prefix}_{name}", arguments, results, calls.KNOWN))
        if freezer.modes:
            code |= dict.fromkeys(directional(f"{prefix}_frozen_directional", arguments, frozen))
    parts = [*calls.tables("".join(code)), *code]
    return Exchange("\n".join(part for part in parts if part not in traced.code), tuple(freezer.kinds))


@dataclass(frozen=True)
class _Step:
    """One operation of a CasADi function: the steps it reads, and of an input its place, of a constant its value."""

    operation: int
    read: tuple[tuple[int, int], ...]
    what: Any = None
    results: int = 1


@dataclass
class _Value:
    """What a step has become: its expressions, whether they move in continuous time, and how far it is from the time.

    The last is none but of the time itself, and of what is the time but for something that does not move.
    """

    cells: list[Any]
    moves: bool = False
    after: Any = None


@dataclass
class _Freezer:
    found: Expressions
    component: Component
    compiled: Any
    modes: list[Any] = field(default_factory=list)
    kinds: list[Mode] = field(default_factory=list)
    relations: list[Any] = field(default_factory=list)

    def results(self, count: int) -> list[Any]:
        """The results of the function, frozen; modes are noted on the way."""
        variables = scalar_variables(self.component)
        real = [v for v in variables if v.slot.type is float]
        self.moving = {v.reference for v in real if v.causality == "input" or _is_state(v)}
        self.standing = _standing(self.component)
        self.steps = list(_steps(self.compiled))
        self.uses = _uses(self.steps)
        self.values: list[_Value] = []
        found: list[Any] = [None] * count
        for k, step in enumerate(self.steps):
            if step.operation == ca.OP_OUTPUT:
                found[step.what] = self._read(step.read)[0]
                self.values.append(_Value([]))
            else:
                self.values.append(self._value(k, step))
        return found

    def _read(self, places: Sequence[tuple[int, int]]) -> list[Any]:
        return [self.values[k].cells[n] for k, n in places]

    def _value(self, k: int, step: _Step) -> _Value:
        operation = step.operation
        if operation == ca.OP_INPUT:
            return self._argument(*step.what)
        if operation == ca.OP_CONST:
            return _Value([ca.SX(step.what)])
        read = self._read(step.read)
        moves = any(self.values[n].moves for n, _ in step.read)
        if operation == ca.OP_CALL:
            return self._call(step, read, moves)
        if moves and operation in (ca.OP_LT, ca.OP_LE) and not self._is_kink(k):
            return _Value([self._comparison(step, *read)])
        if moves and operation == ca.OP_FLOOR:
            place = self._piece(step.read[0], read[0], lambda p: (ca.floor(p), ca.floor(p) + 1.0))
            return _Value([ca.floor(place)])
        apply = ca.SX.unary if len(read) == 1 else ca.SX.binary
        return _Value([apply(operation, *read)], moves, self._after(step, read))

    def _argument(self, argument: int, place: int) -> _Value:
        if argument == 1:
            return _Value([self.found.values[place]], place in self.moving)
        is_time = place == 0
        return _Value([self.found.clock[place]], is_time, ca.SX(0.0) if is_time else None)

    def _after(self, step: _Step, read: list[Any]) -> Any:
        """How far a sum or difference is from the time."""
        first, *others = [self.values[k] for k, _ in step.read]
        if step.operation not in (ca.OP_ADD, ca.OP_SUB) or sum(v.moves for v in (first, *others)) != 1:
            return None
        if first.after is not None:
            return ca.SX.binary(step.operation, first.after, read[1])
        (second,) = others
        return second.after + read[0] if step.operation == ca.OP_ADD and second.after is not None else None

    def _call(self, step: _Step, read: list[Any], moves: bool) -> _Value:
        function = self.compiled.get_function(step.what)
        table = calls.TABLES.get(step.what) if step.what.startswith("cells_") else None
        if table is None or not moves:
            return _Value(_flat(function, read), moves)
        for axis, starts in enumerate(table[:-1]):
            if len(starts) > 1 and self.values[step.read[axis][0]].moves:
                read[axis] = self._piece(step.read[axis], read[axis], _bounds(starts.tolist()))
        return _Value(_flat(function, read))

    def _comparison(self, step: _Step, a: Any, b: Any) -> Any:
        strict = step.operation == ca.OP_LT
        for clock, other, kind in ((0, 1, "BEFORE"), (1, 0, "AFTER")):
            after = self.values[step.read[clock][0]].after
            if after is not None and not self.values[step.read[other][0]].moves:
                return self._mode(Mode(kind, indicated=False), (a, b)[other] - after, ca.SX(0.0))  # type: ignore[arg-type]
        # A state with a standstill has an indicator for that already.
        stands = any(
            self.steps[x[0]].operation == ca.OP_INPUT
            and self.steps[x[0]].what[0] == 1
            and self.steps[x[0]].what[1] in self.standing
            and self.steps[y[0]].operation == ca.OP_CONST
            and self.steps[y[0]].what == 0.0
            for x, y in (step.read, step.read[::-1])
        )
        kind_of = "LESS" if strict else "NOT_ABOVE"
        return self._mode(Mode(kind_of, indicated=not stands), b - a, ca.fabs(a) + ca.fabs(b))  # type: ignore[arg-type]

    def _piece(self, read: tuple[int, int], a: Any, bounds: Callable[[Any], tuple[Any, Any]]) -> Any:
        """The place that is kept of one that is looked up."""
        place = ca.SX.sym(f"mode{len(self.modes)}")
        low, high = bounds(place)
        after = self.values[read[0]].after
        if after is not None:
            ahead = a + _AHEAD * (1.0 + ca.fabs(self.found.clock[0]) + ca.fabs(after))
            return self._mode(Mode("TIME_PIECE", indicated=False), high - after, ahead, place)
        below, above = a - low, high - a
        return self._mode(Mode("PIECE", indicated=True), ca.if_else(below < above, below, above), a, place)

    def _mode(self, mode: Mode, first: Any, second: Any, symbol: Any = None) -> Any:
        symbol = ca.SX.sym(f"mode{len(self.modes)}") if symbol is None else symbol
        self.modes.append(symbol)
        self.kinds.append(mode)
        self.relations += [first, second]
        return symbol

    def _is_kink(self, k: int) -> bool:
        """Whether a comparison chooses between the two that it compares, and nothing else: continuous, with a kink."""
        compared = {self._identity(read) for read in self.steps[k].read}
        chosen: list[bool] = []
        for user in self.uses[k]:
            negated = self.steps[user].operation == ca.OP_NOT
            for n in self.uses[user] if negated else [user]:
                choice = self.steps[n]
                if choice.operation != ca.OP_IF_ELSE_ZERO or self._identity(choice.read[1]) not in compared:
                    return False
                chosen.append(negated)
        return set(chosen) == {True, False}

    def _identity(self, read: tuple[int, int]) -> Any:
        step = self.steps[read[0]]
        return ("constant", step.what) if step.operation == ca.OP_CONST else read


def _standing(component: Component) -> set[int]:
    """Where the states with a standstill stand among the values."""
    states = [v for v in scalar_variables(component) if _is_state(v)]
    return {v.reference for v in states if getattr(v.slot.declaration, "standstill", False)}


def _is_state(variable: Any) -> bool:
    return isinstance(variable.slot.declaration, State) and not variable.is_start


def _steps(compiled: Any) -> Iterator[_Step]:
    names = iter(called_in(compiled))
    holds: dict[int, tuple[int, int]] = {}
    for k in range(compiled.n_instructions()):
        operation, places = compiled.instruction_id(k), compiled.instruction_input(k)
        written = compiled.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            yield _Step(operation, (holds[places[0]],), written[1])
            continue
        if operation == ca.OP_INPUT:
            yield _Step(operation, (), tuple(places))
        elif operation == ca.OP_CONST:
            yield _Step(operation, (), compiled.instruction_constant(k))
        else:
            what = next(names) if operation == ca.OP_CALL else None
            yield _Step(operation, tuple(holds[place] for place in places), what, len(written))
        for n, place in enumerate(written):
            holds[place] = (k, n)


def _uses(steps: Sequence[_Step]) -> list[list[int]]:
    uses: list[list[int]] = [[] for _ in steps]
    for k, step in enumerate(steps):
        for n, _ in step.read:
            uses[n].append(k)
    return uses


def _bounds(starts: Sequence[float]) -> Callable[[Any], tuple[Any, Any]]:
    """Where the cell begins and ends that a place is in."""
    ends = [[low, high] for low, high in zip([-_FAR, *starts[1:]], [*starts[1:], _FAR], strict=True)]
    table = Cells([starts], ends)

    def find(place: Any) -> tuple[Any, Any]:
        low, high = calls.cells(table, [place])
        return low, high

    return find


def _flat(function: Any, read: Sequence[Any]) -> list[Any]:
    """The results of a CasADi function of vectors, whose cells are given one after the other."""
    arguments, at = [], 0
    for k in range(function.n_in()):
        arguments.append(ca.vertcat(*read[at : at + function.nnz_in(k)]))
        at += function.nnz_in(k)
    results = function.call(arguments)
    return [cell for result in results for cell in ca.vertsplit(result)]
