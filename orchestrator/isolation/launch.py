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
from collections.abc import Iterator
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
import_module(name + "." + module).main(*sys.argv[4:])
"""
"""Starts a module without the ``__init__`` of any room, which imports what all of it needs: 0.1 s instead of 0.4 s."""

INHERITS = os.name == "posix"
"""Whether a process can be given an open socket; it connects to one where it cannot."""


def starting(module: str) -> list[str]:
    """The command, but for its arguments, that runs the ``main`` of a module of ours (``"isolation.host"``) alone."""
    orchestrator = Path(__file__).parents[1]
    package = (__package__ or "").rpartition(".")[0]
    return [sys.executable, "-u", "-P", "-c", _BOOT, package, str(orchestrator), module]


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
            # In a session of its own: a Ctrl-C in the terminal is for the master, which ends the run properly.
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


def accept(server: socket.socket, process: subprocess.Popen[bytes], password: bytes, seconds: float) -> socket.socket:
    """The connection of a process that knows the password.

    Raises:
        TimeoutError: it has not come within some time.
    """
    until = world.monotonic() + seconds
    server.settimeout(0.1)
    while world.poll(process) is None and world.monotonic() < until:
        with contextlib.suppress(OSError):
            end, _ = server.accept()
            end.settimeout(seconds)
            if secrets.compare_digest(world.receive(end, len(password), socket.MSG_WAITALL), password):
                return end
            end.close()
    if world.poll(process) is None:
        raise TimeoutError
    return socket.socket()  # not connected: its first use tells that the process is lost


def end_with_parent() -> None:
    """Let Linux end this process with the thread that has started it."""
    ctypes.CDLL(None).prctl(_KILL_WITH_PARENT, signal.SIGKILL, 0, 0, 0)


_KILL_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux's prctl."""


def end_process(process: subprocess.Popen[bytes]) -> None:
    """End a process, and what it has started: they are a group of their own, which outlives the process."""
    if sys.platform == "win32":
        with contextlib.suppress(OSError):
            world.kill(process)
        return
    with contextlib.suppress(OSError):
        world.kill_group(process.pid, signal.SIGKILL)


def signal_name(number: int) -> str:
    """``SIGSEGV`` for 11."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
