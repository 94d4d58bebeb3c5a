"""The process of an isolated instance as the master sees it: started, heard, brought to its end whatever it does."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from .. import world
from ..errors import cut
from ..fmi import Interface
from ..fmi.binding import plain_interface
from . import messages
from .launch import accept, end_process, signal_name, start_process, starting
from .messages import NOTE_CALL, NOTE_MEMORY, Door

PATIENCE = 60.0
"""Default wall time in s for one call, and the least for Python to start on a busy machine."""
_GRACE = 10.0
"""Wall time in s for a process to be gone once it has left: writing a large core file takes a while."""
_LINES, _LINE = 20, 500
"""How much of what it wrote is shown after a crash."""


class HostLostError(Exception):
    """The process of an instance is gone: its message says how. `log` holds the last lines it wrote."""

    def __init__(self, message: str, log: list[str]) -> None:
        super().__init__(message)
        self.log = log


class HostProcess:
    """One instance's process. It starts when this is made, and is not waited for before the first answer.

    Args:
        name: the instance's name.
        interface: its interface.
        folder: where the FMU was unpacked; files shared with the process stand beside it.
        cells: how many values the shared memory has room for.
        name_call: the name of the FMU's function that `note` speaks of.
        patience: wall time in s after which a call counts as hanging; None for the default.
        memory_limit: what the FMU may allocate, in MiB; None for half of what the machine has.
    """

    def __init__(
        self,
        name: str,
        interface: Interface,
        folder: Path,
        *,
        cells: int,
        name_call: Callable[[str, int], str],
        patience: float | None,
        memory_limit: float | None,
    ) -> None:
        self.patience = PATIENCE if patience is None else patience
        self.is_ready = False
        self._name_call = name_call
        self._limit_given = memory_limit is not None
        self._limit: int | None = None
        self._folder = Path(world.mkdtemp(prefix="host_", dir=folder.parent))
        start = {
            "path": sys.path,
            "parent": os.getpid(),
            "of_main_thread": threading.current_thread() is threading.main_thread(),
            "memory_limit": _default_limit() if memory_limit is None else memory_limit,
            "name": name,
            "folder": str(folder),
            "interface": plain_interface(interface),
        }
        world.write_bytes(self._folder / "start", messages.encoded(start))
        with world.open(self._folder / "memory", "w+b") as stream:
            stream.truncate(messages.HEAD + 8 * cells)
            self.memory = world.map_memory(stream.fileno(), 0)
        self._notes: memoryview | None = memoryview(self.memory)[: messages.HEAD].cast("q")
        with world.open(self._folder / "output", "ab") as output:
            command = [*starting("isolation.host"), str(self._folder)]
            self._process, self._end, self._password = start_process(command, output)
        self._door: Door | None = None

    @property
    def pid(self) -> int:
        """The number by which the system knows it."""
        return self._process.pid

    # ---------------------------------------------------------------- talk

    def wait_until_ready(self) -> None:
        """Wait for its sign of life.

        Raises:
            HostLostError: it does not start.
        """
        try:
            self._door = Door(
                accept(self._end, self._process, self._password, PATIENCE) if self._password else self._end
            )
        except TimeoutError as error:
            raise self._hangs() from error
        self._door.wait_at_most(max(self.patience, PATIENCE))
        _, body = self.receive()
        self._limit = messages.content(body)
        self.is_ready = True
        self._door.wait_at_most(self.patience)

    def send(self, frames: bytes) -> None:
        """Ring.

        Raises:
            HostLostError: it is gone, or does not listen.
        """
        assert self._door is not None
        try:
            self._door.send(frames)
        except TimeoutError as error:
            raise self._hangs() from error
        except OSError as error:
            raise self._is_lost() from error

    def receive(self) -> tuple[int, bytes]:
        """Its answer.

        Raises:
            HostLostError: it is gone, or does not answer; it is ended then.
        """
        assert self._door is not None
        try:
            return self._door.receive()
        except TimeoutError as error:
            raise self._hangs() from error
        except (OSError, EOFError) as error:
            raise self._is_lost() from error

    def last_call(self) -> tuple[str, int]:
        """What it is doing, or was when it was lost: a name of `messages.CALLS`, and the channel where that matters.

        An FMU may have overwritten it.
        """
        found = self._notes[NOTE_CALL] if self._notes is not None else 0
        number = found & 0xFF
        return messages.CALLS[number] if number < len(messages.CALLS) else "", found >> 8

    def _where(self) -> str:
        call, channel = self.last_call()
        return f"in {self._name_call(call, channel)}" if call else "between two calls"

    # ---------------------------------------------------------------- how it ends

    def kill(self) -> None:
        """End it, and what it has started, at once."""
        if self._process.returncode is None:
            end_process(self._process)
            self._reap(_GRACE)
        self._close()

    def wait(self) -> None:
        """Wait for the end that it was asked for."""
        if not self._reap(self.patience):
            end_process(self._process)
            self._reap(_GRACE)
        self._close()

    def _close(self) -> None:
        self._end.close()
        if self._door is not None:
            self._door.close()
        if self._notes is not None:
            self._notes.release()
            self._notes = None
            self.memory.close()

    def _lost(self, message: str) -> HostLostError:
        return HostLostError(message, self._last_lines())

    def _hangs(self) -> HostLostError:
        if world.poll(self._process) is not None:  # what it has started holds the line open
            return self._is_lost()
        end_process(self._process)
        self._reap(_GRACE)
        if not self.is_ready:
            return self._lost(f"its process did not start within {max(self.patience, PATIENCE):g} s")
        call = self._name_call(*self.last_call()) or "what it was asked for"
        return self._lost(
            f"did not return from {call} within {self.patience:g} s; its process was ended; set step_timeout to allow "
            "more wall time"
        )

    def _is_lost(self) -> HostLostError:
        """How it went: a signal, or an exit code."""
        forced = not self._reap(_GRACE)
        end_process(self._process)  # what it has started, too
        self._reap(_GRACE)
        code = self._process.returncode or 0
        if not self.is_ready:
            return self._lost(f"its process could not be started (exit code {code})")
        where = self._where()
        if forced:
            return self._lost(f"its process left {where} and was ended")
        if code == -_KILL:
            return self._lost(
                f"its process was killed {where} (SIGKILL), most likely by the system, for lack of memory"
            )
        if code < 0:
            return self._lost(f"its process crashed {where} ({signal_name(-code)}){self._hint()}")
        if code > 0xFFFF:  # as Windows tells of a crash
            return self._lost(f"its process crashed {where} (exit code {code:#x}){self._hint()}")
        return self._lost(f"its process ended {where} (exit code {code})")

    def _hint(self) -> str:
        """Whether memory may be the reason."""
        seen = self._notes[NOTE_MEMORY] if self._notes is not None else 0
        hint = messages.memory_hint(seen, self._limit)
        if hint or not self._limit_given or self._limit is None:
            return hint
        return f"; its memory_limit was {self._limit / 1024:g} MiB"

    def _reap(self, seconds: float) -> bool:
        """Wait for its end; False if it does not come."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            world.wait(self._process, seconds)
        return self._process.returncode is not None

    def _last_lines(self) -> list[str]:
        """The end of what it wrote: messages of the FMU, and what it printed."""
        with world.open(self._folder / "output", "rb") as stream:
            size = stream.seek(0, os.SEEK_END)
            stream.seek(max(0, size - _LINES * _LINE))
            lines = stream.read().decode(errors="replace").splitlines()
        return [cut(line, _LINE) for line in lines[-_LINES:]]


_KILL = 9
"""SIGKILL, which Windows has no name for."""


def _default_limit() -> float:
    """Half of the memory that the machine has, in MiB."""
    import psutil  # noqa: PLC0415 (which only those need who isolate an FMU)

    return float(psutil.virtual_memory().total) / 2**21
