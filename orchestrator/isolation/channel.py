"""Variables of an isolated instance: set into the shared memory, and read from there while that is fresh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from ..errors import FmuError
from ..fmi import Type
from .messages import Cells


class Owner(Protocol):
    """What a channel needs of its instance."""

    end: float | None
    moment: int
    reads: dict[IsolatedChannel, None]

    def set_later(self, channel: IsolatedChannel, values: Sequence[Any]) -> None:
        """Keep values for the next call."""

    def name_call(self, call: str, channel: int) -> str:
        """The function of the standard behind a name of `messages.CALLS`, called for a channel."""

    def refresh(self, channel: IsolatedChannel) -> None:
        """See to it that what a channel shows is of this moment."""


class IsolatedChannel:
    """Some variables of one type of an isolated instance.

    Attributes:
        index: its number in the process. kind: its variables' type.
        cells: its place in the shared memory, if it has one.
        moment: when it was read. texts: what was read then, where that came in a message.
        problem: when it could not be read, and why.
    """

    def __init__(self, slave: Owner, index: int, kind: Type, cells: Cells | None) -> None:
        self._slave = slave
        self.index, self.kind = index, kind
        self.cells = cells
        self.moment = -1
        self.texts: list[Any] | None = None
        self.problem: tuple[int, FmuError] | None = None

    @property
    def calls(self) -> tuple[str, str]:
        """The names of the functions that set and get."""
        return self._slave.name_call("set", self.index), self._slave.name_call("get", self.index)

    @property
    def references(self) -> Sequence[int]:
        """In the place of value references, which the process has: as many numbers."""
        return (0,) * (0 if self.cells is None else self.cells.count)

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
