"""A process of isolated instances as the master sees it: started, heard, brought to its end whatever they do."""

from __future__ import annotations

import contextlib
import struct
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import world
from ..errors import cut
from ..fmi.binding import plain_interface
from . import messages
from .lanes import LANE_SIZE, lane, layout, spin_time
from .launch import CRASHES, GRACE, MOMENT, accept, end_process, signal_name, start_process, starting
from .messages import NOTE_CALL, NOTE_LINE, NOTE_MEMORY, NOTE_TIME, Door
from .seats import Guest, HostLostError, Seated

PATIENCE = 60.0
"""Default wall time in s for one call, and the least for Python to start on a busy machine."""
LAST_PATIENCE = 10.0
"""The wall time in s that an instance's calls may take, all together, once the run is to stop."""
_NAMES = 5
"""How many of those that shared it are named."""
_LINES, _LINE = 20, 500
"""How much of what it wrote is shown after a crash."""


class HostProcess:
    """The process of one instance or more. It starts when this is made, and is not waited for before the first answer.

    Args:
        guests: who lives in it; files shared with it stand beside the folder of the first.
        patience: wall time in s after which a call counts as hanging; None for the default.
        memory_limit: what may be allocated there, in MiB; None for half of what the machine has.
        stopped: whether the run is to stop; calls are given `LAST_PATIENCE` from then on.

    Attributes:
        seated: those who live in it, as the master has them; the number of a seat is that of the guest.
        begins: where their parts of the memory begin, in bytes.
        is_riding: whether it takes calls from the lane, and no messages.
    """

    def __init__(
        self,
        guests: Sequence[Guest],
        *,
        patience: float | None,
        memory_limit: float | None,
        stopped: Callable[[], bool] | None = None,
    ) -> None:
        self.patience = PATIENCE if patience is None else patience
        self.is_ready = False
        self._stopped = stopped
        self._is_over = False
        self._moment = min(MOMENT, self.patience)
        self._left, self._last_left = max(self.patience, PATIENCE), LAST_PATIENCE
        """Wall time in s that the present call may still take; that all calls may, once the run is to stop."""
        self.seated: list[Seated] = []
        self._left_seats = len(guests)
        self._inboxes: list[deque[tuple[int, bytes]]] = [deque() for _ in guests]
        self._expecting = deque(range(len(guests)))
        """Whose answers are under way, in the order in which they come: first, how each was instantiated."""
        self._unread = 0
        """Bytes that were sent since no answer was under way."""
        self._told_seat = self._asked = 0
        """Whom frames are for; who was asked last."""
        self._limit_given = memory_limit is not None
        self._limit: int | None = None
        self._folder = Path(world.mkdtemp(prefix="host_", dir=guests[0].folder.parent))
        *self.begins, self._lane_offset = layout(guest.room for guest in guests)
        start = {
            "path": sys.path,
            "memory_limit": _default_limit() if memory_limit is None else memory_limit,
            "guests": [
                {"name": name, "folder": str(folder), "interface": plain_interface(interface), "begin": begin}
                for (name, interface, folder, *_), begin in zip(guests, self.begins, strict=True)
            ],
        }
        self._door: Door | None = None
        self.lane: lane.Lane | None = None
        self.is_riding = False
        try:
            world.write_bytes(self._folder / "start", messages.encoded(start))
            # Zeros, not a hole: where the disk is full, whoever fills one is killed, and that may be the master.
            world.write_bytes(self._folder / "memory", bytes(self._lane_offset + LANE_SIZE))
            with world.open(self._folder / "memory", "r+b") as stream:
                self.memory = world.map_memory(stream.fileno(), 0)
            self._notes: memoryview | None = memoryview(self.memory)[: self._lane_offset].cast("q")
            with world.open(self._folder / "output", "ab") as output:
                command = [*starting("isolation.host"), str(self._folder)]
                self._process, self._end, self._password = start_process(command, output)
        except OSError as error:
            error.filename = error.filename or str(self._folder)
            world.rmtree(self._folder, ignore_errors=True)
            raise
        self.pid = self._process.pid
        """The number by which the system knows it; until it is ready, that of its guard."""

    # ---------------------------------------------------------------- talk

    def wait_until_ready(self) -> None:
        """Wait for its sign of life, unless it has given one.

        Raises:
            HostLostError: it does not start.
        """
        if self.is_ready:
            return
        end = (
            accept(self._end, self._process, self._password, self._wait, self._moment) if self._password else self._end
        )
        self._door = Door(end, self._wait, self._moment)
        _, body = self._told(self._door.receive)
        try:
            limit, pid = messages.content(body)
            self._limit, self.pid = None if limit is None else int(limit), int(pid)
        except (ValueError, TypeError) as error:
            raise self.garbled(error) from error
        self.is_ready = True

    def send(self, seat: int, frames: bytes) -> None:
        """Ring for one instance, of which an answer is to come.

        Raises:
            HostLostError: it is gone, or does not listen.
        """
        self._asked = seat
        is_much = len(self._expecting) >= _MOST_EXPECTED or self._unread + len(frames) > _MOST_UNREAD
        if self._expecting and is_much:  # lest both wait for the other to listen
            self._collect()
        if seat != self._told_seat:
            frames = messages.frame(messages.SEAT, seat) + frames
            self._told_seat = seat
        self._unread = len(frames) + (self._unread if self._expecting else 0)
        self._send(frames)
        self._expecting.append(seat)

    def _send(self, frames: bytes) -> None:
        assert self._door is not None
        self._left = self.patience
        try:
            self._door.send(frames)
        except OSError as error:
            raise self._is_lost() from error

    def receive(self, seat: int) -> tuple[int, bytes]:
        """The answer to one instance; those to others, which come before, are kept for them.

        Raises:
            HostLostError: it is gone, or does not answer; it is ended then.
        """
        self._asked = seat
        while not self._inboxes[seat]:
            self._receive()
        return self._inboxes[seat].popleft()

    def _receive(self) -> None:
        assert self._door is not None
        self._left = self.patience
        self._inboxes[self._expecting.popleft()].append(self._told(self._door.receive))

    def _collect(self) -> None:
        while self._expecting:
            self._receive()

    def _told(self, receive: Callable[[], tuple[int, bytes]]) -> tuple[int, bytes]:
        try:
            return receive()
        except ValueError as error:
            raise self.garbled(error) from error
        except (OSError, EOFError) as error:
            raise self._is_lost() from error

    def garbled(self, error: Exception) -> HostLostError:
        """How it is lost that sends what cannot be read, most likely because an FMU writes there; it is ended."""
        end_process(self._process)
        return self._lost(f"its process sends what cannot be read ({error}) and was ended")

    def _wait(self) -> None:
        """A moment has passed in silence; counted, because a clock runs on while the master is suspended (Ctrl-Z)."""
        if self._is_over:  # and what it has started holds the line open
            raise self._is_lost()
        self._is_over = world.poll(self._process) is not None  # its last answer may have come since
        self._left -= self._moment
        if self._stopped is not None and self._stopped():
            self._last_left -= self._moment
        if min(self._left, self._last_left) <= 0.0:
            raise self._hangs()

    def note(self, which: int, seat: int = 0) -> int:
        """One of its notes, by number, of an instance."""
        return self._notes[self.begins[seat] // 8 + which] if self._notes is not None else 0

    # ---------------------------------------------------------------- the lane

    def open_lane(self) -> lane.Lane:
        """The way by which the compiled step loop calls it, once it is ready."""
        if self.lane is None:
            assert self._door is not None
            line, spin = self._door.number, spin_time()
            self.lane = lane.Lane(self.memory, self._lane_offset, line, self._moment, spin, self._keep_waiting)
        return self.lane

    def _keep_waiting(self, seat: int) -> None:
        self.seated[seat].await_lane()

    def enter_lane(self) -> None:
        """Let it take calls from there.

        Raises:
            HostLostError: it is gone, or does not listen.
        """
        if not self.is_riding:
            self._collect()  # whoever waits at the lane takes what there is to hear for its end
            self._send(messages.frame(messages.RIDE, None))
            self.is_riding = True

    def leave_lane(self) -> None:
        """Let it take messages again; what it is asked then is asked at the times that its instances have."""
        if self.is_riding:
            assert self.lane is not None
            self.is_riding = False
            for begin, seated in zip(self.begins, self.seated, strict=True):
                struct.pack_into("=d", self.memory, begin + 8 * NOTE_TIME, seated.time)
            self.lane.leave()

    def await_lane(self, seat: int) -> None:
        """Wait for all that is under way there, for one instance; each call may take its time.

        Raises:
            HostLostError: it is gone, or does not come to an end; it is ended then.
        """
        assert self.lane is not None
        self._asked, self._left = seat, self.patience - self._moment  # which has passed before
        done = self.lane.done()
        while (how := self.lane.wait(self._moment)) != lane.CAME:
            if how == lane.CLOSED:
                self.lane.leave()  # so that it sees that, where it only has lost its line
                raise self._is_lost()
            if done != (done := self.lane.done()):
                self._left = self.patience
            self._wait()

    def culprit(self) -> int:
        """The seat of whom it calls, or called when it was lost; if that is nobody, of whom it was asked for last."""
        seats = range(len(self.begins))
        return next((seat for seat in seats if self.note(NOTE_CALL, seat)), self._asked)

    def last_call(self) -> tuple[str, int, int]:
        """What it is doing, or was when it was lost, as `messages.noted` has it."""
        return messages.noted(self.note(NOTE_CALL, self.culprit()))

    def _where(self) -> str:
        call = self._called()
        return f"in {call}" if call else "between two calls"

    def _called(self) -> str:
        call, *which = self.last_call()
        return self.seated[self.culprit()].name_call(call, *which) if call else ""

    # ---------------------------------------------------------------- how it ends

    def leave(self) -> bool:
        """Give a seat back: whether it was the last, with which the process is to end."""
        self._left_seats -= 1
        return not self._left_seats

    def kill(self) -> None:
        """End it, and what it has started, at once."""
        if self._process.returncode is None:
            end_process(self._process)
        self._close()

    def wait(self) -> None:
        """Wait for the end that it was asked for."""
        if not self._reap():
            end_process(self._process)
        self._close()

    def _close(self) -> None:
        self._end.close()
        if self.lane is not None:
            self.lane.close()
        if self._door is not None:
            self._door.close()
        if self._notes is not None:
            self._notes.release()
            self._notes = None
            self.memory.close()
            world.rmtree(self._folder, ignore_errors=True)

    def _lost(self, message: str, *, is_stopped: bool = False) -> HostLostError:
        seat = self.culprit()
        others = [one.name for k, one in enumerate(self.seated) if k != seat]
        if others and self.is_ready:
            names = others if len(others) <= _NAMES else [*others[: _NAMES - 1], f"{len(others) - _NAMES + 1} more"]
            message += f"; it was the process of {', '.join(names)} as well"
        return HostLostError(message, seat, self._last_lines(), is_stopped=is_stopped)

    def _hangs(self) -> HostLostError:
        end_process(self._process)
        is_stopped = self._last_left <= 0.0
        if not self.is_ready and not is_stopped:
            return self._lost(f"its process did not start within {max(self.patience, PATIENCE):g} s")
        call = self._called() or "what it was asked for"
        told = f"did not return from {call} within"
        if is_stopped:
            told = f"{told} {LAST_PATIENCE:g} s after the run was to stop; its process was ended"
        else:
            told = f"{told} {self.patience:g} s; its process was ended; set step_timeout to allow more wall time"
        return self._lost(told, is_stopped=is_stopped)

    def _is_lost(self) -> HostLostError:
        """How it went: a signal, or an exit code."""
        forced = not self._reap()
        if forced:
            end_process(self._process)
        code = self._process.returncode or 0
        if not self.is_ready:
            return self._lost(f"its process could not be started (exit code {code})")
        where = self._where()
        if self.note(NOTE_LINE):
            how = f"lost its line to the master {where} or before: the FMU closes descriptors that are not its own"
        elif forced:
            how = f"left {where} and was ended"
        elif code == -_KILL:
            how = f"was killed {where} (SIGKILL), most likely by the system, for lack of memory"
        elif code < 0 and signal_name(-code) not in CRASHES:
            how = f"was ended {where} by a signal ({signal_name(-code)})"
        elif code < 0:
            how = f"crashed {where} ({signal_name(-code)}){self._hint()}"
        elif code > 0xFFFF:  # as Windows tells of a crash
            how = f"crashed {where} (exit code {code:#x}){self._hint()}"
        else:
            how = f"ended {where} (exit code {code})"
        return self._lost(f"its process {how}")

    def _hint(self) -> str:
        """Whether memory may be the reason."""
        hint = messages.memory_hint(self.note(NOTE_MEMORY), self._limit)
        if hint or not self._limit_given or self._limit is None:
            return hint
        return f"; its memory_limit was {self._limit / 1024:g} MiB"

    def _reap(self) -> bool:
        """Wait for its end; False if it does not come."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            world.wait(self._process, GRACE)
        return self._process.returncode is not None

    def _last_lines(self) -> list[str]:
        """The end of what it wrote: messages of the FMU, and what it printed."""
        try:
            said = world.read_bytes(self._folder / "output")
        except OSError:  # an FMU may remove whatever it likes
            return []
        lines = said[-_LINES * _LINE :].decode(errors="replace").splitlines()
        return [cut(line, _LINE) for line in lines[-_LINES:]]


_MOST_UNREAD, _MOST_EXPECTED = 1 << 12, 64
"""Bytes that may be sent before an answer is read, and answers that may be under way: less than a socket holds, on
either side. It counts what it keeps of each message as well: a few hundred small ones fill it."""
_KILL = 9
"""SIGKILL, which Windows has no name for."""


def _default_limit() -> float:
    """Half of the memory that the machine has, in MiB."""
    import psutil

    return float(psutil.virtual_memory().total) / 2**21
