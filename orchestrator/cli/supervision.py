"""A parent that watches over the process of a command: an FMU in it can end it, and nobody else could tell."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable

from .. import world
from ..isolation import CRASHES, end_with_parent, signal_name
from .options import FMU_FAILED
from .printing import tell

_PASSED_ON = {signal.SIGINT, signal.SIGTERM, *({signal.SIGHUP, signal.SIGQUIT} if os.name == "posix" else ())}
_UNEXPECTED = 1
"""The exit code that Python has for an exception that nobody expected."""
_REMEDY = "--isolate finds the culprit, and keeps what was computed until then"


def supervised(command: Callable[[], int]) -> int:
    """The exit code of a command that runs in a child of this process; it is 0 only if the command says so itself.

    On other systems than Linux it runs in this process.

    Args:
        command: gives an exit code; it must have flushed what it prints.
    """
    if not sys.platform.startswith("linux"):
        return command()
    said, saying = world.pipe()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    awaited = {*_PASSED_ON, signal.SIGCHLD}
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
    code = os.waitstatus_to_exitcode(_outlived(child, awaited))
    os.set_blocking(said, False)
    try:
        if world.read(said, 1):
            return code
    except BlockingIOError:  # what it has started holds the other end
        pass
    return _untimely(code, before)


def _outlived(child: int, awaited: set[signal.Signals]) -> int:
    """Wait for the child's end. Signals that were sent to this process alone are meant for it, too."""
    while True:
        told = signal.sigwaitinfo(awaited)
        if told.si_signo == signal.SIGCHLD:
            gone, status = world.wait_for(child, os.WNOHANG)
            if gone:
                return status
        elif told.si_code <= 0:  # from a process, not from the terminal, which tells the child itself
            world.signal_to(child, told.si_signo)


def _untimely(code: int, mask: Iterable[int]) -> int:
    """Say how the child ended, and end likewise where that was no crash."""
    if code >= 0:
        tell(f"error: something in the run, most likely an FMU, ended the process (exit code {code}); {_REMEDY}")
        return FMU_FAILED
    name = signal_name(-code)
    if name in CRASHES:
        tell(f"error: something in the run, most likely an FMU, crashed ({name}); {_REMEDY}")
        return FMU_FAILED
    if name == "SIGKILL":
        tell("error: the process was killed (SIGKILL), most likely by the system, for lack of memory")
    else:
        signal.signal(-code, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    world.signal_to(os.getpid(), -code)
    return 128 - code
