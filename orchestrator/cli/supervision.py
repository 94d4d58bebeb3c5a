"""A parent that watches over the process of a command: an FMU in it can end it, and nobody else could tell."""

from __future__ import annotations

import atexit
import math
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path

from .. import world
from ..fmi.guard import NOTES, described, share_notes
from ..isolation import CRASHES, end_with_parent, signal_name
from .documents import fail
from .options import FMU_FAILED, interrupted

_ASKING = {signal.SIGINT, signal.SIGTERM, *({signal.SIGHUP} if os.name == "posix" else ())}
"""Signals that ask for an end; `Interruption` listens to the same."""
_PASSED_ON = {*_ASKING, *({signal.SIGQUIT} if os.name == "posix" else ())}
_UNEXPECTED = 1
"""The exit code that Python has for an exception that nobody expected."""
_REMEDY = "--isolate finds the culprit, and keeps what was computed until then"
_ISOLATE = "--isolate keeps that to itself"
_TOGETHER, _PATIENCE = 0.1, 5.0
"""Signals within so many s are one; and so long after a second one the child has to end by itself."""


def supervised(command: Callable[[], int]) -> int:
    """The exit code of a command that runs in a child of this process; it is 0 only if the command says so itself.

    On other systems than Linux it runs in this process.

    Args:
        command: gives an exit code; it must have flushed what it prints.
    """
    if not sys.platform.startswith("linux"):
        return command()
    said, saying = world.pipe()
    share_notes()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    # One that is ignored, as by nohup, stays so: blocked, it would come all the same.
    awaited = {each for each in _PASSED_ON if signal.getsignal(each) != signal.SIG_IGN} | {signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
    parent = os.getpid()
    child = world.fork()
    if child == 0:
        end_with_parent()
        if os.getppid() != parent:  # gone already
            world.exit_at_once(FMU_FAILED)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        code = _UNEXPECTED
        try:
            code = command()
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        finally:
            world.write(saying, b".")
            atexit._run_exitfuncs()  # temporary folders are removed by them
            world.exit_at_once(code)
    world.close(saying)
    status, asked = _outlived(child, awaited)
    code = os.waitstatus_to_exitcode(status)
    os.set_blocking(said, False)
    try:
        if world.read(said, 1):
            return code
    except BlockingIOError:  # what it has started holds the other end
        pass
    _show_cursor()
    if code == NOTES.decided:  # by itself, after it had said why
        return code
    return _interrupted(child, asked) if asked else _untimely(child, code, before)


def _outlived(child: int, awaited: set[signal.Signals]) -> tuple[int, int]:
    """Wait for the child's end. Signals that were sent to this process alone are meant for it, too.

    Returns: how it ended, as the system says; and the signal after which it had to be ended by force, mostly 0.
    """
    asked, last, until, forced = 0, -_TOGETHER, math.inf, 0
    while True:
        left = max(0.0, until - world.monotonic())
        told = signal.sigwaitinfo(awaited) if left == math.inf else signal.sigtimedwait(awaited, left)
        if told is None:  # what it is in lets it hear nothing
            world.signal_to(child, signal.SIGKILL)
            forced, until = asked, math.inf
            continue
        if told.si_signo == signal.SIGCHLD:
            gone, status = world.wait_for(child, os.WNOHANG)
            if gone:
                return status, forced
            continue
        if told.si_code <= 0:  # from a process, not from the terminal, which tells the child itself
            world.signal_to(child, told.si_signo)
        now = world.monotonic()
        if told.si_signo in _ASKING and now - last >= _TOGETHER:
            until = now + _PATIENCE if asked else until
            asked = asked or told.si_signo
        last = now


def _show_cursor() -> None:
    """A progress bar hides it, and had no time to show it again."""
    if sys.stderr.isatty():
        sys.stderr.write("\x1b[?25h")
        sys.stderr.flush()


def _interrupted(child: int, number: int) -> int:
    """Say where the child was when it had to be ended."""
    seen = described(NOTES.under_way())
    why = f"interrupted{f': {seen} does not return' if seen else ''}"
    _conclude(child, "interrupted", why)
    return fail([f"{why}; {_ISOLATE}"], interrupted(number), sys.argv[1:])


def _conclude(child: int, status: str, why: str) -> None:
    from ..run import conclude

    if NOTES.directory:
        conclude(Path(NOTES.directory), child, status, why)


def _untimely(child: int, code: int, mask: Iterable[int]) -> int:
    """Say how the child ended, and end likewise where that was no crash."""
    name = "" if code >= 0 else signal_name(-code)
    if code >= 0 or name in CRASHES:
        what = f"ended the process (exit code {code})" if code >= 0 else f"crashed ({name})"
        seen = described(NOTES.under_way())
        why = f"{seen or 'something in the run, most likely an FMU,'} {what}"
        _conclude(child, "failed", why)
        return fail([f"{why}; {_ISOLATE if seen else _REMEDY}"], FMU_FAILED, sys.argv[1:])
    if name == "SIGKILL":
        fail(
            ["the process was killed (SIGKILL), most likely by the system, for lack of memory"],
            128 - code,
            sys.argv[1:],
        )
    else:
        signal.signal(-code, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    world.signal_to(os.getpid(), -code)
    return 128 - code
