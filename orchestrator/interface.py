"""What an FMU shows: its variables, units and capabilities, read from ``modelDescription.xml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Type = Literal["Real", "Integer", "Boolean", "String", "Enumeration"]


@dataclass(frozen=True)
class Unit:
    """A unit definition: value in SI = factor * value + offset; ``exponents`` over kg, m, s, A, K, mol, cd, rad."""

    name: str
    exponents: tuple[int, ...] | None
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Variable:
    """One scalar variable of an FMU.

    ``dependencies`` holds, for an output, the variables it depends on directly; None where the FMU does not say.
    """

    name: str
    reference: int
    type: Type
    causality: str
    variability: str
    initial: str | None
    start: Any
    unit: str | None = None
    minimum: float | None = None
    maximum: float | None = None
    description: str = ""
    dependencies: frozenset[str] | None = None

    @property
    def settable(self) -> bool:
        """Whether a start value may be set before initialization."""
        if self.variability == "constant":
            return False
        return self.causality in ("input", "parameter") or self.initial in ("exact", "approx")


@dataclass(frozen=True)
class Interface:
    """Everything the orchestrator needs to know of an FMU before it is loaded.

    Attributes:
        model: the model's name. variables: by name, in the order of the file. units: by name.
        arrays: names of scalars by the bare array name (``"force"`` -> ``"force[1]"``, ...).
        vendor: our own annotation: component, arguments, digest, optional inputs, recommended step, note; empty for
            an FMU of another maker.
        version: of the FMI standard.
        warnings: what is wrong with the file though it can be used.
    """

    model: str
    identifier: str
    guid: str
    variables: Mapping[str, Variable]
    units: Mapping[str, Unit]
    arrays: Mapping[str, tuple[str, ...]]
    description: str = ""
    generator: str = ""
    default_step: float | None = None
    default_stop: float | None = None
    version: str = "2.0"
    can_save_state: bool = False
    can_serialize_state: bool = False
    directional_derivatives: bool = False
    interpolates_inputs: bool = False
    variable_step: bool = True
    single_instance: bool = False
    needs_tool: bool = False
    vendor: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def optional_inputs(self) -> frozenset[str]:
        """Inputs that may stay unconnected without a word."""
        return frozenset(self.vendor.get("optional_inputs", ()))

    def of(self, *causalities: str) -> tuple[Variable, ...]:
        """The variables of the given causalities, in order."""
        return tuple(v for v in self.variables.values() if v.causality in causalities)

    def scalars(self, name: str) -> tuple[str, ...] | None:
        """The scalar names behind a name: itself, an array's elements, or None where there is no such name."""
        return (name,) if name in self.variables else self.arrays.get(name)
