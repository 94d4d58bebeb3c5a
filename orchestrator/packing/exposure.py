"""Which variables of a scenario a packed FMU shows: ``train[:].speed``, ``cruise[2]``, ``gust.size``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..errors import ScenarioError
from ..fmi import Interface, Variable
from ..names import SignalName, parted
from ..problems import Problem, suggestion
from ..run import Checked
from ..scenario import NAME
from ..system import System

_PATTERN = re.compile(rf"({NAME})(?:\[\s*(:|\d+)\s*\])?(?:\.(\S.*))?")
_CAUSALITY = {"output": "output", "local": "output", "input": "input", "parameter": "parameter"}
DEFAULT_FAMILY = "train"


@dataclass(frozen=True)
class Exposed:
    """One variable of the packed FMU.

    Attributes:
        instance: where it belongs. variable: what it is there. causality: what it is outside.
    """

    instance: str
    variable: Variable
    causality: str

    @property
    def name(self) -> str:
        """Its name outside."""
        return f"{self.instance}.{self.variable.name}"


def select(wanted: Sequence[str], system: System, checked: Checked) -> tuple[tuple[Exposed, ...], list[Problem]]:
    """What the patterns stand for, each variable once, and what is wrong with those that stand for nothing.

    Args:
        wanted: patterns, several to a text where commas part them; none for the default.
        system: the scenario.
        checked: its models and connections.
    """
    interfaces = {name: model.interface for name, model in checked.models.items()}
    patterns = list(parted(wanted))
    if not patterns:
        trains = [name for name in system.instances if name.startswith(DEFAULT_FAMILY)]
        patterns = trains or list(system.instances)
    found: dict[str, Exposed] = {}
    problems: list[Problem] = []
    fed = {link.target: link.source for link in checked.wiring.links}
    for pattern in patterns:
        try:
            found |= {each.name: each for each in _match(pattern, interfaces, fed)}
        except ScenarioError as error:
            problems += error.at(f"expose {pattern!r}")
    return tuple(found.values()), problems


def _match(
    pattern: str, interfaces: Mapping[str, Interface], fed: Mapping[SignalName, SignalName]
) -> Iterator[Exposed]:
    """What one pattern stands for.

    Raises:
        ScenarioError: what is wrong with it.
    """
    match = _PATTERN.fullmatch(pattern)
    if match is None:
        raise ScenarioError("write instance.variable, as in train[1].speed, or train[:].speed for all trains")
    family, index, name = match.groups()
    groups = {instance: SignalName(instance).group for instance in interfaces}
    members = [n for n in interfaces if groups[n] == family]
    chosen = members if index == ":" else [n for n in members if n == (f"{family}[{index}]" if index else family)]
    if not members:
        raise ScenarioError(Problem("", f"there is no instance {family!r}", suggestion(family, groups.values())))
    if not chosen:
        raise ScenarioError(Problem("", f"there is {', '.join(members)}", f"for all of them write {family}[:]"))
    for instance in chosen:
        yield from _variables(instance, name, interfaces[instance], fed)


def _variables(
    instance: str, name: str | None, interface: Interface, fed: Mapping[SignalName, SignalName]
) -> Iterator[Exposed]:
    if name is None or name == "*":
        yield from (Exposed(instance, v, "output") for v in interface.of("output"))
        return
    scalars = interface.scalars(name)
    if scalars is None:
        near = interface.elements_beside(name) or suggestion(name, [*interface.variables, *interface.arrays])
        raise ScenarioError(Problem("", f"{interface.model} ({instance}) has no variable {name!r}", near))
    for variable in (interface.variables[scalar] for scalar in scalars):
        signal = SignalName(instance, variable.name)
        causality = _CAUSALITY.get(variable.causality)
        if causality is None or variable.variability == "constant":
            raise ScenarioError(f"{signal} is {variable.causality} and cannot be shown")
        if signal in fed:
            raise ScenarioError(f"the input {signal} is fed by {fed[signal]} inside")
        yield Exposed(instance, variable, causality)
