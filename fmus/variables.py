"""The scalar variables of a component's FMU, in the order of their value references.

Writer of the model description and slave both number variables with this one function, so they cannot disagree. The
file travels inside every Python FMU: it imports components only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..components.component import Component, Slot
from ..components.declarations import Input, Memory, Output, Parameter, State
from ..components.errors import ComponentError
from ..components.tracing import computed_starts, start_name

Causality = Literal["parameter", "input", "output", "local"]


@dataclass(frozen=True)
class ScalarVariable:
    """One FMI variable: an element of a slot, or the parameter that such an element begins at.

    ``element`` is its row-major place in an array, None for a scalar. ``reference`` is the value reference.
    ``is_start``: the slot is a state or memory, and this its start value.
    """

    reference: int
    name: str
    slot: Slot
    element: int | None
    is_start: bool = False

    @property
    def description(self) -> str:
        """One line on what it is."""
        said = self.slot.declaration.description
        return f"start value of {self.slot.name}{said and ': '}{said}" if self.is_start else said

    @property
    def is_parameter(self) -> bool:
        """Whether it is one, declared or of a start."""
        return self.is_start or isinstance(self.slot.declaration, Parameter)

    @property
    def is_kept(self) -> bool:
        """Whether it is a state or memory itself."""
        return isinstance(self.slot.declaration, State | Memory) and not self.is_start

    @property
    def causality(self) -> Causality:
        """FMI causality: shown states and memory are outputs, the others local."""
        declaration = self.slot.declaration
        if self.is_parameter:
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
        if self.is_parameter:
            return "tunable" if isinstance(declaration, Parameter) and declaration.tunable else "fixed"
        if self.slot.type is not float or isinstance(declaration, Memory):
            return "discrete"
        return "continuous"


def scalar_variables(component: Component) -> tuple[ScalarVariable, ...]:
    """Every FMI variable of a component: parameters, those of starts, inputs, outputs, states and memory.

    Each kind is in order of declaration. A state or memory that ``initial`` computes has no start to be set.

    Raises:
        ComponentError: the name of a start is taken.
    """
    computed = computed_starts(component)
    started = [slot for kind in (State, Memory) for slot in component.of(kind) if slot.name not in computed]
    slots = [(slot, False) for slot in component.of(Parameter)] + [(slot, True) for slot in started]
    slots += [(slot, False) for kind in (Input, Output, State, Memory) for slot in component.of(kind)]
    found: list[ScalarVariable] = []
    for slot, is_start in slots:
        if is_start and start_name(slot.name) in component.slots:
            raise ComponentError(
                f"{type(component).__name__}.{start_name(slot.name)} is the name of {slot.name}'s start value; choose "
                f"another, or let initial() compute {slot.name}"
            )
        for k, name in enumerate(slot.scalars):
            scalar = start_name(name) if is_start else name
            found.append(ScalarVariable(len(found), scalar, slot, k if slot.shape else None, is_start))
    return tuple(found)
