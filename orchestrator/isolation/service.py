"""An isolated instance on its process's side of the lane: what is called, and where its values stand."""

from __future__ import annotations

import mmap
import struct
from array import array
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from .lanes import LANE_SIZE, lane, spin_time
from .messages import GET_INTEGERS, GET_REALS, LANE_STEP, NOTE_FAILED, NOTE_TIME, Cells, note

if TYPE_CHECKING:
    from ..fmi import Slave

_OPERATION = struct.Struct("=q5Qq")
"""As ``native/serving.c`` has it."""


class Service:
    """Calls of one instance that come through the lane.

    Args:
        memory: shared with the master; the lane stands at its end.
        begin: where the instance's part of it begins.
    """

    def __init__(self, memory: mmap.mmap, begin: int) -> None:
        self._memory, self.begin = memory, begin
        self.operations = b""
        self._kept: list[array[int]] = []
        """Value references, of which C has the addresses."""

    def board(self, slave: Slave, table: Iterable[tuple[int, int, Any, Cells | None]]) -> None:
        """Prepare operations: what is done (by its number), to which channel (by its number, and itself), and where."""
        from ..fmi.binding import FmuChannel, FmuSlave  # noqa: PLC0415 (it is there by now, with the FMU)

        assert isinstance(slave, FmuSlave)
        struct.pack_into("=q", self._memory, self.begin + 8 * NOTE_FAILED, 0)
        self.leave()
        for kind, number, channel, cells in table:
            if kind == LANE_STEP:
                self._add(kind, slave.addresses(slave.DO_STEP), [], 0, note("step"))
                continue
            assert isinstance(channel, FmuChannel)
            assert cells is not None
            is_get = kind in (GET_REALS, GET_INTEGERS)
            call = slave.addresses(channel.calls[is_get])
            self._add(kind, call, channel.references, cells.offset, note("get" if is_get else "set", number))

    def _add(self, kind: int, call: tuple[int, int], references: Any, offset: int, told: int) -> None:
        kept = array("I", references)
        self._kept.append(kept)
        self.operations += _OPERATION.pack(kind, *call, kept.buffer_info()[0], len(kept), offset, told)

    def leave(self) -> None:
        """Nothing is called any more."""
        self.operations, self._kept = b"", []

    @property
    def time(self) -> float:
        """The time in s that the master has got to when it lets the instance take messages again."""
        time: float = struct.unpack_from("=d", self._memory, self.begin + 8 * NOTE_TIME)[0]
        return time


def serve(memory: mmap.mmap, services: Sequence[Service]) -> None:
    """Take calls of all instances of a process from its lane until told to leave."""
    guests = [(service.begin, service.operations) for service in services]
    lane.serve(memory, len(memory) - LANE_SIZE, guests, spin_time(2))
