"""What tells the versions of FMI apart when a model description is written."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from ...components.component import Component
from ..annotation import Annotation
from ..variables import ScalarVariable
from .structure import Rate, Unknowns


class ModelExchange(NamedTuple):
    """What is said of model exchange: how many event indicators there are, and the states that samples put back."""

    indicators: int
    reinitialised: tuple[str, ...]

    def puts_back(self, variable: ScalarVariable) -> bool:
        """Whether events may set a state anew: at samples, or where it stands still."""
        stands = getattr(variable.slot.declaration, "standstill", False)
        return variable.is_kept and (stands or variable.name in self.reinitialised)


class Described(NamedTuple):
    """What every version says of a component, each in its way.

    Attributes:
        component: its values are the start values.
        variables: in the order of their value references.
        rates: those after them.
        unknowns: of the model structure (`structure.unknowns`).
        annotation: our own.
        exchange: where the FMU is for model exchange as well.
    """

    component: Component
    variables: tuple[ScalarVariable, ...]
    rates: tuple[Rate, ...]
    unknowns: Mapping[str, Unknowns]
    annotation: Annotation
    exchange: ModelExchange | None = None


class Dialect(ABC):
    """How one version of FMI says what the writer has to say.

    Attributes:
        version: as the file has it.
        token: the attribute that binary and description share.
        states: how the attributes for states spell their word.
        derivatives: the attribute for directional derivatives.
        steps: the attribute, and its value, that says of model exchange that no step has to be told.
        units: those of variables that this version has beside the component's.
    """

    version: ClassVar[str]
    token: ClassVar[str]
    states: ClassVar[str]
    derivatives: ClassVar[str]
    steps: ClassVar[tuple[str, str]]
    units: ClassVar[frozenset[str]] = frozenset()

    @abstractmethod
    def complete(self, capabilities: Any, *, native: bool, interpolates: bool) -> None:
        """Add to the element ``CoSimulation``, or ``ModelExchange``, what this version alone knows."""

    @abstractmethod
    def write_model(self, root: Any, model: Described) -> None:
        """Add variables, structure and annotation, in this version's order."""
