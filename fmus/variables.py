"""The scalar variables of a component's FMU, in the order of their value references.

Writer of the model description and slave both number variables with this one function, so they cannot disagree. The
file travels inside every Python FMU: it imports components only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..components.component import Component, Slot
from ..components.declarations import Input, Memory, Output, Parameter, State

Causality = Literal["parameter", "input", "output", "local"]


@dataclass(frozen=True)
class ScalarVariable:
    """One FMI variable: an element of a slot.

    ``element`` is its row-major place in an array, None for a scalar. ``reference`` is the value reference.
    """

    reference: int
    name: str
    slot: Slot
    element: int | None

    @property
    def causality(self) -> Causality:
        """FMI causality: shown states and memory are outputs, the others local."""
        declaration = self.slot.declaration
        if isinstance(declaration, Parameter):
            return "parameter"
        if isinstance(declaration, Input):
            return "input"
        if isinstance(declaration, Output) or (isinstance(declaration, State | Memory) and declaration.output):
            return "output"
        return "local"

    @property
    def variability(self) -> str:
        """FMI variability."""
        declaration = self.slot.declaration
        if isinstance(declaration, Parameter):
            return "tunable" if declaration.tunable else "fixed"
        if self.slot.type is not float or isinstance(declaration, Memory):
            return "discrete"
        return "continuous"


def scalar_variables(component: Component) -> tuple[ScalarVariable, ...]:
    """Every FMI variable of a component: parameters, inputs, outputs, states and memory, in order of declaration."""
    kinds: tuple[type, ...] = (Parameter, Input, Output, State, Memory)
    found: list[ScalarVariable] = []
    for slot in sorted(component.of(*kinds), key=lambda s: _rank(s, kinds)):
        for k, name in enumerate(slot.scalars):
            found.append(ScalarVariable(len(found), name, slot, k if slot.shape else None))
    return tuple(found)


def _rank(slot: Slot, kinds: tuple[type, ...]) -> int:
    return next(rank for rank, kind in enumerate(kinds) if isinstance(slot.declaration, kind))
