"""A system against the interfaces of its FMUs: start values and connections as single scalars, or what is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..errors import ScenarioError
from ..fmi import Interface
from ..names import SignalName
from ..system import System
from .inputs import check_inputs, check_sampling
from .links import Wiring, described, find_links
from .routing import find_routes
from .starts import find_starts


def _connect_beside(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    """Connect what nobody connected but belongs to an input that is: curves and tunnels where the slope comes from."""
    fed = {link.target for link in wiring.links}
    for link in list(wiring.links):
        there, here = link.source.instance, link.target.instance
        for name, other in interfaces[here].beside.items():
            source, target = SignalName(there, name), SignalName(here, name)
            given = interfaces[there].variables.get(name)
            if link.target.variable != other or target in fed or name in system.instances[here].start:
                continue
            if link.source.variable == other and given is not None and given.causality == "output":
                made = replace(link.connection, source=str(source), target=str(target))
                wiring.links += find_links(made, interfaces, wiring)
                wiring.notes.append(f"{target} takes {source}, because {link.target} takes {link.source}")


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
    _connect_beside(system, interfaces, wiring)
    check_inputs(system, interfaces, wiring)
    find_routes(system, interfaces, wiring)
    check_sampling(system, interfaces, wiring)
    return wiring
