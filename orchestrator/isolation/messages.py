"""What the master and a process of isolated instances say to each other.

Numbers stand in a file that both map into their memory; calls and answers go as frames over a socket. The one who has
rung leaves the memory alone until the other has answered.
"""

from __future__ import annotations

import base64
import json
import mmap
import socket
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from .. import world
from ..errors import FmuError, RollbackError, StoppedError
from .launch import MOMENT

if TYPE_CHECKING:
    from ..fmi import Type

A = TypeVar("A")
T = TypeVar("T")
STEP, CALL, CHANNEL, WATCH, VALUES, SEAT, RIDE = range(7)
"""Frames to the host. The first two are answered; what went wrong with one of those up to `VALUES` comes with the next
answer. `SEAT` says which instance the following are for, by its number; `RIDE`, to take calls from the lane."""
READY, DONE, REPORT = range(16, 19)
"""Frames from the host: it has started; all went as asked; what there is to tell."""

FRAME = struct.Struct("<BI")
"""A frame's kind, and the length of what follows."""
STEP_FRAME = struct.Struct("<BIddB")
STEP_BODY = struct.Struct("<ddB")
"""Time and length in s and whether it is final; the channels to be set before follow."""
ANSWER = FRAME.pack(DONE, 0)

HEAD = 64
"""Bytes before the values of an instance: notes of the host as whole numbers of 64 bits, which outlive it."""
NOTE_CALL, NOTE_MEMORY, NOTE_BASE, NOTE_LINE, NOTE_FAILED, NOTE_STATUS, NOTE_TIME = range(7)
"""What it is doing (see `note`); the most memory it has been seen to use beyond what Python has, which is the third, in
KiB; whether it has lost its line to the master: these three of the whole process, at its first instance. Of calls
through the lane: which one failed, counted from 1, and less than 0 unless that was one that reads; its status; and the
time in s, a real number, that the master has got to."""
LANE_SET, LANE_SET_3, LANE_STEP, LANE_STEP_3, LANE_GET, LANE_GET_3 = range(6)
SET_SLOPES, ASK, ASK_3, LANE_SAVE, LANE_RESTORE, LANE_FORGET, LANE_RESTORE_NOW = range(6, 13)
"""What is called through the lane: see ``native/lane.h``; the last waits until a state is restored."""
LANE_GETS = LANE_GET, LANE_GET_3
LANE_VALUES = LANE_SET, LANE_SET_3, *LANE_GETS
"""Of these, what reads channels; and what sets or reads them."""
CALLS = ("", "instantiate", "setup", "enter_initialization", "exit_initialization", "set", "step", "get", "save",
         "restore", "forget", "serialize", "deserialize", "directional_derivatives", "interpolate", "terminate",
         "roll_back", "reset", "free", "complain", "board")  # fmt: skip
"""What an FMU is asked to do, by number in `NOTE_CALL`."""
NUMBERS = {name: number for number, name in enumerate(CALLS)}
_FRAMES = {*range(STEP, RIDE + 1), *range(READY, REPORT + 1)}
_CHUNK, _LARGE = 1 << 16, 1 << 20
_SHOWN = 20
_SUSPICIOUS = 0.5
"""The part of the memory limit in use from which on it is named as a likely reason of a failure."""


def note(call: str, channel: int = 0, part: int = 0) -> int:
    """What stands in `NOTE_CALL` during a call, of one of a channel's parts."""
    return NUMBERS[call] | part << 8 | channel << 16


def noted(found: int) -> tuple[str, int, int]:
    """A name of `CALLS`, and the channel and part where they matter; an FMU may have overwritten it."""
    number = found & 0xFF
    return CALLS[number] if number < len(CALLS) else "", found >> 16, found >> 8 & 0xFF


def note_part(notes: memoryview, channel: int, part: int) -> None:
    """Note that the call that is under way has come to another part of a channel."""
    call, *_ = noted(notes[NOTE_CALL])
    notes[NOTE_CALL] = note(call, channel, part)


def frame(kind: int, content: Any) -> bytes:
    """A frame of numbers, texts, bytes, and lists and mappings of them: JSON, because who reads it trusts nobody."""
    body = encoded(content)
    return FRAME.pack(kind, len(body)) + body


def encoded(content: Any) -> bytes:
    """The same without a head; `content` reads it."""
    return json.dumps(content, default=_as_text).encode()


def content(body: bytes) -> Any:
    """What such a frame holds."""
    return json.loads(body, object_hook=_as_bytes)


_BYTES = "bytes in base64"


def _as_text(value: Any) -> Any:
    if isinstance(value, bytes):
        return {_BYTES: base64.b64encode(value).decode()}
    raise TypeError(f"a {type(value).__name__} goes into no message")


def _as_bytes(found: dict[str, Any]) -> Any:
    return base64.b64decode(found[_BYTES]) if found.keys() == {_BYTES} else found


@dataclass(frozen=True, eq=False)
class Saved:
    """A saved state, which lives in the process: its number there, and its time in s."""

    number: int
    time: float


@dataclass(frozen=True)
class Report:
    """What a host has to tell.

    Attributes:
        time: of the instance, in s. result: of a call. error: what went wrong.
        texts: values that have no place in the memory, by channel.
        failed: the channel that could not be read, and why.
    """

    time: float
    result: Any = None
    error: FmuError | None = None
    texts: Mapping[int, list[Any]] = field(default_factory=dict)
    failed: tuple[int, FmuError] | None = None

    @classmethod
    def read(cls, body: bytes, instance: str) -> Report:
        """Out of a frame, which an FMU may have written as well.

        Raises:
            ValueError: there is anything else in it.
        """
        try:
            told = content(body)
            time, error, failed = float(told["time"]), told.get("error"), told.get("failed")
            return cls(
                time,
                told.get("result"),
                None if error is None else as_error(error, instance, time),
                {int(channel): list(values) for channel, values in told.get("texts", ())},
                None if failed is None else (int(failed[0]), as_error(failed[1], instance, time)),
            )
        except Exception as error:
            raise ValueError(f"{type(error).__name__}: {error}") from error


class Door:
    """One end of the socket.

    Args:
        end: the socket.
        wait: called after each moment of silence; without it, silence may last.
        moment: its length in s.
    """

    def __init__(self, end: socket.socket, wait: Callable[[], None] | None = None, moment: float = MOMENT) -> None:
        self._end = end
        self._wait = wait
        self._rest = bytearray()
        if wait is not None:
            end.settimeout(moment)
        if end.family != getattr(socket, "AF_UNIX", None):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, frames: bytes) -> None:
        """Ring.

        Raises:
            OSError: the other is gone.
        """
        rest = memoryview(frames)
        while rest:
            rest = rest[self._patiently(world.send_part, rest) :]

    def receive(self) -> tuple[int, bytes]:
        """The next frame.

        Raises:
            EOFError: the other is gone.
            OSError: so it is.
            ValueError: it is no frame of ours.
        """
        while len(self._rest) < FRAME.size:
            self._more(_CHUNK)
        kind, length = FRAME.unpack_from(self._rest)
        if kind not in _FRAMES:
            raise ValueError(f"no frame begins with {bytes(self._rest[:_SHOWN])!r}")
        size = FRAME.size + length
        while len(self._rest) < size:
            self._more(min(max(size - len(self._rest), _CHUNK), _LARGE))
        body = bytes(self._rest[FRAME.size : size])
        del self._rest[:size]
        return kind, body

    def _more(self, most: int) -> None:
        chunk = self._patiently(world.receive, most)
        if not chunk:
            raise EOFError
        self._rest += chunk

    def _patiently(self, act: Callable[[socket.socket, A], T], argument: A) -> T:
        while True:
            try:
                return act(self._end, argument)
            except TimeoutError:
                if self._wait is None:
                    raise
                self._wait()

    @property
    def number(self) -> int:
        """By which the system knows the socket."""
        return self._end.fileno()

    def close(self) -> None:
        """Leave."""
        self._end.close()


class Cells:
    """The values of one channel in the shared memory.

    Args:
        memory: the shared memory.
        offset: where they stand in it, in bytes.
        kind: their type: real numbers, or whole ones of 64 bits.
        count: how many there are.
    """

    def __init__(self, memory: mmap.mmap, offset: int, kind: Type, count: int) -> None:
        self._memory = memory
        self.offset, self.count = offset, count
        self._layout = struct.Struct(f"={count}{'d' if kind == 'Real' else 'q'}")

    def write(self, values: Sequence[Any]) -> bool:
        """Put values there; False if they do not fit, and must go another way."""
        try:
            self._layout.pack_into(self._memory, self.offset, *values)
        except (struct.error, OverflowError):
            return False
        return True

    def read(self) -> list[Any]:
        """The values that stand there."""
        return list(self._layout.unpack_from(self._memory, self.offset))


def memory_hint(used: float, limit: float | None) -> str:
    """A clause to append to an error when much of the memory that an FMU may use (both in KiB) is used, or nothing."""
    if limit is None or used <= _SUSPICIOUS * limit:
        return ""
    return f"; it had {used / 1024:.0f} of the {limit / 1024:.0f} MiB that memory_limit allows: a likely reason"


_KINDS: dict[str, type[FmuError]] = {kind.__name__: kind for kind in (FmuError, RollbackError, StoppedError)}


def describe(error: Exception) -> dict[str, Any]:
    """An error as plain values, for `as_error`."""
    if isinstance(error, FmuError):
        kind = next((name for name, kind in _KINDS.items() if type(error) is kind), "FmuError")
        told = {"instance": error.instance, "time": error.time, "status": error.status, "log": error.log}
        return {"kind": kind, "message": str(error.args[0]), **told}
    return {"kind": "FmuError", "message": f"{type(error).__name__}: {error}", "log": []}


def as_error(told: Mapping[str, Any], instance: str, time: float) -> FmuError:
    """The error that `describe` described, of this instance at this time in s where it does not say."""
    time_told = told.get("time", time)
    return _KINDS[told["kind"]](
        str(told["message"]),
        instance=str(told.get("instance", instance)),
        time=None if time_told is None else float(time_told),
        status=str(told.get("status", "")),
        log=[str(line) for line in told["log"]],
    )
