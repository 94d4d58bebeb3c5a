"""Tracing: a component's equations, run on symbols, become CasADi expressions and from them C.

The values of an instance stand in one vector: every scalar variable at its value reference, then the cells of the
tapes, then those of the random numbers. Time and the length of a sample are the vector ``clock``.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import casadi as ca
import numpy as np

from ...components.component import Component, Method, Slot, evaluated
from ...components.declarations import Memory, Output, State, Tape
from ...components.errors import ComponentError
from ...components.returned import check_returned, due, line_of
from ...components.tracing import TracingError
from ..variables import scalar_variables
from . import calls
from .ccode import function
from .symbol import Symbol, Text, arranged, expression

_REMEDY = "on values use operators, slices, reshaping and railcosim.components.maths, nothing else"
_NOT_THE_AUTHORS = (Path(__file__).parent, Path(__file__).parents[1])
"""Folders whose files are never to blame."""


@dataclass(frozen=True)
class Layout:
    """Where everything stands among the values: the first place and the number of each kind."""

    variables: int
    outputs: tuple[int, int]
    states: tuple[int, int]
    memory: tuple[int, int]
    tape: tuple[int, int]
    noise: tuple[int, int]

    @property
    def values(self) -> int:
        """Length of the vector."""
        return sum(self.noise)


@dataclass(frozen=True)
class Traced:
    """A component as C.

    Attributes:
        code: the C functions ``<prefix>_outputs``, ``_derivatives``, ``_update``, ``_initial``, ``_keep``, and of the
            outputs and rates, and of ``initial``, the derivatives along a direction, ``_directional`` and
            ``_initial_directional``; those that would compute nothing are left out.
        layout: where the values stand.
        initial: names of the scalars that ``initial`` computes, in the order of its results.
        reinitialised: names of the states that ``update`` may re-initialise.
    """

    code: str
    layout: Layout
    initial: tuple[str, ...]
    reinitialised: tuple[str, ...]


@dataclass(frozen=True)
class Expressions:
    """A component's methods as CasADi expressions.

    Attributes:
        layout: where the values stand.
        clock, values: what they are expressions of.
        outputs, derivatives, initial, update, keep: a column each; that of ``update`` is the next memory and tape row,
            then the states that it re-initialises.
        started: names of the scalars that ``initial`` computes. reinitialised: of those states.
    """

    layout: Layout
    clock: Any
    values: Any
    outputs: list[Any]
    derivatives: list[Any]
    initial: list[Any]
    update: list[Any]
    keep: list[Any]
    started: tuple[str, ...]
    reinitialised: tuple[str, ...]


def layout(component: Component) -> Layout:
    """The places of a component's values."""
    variables = scalar_variables(component)

    def place(*kinds: type) -> tuple[int, int]:
        references = [v.reference for v in variables if isinstance(v.slot.declaration, kinds) and not v.is_start]
        return (references[0], len(references)) if references else (len(variables), 0)

    columns = sum(len(slot.scalars) for slot in component.of(Tape))
    cells = sum(int(np.size(component.present_values[name])) for name in component.noises)
    count = len(variables)
    return Layout(count, place(Output), place(State), place(Memory), (count, columns), (count + columns, cells))


def trace(component: Component, prefix: str) -> Traced:
    """Run a component's equations on symbols.

    Args:
        component: built; its values do not matter.
        prefix: beginning of the C functions' names.

    Raises:
        TracingError: an equation cannot be traced; component, method and construct are named.
    """
    with simplification(False):
        return _code(expressions(component), prefix)


def expressions(component: Component) -> Expressions:
    """A component's equations run on symbols, as they stand.

    Raises:
        TracingError: as `trace` does.
    """
    with simplification(False):  # rearranged operations would round differently from the Python they came from
        return _Tracer(component).expressions()


def _code(found: Expressions, prefix: str) -> Traced:
    functions = {
        "outputs": found.outputs,
        "derivatives": found.derivatives,
        "initial": found.initial,
        "update": found.update,
        "keep": found.keep,
    }
    arguments = [("clock", found.clock), ("values", found.values)]
    code: dict[str, None] = {}  # what several of them call stands there once
    for name, column in functions.items():
        code |= dict.fromkeys(function(f"{prefix}_{name}", arguments, column, calls.KNOWN) if column else [])
    along = {"directional": [*found.outputs, *found.derivatives], "initial_directional": found.initial}
    for name, column in along.items():
        if column:
            code |= dict.fromkeys(directional(f"{prefix}_{name}", arguments, column))
    return Traced("\n".join([*calls.tables("".join(code)), *code]), found.layout, found.started, found.reinitialised)


def directional(name: str, arguments: list[tuple[str, Any]], column: list[Any]) -> list[str]:
    """C of the derivative of expressions along a direction in the space of the values, ``seed``.

    Args:
        name: of the function.
        arguments: name and CasADi vector of each, the values second; ``seed`` comes last.
        column: the expressions.
    """
    values = arguments[1][1]
    seed = ca.SX.sym("seed", values.shape[0])
    # Simplified, or x**2 at a negative x gives NaN: its rule adds 0 * log(x) for an exponent that does not vary.
    with simplification(True):
        derivative = ca.densify(ca.jtimes(ca.vertcat(*column), values, seed))
        results = [derivative[k] for k in range(len(column))]
        return function(name, [*arguments, ("seed", seed)], results, calls.KNOWN)


@contextlib.contextmanager
def simplification(wanted: bool) -> Iterator[None]:
    """CasADi's simplification of each operation as it is recorded: a global option of its own."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(wanted)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)


class _Tracer:
    def __init__(self, component: Component) -> None:
        self.name = type(component).__name__
        self.layout = layout(component)
        self.clock = ca.SX.sym("clock", 2)
        self.values = ca.SX.sym("values", self.layout.values)
        self.probe = type(component)(**component.build_arguments)
        self._fill()

    def _fill(self) -> None:
        place = self.probe.present_values
        references = {v.name: v.reference for v in scalar_variables(self.probe)}
        for slot in self.probe.slots.values():
            if slot.type is str:
                place[slot.name] = arranged([Text() for _ in slot.scalars], slot.shape)
            elif slot.scalars and slot.scalars[0] in references:
                place[slot.name] = self._cells([references[name] for name in slot.scalars], slot.shape)
        at = self.layout.tape[0]
        for slot in self.probe.of(Tape):
            place[slot.name] = self._cells(range(at, at + len(slot.scalars)), slot.shape)
            at += len(slot.scalars)
        for name in self.probe.noises:
            shape = np.shape(place[name])
            count = int(np.prod(shape, dtype=int))
            place[name] = self._cells(range(at, at + count), shape)
            at += count
        place["time"] = Symbol(self.clock[0])

    def _cells(self, references: Iterable[int], shape: tuple[int, ...]) -> Any:
        return arranged([Symbol(self.values[k]) for k in references], shape)

    def expressions(self) -> Expressions:
        outputs = self._results("outputs", [*self.probe.of(Output)])
        derivatives = self._results("derivatives", [*self.probe.of(State)])
        kept = [*self.probe.of(State, Memory)]
        started = self._returned("initial")
        computed = [slot for slot in kept if slot.name in started]
        initial = self._flat(started, computed, "initial")
        remembered = [*self.probe.of(Memory), *self.probe.of(Tape)]
        self.probe.present_values["step"] = Symbol(self.clock[1])
        updated = self._returned("update")
        del self.probe.present_values["step"]
        again = [slot for slot in self.probe.of(State) if slot.name in updated]
        update = self._flat(updated, [*remembered, *again], "update")
        keep = [expression(self._call("keep"))]
        return Expressions(
            self.layout,
            self.clock,
            self.values,
            outputs,
            derivatives,
            initial,
            update if self.probe.is_sampled else [],
            keep if self.layout.tape[1] else [],
            tuple(name for slot in computed for name in slot.scalars),
            tuple(name for slot in again for name in slot.scalars),
        )

    def _results(self, method: Method, slots: list[Slot]) -> list[Any]:
        return self._flat(self._returned(method), slots, method)

    def _call(self, method: Method) -> Any:
        try:
            return evaluated(self.probe, method)
        except Exception as error:
            self._refuse(method, error)

    def _returned(self, method: Method) -> dict[str, Any]:
        """What a method returns, by name."""
        returned: dict[str, Any] = self._call(method)
        check_returned(self.probe, method, returned, due(self.probe)[method])
        return returned

    def _refuse(self, method: str, error: Exception) -> NoReturn:
        """Say which method of which component did what: the author's own line."""
        what = f"{self.name}.{method} cannot be traced"
        remedy = "" if isinstance(error, ComponentError) else f"; {_REMEDY}"
        line = line_of(error, *_NOT_THE_AUTHORS)
        if line:
            what += f" at {line}"
        raise TracingError(f"{what}: {error}{remedy}") from error

    def _flat(self, returned: dict[str, Any], slots: list[Slot], method: str) -> list[Any]:
        cells: list[Any] = []
        for slot in slots:
            if slot.type is str:
                raise TracingError(f"{self.name}.{slot.name} is a computed text; only a Python FMU can have one")
            try:
                array = np.asarray(returned[slot.name], dtype=object)
                expressions = [expression(cell) for cell in array.flat]
            except ValueError as error:  # a text, or something else that is no number; TracingError is one
                raise TracingError(f"{self.name}.{method}: {slot.name!r}: {error}") from None
            if array.shape != slot.shape:
                raise TracingError(
                    f"{self.name}.{method}: {slot.name!r} has shape {array.shape}, declared {slot.shape}"
                )
            cells += expressions
        return cells
