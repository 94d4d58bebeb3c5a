"""What a native FMU does in a communication step, as one expression that can be differentiated.

The runtime does it in C (``advance.c``, ``integration.c``). Here a state that passes its standstill within a sub-step
stands at its end, where the runtime locates the instant; and there are no tapes and no random numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from ...components.component import Component
from ...components.declarations import State, Tape
from ...components.tracing import TracingError, start_name
from ..variables import scalar_variables
from .tables import held_outputs
from .trace import expressions, simplification

_NEAR = 1e-300
"""What stands for just before a standstill, as in ``components/methods.py``: it has a sign, and no size."""


class Steps:
    """The steps of a component, as functions of the values of an instance: every scalar variable at its reference.

    Args:
        component: built.

    Attributes:
        places: where each scalar variable stands among the values. size: how many these are.
        parameters: which of the variables are parameters.

    Raises:
        TracingError: the equations cannot be traced, keep a tape or draw random numbers.
    """

    def __init__(self, component: Component) -> None:
        name = type(component).__name__
        if component.noises or list(component.of(Tape)):
            raise TracingError(f"{name} {'draws random numbers' if component.noises else 'keeps a tape'}")
        if component.requires:
            raise TracingError(f"{name} imports {', '.join(component.requires)}")
        found = expressions(component)
        variables = scalar_variables(component)
        self.places = {variable.name: variable.reference for variable in variables}
        self.parameters = tuple(variable.name for variable in variables if variable.is_parameter)
        self.size = found.layout.values
        self.is_sampled = component.is_sampled
        self._layout, self._held = found.layout, held_outputs(component)
        known = [found.clock, found.values]
        with simplification(True):
            self._outputs, self._rates, self._initial, self._update = (
                ca.Function("equations", known, [ca.densify(ca.vertcat(*column)) if column else ca.SX(0, 1)])
                for column in (found.outputs, found.derivatives, found.initial, found.update)
            )
        self._started = [self.places[each] for each in found.started]
        updated = range(found.layout.memory[0], sum(found.layout.memory))
        self._updated = [*updated, *(self.places[each] for each in found.reinitialised)]
        kept = {v.reference: start_name(v.name) for v in variables if v.is_kept}
        self._starts = [(place, self.places[start]) for place, start in kept.items() if start in self.places]
        stopping = [slot for slot in component.of(State) if getattr(slot.declaration, "standstill", False)]
        self._stopping = [self.places[each] - found.layout.states[0] for slot in stopping for each in slot.scalars]

    def start(self, values: Any, time: Any) -> Any:
        """The values in initialization mode, its inputs being set: states and memory from their starts, outputs."""
        clock = ca.vertcat(time, 0.0)
        values = replaced(values, [place for place, _ in self._starts], [values[start] for _, start in self._starts])
        values = replaced(values, self._started, ca.vertsplit(self._initial(clock, values)))
        return self._with_outputs(values, self._outputs(clock, values))

    def step(self, values: Any, time: Any, length: float, parts: int) -> Any:
        """The values after a communication step, its inputs being set.

        Args:
            values: before it.
            time: when it begins, s.
            length: of it, s.
            parts: sub-steps of its integration.
        """
        sampled = None
        if self.is_sampled:
            clock = ca.vertcat(time, length)
            sampled = self._outputs(clock, values)
            values = self._with_outputs(values, sampled)
            values = replaced(values, self._updated, ca.vertsplit(self._update(clock, values)))
        for part in range(parts):
            values = self._integrated(values, time + part * (length / parts), length / parts)
        outputs = self._outputs(ca.vertcat(time + length, 0.0), values)
        if sampled is not None:
            outputs = ca.vertcat(*(sampled[k] if held else outputs[k] for k, held in enumerate(self._held)))
        return self._with_outputs(values, outputs)

    def _integrated(self, values: Any, time: Any, h: float) -> Any:
        """Classical Runge-Kutta, one step."""
        first, count = self._layout.states
        if not count:
            return values
        x = values[first : first + count]

        def rates(elapsed: float, states: Any) -> Any:
            states = self._stopped(x, states, [ca.if_else(x[k] > 0.0, _NEAR, -_NEAR) for k in self._stopping])
            return self._rates(ca.vertcat(time + elapsed, 0.0), _with(values, first, states))

        k1 = rates(0.0, x)
        k2 = rates(0.5 * h, x + 0.5 * h * k1)
        k3 = rates(0.5 * h, x + 0.5 * h * k2)
        k4 = rates(h, x + h * k3)
        end = x + (h / 6.0) * (((k1 + 2.0 * k2) + 2.0 * k3) + k4)
        return _with(values, first, self._stopped(x, end, [0.0 for _ in self._stopping]))

    def _stopped(self, start: Any, end: Any, instead: Sequence[Any]) -> Any:
        """States with others instead of those that pass their standstill."""
        chosen = [
            ca.if_else(start[k] * end[k] < 0.0, cell, end[k]) for k, cell in zip(self._stopping, instead, strict=True)
        ]
        return replaced(end, self._stopping, chosen)

    def _with_outputs(self, values: Any, outputs: Any) -> Any:
        return _with(values, self._layout.outputs[0], outputs)


def replaced(values: Any, places: Sequence[int], cells: Sequence[Any]) -> Any:
    """Values with others in some places."""
    if not places:
        return values
    found = ca.vertsplit(values)
    for place, cell in zip(places, cells, strict=True):
        found[place] = cell
    return ca.vertcat(*found)


def _with(values: Any, first: int, column: Any) -> Any:
    """Values with others from a place on."""
    return ca.vertcat(values[:first], column, values[first + column.shape[0] :])
