"""Processes of our own: started with little of the package, given a socket, ended with all they have started."""

from __future__ import annotations

import contextlib
import ctypes
import os
import secrets
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from .. import world

_BOOT = """
import os, sys, types
from importlib import import_module
name, folder, module = sys.argv[1:4]
rooms = [room for room in os.listdir(folder) if os.path.isfile(os.path.join(folder, room, "__init__.py"))]
for package, path in [(name, folder), *((name + "." + room, os.path.join(folder, room)) for room in rooms)]:
    sys.modules[package] = types.ModuleType(package)
    sys.modules[package].__path__ = [path]
import_module(name + ".isolation.guard").run(import_module(name + "." + module), *sys.argv[4:])
"""
"""Starts a module without the ``__init__`` of any room, which imports what all of it needs: 0.1 s instead of 0.4 s."""

MOMENT = 0.25
"""Wall time in s after which whoever waits for a process looks up, and may give up."""
GRACE = 10.0
"""Wall time in s for a process to be gone once it has left: writing a large core file takes a while."""
_PASSWORD_SECONDS = 5.0
INHERITS = os.name == "posix"
"""Whether a process can be given an open socket; it connects to one where it cannot."""


def starting(module: str) -> list[str]:
    """The command, but for its arguments, that runs a module of ours (``"isolation.host"``) alone, and guarded."""
    orchestrator = Path(__file__).parents[1]
    package = (__package__ or "").rpartition(".")[0]
    return [sys.executable, "-u", "-P", "-c", _BOOT, package, str(orchestrator), module, str(os.getpid())]


@contextlib.contextmanager
def _closed_on_failure(end: socket.socket) -> Iterator[None]:
    try:
        yield
    except BaseException:
        end.close()
        raise


def start_process(command: list[str], output: IO[bytes]) -> tuple[subprocess.Popen[bytes], socket.socket, bytes]:
    """A process; and a socket to it, or one at which it will show a password (empty where it needs none).

    Args:
        command: to which the way to the socket is added: its number, or ``"host:port"`` of one to connect to.
        output: where all that the process prints goes.
    """
    if INHERITS:
        near, far = world.socketpair()
        with far, _closed_on_failure(near):
            # In a session of its own: a Ctrl-C in the terminal is for the master, which ends the run in order.
            process = world.start(
                [*command, str(far.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                pass_fds=[far.fileno()],
                start_new_session=True,
            )
        return process, near, b""
    server = world.create_server(("127.0.0.1", 0))
    address, port = server.getsockname()
    with _closed_on_failure(server):
        process = world.start(
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


def accept(
    server: socket.socket,
    process: subprocess.Popen[bytes],
    password: bytes,
    wait: Callable[[], None],
    moment: float,
) -> socket.socket:
    """The connection of a process that knows the password.

    Args:
        server: where it connects to.
        process: the process.
        password: what it shows.
        wait: called after each moment without a connection.
        moment: its length in s.
    """
    server.settimeout(moment)
    while world.poll(process) is None:
        try:
            end, _ = server.accept()
        except TimeoutError:
            wait()
            continue
        end.settimeout(_PASSWORD_SECONDS)
        with contextlib.suppress(OSError):
            if secrets.compare_digest(world.receive(end, len(password), socket.MSG_WAITALL), password):
                return end
        end.close()
    return socket.socket()  # not connected: its first use tells that the process is lost


def end_with_parent() -> None:
    """Let Linux end this process with the thread that has started it."""
    ctypes.CDLL(None).prctl(_KILL_WITH_PARENT, signal.SIGKILL, 0, 0, 0)


_KILL_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux's prctl."""


def end_process(process: subprocess.Popen[bytes]) -> None:
    """End a process, and what it has started: its guard sees to that, and is ended itself if it does not."""
    with contextlib.suppress(OSError):
        process.terminate()
        if sys.platform != "win32":
            process.send_signal(signal.SIGCONT)  # an FMU may have stopped its parent
        with contextlib.suppress(subprocess.TimeoutExpired):
            world.wait(process, GRACE)
        world.kill(process)
        world.wait(process, GRACE)


CRASHES = ("SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL", "SIGABRT", "SIGTRAP", "SIGSYS")
"""Names of signals that tell of a fault of the program, not of somebody's wish."""


def signal_name(number: int) -> str:
    """``SIGSEGV`` for 11."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
