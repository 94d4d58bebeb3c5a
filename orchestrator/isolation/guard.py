"""A parent for a process that runs the code of others: it hears what that prints, and ends all that it leaves behind.

The process that is started forks. The child does the work, in a session of its own. Its parent stays clear of the work:
it keeps the last of what is printed, whoever prints it; ends the child when the master wants it or is gone; then ends
whoever the child has started, and ends as the child did. What the child does to its own descriptors, limits, signals or
folder touches nothing of that.

On Linux all descendants are found, also those in a session of their own whose parents are gone; on other POSIX systems
those of the child's group, and the children of children that live. On Windows there is no such parent.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import psutil

from .. import world
from ..leftovers import remove_where_abandoned
from .launch import end_with_parent

LOOK_SECONDS = 0.25
"""How often the master and the process are looked after."""
_KEPT = 1 << 14
"""Bytes of what was printed last that are kept."""
_CHUNK = 1 << 20
_PAUSE = 0.002
"""Wall time in s in which what is printed gathers: who prints a lot by small lines is not woken up for each of them."""
_GRACE = 5.0
"""Wall time in s for processes to be gone that were killed."""
_HIGH = 4096
"""Descriptors of ours stand just below this number: a program that closes all it knows of may not come so far, and one
that does will not open so many of its own that one gets the number of ours."""

Look = Callable[[int], None]
"""Called now and then with the number of the process that does the work."""


def run(module: Any, master: str, *arguments: str) -> None:
    """Do the work of a module, watched over.

    Args:
        module: its ``main`` does the work; its ``watching``, if it has one, gives a `Look`.
        master: the number of the process that has started this one.
        arguments: of ``main`` and of ``watching``; the first is a path in the workspace of the master.
    """
    if sys.platform == "win32":
        _keep_line(1)
        threading.Thread(target=_leave_with, args=(int(master),), daemon=True).start()
        module.main(*arguments)
        return
    wake, bell = world.pipe()
    os.set_blocking(bell, False)
    for number in (signal.SIGCHLD, signal.SIGTERM):
        signal.signal(number, _ring)
    signal.set_wakeup_fd(bell)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(_ADOPT, 1, 0, 0, 0)
    heard, saying = world.pipe()
    _widen(heard)
    guard = os.getpid()
    child = world.fork()
    if child == 0:
        signal.set_wakeup_fd(-1)
        for end in (wake, bell, heard):
            world.close(end)
        _begin(guard, saying)
        module.main(*arguments)
        return
    look = module.watching(*arguments) if hasattr(module, "watching") else _look_away
    _close_all_but(0, 1, 2, wake, bell, heard)  # the master's line, above all: the child alone is to hold it
    _Guard(child, int(master), look, heard=heard, wake=wake).stand(Path(arguments[0]))


def say(line: str) -> None:
    """Print a line that outlives this process, wherever standard output leads by now."""
    with contextlib.suppress(OSError):
        if _identity(_line) == _line_identity:
            world.write(_line, f"{line}\n".encode(errors="replace"))


def high(descriptor: int) -> int:
    """The same under a number that nobody meets by chance, and not inherited; the given one is closed."""
    if sys.platform == "win32":
        return descriptor
    import fcntl  # noqa: PLC0415 (not on Windows)
    import resource  # noqa: PLC0415

    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    first = (_HIGH if limit == resource.RLIM_INFINITY else min(limit, _HIGH)) - 16
    found = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, max(3, first))
    world.close(descriptor)
    return found


_line = 1
_line_identity: tuple[int, int] = (0, 0)
_EXITING = 0x4
"""PF_EXITING of Linux."""
_ADOPT = 36
"""PR_SET_CHILD_SUBREAPER of Linux's prctl."""


def _ring(*_: object) -> None:
    """A signal wakes the guard by its descriptor."""


def _look_away(_: int) -> None:
    """There is nothing to see."""


def _identity(descriptor: int) -> tuple[int, int]:
    status = os.fstat(descriptor)
    return status.st_dev, status.st_ino


def _widen(pipe: int) -> None:
    """Let as much stand in a pipe as is read at once, where the system can do that."""
    import fcntl  # noqa: PLC0415 (not on Windows)

    with contextlib.suppress(OSError, AttributeError):
        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _CHUNK)


def _close_all_but(*kept: int) -> None:
    for descriptor in {*map(int, world.listdir("/dev/fd"))} - {*kept}:  # how many there may be is a large number
        with contextlib.suppress(OSError):  # the one by which they were listed
            world.close(descriptor)


def _keep_line(descriptor: int) -> None:
    """Let `say` print by this descriptor, whatever becomes of standard output."""
    global _line, _line_identity
    _line, _line_identity = descriptor, _identity(descriptor)


def _begin(guard: int, saying: int) -> None:
    """Make the child what the work expects: it prints to the guard, and ends with it."""
    os.setsid()
    for number in (signal.SIGCHLD, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    if sys.platform.startswith("linux"):
        end_with_parent()
    if os.getppid() != guard:  # gone already
        world.exit_at_once(1)
    os.dup2(saying, 1)
    os.dup2(saying, 2)
    _keep_line(high(saying))


class _Guard:
    """Watches over a child.

    Args:
        child: its number.
        master: the number of the process that has started this one.
        look: called now and then.
        heard: the descriptor where all that is printed arrives.
        wake: the descriptor where signals ring.
    """

    def __init__(self, child: int, master: int, look: Look, *, heard: int, wake: int) -> None:
        self._child, self._master, self._look = child, master, look
        self._heard, self._wake = heard, wake
        self._status: int | None = None
        self._said = b""

    def stand(self, inside: Path) -> NoReturn:
        """Watch until the end, and end as the child did.

        Args:
            inside: a path in the workspace of the master, which is removed if the master could not do it.
        """
        is_wanted = self._watch()
        is_alone = self._is_alone()
        self._end_all()
        while self._hear():
            pass
        with contextlib.suppress(OSError):
            world.write(1, self._said)
        if is_alone:
            remove_where_abandoned(inside)
        _end_as(os.waitstatus_to_exitcode(self._status or 0) if is_wanted else -signal.SIGTERM)

    def _is_alone(self) -> bool:
        """Whether the master is gone. One that is going has given up its line to the child, but not yet its place."""
        until = world.monotonic() + _GRACE
        while os.getppid() == self._master:
            if not _is_going(self._master) or world.monotonic() > until:
                return False
            world.sleep(0.01)
        return True

    def _watch(self) -> bool:
        """Wait for the child's end, or that of the master; False where it was the master's wish."""
        waiting, next_look = [self._heard, self._wake], 0.0
        while True:
            ready, _, _ = select.select(waiting, [], [], LOOK_SECONDS)
            if self._heard in ready:
                world.sleep(_PAUSE)
                if not self._hear():
                    waiting.remove(self._heard)
            if self._wake in ready and signal.SIGTERM in world.read(self._wake, _CHUNK):
                return False
            self._reap()
            if self._status is not None or os.getppid() != self._master:
                return True
            if world.monotonic() >= next_look:
                self._look(self._child)
                next_look = world.monotonic() + LOOK_SECONDS

    def _hear(self) -> bool:
        """Keep the last of what there is to hear; False if nobody is left who speaks."""
        try:
            said = world.read(self._heard, _CHUNK)
        except BlockingIOError:  # somebody is left, but silent
            return False
        self._said = (self._said + said)[-_KEPT:]
        return bool(said)

    def _reap(self) -> bool:
        """Note who has ended; False if nobody is left."""
        with contextlib.suppress(ChildProcessError):
            while True:
                ended, status = world.wait_for(-1, os.WNOHANG)
                if ended == self._child:
                    self._status = status
                if not ended:
                    return True
        return False

    def _end_all(self) -> None:
        """End the child, whoever it has started, and whoever they start meanwhile."""
        until = world.monotonic() + _GRACE
        os.set_blocking(self._heard, False)
        with contextlib.suppress(OSError):
            world.kill_group(self._child, signal.SIGKILL)
        while self._reap() and world.monotonic() < until:
            for one in psutil.Process().children(recursive=True):
                with contextlib.suppress(psutil.Error):
                    one.kill()
            world.sleep(0.01)


def _is_going(process: int) -> bool:
    """Whether Linux is about to end a process."""
    try:
        told = world.read_text(Path(f"/proc/{process}/stat")).rpartition(")")[2].split()
        return bool(int(told[6]) & _EXITING)
    except (OSError, LookupError, ValueError):  # gone by now, or another system
        return False


def _end_as(code: int) -> NoReturn:
    """End this process as another did, but for its core file."""
    if code < 0:
        if sys.platform.startswith("linux"):
            ctypes.CDLL(None).prctl(_DUMPABLE, 0, 0, 0, 0)
        with contextlib.suppress(OSError):  # SIGKILL has no handler
            signal.signal(-code, signal.SIG_DFL)
        world.signal_to(os.getpid(), -code)
    world.exit_at_once(code)


_DUMPABLE = 4
"""PR_SET_DUMPABLE of Linux's prctl."""


def _leave_with(master: int) -> None:  # pragma: no cover: it is for Windows
    """End this process with the master, even inside a long call."""
    with contextlib.suppress(psutil.NoSuchProcess):
        process = psutil.Process(master)
        while process.is_running():
            world.sleep(LOOK_SECONDS)
    world.exit_at_once(1)
