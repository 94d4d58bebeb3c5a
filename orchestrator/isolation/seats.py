"""Instances in a process of their own, as that process needs them on the master's side."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol

from ..errors import FmuError
from ..fmi import Interface


class HostLostError(Exception):
    """The process of an instance is gone: its message says how.

    Attributes: `seat` (the number of the instance that was called), `log` (the last lines that were written),
    `is_stopped` (whether that is because the run was to stop).
    """

    def __init__(self, message: str, seat: int, log: list[str], *, is_stopped: bool = False) -> None:
        super().__init__(message)
        self.seat, self.log, self.is_stopped = seat, log, is_stopped


class Guest(NamedTuple):
    """An instance that is to live in a process.

    Attributes: `name`, `interface`, `folder` (where its FMU was unpacked), `cells` (for how many values the shared
    memory is to have room).
    """

    name: str
    interface: Interface
    folder: Path
    cells: int

    @property
    def slopes(self) -> int:
        """For how many derivatives of inputs there is room behind the values: two orders of each."""
        return 2 * len(self.interface.of("input")) if self.interface.interpolates_inputs else 0

    @property
    def asked(self) -> int:
        """For how many variables there is room behind these, of which directional derivatives are asked for."""
        return len(self.interface.variables) if self.interface.directional_derivatives else 0

    @property
    def places(self) -> tuple[int, int]:
        """Where these two begin, as numbers of 64 bits."""
        return self.cells, self.cells + 1 + 2 * self.slopes

    @property
    def room(self) -> int:
        """How many such numbers all that takes: see `Slopes` and `Question` in ``native/lane.h``."""
        return self.places[1] + 5 + 3 * self.asked


class Seated(Protocol):
    """What a process needs of an instance that lives in it."""

    name: str
    time: float

    def name_call(self, call: str, channel: int, part: int) -> str:
        """The function of the standard behind a name of `messages.CALLS`, called for a part of a channel."""

    def await_lane(self) -> None:
        """Wait for what is under way in the lane.

        Raises:
            FmuError: it is lost.
        """

    def mourn(self, lost: HostLostError) -> FmuError:
        """The error that tells that it was lost, with its process."""

    def lose(self, error: FmuError) -> None:
        """Let everything that is asked of it from now on be this error."""
