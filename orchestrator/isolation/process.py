"""The process of an isolated instance as the master sees it: started, heard, brought to its end whatever it does."""

from __future__ import annotations

import contextlib
import mmap
import os
import pickle
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from ..fmi import Interface
from . import messages
from .messages import NOTE_CALL, NOTE_MEMORY, Door

_BOOT = """
import os, sys, types
from importlib import import_module
name, folder, module = sys.argv[1:4]
rooms = [room for room in os.listdir(folder) if os.path.isfile(os.path.join(folder, room, "__init__.py"))]
for package, path in [(name, folder), *((name + "." + room, os.path.join(folder, room)) for room in rooms)]:
    sys.modules[package] = types.ModuleType(package)
    sys.modules[package].__path__ = [path]
import_module(name + "." + module).main(*sys.argv[4:])
"""
"""Starts a module without the ``__init__`` of any room, which imports what all of it needs: 0.1 s instead of 0.4 s."""

INHERITS = os.name == "posix"
"""Whether a process can be given an open socket; it connects to one where it cannot."""
PATIENCE = 60.0
"""Default wall time in s for one call, and the least for Python to start on a busy machine."""
_GRACE = 10.0
"""Wall time in s for a process to be gone once it has left: writing a large core file takes a while."""
_LINES, _LINE = 20, 500
"""How much of what it wrote is shown after a crash."""


def starting(module: str) -> list[str]:
    """The command, but for its arguments, that runs the ``main`` of a module of ours (``"isolation.host"``) alone."""
    orchestrator = Path(__file__).parents[1]
    package = (__package__ or "").rpartition(".")[0]
    return [sys.executable, "-u", "-P", "-c", _BOOT, package, str(orchestrator), module]


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
        self._folder = Path(tempfile.mkdtemp(prefix="host_", dir=folder.parent))
        start = {
            "path": sys.path,
            "parent": os.getpid(),
            "of_main_thread": threading.current_thread() is threading.main_thread(),
            "memory_limit": _default_limit() if memory_limit is None else memory_limit,
            "name": name,
            "folder": str(folder),
            "interface": pickle.dumps(interface, pickle.HIGHEST_PROTOCOL),
        }
        (self._folder / "start").write_bytes(pickle.dumps(start))
        with (self._folder / "memory").open("w+b") as stream:
            stream.truncate(messages.HEAD + 8 * cells)
            self.memory = mmap.mmap(stream.fileno(), 0)
        self._notes: memoryview | None = memoryview(self.memory)[: messages.HEAD].cast("q")
        with (self._folder / "output").open("ab") as output:
            self._process, self._end, self._password = _start(str(self._folder), output)
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
            self._door = Door(_accept(self._end, self._process, self._password) if self._password else self._end)
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
            _kill(self._process)
            self._reap(_GRACE)
        self._close()

    def wait(self) -> None:
        """Wait for the end that it was asked for."""
        if not self._reap(self.patience):
            _kill(self._process)
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
        if self._process.poll() is not None:  # what it has started holds the line open
            return self._is_lost()
        _kill(self._process)
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
        _kill(self._process)  # what it has started, too
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
            return self._lost(f"its process crashed {where} ({_signal_name(-code)}){self._hint()}")
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
            self._process.wait(seconds)
        return self._process.returncode is not None

    def _last_lines(self) -> list[str]:
        """The end of what it wrote: messages of the FMU, and what it printed."""
        with (self._folder / "output").open("rb") as stream:
            size = stream.seek(0, os.SEEK_END)
            stream.seek(max(0, size - _LINES * _LINE))
            lines = stream.read().decode(errors="replace").splitlines()
        return [line[:_LINE] for line in lines[-_LINES:]]


_KILL = 9
"""SIGKILL, which Windows has no name for."""


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


@contextlib.contextmanager
def _closed_on_failure(end: socket.socket) -> Iterator[None]:
    try:
        yield
    except BaseException:
        end.close()
        raise


def _start(folder: str, output: IO[bytes]) -> tuple[subprocess.Popen[bytes], socket.socket, bytes]:
    """A process; and a socket to it, or one at which it will show a password."""
    command = [*starting("isolation.host"), folder]
    if INHERITS:
        near, far = socket.socketpair()
        with far, _closed_on_failure(near):
            # In a session of its own: a Ctrl-C in the terminal is for the master, which ends the run properly.
            process = subprocess.Popen(
                [*command, str(far.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                pass_fds=[far.fileno()],
                start_new_session=True,
            )
        return process, near, b""
    server = socket.create_server(("127.0.0.1", 0))
    address, port = server.getsockname()
    with _closed_on_failure(server):
        process = subprocess.Popen(
            [*command, f"{address}:{port}"],
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=output,
            creationflags=_new_group(),
            start_new_session=sys.platform != "win32",
        )
    password = secrets.token_hex(16).encode()
    assert process.stdin is not None
    with contextlib.suppress(OSError), process.stdin as pipe:
        pipe.write(password + b"\n")
    return process, server, password


def _new_group() -> int:
    """What keeps a Ctrl-C from a process on Windows."""
    if sys.platform == "win32":
        return subprocess.CREATE_NEW_PROCESS_GROUP
    return 0


def _accept(server: socket.socket, process: subprocess.Popen[bytes], password: bytes) -> socket.socket:
    """The connection of a process that knows the password."""
    until = time.monotonic() + PATIENCE
    server.settimeout(0.1)
    while process.poll() is None and time.monotonic() < until:
        with contextlib.suppress(OSError):
            end, _ = server.accept()
            end.settimeout(PATIENCE)
            if secrets.compare_digest(end.recv(len(password), socket.MSG_WAITALL), password):
                return end
            end.close()
    if process.poll() is None:
        raise TimeoutError
    return socket.socket()  # not connected: its first use tells that the process is lost


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End a process, and what it has started: they are a group of their own."""
    if sys.platform == "win32":
        with contextlib.suppress(OSError):
            process.kill()
        return
    with contextlib.suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)


def _default_limit() -> float | None:
    """Half of the memory that the machine has, in MiB; None where nobody tells."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**21
    except (AttributeError, ValueError, OSError):
        return None
