"""Variables of an isolated instance: set into the shared memory, and read from there while that is fresh."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import sizeof
from functools import cached_property
from typing import Any, NamedTuple, Protocol

from ..errors import FmuError
from ..fmi import Interface, Type
from ..fmi.binding import SLAVES, are_as_called, by_type, call_name, heads
from .messages import Cells

_CELL = 8
"""Bytes that there are for a value, of whatever type."""


class Owner(Protocol):
    """What a channel needs of its instance."""

    interface: Interface
    end: float | None
    moment: int
    reads: dict[IsolatedChannel, None]

    def set_later(self, channel: IsolatedChannel, values: Sequence[Any]) -> None:
        """Keep values for the next call."""

    def refresh(self, channel: IsolatedChannel) -> None:
        """See to it that what a channel shows is of this moment."""


class IsolatedPart(NamedTuple):
    """Variables of a channel that one call of the FMU's sets or reads.

    Attributes: `channel` and `number` (of the channel in the process, and of this among its parts), `kind` (their type
    in the FMU), `calls` (the functions that set and get), `references` (their value references, one for a whole array),
    `place` (where in the shared memory the values stand in a lane, how many, of how many bytes).
    """

    channel: int
    number: int
    kind: str
    calls: tuple[str, str]
    references: list[int]
    place: tuple[int, int, int]


class IsolatedChannel:
    """Some variables of one type of an isolated instance.

    Attributes:
        index: its number in the process. kind: its variables' type. names: the variables.
        cells: its place in the shared memory, if it has one.
        moment: when it was read. texts: what was read then, where that came in a message.
        problem: when it could not be read, and why.
    """

    def __init__(self, slave: Owner, index: int, kind: Type, names: Sequence[str], cells: Cells | None) -> None:
        self._slave = slave
        self.index, self.kind, self.names = index, kind, names
        self.cells = cells
        self.moment = -1
        self.texts: list[Any] | None = None
        self.problem: tuple[int, FmuError] | None = None

    @cached_property
    def parts(self) -> list[tuple[IsolatedPart, Sequence[int]]] | None:
        """The calls behind it in a lane, each with the places of its values; None where they go as messages alone."""
        interface, names = self._slave.interface, self.names
        if self.cells is None or not are_as_called(self.kind, names, interface):
            return None
        own, offset = SLAVES[interface.version], self.cells.offset
        found: list[tuple[IsolatedPart, Sequence[int]]] = []
        for kind, places in by_type(self.kind, names, interface).items():
            suffix, c_type = own.TYPES[kind]
            calls, place = (f"{own.SET}{suffix}", f"{own.GET}{suffix}"), (offset, len(places), sizeof(c_type))
            references = heads([names[k] for k in places], interface)
            found.append((IsolatedPart(self.index, len(found), kind, calls, references, place), places))
            offset += _CELL * len(places)
        return found

    def name_call(self, call: str, part: int) -> str:
        """The function of the standard behind ``set`` or ``get``, called for a part."""
        interface, names = self._slave.interface, self.names
        parts = list(by_type(self.kind, names, interface).values())
        own = [names[k] for k in parts[part]] if part < len(parts) else names
        return call_name(interface, call, self.kind, own)

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them; what is wrong with it may be said by a later call."""
        self._slave.set_later(self, values)

    def get(self) -> list[Any]:
        """Read all of them."""
        slave = self._slave
        if slave.end is not None or self.moment != slave.moment:
            slave.refresh(self)
        slave.reads[self] = None
        if self.texts is None:
            assert self.cells is not None
            return self.cells.read()
        return list(self.texts)
