"""Where a position comes from, and where a force goes: connections followed through what stands in between."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..fmi import Interface
from ..names import SignalName
from .links import Link


@dataclass(frozen=True)
class Ends:
    """The connections of a system by the instance they lead into and out of, and by the input they feed."""

    into: Mapping[str, Sequence[Link]]
    out_of: Mapping[str, Sequence[Link]]
    feeding: Mapping[tuple[str, str], Link]


def ends_of(links: Sequence[Link]) -> Ends:
    """Connections by their ends."""
    into: dict[str, list[Link]] = {}
    out_of: dict[str, list[Link]] = {}
    for link in links:
        into.setdefault(link.target.instance, []).append(link)
        out_of.setdefault(link.source.instance, []).append(link)
    return Ends(into, out_of, {(link.target.instance, link.target.variable): link for link in links})


def first_of(face: Interface, name: str) -> str:
    """A variable's name, or that of the first element of an array."""
    return (face.scalars(name) or (name,))[0]


def position_path(
    link: Link, trains: Collection[str], interfaces: Mapping[str, Interface], ends: Ends
) -> list[Link] | None:
    """The connections back from one to the train whose position it brings; None where that is of none, or of several.

    Args:
        link: into the input in question.
        trains: where to stop.
        interfaces: by instance name.
        ends: of all connections.
    """
    seen: set[SignalName] = set()
    paths = [[link]]
    while paths:
        found = [path for path in paths if path[-1].source.instance in trains]
        if found:
            return found[0] if len({path[-1].source.instance for path in found}) == 1 else None
        seen.update(path[-1].target for path in paths)
        paths = [[*path, x] for path in paths for x in _behind(path[-1], interfaces, ends) if x.target not in seen]
    return None


def _behind(link: Link, interfaces: Mapping[str, Interface], ends: Ends) -> Iterator[Link]:
    """The connections of positions into the instance that a connection comes from, as far as its output needs them."""
    instance, variable = link.source
    needed = interfaces[instance].variables[variable].dependencies
    for further in ends.into.get(instance, ()):
        names = further.source.array, further.target.array
        if any(name.endswith("position") for name in names) and (not needed or further.target.variable in needed):
            yield further


def force_paths(name: str, ends: Ends) -> dict[str, list[Link]]:
    """The connections from an instance to each one that its ``force`` reaches, through protections and the like."""
    found: dict[str, list[Link]] = {}
    front = [name]
    while front:
        here = front.pop(0)
        for link in ends.out_of.get(here, ()):
            to = link.target.instance
            if link.source.array == "force" and to not in found:
                found[to] = [*found.get(here, []), link]
                front.append(to)
    return found
