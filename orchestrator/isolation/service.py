"""An isolated instance on its process's side of the lane: what is called, and where its values stand."""

from __future__ import annotations

import ctypes
import mmap
import struct
from array import array
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from .lanes import LANE_SIZE, lane, spin_time
from .messages import (
    ASK,
    ASK_3,
    LANE_GETS,
    LANE_RESTORE,
    LANE_SAVE,
    LANE_STEP,
    LANE_STEP_3,
    NOTE_FAILED,
    NOTE_TIME,
    SET_SLOPES,
    note,
)

if TYPE_CHECKING:
    from ..fmi import Channel, Slave
    from ..fmi.binding import ElementsChannel

_OPERATION = struct.Struct("=q6Qq")
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
        self._arrays: list[ElementsChannel] = []
        """Channels that are set and read past themselves."""
        self.states: dict[int, ctypes.c_void_p] = {}
        """Those saved through the lane, by the numbers that the master has for them; empty where there is none."""

    def board(self, slave: Slave, table: Iterable[tuple[int, int, int, int, int, Channel | None]]) -> None:
        """Prepare operations.

        Args:
            slave: the instance.
            table: of each, what is done (by its number); to which channel or state (by its number), and to which part
                of the channel; where its values or derivatives stand in the memory, and how many there are or may be;
                the channel.
        """
        from ..fmi.binding import Fmi3Slave, LoadedSlave, arrays_in, calls_of  # noqa: PLC0415 (it is there by now, with the FMU)

        assert isinstance(slave, LoadedSlave)
        struct.pack_into("=q", self._memory, self.begin + 8 * NOTE_FAILED, 0)
        self.leave()
        for kind, number, part, offset, room, channel in table:
            if kind in (LANE_STEP, LANE_STEP_3):
                beside = ctypes.addressof(slave.told) if isinstance(slave, Fmi3Slave) else 0
                self._add(kind, slave.addresses(slave.DO_STEP), note("step"), beside)
            elif kind == SET_SLOPES:
                self._add(kind, slave.addresses(slave.INTERPOLATE), note("interpolate"), 0, (room, 0, offset))
            elif kind in (ASK, ASK_3):
                told = note("directional_derivatives")
                self._add(kind, slave.addresses(slave.DERIVE), told, 0, (room, 0, offset))
            elif kind >= LANE_SAVE:
                handle = self.states.setdefault(number, ctypes.c_void_p())
                call = slave.addresses(slave.STATE[kind - LANE_SAVE])
                name = {LANE_SAVE: "save", LANE_RESTORE: "restore"}.get(kind, "forget")
                self._add(kind, call, note(name), ctypes.addressof(handle))
            else:
                assert channel is not None
                calls = calls_of(channel)
                assert calls is not None
                self._arrays += arrays_in(channel)
                own, is_get = calls[part][0], kind in LANE_GETS
                kept = array("I", own.references)
                self._kept.append(kept)
                call, told = slave.addresses(own.calls[is_get]), note("get" if is_get else "set", number, part)
                self._add(kind, call, told, kept.buffer_info()[0], (len(kept), room, offset))

    def _add(
        self, kind: int, call: tuple[int, int], told: int, beside: int = 0, values: tuple[int, int, int] = (0, 0, 0)
    ) -> None:
        """Beside: the address of value references, a handle or what a step tells. Values: references, they, where."""
        self.operations += _OPERATION.pack(kind, *call, beside, *values, told)

    def leave(self) -> None:
        """Nothing is called any more."""
        self.operations, self._kept, self._arrays = b"", [], []

    def forget_arrays(self) -> None:
        """What stands in arrays that were set as a whole is to be asked of the FMU."""
        for each in self._arrays:
            each.forget()

    @property
    def time(self) -> float:
        """The time in s that the master has got to when it lets the instance take messages again."""
        time: float = struct.unpack_from("=d", self._memory, self.begin + 8 * NOTE_TIME)[0]
        return time


def serve(memory: mmap.mmap, services: Sequence[Service]) -> None:
    """Take calls of all instances of a process from its lane until told to leave."""
    guests = [(service.begin, service.operations) for service in services]
    lane.serve(memory, len(memory) - LANE_SIZE, guests, spin_time())
