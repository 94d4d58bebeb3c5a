"""An isolated instance on its process's side of the lane: what is called, and where its values stand."""

from __future__ import annotations

import ctypes
import mmap
import struct
from array import array
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from .lanes import LANE_SIZE, lane, spin_time
from .messages import (
    ASK,
    GET_INTEGERS,
    GET_REALS,
    LANE_RESTORE,
    LANE_SAVE,
    LANE_STEP,
    NOTE_FAILED,
    NOTE_TIME,
    SET_SLOPES,
    Cells,
    note,
)

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
        self.states: dict[int, ctypes.c_void_p] = {}
        """Those saved through the lane, by the numbers that the master has for them; empty where there is none."""

    def board(self, slave: Slave, table: Iterable[tuple[int, int, int, Any, Cells | None]]) -> None:
        """Prepare operations.

        Args:
            slave: the instance.
            table: of each, what is done (by its number); to which channel or state (by its number), or where
                derivatives stand in the memory; how many values there are or may be; the channel, and its place.
        """
        from ..fmi.binding import FmuChannel, FmuSlave  # noqa: PLC0415 (it is there by now, with the FMU)

        assert isinstance(slave, FmuSlave)
        struct.pack_into("=q", self._memory, self.begin + 8 * NOTE_FAILED, 0)
        self.leave()
        for kind, number, room, channel, cells in table:
            if kind == LANE_STEP:
                self._add(kind, slave.addresses(slave.DO_STEP), note("step"))
            elif kind == SET_SLOPES:
                self._add(kind, slave.addresses(slave.INTERPOLATE), note("interpolate"), (0, room, number))
            elif kind == ASK:
                self._add(kind, slave.addresses(slave.DERIVE), note("directional_derivatives"), (0, room, number))
            elif kind >= LANE_SAVE:
                told = {LANE_SAVE: "save", LANE_RESTORE: "restore"}.get(kind, "forget")
                handle = self.states.setdefault(number, ctypes.c_void_p())
                call = slave.addresses(slave.STATE[kind - LANE_SAVE])
                self._add(kind, call, note(told), (ctypes.addressof(handle), 0, 0))
            else:
                assert isinstance(channel, FmuChannel)
                assert cells is not None
                is_get = kind in (GET_REALS, GET_INTEGERS)
                kept = array("I", channel.references)
                self._kept.append(kept)
                call, told = slave.addresses(channel.calls[is_get]), "get" if is_get else "set"
                self._add(kind, call, note(told, number), (kept.buffer_info()[0], len(kept), cells.offset))

    def _add(self, kind: int, call: tuple[int, int], told: int, places: tuple[int, int, int] = (0, 0, 0)) -> None:
        """Places: of value references or a handle, by address; how many values; these, in the memory."""
        self.operations += _OPERATION.pack(kind, *call, *places, told)

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
    lane.serve(memory, len(memory) - LANE_SIZE, guests, spin_time())
