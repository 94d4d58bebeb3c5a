"""A system against the interfaces of its FMUs: start values and connections as single scalars, or what is wrong."""

from __future__ import annotations

from collections.abc import Mapping

from ..errors import ScenarioError
from ..fmi import Interface
from ..names import SignalName
from ..system import System
from .inputs import check_inputs, check_sampling
from .links import Wiring, described, find_links
from .starts import find_starts


def wire(system: System, interfaces: Mapping[str, Interface]) -> Wiring:
    """Resolve every start value and connection; all problems are collected, none raised."""
    wiring = Wiring()
    for instance in system.instances.values():
        wiring.starts[instance.name] = find_starts(system, instance, interfaces[instance.name], wiring)
    made: dict[str, int] = {}
    for connection in system.connections:
        try:
            links = find_links(connection, interfaces, wiring)
            wiring.links += links
            made[connection.origin] = made.get(connection.origin, 0) + len(links)
        except ScenarioError as error:
            ends = SignalName.parse(connection.source), SignalName.parse(connection.target)
            wiring.problems += error.at(described(connection), *ends)
    for connection in system.connections:
        if connection.optional and made.pop(connection.origin, None) == 0:
            wiring.notes.append(f"{described(connection)} stands for nothing: there are no such elements")
    check_inputs(system, interfaces, wiring)
    check_sampling(system, interfaces, wiring)
    return wiring
