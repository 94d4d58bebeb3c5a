"""What depends on what in a component, in the terms of FMI's ``ModelStructure`` and by names of scalars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...components.component import Component
from ...components.declarations import Input, State
from ...components.tracing import (
    Names,
    TracingError,
    dependencies,
    initial_dependencies,
    rate_dependencies,
    start_name,
    used_inputs,
)
from ..variables import ScalarVariable

_POWERS = ("", "2", "3")
"""Of seconds, in the units of states."""
Unknowns = list[tuple[str, Names | None]]
"""Names, each with those that it depends on; None where they are unknown."""


@dataclass(frozen=True)
class Structure:
    """What depends on what, found by running the equations; None where they cannot be depends.

    Attributes:
        direct: for each scalar output, the inputs and states it depends on at one instant.
        rates: the same for the rate of each scalar state.
        initial: for each scalar that is computed at the start, what it follows from.
        used: the inputs that anything is computed from at all.
    """

    direct: Mapping[str, Names] | None
    rates: Mapping[str, Names] | None
    initial: Mapping[str, Names] | None
    used: Names | None


def structure(component: Component) -> Structure:
    """Trace a component; one that reads values as plain numbers (a Python-only one) keeps its dependencies unknown."""
    try:
        computed, initial = initial_dependencies(component)
        rates = rate_dependencies(component)
        started = {**computed, **initial}
        return Structure(dependencies(component), rates, started, _used(component))
    except TracingError:
        if not component.requires:
            raise
        return Structure(None, None, None, None)


def _used(component: Component) -> Names | None:
    """The inputs that are used; None where ``update`` or ``keep`` reads values as plain numbers, as it may."""
    try:
        return used_inputs(component)
    except TracingError:
        return None


@dataclass(frozen=True)
class Rate:
    """The variable ``der(x)`` of a scalar state: it has a value reference after all others."""

    state: ScalarVariable
    reference: int

    @property
    def name(self) -> str:
        """As FMI's structured naming has it."""
        return f"der({self.state.name})"

    @property
    def unit(self) -> str:
        """The state's unit per second: m/s, m/s2, m/s3."""
        unit, per, power = self.state.slot.unit.rpartition("/s")
        return f"{unit}{per}{int(power or 1) + 1}" if per and power in _POWERS else f"{self.state.slot.unit}/s"


def rates_of(variables: tuple[ScalarVariable, ...]) -> tuple[Rate, ...]:
    """Those of the states, in their order."""
    states = (v for v in variables if isinstance(v.slot.declaration, State) and not v.is_start)
    return tuple(Rate(state, len(variables) + k) for k, state in enumerate(states))


def initial_kind(variable: ScalarVariable) -> str | None:
    """FMI ``initial``: parameters are exact, start values among them; inputs have none."""
    if isinstance(variable.slot.declaration, Input):
        return None
    return "exact" if variable.is_parameter else "calculated"


def unknowns(variables: tuple[ScalarVariable, ...], rates: tuple[Rate, ...], depends: Structure) -> dict[str, Unknowns]:
    """The unknowns of the model structure; states are knowns only where their rates are listed.

    Returns:
        ``"outputs"``, ``"derivatives"`` and ``"initial"``, each with what its members depend on.
    """
    inputs = {v.name for v in variables if v.causality == "input"}
    states = {rate.state.name for rate in rates}
    exact = {v.name for v in variables if v.is_parameter}
    computed = [v.name for v in variables if initial_kind(v) == "calculated"]
    started = {v.name: start_name(v.name) for v in variables if v.is_kept and start_name(v.name) in exact}
    shown = [v.name for v in variables if v.causality == "output"]
    of_rates = None if depends.rates is None else {f"der({name})": names for name, names in depends.rates.items()}
    first = [name for name in computed if name in shown or name in states]
    begin = None if depends.initial is None or of_rates is None else {**of_rates, **depends.initial}

    def known(name: str, sources: Mapping[str, Names] | None, knowns: set[str]) -> Names | None:
        return None if sources is None else frozenset(sources.get(name, frozenset()) & knowns)

    def at_start(name: str) -> Names | None:
        if name in started:
            return frozenset({started[name]})
        if begin is None:
            return None
        return frozenset(started.get(source, source) for source in begin.get(name, frozenset())) & (inputs | exact)

    derivatives = [rate.name for rate in rates]
    return {
        "outputs": [(name, known(name, depends.direct, inputs | states)) for name in shown],
        "derivatives": [(name, known(name, of_rates, inputs | states)) for name in derivatives],
        "initial": [(name, at_start(name)) for name in (*first, *derivatives)],
    }
