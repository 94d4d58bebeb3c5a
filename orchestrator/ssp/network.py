"""Connections followed through nested systems: from a component's input to where its value comes from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple, final

from ..errors import ScenarioError
from ..fmi import Interface, Unit
from ..problems import Problem, suggestion
from .structure import Connection, Connector, Element
from .values import Transformation

Path = tuple[str, ...]
_GIVES = {"output", "calculatedParameter", "constant", "local"}
_TAKES = {"input", "parameter", "structuralParameter"}
"""Kinds of an element's connectors; a system's own are the other way round when they are seen from inside."""


class Node(NamedTuple):
    """A connector: the names of elements from the root's inside on, and its own."""

    path: Path
    name: str

    def __str__(self) -> str:
        return ".".join((*self.path, self.name))


class Hop(NamedTuple):
    """One connection as it is passed."""

    source: Node
    target: Node
    suppressed: bool
    transformation: Transformation | None
    place: str
    delay: int = 0
    threshold: float | None = None


@dataclass(frozen=True)
class _Open:
    """A connection whose direction is not known yet."""

    ends: tuple[Node, Node]
    connection: Connection


@final
class Network:
    """All connections of a system, by what they lead to.

    Args:
        root: the system.
        interfaces: of the components that have a source, by path.

    Attributes:
        incoming: the connection that leads to a connector.
        problems, notes: what is wrong, and what a user should know.
    """

    def __init__(self, root: Element, interfaces: Mapping[Path, Interface]) -> None:
        self.interfaces = interfaces
        self.incoming: dict[Node, Hop] = {}
        self.problems: list[Problem] = []
        self.notes: list[str] = []
        self._connectors: dict[Node, Connector] = {}
        self._open: list[_Open] = []
        self._visit(root, (), {})
        self._settle()

    def _visit(self, system: Element, path: Path, scope: Mapping[str, Path]) -> None:
        scope = {**scope, **dict.fromkeys(system.dictionaries, path)}
        for connection in system.connections:
            try:
                self._add(system, path, scope, connection)
            except ScenarioError as error:
                self.problems += error.problems
        for name, element in system.inner.items():
            if element.dictionary is None:
                self._visit(element, (*path, name), scope)

    def _add(self, system: Element, path: Path, scope: Mapping[str, Path], connection: Connection) -> None:
        ends, gives, takes = [], [], []
        for name, connector in (connection.start, connection.end):
            owner, element = self._owner(system, path, scope, name, connection.place)
            node, kind = self._known(Node(owner, connector), element, connection.place)
            givers, takers = (_TAKES, _GIVES) if name is None else (_GIVES, _TAKES)
            ends.append(node)
            gives.append(kind not in takers)
            takes.append(kind not in givers)
        forwards, backwards = gives[0] and takes[1], gives[1] and takes[0]
        if not (forwards or backwards):
            what = f"{ends[0]} and {ends[1]} {'both give' if gives[0] else 'both take'} a value"
            raise ScenarioError(Problem(connection.place, what, "a connection leads from an output to an input"))
        if forwards and backwards:
            self._open.append(_Open((ends[0], ends[1]), connection))
        else:
            self._lead(ends[0], ends[1], connection) if forwards else self._lead(ends[1], ends[0], connection)

    def _owner(
        self, system: Element, path: Path, scope: Mapping[str, Path], name: str | None, place: str
    ) -> tuple[Path, Element]:
        """What the connector at one end belongs to: those of one signal dictionary are one, wherever they stand."""
        if name is None:
            return path, system
        element = system.inner.get(name)
        if element is None:
            near = suggestion(name, system.inner) or f"there are {', '.join(system.inner)}"
            raise ScenarioError(Problem(place, f"there is no element {name!r}", near))
        if element.dictionary is None:
            return (*path, name), element
        if element.dictionary not in scope:
            raise ScenarioError(Problem(element.place, f"there is no signal dictionary {element.dictionary!r}"))
        return (*scope[element.dictionary], f"signal dictionary {element.dictionary}"), element

    def _known(self, node: Node, element: Element, place: str) -> tuple[Node, str]:
        found = element.connectors.get(node.name)
        interface = self.interfaces.get(node.path)
        if found is None and interface is not None and (scalars := interface.scalars(node.name)):
            found = Connector(node.name, interface.variables[scalars[0]].causality)
            self.notes.append(f"{place}: {element.name} declares no connector {node.name!r}; that of its FMU is taken")
        if found is None:
            near = suggestion(node.name, element.connectors) or f"it has {', '.join(element.connectors) or 'none'}"
            raise ScenarioError(Problem(place, f"{element.name} has no connector {node.name!r}", near))
        if node.path not in self.interfaces or node not in self._connectors:
            self._connectors[node] = found
        return node, found.kind

    def _lead(self, source: Node, target: Node, connection: Connection) -> None:
        if target in self.incoming:
            what = f"{target} takes a value already, by the connection at {self.incoming[target].place}"
            raise ScenarioError(Problem(connection.place, what, "remove one of the two"))
        how = (connection.suppressed, connection.transformation, connection.place, connection.delay)
        self.incoming[target] = Hop(source, target, *how, connection.threshold)

    def _settle(self) -> None:
        """Directions where both ends may give and take, as in signal dictionaries: away from where a value comes."""
        waiting = self._open
        while waiting:
            left = []
            for one in waiting:
                fed = [end in self.incoming for end in one.ends]
                if fed[0] == fed[1]:
                    left.append(one)
                    continue
                self._lead(*(one.ends if fed[0] else one.ends[::-1]), one.connection)
            if len(left) == len(waiting):
                break
            waiting = left
        for one in waiting:
            self.notes.append(f"{one.connection.place}: nothing says in which direction it leads; it is left out")

    def trace(self, target: Node) -> tuple[Node, list[Hop]]:
        """Where the value of a connector comes from, and the connections on the way from there.

        Raises:
            ScenarioError: it comes from itself.
        """
        hops: list[Hop] = []
        node, seen = target, {target}
        while node in self.incoming:
            hops.append(self.incoming[node])
            node = hops[-1].source
            if node in seen:
                raise ScenarioError(Problem(hops[-1].place, f"{node} takes its value from itself"))
            seen.add(node)
        return node, hops[::-1]

    def targets(self) -> Iterator[Node]:
        """The inputs of FMUs that something leads to."""
        return (node for node in self.incoming if node.path in self.interfaces)

    def unit(self, node: Node) -> Unit | None:
        """The unit of a connector: the one that is defined for it, else that of the FMU's variable."""
        found = self._connectors.get(node)
        if found is not None and found.unit is not None and found.unit.exponents is not None:
            return found.unit
        own = own_unit(self.interfaces[node.path], node.name) if node.path in self.interfaces else None
        return own or (found.unit if found is not None else None)


def own_unit(interface: Interface, name: str) -> Unit | None:
    """The unit of a variable as its FMU has it."""
    scalars = interface.scalars(interface.start_name(name))
    unit = interface.variables[scalars[0]].unit if scalars else None
    return None if unit is None else interface.units.get(unit, Unit(unit, None))
