"""Who hears whom: the information graph of a platoon, out of its connections and flags.

A controller hears a neighbour when its flag (``has_ahead``, ``has_behind``, ``has_leader``) is set and its inputs
(``ahead_speed``, ``ahead_position``, ...) are connected and used by its law; a radio in between is looked through. The
Laplacian is L = D - A, with A[i, j] = 1 where vehicle i hears vehicle j, and D the number of vehicles each one hears.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fmi import Interface
from .graphs import circles, graph_of
from .links import Link, Wiring

SIDES = ("ahead", "behind", "leader")
_SHOWN = 10
"""Vehicles up to which the whole Laplacian is worth printing."""


@dataclass(frozen=True)
class Topology:
    """The information graph of one platoon.

    Attributes:
        vehicles: names of the vehicles, as the controllers are listed.
        heard: for each of them, which vehicle it hears on which side.
    """

    vehicles: tuple[str, ...]
    heard: tuple[Mapping[str, str], ...]

    @property
    def laplacian(self) -> NDArray[np.float64]:
        """L = D - A, shape (n, n)."""
        place = {name: k for k, name in enumerate(self.vehicles)}
        adjacency = np.zeros((len(self.vehicles), len(self.vehicles)))
        for k, neighbours in enumerate(self.heard):
            for name in neighbours.values():
                adjacency[k, place[name]] = 1.0
        laplacian: NDArray[np.float64] = np.diag(adjacency.sum(axis=1)) - adjacency
        return laplacian

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Of the Laplacian, by rising real part."""
        values = np.linalg.eigvals(self.laplacian).astype(np.complex128)
        values.real[np.abs(values.real) < 1e-12] = 0.0
        values.imag[np.abs(values.imag) < 1e-9] = 0.0
        order: NDArray[np.complex128] = values[np.lexsort((values.imag, values.real))]
        return order

    @property
    def reaches_all(self) -> bool:
        """Whether what some one vehicle does reaches all others: without that no agreement is possible."""
        return int((np.abs(self.eigenvalues) < 1e-9).sum()) == 1

    @property
    def name(self) -> str:
        """The topology in words."""
        leader = self.vehicles[0]
        first, others = self.heard[0], self.heard[1:]
        lacks_leader = [neighbours for neighbours in others if leader not in neighbours.values()]
        sides = {frozenset(neighbours) - {"leader"} for neighbours in others}
        hears_leader = any("leader" in neighbours for neighbours in others)
        if sides <= {frozenset({"ahead"})} and not first:
            if not hears_leader:
                return "predecessor only"
            return "other" if lacks_leader else "predecessor and leader"
        whole = all("ahead" in n for n in others) and all("behind" in n for n in self.heard[:-1])
        if whole and "behind" not in self.heard[-1]:
            if not hears_leader:
                return "neighbours on both sides"
            return "other" if lacks_leader else "neighbours on both sides and leader"
        return "other"


def topologies(interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Topology]:
    """The platoons of a system: vehicles connected by what they hear, each in the order of the instances.

    Args:
        interfaces: by instance name.
        wiring: start values and connections of the system.
    """
    fed: dict[str, dict[str, str]] = {}
    for link in wiring.links:
        fed.setdefault(link.target[0], {})[link.target[1]] = link.source[0]
    acting = {link.source[0] for link in wiring.links}  # of two that know a train one may wait for its turn
    controllers = [name for name, face in interfaces.items() if name in acting and f"has_{SIDES[0]}" in face.variables]
    vehicle = {name: fed[name]["position"] for name in controllers if "position" in fed.get(name, {})}
    feeders = _feeders(wiring.links)
    known = set(vehicle.values())
    heard: dict[str, dict[str, str]] = {}
    for controller, own in vehicle.items():
        heard[own] = {
            side: source
            for side in SIDES
            if is_heard(controller, f"has_{side}", fed, interfaces, wiring)
            and (source := _origin(_source(side, fed[controller], interfaces[controller]), known, feeders)) is not None
            and source != own
        }
    edges = [(own, other) for own, neighbours in heard.items() for other in neighbours.values()]
    graph = graph_of([*edges, *((other, own) for own, other in edges)], heard)
    rank = {name: k for k, name in enumerate(heard)}
    groups = [sorted(group, key=rank.__getitem__) for group in circles(graph) if len(group) > 1]
    groups.sort(key=lambda group: rank[group[0]])
    return [Topology(tuple(group), tuple(heard[name] for name in group)) for group in groups]


def describe_topology(interfaces: Mapping[str, Interface], wiring: Wiring) -> Iterator[str]:
    """What `check` prints of them: each topology, its Laplacian where that is small, and its eigenvalues."""
    found = topologies(interfaces, wiring)
    told: dict[tuple[str, bytes], list[Topology]] = {}
    for topology in found:
        told.setdefault((topology.name, topology.laplacian.tobytes()), []).append(topology)
    for same in told.values():
        topology = same[0]
        times = f" ({len(same)} platoons alike)" if len(same) > 1 else ""
        yield f"information: {topology.name}, {topology.vehicles[0]} to {topology.vehicles[-1]}{times}"
        if len(topology.vehicles) <= _SHOWN:
            for k, row in enumerate(topology.laplacian):
                yield f"  {'Laplacian' if not k else '         '} [{' '.join(f'{value:2g}' for value in row)}]"
        yield f"  eigenvalues {', '.join(map(_text, topology.eigenvalues))}"
        if not topology.reaches_all:
            yield "  no vehicle is heard by all, directly or through others: they cannot agree by themselves"


def _text(value: complex) -> str:
    if value.imag == 0.0:
        return f"{value.real:.4g}"
    return f"{value.real:.4g}{value.imag:+.4g}i"


def _source(side: str, fed: Mapping[str, str], interface: Interface) -> str | None:
    """The instance that what is used of a side comes from; None where nothing is."""
    names = (f"{side}_speed", f"{side}_position")
    return next((fed[name] for name in names if name in fed and name not in interface.unused_inputs), None)


def is_heard(
    controller: str,
    flag: str,
    fed: Mapping[str, Mapping[str, str]],
    interfaces: Mapping[str, Interface],
    wiring: Wiring,
) -> bool:
    """Whether a side is heard; a flag that something else drives may be true at any time, and counts."""
    variables = interfaces[controller].variables
    if flag not in variables or flag in fed[controller]:
        return flag in fed[controller]
    return bool(wiring.starts[controller].get(flag, variables[flag].start))


def _feeders(links: Sequence[Link]) -> dict[str, list[str]]:
    """Which instances feed an instance."""
    feeders: dict[str, list[str]] = {}
    for link in links:
        feeders.setdefault(link.target[0], []).append(link.source[0])
    return feeders


def _origin(source: str | None, vehicles: set[str], feeders: Mapping[str, Sequence[str]]) -> str | None:
    """The vehicle behind a source, looking through radios and the like."""
    seen: set[str] = set()
    front = [source] if source else []
    while front:
        name = front.pop(0)
        if name in vehicles:
            return name
        if name not in seen:
            seen.add(name)
            front += feeders.get(name, [])
    return None
