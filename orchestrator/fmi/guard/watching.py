"""FMUs' functions as they are called here: noted, and with a way back where the FMU ends the process instead."""

from __future__ import annotations

import ctypes
import logging
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from ...errors import FmuError
from .notes import NOTES, described

try:
    from . import calls
except ImportError:  # installed without a C compiler
    calls = None  # type: ignore[assignment]

_LOG = logging.getLogger(__name__)
GUARD: int = 0 if calls is None else calls.GUARD
"""Where the compiled step loop finds what it needs of this; 0 for nothing."""
ENDED = 3
"""The exit code of a process that an FMU has ended."""
_WAYS = {1: "exit({})", 2: "_exit({})", 3: "quick_exit({})", 4: "abort()", 5: "pthread_exit()"}
_LOADING, _UNLOADING = 1, 2
"""Numbers that stand for what is no function: they are no addresses."""


_NONE = (1 << 31) - 1
"""More libraries than there can be."""


class Owner(Protocol):
    """An instance, as far as it matters here."""

    name: str
    time: float

    def lose(self, what: str) -> FmuError:
        """It must not be called any more: the error that says so."""


_OPEN: Any = None
_CLOSE: Any = None
_AT_ONCE = 2
"""RTLD_NOW, as Python asks for."""
if sys.platform.startswith("linux"):
    _OPEN, _CLOSE = (ctypes.CDLL(None)[name] for name in ("dlopen", "dlclose"))
    _OPEN.restype, _OPEN.argtypes = ctypes.c_void_p, (ctypes.c_char_p, ctypes.c_int)
    _CLOSE.restype, _CLOSE.argtypes = ctypes.c_int, (ctypes.c_void_p,)

_LIVING: dict[int, Owner] = {}
_NUMBERS: dict[int, list[int]] = {}
"""Of each owner, by its own number, those that stand for it."""
_FUNCTIONS: dict[int, str] = {}
"""The functions of loaded libraries by their address."""
_WILLS: list[Callable[[FmuError], None]] = []


def _begin() -> None:
    calls.attach(NOTES.memory, *NOTES.place)


def _begin_anew() -> None:
    NOTES.begin_anew()
    _begin()
    calls.renew()


def _gone(instance: int, function: int, way: int, code: int) -> FmuError:
    """The error of a call that was left."""
    what = said(NOTES.seen(instance, function, 0.0).call or "it", way, code)
    owner = _LIVING.get(instance)
    return FmuError(what) if owner is None else owner.lose(what)


def _speak(instance: int, function: int, time: float, way: int, code: int) -> None:
    """Save what can be saved, and say who has ended the process: it ends when this returns."""
    seen = NOTES.seen(instance, function, time)
    who = described([seen]) if seen.instance else "an FMU"
    message = f"{who} called {_WAYS[way].format(code)}, which ended the process"
    error = FmuError(message, instance=seen.instance, time=seen.time)
    for will in reversed(_WILLS):
        try:
            will(error)
        except Exception:
            _LOG.exception("what was computed could not be saved")
    _LOG.error("%s; isolate it to keep that to itself", message)
    end_streams()
    NOTES.decide(ENDED)


if calls is not None:
    _begin()
    calls.set_will(_gone, _speak)
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_begin_anew)


def stand_aside() -> None:
    """From now on leave calls as they are: in a process that an FMU may end."""
    global calls  # noqa: PLW0603
    calls = None  # type: ignore[assignment]


def said(call: str, way: int, code: int) -> str:
    """What happened in a call that was left."""
    return f"{call} called {_WAYS[way].format(code)}, which would have ended the process"


def end_streams() -> None:
    """Bring what was printed to where it goes."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()


def share_notes() -> None:
    """Share the notes with the next process that is forked."""
    NOTES.share()
    if calls is not None:
        _begin()


# -------------------------------------------------------------------- libraries, functions and instances


def guarded(function: Any, address: int, name: str) -> Any:
    """A function of a library, as ctypes has it, guarded."""
    if calls is None:
        return function
    _FUNCTIONS[address] = name
    NOTES.tell(address, name)
    return calls.Call(function, address, name.endswith("DoStep"))


@contextmanager
def loading(path: Path) -> Iterator[None]:
    """Load a library, which is watched over from then on, with all others that it brings along.

    What it does first of all is done here, while others use the interpreter: Python keeps it to itself meanwhile.
    """
    if calls is None:
        yield
        return
    count = calls.watch(_NONE)
    early = _OPEN(os.fsencode(path), _AT_ONCE) if _OPEN is not None else None
    try:
        yield
    finally:
        if early:
            _CLOSE(early)
    calls.watch(count)


def unload(handle: int, addresses: Iterable[int]) -> None:
    """Take a library out of memory, while others use the interpreter, too.

    Args:
        handle: of the library.
        addresses: of its functions.
    """
    for address in addresses:
        _FUNCTIONS.pop(address, None)
    if _CLOSE is None:
        import fmpy  # noqa: PLC0415 (a parent that waits for a command to end takes no library out)

        fmpy.freeLibrary(handle)
    else:
        _CLOSE(handle)


@contextmanager
def noted(owner: Owner, call: str) -> Iterator[None]:
    """Whatever happens meanwhile is this instance's doing, though none of its functions is called.

    Args:
        owner: the instance.
        call: what is done: "loading" or "unloading".
    """
    if calls is None:
        yield
        return
    number = {"loading": _LOADING, "unloading": _UNLOADING}[call]
    NOTES.tell(number, f"{call} its library")
    before = calls.begin(id(owner), number)
    try:
        yield
    finally:
        calls.begin(*before)


def introduce(number: int, owner: Owner, model: str) -> None:
    """Say for which instance a number stands in the notes: its address."""
    _LIVING[number] = owner
    _NUMBERS.setdefault(id(owner), []).append(number)
    NOTES.tell(number, owner.name, model)


def dismiss(owner: Owner) -> None:
    """Forget an instance."""
    for number in _NUMBERS.pop(id(owner), ()):
        if _LIVING.get(number) is owner:
            del _LIVING[number]
    if not _LIVING:
        NOTES.forget()
        for address, function in _FUNCTIONS.items():  # the library of an instance that was lost stays loaded
            NOTES.tell(address, function)


# -------------------------------------------------------------------- runs


def own_note() -> int:
    """The number of this thread's note."""
    return 0 if calls is None else calls.own_note()


@contextmanager
def run_guarded(will: Callable[[FmuError], None], directory: Path | None) -> Iterator[None]:
    """A run, in this thread. Who ends the process meanwhile is told, with `ENDED` for the exit code.

    Args:
        will: called before the process ends, in any thread, with what ended it.
        directory: of the run.
    """
    _WILLS.append(will)
    NOTES.directory = "" if directory is None else str(directory)
    if calls is not None:
        calls.enter_run()
    try:
        yield
    finally:
        if calls is not None:
            calls.leave_run()
        NOTES.directory = ""
        _WILLS.remove(will)
