"""Variables of an FMU, prepared for being set or read together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Protocol

from ...errors import FmuError
from ..interface import Interface, Type
from ..slave import Channel
from .surroundings import ONE, SMALL, TINY


class Owner(Protocol):
    """What a channel needs of the instance whose variables it sets and reads."""

    TYPES: ClassVar[Mapping[str, tuple[str, Any]]]
    SET: ClassVar[str]
    GET: ClassVar[str]
    COUNTS_VALUES: ClassVar[bool]
    name: str
    interface: Interface
    time: float
    pointer: int
    functions: dict[str, Any]

    def references(self, names: Sequence[str]) -> Any:
        """The value references of variables, for C."""

    def function(self, name: str) -> Any:
        """A function of the library."""

    def call(self, name: str, *arguments: Any) -> None:
        """Make a call that has to succeed."""

    def check(self, call: str, status: int) -> None:
        """Raise unless the status of a call is ok or warning."""

    def mend(self) -> None:
        """Put the floating-point environment back, which it has changed."""


class FmuChannel:
    """Some variables of one type of an FMU: value references and a buffer, prepared once.

    ``calls`` names the functions that set and get.

    Args:
        slave: the instance.
        kind: its variables' type, one of the slave's ``TYPES``.
        names: the variables.
    """

    def __init__(self, slave: Owner, kind: str, names: Sequence[str]) -> None:
        suffix, c_type = slave.TYPES[kind]
        count = len(names)
        self._slave, self.kind, self.names = slave, kind, names
        self.calls = f"{slave.SET}{suffix}", f"{slave.GET}{suffix}"
        self._set, self._get = (slave.functions.get(call) for call in self.calls)
        self._values = (c_type * count)()
        references = slave.references(names)
        self.references: Sequence[int] = references[:]
        more = (count,) if slave.COUNTS_VALUES else ()
        self._arguments = (slave.pointer, references, len(references), self._values, *more)
        self._text, self._truth = kind == "String", kind == "Boolean"
        self._limits = slave.interface.variables[names[0]].whole_range if names else None

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        if self._limits is not None:
            self._check_limits(values, *self._limits)
        if self._text:
            values = [v.encode() for v in values]
        self._values[:] = [1 if v else 0 for v in values] if self._truth else values
        status = (self._set or self._slave.function(self.calls[0]))(*self._arguments)
        if ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0:
            self._slave.mend()
        if status:
            self._slave.check(self.calls[0], status)

    def _check_limits(self, values: Sequence[Any], low: int, high: int) -> None:
        """C would take what does not fit for another number."""
        for name, value in zip(self.names, values, strict=True):
            if not low <= value <= high:
                what = f"{name!r} cannot become {value}: its type {self.kind} holds {low} to {high}"
                raise FmuError(what, instance=self._slave.name, time=self._slave.time)

    def get(self) -> list[Any]:
        """Read all of them."""
        status = (self._get or self._slave.function(self.calls[1]))(*self._arguments)
        if ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0:
            self._slave.mend()
        if status:
            self._slave.check(self.calls[1], status)
        if self._text:
            return [(v or b"").decode(errors="replace") for v in self._values]
        # A boolean is 0 or 1 here; in C it is true with any bit that is set.
        return [1 if v else 0 for v in self._values] if self._truth else list(self._values)


class MixedChannel:
    """Variables of one type of ours that are of several types in the FMU.

    Attributes:
        parts: a channel for each type, with the places of its variables.
        heed: is told the number of each part before it is set or read.
    """

    def __init__(self, parts: Sequence[tuple[Channel, Sequence[int]]], count: int) -> None:
        self.parts, self._count = parts, count
        self.heed: Callable[[int], object] = lambda _: None

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        for number, (channel, places) in enumerate(self.parts):
            self.heed(number)
            channel.set([values[k] for k in places])

    def get(self) -> list[Any]:
        """Read all of them."""
        found: list[Any] = [None] * self._count
        for number, (channel, places) in enumerate(self.parts):
            self.heed(number)
            for place, value in zip(places, channel.get(), strict=True):
                found[place] = value
        return found


def heed_parts(channel: Channel, heed: Callable[[int], object]) -> None:
    """Let somebody be told the number of each part of a channel before it is set or read, if it has several."""
    if isinstance(channel, MixedChannel):
        channel.heed = heed


class NegatedChannel:
    """Variables some of which are another's negative: what the library keeps is minus (or not) their value."""

    def __init__(self, plain: Channel, negated: Sequence[bool], kind: Type) -> None:
        self._plain, self._negated = plain, negated
        self._is_truth = kind == "Boolean"

    def _turned(self, values: Sequence[Any]) -> list[Any]:
        pairs = zip(values, self._negated, strict=True)
        return [((1 - value) if self._is_truth else -value) if negated else value for value, negated in pairs]

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        self._plain.set(self._turned(values))

    def get(self) -> list[Any]:
        """Read all of them."""
        return self._turned(self._plain.get())
