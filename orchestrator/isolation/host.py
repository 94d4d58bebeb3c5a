"""The process of isolated instances: it loads their FMUs and does what the master asks for, until told to end.

It is started without the rest of the package (see `launch`), so what is imported here at the top is little.
"""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import socket
import sys
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy  # noqa: F401 (before the guard forks: its threads stay there, and an FMU that ends its thread ends the process)
import psutil

from .. import world
from . import guard, messages
from .guard import Look
from .line import Line
from .messages import NOTE_BASE, NOTE_CALL, NOTE_FAILED, NOTE_MEMORY, NOTE_STATUS, Cells, Door, note
from .service import Service, serve

if TYPE_CHECKING:
    from ..fmi import Channel, Slave
    from ..fmi.binding import LoadedSlave

_LOG_LINES = 50


class _Heard(deque[str]):
    """What the FMU says, kept as ever and printed for the guard, with whom it outlives a crash."""

    def extend(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.append(line)

    def append(self, line: str) -> None:
        super().append(line)
        guard.say(line)


class Host:
    """Does with one instance what the frames of the master say.

    Args:
        line: to the master.
        memory: shared with it.
        begin: where the instance's part of that begins.
        before: what the process had allocated before there was an FMU, in KiB.
        limit: what it may allocate beyond that, in KiB; None for no limit.
    """

    def __init__(self, line: Line, memory: mmap.mmap, begin: int, before: int, limit: int | None) -> None:
        self._line = line
        self._memory = memory
        self._notes = _notes(memory, begin)
        self._before = before
        self._limit = limit
        self._slave: LoadedSlave | None = None
        self._channels: list[tuple[Channel, Cells | None]] = []
        self._texts: dict[int, Sequence[Any]] = {}
        self._watched: list[int] = []
        self._states: dict[int, Any] = {}
        self._problem: Exception | None = None
        """What went wrong since the last answer."""
        self._is_settled = False
        """Whether a call that failed in the lane has been seen to."""
        self.service = Service(memory, begin)
        self._quiet: dict[int, Callable[[Any], None]] = {
            messages.CHANNEL: self._add_channel,
            messages.WATCH: self._watch,
            messages.VALUES: self._keep_values,
        }

    def instantiate(self, make: Callable[[deque[str]], LoadedSlave]) -> None:
        """Make the instance, whose messages go where they outlive a crash, and tell how it went."""
        self._notes[NOTE_CALL] = note("instantiate")
        try:
            self._slave = made = make(_Heard(maxlen=_LOG_LINES))
            self._report({"result": sorted(made.functions)})
        except Exception as error:
            self._report({"error": self._describe(error)})

    def obey(self, kind: int, body: bytes) -> None:
        """Do what a frame says."""
        if kind == messages.STEP:
            self._step(body)
        elif kind == messages.CALL:
            self._call(*messages.content(body))
        else:
            try:
                self._quiet[kind](messages.content(body))
            except Exception as error:
                self._problem = self._problem or error
            self._notes[NOTE_CALL] = 0

    def come_back(self) -> None:
        """Go on by messages, at the time that the master has got to by calls through the lane."""
        if self._slave is not None and self.service.operations:
            self.service.forget_arrays()
            self._slave.time = self.service.time
            if self._notes[NOTE_FAILED] and not self._is_settled:  # whoever is told of
                self._is_settled = True
                self._slave.settle(self._notes[NOTE_STATUS])

    # ---------------------------------------------------------------- answered

    def _step(self, body: bytes) -> None:
        length = messages.STEP_BODY.size
        time, step, final = messages.STEP_BODY.unpack_from(body)
        try:
            self._set(memoryview(body)[length:].cast("I") if len(body) > length else ())
            self._notes[NOTE_CALL] = _STEPPING
            self._instance.step(time, step, final=bool(final))
        except Exception as error:
            self._report({"error": self._describe(error)})
            return
        told = self._read(self._watched)
        if told:
            self._report(told)
        else:
            self._answer(messages.ANSWER)

    def _call(self, dirty: Sequence[int], operation: str, arguments: tuple[Any, ...]) -> None:
        """Set what waits to be set, then do what has a name."""
        if operation == "free":
            self._free(*arguments)
            return
        try:
            self._set(dirty)
            told = self._read(arguments[0]) if operation == "get" else {"result": self._do(operation, arguments)}
        except Exception as error:
            told = {"error": self._describe(error)}
        self._report(told)

    def _do(self, operation: str, arguments: tuple[Any, ...]) -> Any:
        if not operation:
            return None
        self._notes[NOTE_CALL] = note(_BEHIND.get(operation, operation))
        own: dict[str, Callable[..., Any]] = {
            "save": self._save,
            "restore": self._restore,
            "forget": self._forget,
            "serialize": self._serialize,
            "deserialize": self._deserialize,
            "board": self._board,
            "complain": self._complain,
            "come_back": self._come_back,
            "give_back": self._give_back,
        }
        call = own[operation] if operation in own else getattr(self._instance, operation)
        return call(*arguments)

    def _free(self, is_last: bool) -> None:
        self._notes[NOTE_CALL] = note("free")
        self.service.leave()
        if self._slave is not None:
            self._slave.free()
            self._slave = None
        self._answer(messages.ANSWER)
        if is_last:  # not by the usual way: some FMUs crash when their libraries are torn down, and all was given back
            world.exit_at_once(0)

    def _report(self, told: dict[str, Any]) -> None:
        time = self._slave.time if self._slave else 0.0
        self._answer(messages.frame(messages.REPORT, told | {"time": time}))

    def _answer(self, frame: bytes) -> None:
        self._line.answer(frame, self._notes)

    @property
    def _instance(self) -> Slave:
        assert self._slave is not None
        return self._slave

    def _describe(self, error: Exception) -> dict[str, Any]:
        told = messages.describe(error)
        used = _memory_in_use(os.getpid()) - self._before
        if isinstance(error, MemoryError) and self._limit is not None:
            used = self._limit
        told["message"] += messages.memory_hint(used, self._limit)
        return told

    # ---------------------------------------------------------------- values

    def _set(self, dirty: Iterable[int]) -> None:
        if self._problem is not None:
            problem, self._problem = self._problem, None
            raise problem
        for k in dirty:
            channel, cells = self._channels[k]
            self._notes[NOTE_CALL] = note("set", k)
            if k in self._texts:
                channel.set(self._texts.pop(k))
            elif cells is not None:
                channel.set(cells.read())

    def _read(self, wanted: Iterable[int]) -> dict[str, Any]:
        """Read channels into the shared memory; what does not fit there, and the first that fails, is told."""
        told: dict[str, Any] = {}
        for k in wanted:
            channel, cells = self._channels[k]
            self._notes[NOTE_CALL] = note("get", k)
            try:
                values = channel.get()
            except Exception as error:
                told["failed"] = k, self._describe(error)
                break
            if cells is None or not cells.write(values):
                told.setdefault("texts", []).append((k, values))
        return told

    def _add_channel(self, content: tuple[Any, Sequence[str], int | None]) -> None:
        from ..fmi.binding import heed_parts  # noqa: PLC0415 (it is there by now, with the FMU)

        kind, names, offset = content
        cells = None if offset is None else Cells(self._memory, offset, kind, len(names))
        channel = self._instance.channel(kind, names)
        heed_parts(channel, partial(messages.note_part, self._notes, len(self._channels)))
        self._channels.append((channel, cells))

    def _watch(self, channels: list[int]) -> None:
        self._watched = channels

    def _keep_values(self, content: tuple[int, Sequence[Any]]) -> None:
        self._texts[content[0]] = content[1]

    def _board(self, table: Sequence[tuple[int, int, int, int, int]]) -> None:
        """Make ready for calls that come through the lane."""
        self._is_settled = False
        found = [self._channels[k][0] if kind in messages.LANE_VALUES else None for kind, k, *_ in table]
        self.service.board(self._instance, [(*entry, channel) for entry, channel in zip(table, found, strict=True)])

    def _complain(self, call: str, status: int) -> None:
        """Raise what a call in the lane has failed of, which has been seen to."""
        assert self._slave is not None
        raise self._slave.complaint(call, status)

    # ---------------------------------------------------------------- saved states

    def _save(self, number: int) -> None:
        self._states[number] = self._instance.save()

    def _serialize(self, number: int) -> bytes:
        return self._instance.serialize(self._states[number])

    def _deserialize(self, number: int, content: bytes) -> float:
        self._states[number] = self._instance.deserialize(content)
        time: float = self._states[number][0]
        return time

    def _restore(self, number: int) -> None:
        self._instance.restore(self._states[number])

    def _forget(self, number: int) -> None:
        self._instance.forget(self._states.pop(number))

    def _come_back(self, number: int, time: float) -> None:
        handle, self._instance.time = self.service.states[number], time
        if handle:  # else it was refused, and nothing has been called since
            self._instance.restore((time, handle))

    def _give_back(self, number: int, time: float) -> None:
        handle, self._instance.time = self.service.states[number], time
        old, handle.value = ctypes.c_void_p(handle.value), None  # whatever comes of it
        if old:
            self._instance.forget((time, old))


_STEPPING = note("step")
_BEHIND = {"resume": "step", "come_back": "restore", "give_back": "forget"}
"""What FMUs are asked to do by what the master asks for."""


# -------------------------------------------------------------------- the process


def main(folder: str, door: str) -> None:
    """Serve some instances; called by the few lines that `launch` starts.

    Args:
        folder: of the files that are shared with the master.
        door: the number of the inherited socket, or ``"host:port"`` of one to connect to.
    """
    end = _connect(door)
    start: dict[str, Any] = messages.content(world.read_bytes(Path(folder) / "start"))
    sys.path[:] = start["path"]
    _be_chosen_first()
    _print_by_lines()
    memory = _shared(folder)
    notes = _notes(memory)
    from ..fmi.binding import SLAVES, read_interface  # noqa: PLC0415 (after the path is set; and what it needs is not the FMU's memory)
    from ..fmi.guard import stand_aside  # noqa: PLC0415

    stand_aside()  # this process may end as it likes: the master tells how

    guests = [(x["name"], read_interface(x["interface"]), Path(x["folder"])) for x in start["guests"]]
    before = notes[NOTE_BASE] = _memory_in_use(os.getpid())
    limit = _limit_memory(before, start["memory_limit"])
    line = Line(end, notes)
    hosts = [Host(line, memory, guest["begin"], before, limit) for guest in start["guests"]]
    try:
        end.send(messages.frame(messages.READY, [limit, os.getpid()]))
        for host, (name, interface, where) in zip(hosts, guests, strict=True):
            host.instantiate(partial(SLAVES[interface.version], name, interface, where))
        _serve(line, memory, hosts)
    except (EOFError, OSError):  # the master is gone
        world.exit_at_once(1)


def _serve(line: Line, memory: mmap.mmap, hosts: Sequence[Host]) -> None:
    """Obey until the master leaves."""
    host = hosts[0]
    while True:
        kind, body = line.receive()
        if kind == messages.SEAT:
            host = hosts[messages.content(body)]
        elif kind == messages.RIDE:
            serve(memory, [host.service for host in hosts])
            for each in hosts:
                each.come_back()
        else:
            host.obey(kind, body)


def watching(folder: str, door: str) -> Look:
    """What the guard does now and then: it notes the most memory that is used."""
    notes = _notes(_shared(folder))

    def look(process: int) -> None:
        with contextlib.suppress(psutil.Error):
            if notes[NOTE_BASE]:
                notes[NOTE_MEMORY] = max(notes[NOTE_MEMORY], _memory_in_use(process) - notes[NOTE_BASE])

    return look


def _shared(folder: str) -> mmap.mmap:
    """The memory that is shared with the master."""
    with world.open(Path(folder) / "memory", "r+b") as stream:
        return world.map_memory(stream.fileno(), 0)


def _notes(memory: mmap.mmap, begin: int = 0) -> memoryview:
    """The notes at the head of an instance's part of it, as whole numbers."""
    return memoryview(memory)[begin : begin + messages.HEAD].cast("q")


def _connect(door: str) -> Door:
    if door.isdigit():
        return Door(socket.socket(fileno=guard.high(int(door))))
    address, _, port = door.rpartition(":")
    end = world.create_connection((address, int(port)))
    world.send(end, sys.stdin.buffer.readline().strip())
    return Door(socket.socket(fileno=guard.high(end.detach())))


def _print_by_lines() -> None:
    """What an FMU prints is on disk at the end of each line, so that it can be had after a crash."""
    with contextlib.suppress(Exception):
        library = ctypes.CDLL(None)
        stdout = ctypes.c_void_p.in_dll(library, "stdout")
        library.setvbuf(stdout, None, _LINES, ctypes.c_size_t(1 << 12))


_LINES = 1
"""_IOLBF, on Linux and on macOS."""


def _be_chosen_first() -> None:
    """Let Linux choose this process, not the master, when memory runs out."""
    if sys.platform.startswith("linux"):
        with contextlib.suppress(OSError):
            world.write_text(Path("/proc/self/oom_score_adj"), "1000")


def _limit_memory(before: int, mebibytes: float) -> int | None:
    """Limit what may be allocated beyond ``before`` KiB; the limit in KiB, or None where the platform has none."""
    if not sys.platform.startswith("linux"):
        return None
    limit = int(mebibytes * 1024)
    psutil.Process().rlimit(psutil.RLIMIT_DATA, ((before + limit) * 1024,) * 2)
    return limit


def _memory_in_use(process: int) -> int:
    """What a process has allocated, in KiB, as Linux counts it for its limit; 0 elsewhere."""
    return int(getattr(psutil.Process(process).memory_info(), "data", 0)) // 1024
