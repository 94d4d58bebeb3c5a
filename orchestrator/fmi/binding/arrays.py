"""Variables by the calls that set and read them: one for each type, and for FMI 3.0 arrays as a whole only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..interface import Interface, Type
from ..slave import Channel
from .binary import BinaryChannel
from .channel import FmuChannel, MixedChannel, Owner


class Held(NamedTuple):
    """An element that is set as it is, with others of its array."""

    array: ElementsChannel
    name: str


Calls = list[tuple[FmuChannel, Sequence[int | Held]]]
"""Calls of an FMU, each with the places of its values among all of a channel, or what is none of them."""


def by_type(kind: Type, names: Sequence[str], interface: Interface) -> dict[str, list[int]]:
    """The places of some variables of one type of ours, by the FMU's types of them: there is a call for each."""
    found: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        found.setdefault(interface.variables[name].fmi_type or kind, []).append(place)
    return found


def are_as_called(kind: Type, names: Sequence[str], interface: Interface) -> bool:
    """Whether numbers and truth values are set and read as they stand there: whole arrays, and nothing negated."""
    types = by_type(kind, names, interface)
    own = [[names[k] for k in places] for places in types.values()]
    return (
        kind != "String"
        and not any(interface.variables[name].negated for name in names)
        and all(whole_arrays(each, interface) == each for each in own)
    )


def heads(names: Sequence[str], interface: Interface) -> list[int]:
    """The value references of variables; of the elements of an array, which stand together, the first's."""
    variables = map(interface.variables.__getitem__, names)
    return [v.reference for v in variables if v.element is None or not v.element[1]]


def calls_of(channel: Channel) -> Calls | None:
    """The calls behind a channel of an instance in this process; None where there are others."""
    if isinstance(channel, FmuChannel):
        return [(channel, range(len(channel.names)))]
    if isinstance(channel, ElementsChannel):
        return [(own, channel.sources) for own, _ in calls_of(channel.channel) or ()] or None
    found: Calls = []
    for own, places in channel.parts if isinstance(channel, MixedChannel) else ():
        inner = calls_of(own)
        if inner is None:
            return None
        found += [(each, [k if isinstance(k, Held) else places[k] for k in own_places]) for each, own_places in inner]
    return found or None


def prepared(slave: Owner, kind: str, names: Sequence[str], given: dict[str, Any]) -> Channel:
    """The channel of some variables of one type.

    Args:
        slave: the instance.
        kind: the variables' type, as `FmuChannel` takes it.
        names: the variables, in any order.
        given: what was given to elements of arrays last, by name; the same for all channels of an instance.
    """
    make = BinaryChannel if kind == "Binary" else FmuChannel
    if not any(slave.interface.variables[name].element for name in names):
        return make(slave, kind, names)
    whole = whole_arrays(names, slave.interface)
    return ElementsChannel(make(slave, kind, whole), whole, names, given, slave.interface)


def arrays_in(channel: Channel) -> list[ElementsChannel]:
    """The arrays of a channel, which are set past it where its `calls_of` are made."""
    if isinstance(channel, ElementsChannel):
        return [channel]
    parts = channel.parts if isinstance(channel, MixedChannel) else ()
    return [array for own, _ in parts for array in arrays_in(own)]


def whole_arrays(names: Sequence[str], interface: Interface) -> list[str]:
    """The variables, each element among them with all others of its array, and in the order of their places."""
    found: dict[str, None] = {}
    for name in names:
        element = interface.variables[name].element
        found |= dict.fromkeys((name,) if element is None else interface.wholes[element[0]])
    return list(found)


class ElementsChannel:
    """Some variables of which one at least is an element of an array.

    Of an array that is set in part, the other elements keep what they were given last, at first their start values, or
    what the FMU has in them where these are not known.

    Args:
        channel: of `whole_arrays`. whole: its variables. names: those that are wanted.
        given: what was given last, by name.
        interface: the instance's.
    """

    def __init__(
        self, channel: Channel, whole: Sequence[str], names: Sequence[str], given: dict[str, Any], interface: Interface
    ) -> None:
        self.channel, self._names, self._given = channel, names, given
        rank = {name: k for k, name in enumerate(whole)}
        self._places = [rank[name] for name in names]
        variables = (interface.variables[name] for name in whole)
        self._starts = {v.name: v.start for v in variables}

    @property
    def sources(self) -> list[int | Held]:
        """Of the elements of the whole arrays, in their order, which of those that are wanted each is."""
        places = {name: place for place, name in enumerate(self._names)}
        return [places.get(name, Held(self, name)) for name in self._starts]

    def value_of(self, name: str) -> Any:
        """What an element is that is not among those that are wanted."""
        value = self._given.get(name, self._starts[name])
        return self.channel.get()[list(self._starts).index(name)] if value is None else value

    def forget(self) -> None:
        """They were set past this channel: what a part of an array is beside, the FMU has to say."""
        self._given.update(dict.fromkeys(self._names))

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        self._given.update(zip(self._names, values, strict=True))
        every = [self._given.get(name, start) for name, start in self._starts.items()]
        if None in every:
            every = [own if value is None else value for value, own in zip(every, self.channel.get(), strict=True)]
        self.channel.set(every)

    def get(self) -> list[Any]:
        """Read all of them."""
        values = self.channel.get()
        return [values[k] for k in self._places]
