"""Connections as single scalars, or what is wrong with them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..errors import ScenarioError
from ..fmi import Interface, Variable
from ..names import SignalName, shape_of
from ..problems import Problem, suggestion
from ..system import Connection, Event
from ..times import digits
from .conversion import fit

_MOST_COMPARED = 50_000
"""How many names wrong ones are compared with to find the nearest: with thousands of both that would take minutes."""


@dataclass(frozen=True)
class Link:
    """One scalar connection: target = scale * source + offset, ``delay`` communication points late.

    With a ``threshold`` that becomes true above it, or is rounded up above that fraction.

    Attributes:
        source, target: scalar variables.
        direct: whether the source output depends directly on an input of its FMU.
        connection: what it was made from.
        mapping: what becomes of single values, which replaces scale and offset; None where there is no such thing.
    """

    source: SignalName
    target: SignalName
    scale: float
    offset: float
    delay: int
    direct: bool
    connection: Connection
    mapping: Mapping[int, int] | None = None

    @property
    def threshold(self) -> float | None:
        """By what a number is made a truth value or a whole number."""
        return self.connection.threshold

    @property
    def is_linear(self) -> bool:
        """Whether scale and offset are all that happens to a value."""
        return self.threshold is None and self.mapping is None


@dataclass(frozen=True)
class Route:
    """The scalar connections that an event makes, in the place of those that lead to the same inputs."""

    event: Event
    links: tuple[Link, ...]


@dataclass
class Wiring:
    """The resolved system.

    Attributes:
        starts: start values by instance and scalar variable. links: scalar connections, as they are in the beginning.
        routes: those that events make later, in the place of others. later: from when on, in s, there are which others:
            the wiring as it is then, each routing once.
        left: numbers that a scenario gives to a variable which the model that was swapped in does not have, by full
            name: a requirement that reads a bound from there still finds it.
        problems: with one the system cannot run. notes: sentences.
        told: what a note has said of some connection, and need not of others. compared: names that wrong ones were
            compared with.
    """

    starts: dict[str, dict[str, Any]] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    routes: list[Route] = field(default_factory=list)
    later: list[tuple[float, Wiring]] = field(default_factory=list)
    left: dict[str, float | bool] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    told: set[str] = field(default_factory=set, repr=False)
    compared: int = field(default=0, repr=False)

    @property
    def every_link(self) -> list[Link]:
        """All connections that there may be at some time."""
        return [*self.links, *(link for route in self.routes for link in route.links)]

    @property
    def routings(self) -> list[tuple[str, Wiring]]:
        """The wiring of the beginning and of later, each with when it is, as the begin of a sentence."""
        return [("", self), *((f"from {digits(since)} s on: ", wiring) for since, wiring in self.later)]

    def near(self, name: str, valid: Iterable[str]) -> str:
        """The nearest right name, as a remedy; not for ever."""
        if self.compared > _MOST_COMPARED:
            return ""
        names = list(valid)
        self.compared += len(names)
        return suggestion(name, names)


def find_links(connection: Connection, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Link]:
    """The scalar connections that one connection stands for; what they make worth knowing goes to the notes.

    Raises:
        ScenarioError: with everything that is wrong with it.
    """
    source, target = SignalName.parse(connection.source), SignalName.parse(connection.target)
    if connection.optional and not (_is_there(source, interfaces) and _is_there(target, interfaces)):
        return []
    problems: list[Problem] = []
    sources = _end(source, "output", interfaces, wiring, problems)
    targets = _end(target, "input", interfaces, wiring, problems)
    if isinstance(connection.delay, bool) or not isinstance(connection.delay, int) or connection.delay < 0:
        wanted = f"delay counts communication points: 0, 1, 2, ..., not {connection.delay!r}"
        problems.append(Problem("", wanted))
    if problems:
        raise ScenarioError(problems)
    if len(sources) != len(targets):
        raise ScenarioError(f"the output has {len(sources)} elements, the input {len(targets)}")
    if len(sources) > 1 and (shapes := (shape_of(sources), shape_of(targets)))[0] != shapes[1]:
        given, taken = (" by ".join(map(str, shape)) for shape in shapes)
        raise ScenarioError(
            Problem("", f"the output is {given}, the input {taken}", "connect it row by row, as y[1,:]")
        )
    of_a, of_b = interfaces[source.instance], interfaces[target.instance]
    links = []
    for one, other in zip(sources, targets, strict=True):
        a = of_a.variables[one]
        conversion = fit(a, of_a, of_b.variables[other], of_b, connection)
        if conversion.problem:
            raise ScenarioError(conversion.problem)
        if conversion.note and conversion.note not in wiring.told:
            wiring.told.add(conversion.note)
            wiring.notes.append(str(Problem(described(connection), conversion.note)))
        ends = SignalName(source.instance, one), SignalName(target.instance, other)
        delay, direct = connection.delay, is_direct(of_a, a)
        links.append(Link(*ends, conversion.scale, conversion.offset, delay, direct, connection, conversion.mapping))
    return links


def described(connection: Connection) -> str:
    """A connection as messages call it, with where it was written."""
    text = f"{connection.target!r} = {connection.source!r}"
    return f"{connection.origin}: {text}" if connection.origin else text


def _is_there(signal: SignalName, interfaces: Mapping[str, Interface]) -> bool:
    interface = interfaces.get(signal.instance)
    return interface is not None and interface.scalars(signal.variable) is not None


def _end(
    signal: SignalName,
    direction: str,
    interfaces: Mapping[str, Interface],
    wiring: Wiring,
    problems: list[Problem],
) -> tuple[str, ...]:
    """The scalar variables at one end; none, with a problem noted, where it is no such end."""
    instance, name = signal
    if instance not in interfaces:
        problems.append(Problem("", f"there is no instance {instance!r}", wiring.near(instance, interfaces)))
        return ()
    interface = interfaces[instance]
    allowed = ("input",) if direction == "input" else ("output", "local", "parameter", "calculatedParameter")
    scalars = interface.scalars(name)
    if scalars is None:
        why = interface.why_left_out(name)
        near = "" if why else _near(interface, name, direction, wiring)
        problems.append(Problem("", f"{interface.model} ({instance}) has no variable {name!r}{why}", near))
        return ()
    wrong = [s for s in scalars if interface.variables[s].causality not in allowed]
    if wrong:
        causality = interface.variables[wrong[0]].causality
        problems.append(Problem("", f"{instance}.{wrong[0]} is not an {direction} but {causality}"))
    return scalars


def _near(interface: Interface, name: str, direction: str, wiring: Wiring) -> str:
    """The nearest input or output, or a list of them; nothing any more where thousands of names are wrong."""
    if wiring.compared > _MOST_COMPARED:
        return ""
    valid = [v.name for v in interface.of("input" if direction == "input" else "output")]
    listed = valid if len(valid) <= 12 else [*valid[:12], "..."]
    near = interface.elements_beside(name) or wiring.near(name, [*valid, *interface.arrays])
    return near or f"its {direction}s are {', '.join(listed) or 'none'}"


def is_direct(interface: Interface, output: Variable) -> bool:
    """Whether an output depends directly on an input of its FMU.

    An FMU that lists no dependencies is taken to have none, except one of ours: ours list them unless they cannot be
    traced.
    """
    if output.causality != "output":
        return False
    if output.dependencies is None:
        return bool(interface.annotation)
    return not output.dependencies.isdisjoint(interface.inputs)
