"""Who is a train, and which train runs behind which: out of ports and connections.

A train has the outputs ``position`` and ``speed`` and an input ``force``, or ``ahead_position`` where its controller is
inside. An instance is one as well, whatever its variables are called, if a controller with the cruise or ATO port reads
its position and speed and that controller's ``force`` reaches it. A controller that hears ``ahead_position`` or
``behind_position`` says in which order its train and the other run; sensors and radios in between are looked through.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..fmi import Interface
from ..names import SignalName
from .links import Link, Wiring
from .topology import is_heard
from .tracing import Ends, ends_of, first_of, force_paths, position_path


@dataclass(frozen=True)
class Quantity:
    """A sum of signals, each with a weight, and an offset."""

    terms: tuple[tuple[SignalName, float], ...]
    offset: float = 0.0

    def minus(self, other: Quantity) -> Quantity:
        """The difference of two."""
        taken = ((signal, -weight) for signal, weight in other.terms)
        return Quantity((*self.terms, *taken), self.offset - other.offset)

    def through(self, link: Link) -> Quantity:
        """What a connection makes of it."""
        terms = tuple((signal, link.scale * weight) for signal, weight in self.terms)
        return Quantity(terms, link.scale * self.offset + link.offset)


@dataclass(frozen=True)
class Train:
    """An instance that is a train; its speed in m/s, of many carriages the mean."""

    name: str
    speed: Quantity


@dataclass(frozen=True)
class Following:
    """One train behind another, and the gap between them in m: the difference of what their controller reads."""

    ahead: str
    behind: str
    gap: Quantity


@dataclass(frozen=True)
class Control:
    """A controller and the train it drives, with the connections from the train's position to it, and on to the train.

    ``links`` are in the order in which a value passes them.
    """

    controller: str
    train: str
    links: tuple[Link, ...]


def find_trains(interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Train]:
    """The trains of a system, in the order of its instances."""
    ends = ends_of(wiring.links)
    by_wiring = dict(_driven(interfaces, ends))
    found = []
    for name, face in interfaces.items():
        if _has_port(face):
            found.append(Train(name, _mean(name, face, "speed")))
        elif name in by_wiring:
            found.append(Train(name, by_wiring[name]))
    return found


def find_followings(interfaces: Mapping[str, Interface], wiring: Wiring, trains: Collection[str]) -> list[Following]:
    """Which train runs behind which, each pair once. Trains that do not hear each other are in no order.

    Args:
        interfaces: by instance name.
        wiring: start values and connections of the system.
        trains: which of the instances are trains.
    """
    ends = ends_of(wiring.links)
    fed = {name: {link.target.variable: link.source.instance for link in links} for name, links in ends.into.items()}
    found: dict[tuple[str, str], Following] = {}
    for name, face in interfaces.items():
        own = _own_position(name, face, trains, interfaces, ends)
        for side in ("ahead", "behind"):
            link = ends.feeding.get((name, f"{side}_position"))
            flag = f"has_{side}"
            if own is None or link is None:
                continue
            if flag in face.variables and not is_heard(name, flag, fed, interfaces, wiring):
                continue
            other = _origin(link, trains, interfaces, ends)
            if other is not None and _owner(other) != _owner(own):
                first, second = (other, own) if side == "ahead" else (own, other)
                pair = _owner(first), _owner(second)
                found.setdefault(pair, Following(*pair, first.minus(second)))
    return list(found.values())


def find_controls(interfaces: Mapping[str, Interface], wiring: Wiring, trains: Collection[str]) -> Iterator[Control]:
    """Which controller drives which train, and by what ways.

    Args:
        interfaces: by instance name.
        wiring: start values and connections of the system.
        trains: which of the instances are trains.
    """
    ends = ends_of(wiring.links)
    for name, face in interfaces.items():
        link = ends.feeding.get((name, first_of(face, "position")))
        path = None if link is None or name in trains else position_path(link, trains, interfaces, ends)
        if path:
            train = path[-1].source.instance
            forces = force_paths(name, ends).get(train)
            if forces:
                yield Control(name, train, (*reversed(path), *forces))


def _has_port(face: Interface) -> bool:
    inputs = {name for v in face.of("input") for name in (v.name, SignalName("", v.name).array)}
    acted_on = not inputs.isdisjoint({"force", "ahead_position"})
    return acted_on and all(_outputs(face, name) for name in ("position", "speed"))


def _outputs(face: Interface, name: str) -> tuple[str, ...]:
    """The scalars of an output of real numbers; empty where there is none."""
    scalars = face.scalars(name) or ()
    is_output = all(face.variables[s].causality == "output" and face.variables[s].type == "Real" for s in scalars)
    return scalars if is_output else ()


def _mean(name: str, face: Interface, variable: str) -> Quantity:
    scalars = _outputs(face, variable)
    unit = face.units.get(face.variables[scalars[0]].unit or "")
    factor = (unit.factor if unit else 1.0) / len(scalars)
    return Quantity(tuple((SignalName(name, scalar), factor) for scalar in scalars))


def _driven(interfaces: Mapping[str, Interface], ends: Ends) -> Iterator[tuple[str, Quantity]]:
    """Instances with the speed that a controller reads of them, and which its force reaches."""
    for name, face in interfaces.items():
        position, speed = (ends.feeding.get((name, first_of(face, x))) for x in ("position", "speed"))
        if position is None or speed is None or position.source.instance != speed.source.instance:
            continue
        if position.source.instance in force_paths(name, ends):
            yield speed.source.instance, Quantity(((speed.source, 1.0),)).through(speed)


def _owner(quantity: Quantity) -> str:
    return quantity.terms[0][0].instance


def _own_position(
    name: str, face: Interface, trains: Collection[str], interfaces: Mapping[str, Interface], ends: Ends
) -> Quantity | None:
    """The position of the train that a controller drives, as it reads it; or of the train that it is."""
    if name in trains:
        scalars = _outputs(face, "position")
        return Quantity(((SignalName(name, scalars[0]), 1.0),)) if scalars else None
    link = ends.feeding.get((name, first_of(face, "position")))
    return None if link is None else _origin(link, trains, interfaces, ends)


def _origin(link: Link, trains: Collection[str], interfaces: Mapping[str, Interface], ends: Ends) -> Quantity | None:
    """The position of a train that arrives by a connection; None where it is of no train, or not of one alone."""
    path = position_path(link, trains, interfaces, ends)
    return _along(path) if path else None


def _along(path: Sequence[Link]) -> Quantity:
    """What arrives at the first connection of a path from the source of its last."""
    quantity = Quantity(((path[-1].source, 1.0),))
    for link in reversed(path):
        quantity = quantity.through(link)
    return quantity
