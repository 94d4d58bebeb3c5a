"""Which variables of a scenario a packed FMU shows: ``train[:].speed``, ``cruise[2]``, ``gust.size``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..errors import did_you_mean
from ..fmi import Interface, Variable
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


def select(wanted: Sequence[str], system: System, checked: Checked) -> tuple[tuple[Exposed, ...], list[str]]:
    """What the patterns stand for, each variable once, and sentences on those that stand for nothing.

    Args:
        wanted: patterns, several to a text where commas part them; none for the default.
        system: the scenario.
        checked: its models and connections.
    """
    interfaces = {name: model.interface for name, model in checked.models.items()}
    patterns = [part.strip() for text in wanted for part in re.split(r",(?![^\[]*\])", text) if part.strip()]
    if not patterns:
        trains = [name for name in system.instances if name.startswith(DEFAULT_FAMILY)]
        patterns = trains or list(system.instances)
    found: dict[str, Exposed] = {}
    problems: list[str] = []
    fed = {link.target: ".".join(link.source) for link in checked.wiring.links}
    for pattern in patterns:
        problem, shown = _match(pattern, interfaces, fed)
        found |= {each.name: each for each in shown}
        if problem:
            problems.append(f"expose {pattern!r}: {problem}")
    return tuple(found.values()), problems


def _family(instance: str) -> str:
    return instance.partition("[")[0]


def _match(
    pattern: str, interfaces: Mapping[str, Interface], fed: Mapping[tuple[str, str], str]
) -> tuple[str, list[Exposed]]:
    match = _PATTERN.fullmatch(pattern)
    if match is None:
        return "write instance.variable, as in train[1].speed, or train[:].speed for all trains", []
    family, index, name = match.groups()
    members = [n for n in interfaces if _family(n) == family]
    chosen = members if index == ":" else [n for n in members if n == (f"{family}[{index}]" if index else family)]
    if not members:
        return f"there is no instance {family!r}{did_you_mean(family, map(_family, interfaces))}", []
    if not chosen:
        return f"there is {', '.join(members)}; for all of them write {family}[:]", []
    shown: list[Exposed] = []
    for instance in chosen:
        problem, variables = _variables(instance, name, interfaces[instance], fed)
        if problem:
            return problem, []
        shown += variables
    return "", shown


def _variables(
    instance: str, name: str | None, interface: Interface, fed: Mapping[tuple[str, str], str]
) -> tuple[str, list[Exposed]]:
    if name is None or name == "*":
        return "", [Exposed(instance, v, "output") for v in interface.of("output")]
    scalars = interface.scalars(name)
    if scalars is None:
        near = did_you_mean(name, [*interface.variables, *interface.arrays])
        return f"{interface.model} ({instance}) has no variable {name!r}{near}", []
    shown = []
    for variable in (interface.variables[scalar] for scalar in scalars):
        causality = _CAUSALITY.get(variable.causality)
        if causality is None or variable.variability == "constant":
            return f"{instance}.{variable.name} is {variable.causality} and cannot be shown", []
        if (instance, variable.name) in fed:
            return f"the input {instance}.{variable.name} is fed by {fed[instance, variable.name]} inside", []
        shown.append(Exposed(instance, variable, causality))
    return "", shown
