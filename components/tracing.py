"""Which outputs depend on which inputs, found by tracing the equations on values that remember where they came from.

To trace is to run the equations on stand-ins for numbers: here on names, in `fmus.trace` on expressions that become C.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .component import Component, Method, evaluated
from .declarations import Input, Memory, Output, Parameter, State, Tape
from .errors import ComponentError
from .lookup.cells import Cells
from .maths import SymbolArray, elementwise
from .returned import check_returned, due, line_of

Names = frozenset[str]


_TAPE_SOURCES: Names = frozenset({"trip_time", "sample_time", "tape_duration", "tape_file"})
"""What a tape reads depends on where along the trip the component is, and on the file it was filled from."""


_DRIVING: Names = frozenset({"trip", "trip_time"})
"""The inputs that drive a tape, whatever the equations make of them."""


class TracingError(ComponentError):
    """An equation did something with a value that only works on plain numbers."""


class Sourced:
    """A value that carries the names it was computed from, and stands in for a number in the equations."""

    __slots__ = ("names",)
    __array_priority__ = 1000.0
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, names: Names) -> None:
        self.names = names

    def _join(self, *others: Any) -> Any:
        # NumPy leaves an operation of an array with a symbol to the symbol, whichever side it stands on.
        if any(isinstance(other, np.ndarray) for other in others):
            return elementwise(self._join, *others)
        return Sourced(self.names.union(*(other.names for other in others if isinstance(other, Sourced))))

    def apply(self, function: str) -> Sourced:
        """The result of a unary function of `maths`."""
        return self

    def where(self, then: Any, otherwise: Any) -> Any:
        """The result of a choice on this value."""
        return self._join(then, otherwise)

    def cells(self, table: Cells, places: Sequence[Any]) -> list[Any]:
        """The constants of a cell: each depends on all that says which cell it is."""
        return [self._join(*places)] * table.constants.shape[-1]

    def product(self, matrix: NDArray[np.float64], vector: Sequence[Any]) -> list[Any]:
        """A matrix times a vector."""
        return [self._join(*vector)] * len(matrix)

    def _refuse(self, *_: Any) -> Any:
        raise TracingError(
            "a value was asked for its truth or turned into a plain number: use railcosim.components.maths "
            "(where, tanh, clip, logical_and, ...) instead of if, and, or, float() or the math module"
        )

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _join
    __pow__ = __rpow__ = __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = _join
    __lt__ = __le__ = __gt__ = __ge__ = _join
    __eq__ = __ne__ = _join
    __neg__ = __pos__ = __abs__ = _join
    __bool__ = __float__ = __int__ = __index__ = _refuse


def dependencies(component: Component) -> dict[str, Names]:
    """For each scalar of ``outputs``: the inputs, states, memory and parameters (and ``"time"``) it is computed from.

    Raises:
        TracingError: the equations treat values as plain numbers; the message names component, method and remedy.
    """
    probe = _sourced_copy(component)
    return _collect(probe, "outputs", Output)


def rate_dependencies(component: Component) -> dict[str, Names]:
    """The same for the rate of each scalar state."""
    return _collect(_sourced_copy(component), "derivatives", State)


def initial_dependencies(component: Component) -> tuple[dict[str, Names], dict[str, Names]]:
    """The same for the initial state: of what ``initial`` computes, and of the outputs that follow from it."""
    probe = _sourced_copy(component)
    computed = _collect(probe, "initial", State, Memory)
    for slot in probe.of(State, Memory):
        if slot.scalars and slot.scalars[0] in computed:
            cells = [Sourced(computed[name]) for name in slot.scalars]
            probe.present_values[slot.name] = _cells(cells, slot.shape)
    return computed, _collect(probe, "outputs", Output)


def computed_starts(component: Component) -> Names:
    """The states and memory, by the names of their slots, that ``initial`` computes."""
    if not hasattr(type(component), "initial"):
        return frozenset()
    try:
        returned = _run(_sourced_copy(component), "initial")
    except TracingError:
        returned = evaluated(component, "initial")
    return frozenset(slot.name for slot in component.of(State, Memory) if slot.name in returned)


def start_name(name: str) -> str:
    """What the start value of a state or memory is called, or that of an element of one."""
    array, bracket, index = name.partition("[")
    return f"{array}_start{bracket}{index}"


def used_inputs(component: Component) -> Names:
    """The scalar inputs that something is computed from: an output, a rate, a start value, or what a sample leaves."""
    probe = _sourced_copy(component)
    computed, started = initial_dependencies(component)
    found = [computed, started, dependencies(component), _collect(probe, "derivatives", State)]
    probe.present_values["step"] = Sourced(frozenset({"time"}))
    found.append(_collect(probe, "update", State, Memory, Tape))
    kept = _run(probe, "keep")
    used = set(_DRIVING if component.of(Tape) else ()) | (kept.names if isinstance(kept, Sourced) else frozenset())
    used.update(*(names for part in found for names in part.values()))
    inputs = component.of(Input)
    return frozenset(name for slot in inputs for name in slot.scalars if name in used or slot.type is str)


def feedthrough(component: Component) -> dict[str, Names]:
    """For each scalar output: the scalar inputs it depends on directly; none for a state or memory shown as output."""
    inputs = {name for slot in component.of(Input) for name in slot.scalars}
    direct = {name: sources & inputs for name, sources in dependencies(component).items()}
    return {name: direct.get(name, frozenset()) for slot in component.output_slots for name in slot.scalars}


def _sourced_copy(component: Component) -> Component:
    probe = type(component)(**component.build_arguments)
    for slot in probe.of(Input, Parameter, State, Memory, Tape):
        if slot.type is str:  # a text is not traced: equations may compare it
            continue
        cells = [Sourced(_TAPE_SOURCES if isinstance(slot.declaration, Tape) else frozenset({n})) for n in slot.scalars]
        probe.present_values[slot.name] = _cells(cells, slot.shape)
    for name, noise in probe.noises.items():
        shape = np.shape(probe.present_values[name])
        sources = frozenset({"time", "seed", noise.hold.name})
        probe.present_values[name] = _cells([Sourced(sources) for _ in range(math.prod(shape))], shape)
    probe.present_values["time"] = Sourced(frozenset({"time"}))
    return probe


def _cells(cells: list[Sourced], shape: tuple[int, ...]) -> Any:
    if not shape:
        return cells[0]
    array = np.empty(len(cells), dtype=object)
    array[:] = cells
    return array.reshape(shape).view(SymbolArray)


def _run(component: Component, method: Method) -> Any:
    """What a method returns; what goes wrong in it is told with its name and its author's line."""
    where = f"{type(component).__name__}.{method}"
    try:
        return evaluated(component, method)
    except Exception as error:
        line = line_of(error)
        at = f" (at {line})" if line else ""
        if isinstance(error, TracingError):
            raise TracingError(f"{where}: {error}{at}") from error
        if isinstance(error, ComponentError):
            raise ComponentError(f"{where}: {error}{at}") from error
        raise TracingError(
            f"{where} cannot be traced ({type(error).__name__}: {error}){at}: "
            "on values use operators, slices, reshaping and railcosim.components.maths, nothing else"
        ) from error


def _collect(component: Component, method: Method, *kinds: type[Output | State | Memory | Tape]) -> dict[str, Names]:
    where = f"{type(component).__name__}.{method}"
    returned = _run(component, method)
    check_returned(component, method, returned, due(component)[method])
    texts = frozenset(
        name
        for slot in component.of(Input, Parameter)
        if slot.type is str and slot.name != "tape_file"
        for name in slot.scalars
    )
    slots = {slot.name: slot for slot in component.of(*kinds)}
    found: dict[str, Names] = {}
    for name in returned.keys() & slots.keys():
        slot, cells = slots[name], np.asarray(returned[name], dtype=object)
        if cells.shape != slot.shape:
            raise ComponentError(f"{where}: {name!r} has shape {cells.shape}, declared {slot.shape}")
        for scalar, cell in zip(slot.scalars, cells.flat, strict=True):
            names = cell.names if isinstance(cell, Sourced) else frozenset()
            found[scalar] = names | texts if slot.type is str else names
    return found
