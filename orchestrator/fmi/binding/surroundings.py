"""What all FMUs of a process share with it, so that one could change another's numbers: noted before, put back after.

The floating-point environment (rounding mode, flushing of subnormal numbers to zero: per thread, and changed by merely
loading a library that was compiled with ``-ffast-math``), the working directory, the locale, environment variables, and
what the process does at the signals by which it is controlled. Handlers of crashes are left alone: Java, .NET and Go
live by theirs.
"""

from __future__ import annotations

import ctypes
import locale
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

FLOATS = "the floating-point mode (rounding, or tiny numbers taken for zero)"
"""The floating-point environment, in words."""
_SIGNALS = [
    int(getattr(signal, name))
    for name in ("SIGHUP", "SIGINT", "SIGPIPE", "SIGTERM", "SIGCHLD")
    if hasattr(signal, name)
]
_ACTION, _FLOATS = 512, 512
"""Bytes that hold C's ``struct sigaction`` and ``fenv_t`` on every platform."""

# Variables, not constants: the sums are to be made when they are asked for.
ONE, SMALL, TINY = 1.0, 1e-30, 5e-324
"""``ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0`` tells of another rounding mode and of flushing."""


def _library() -> Any:
    """C's own functions; None where they have other names."""
    with suppress(Exception):
        return ctypes.CDLL(None)
    return None


_C = _library()


def _environment_of_floats() -> Any:
    """The floating-point environment of this thread as C has it; None where it cannot be had."""
    kept = ctypes.create_string_buffer(_FLOATS)
    with suppress(Exception):
        return kept if _C.fegetenv(kept) == 0 else None
    return None


_AT_FIRST = _environment_of_floats()
"""That of the process before it has loaded any FMU."""


def are_floats_disturbed() -> bool:
    """Whether this thread rounds in another way than to the nearest, or takes tiny numbers for zero."""
    return ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0


def mend_floats() -> None:
    """Give this thread the floating-point environment that the process had before there was an FMU."""
    if _AT_FIRST is not None:
        _C.fesetenv(_AT_FIRST)


@dataclass(frozen=True)
class Surroundings:
    """What there was at one moment."""

    folder: str
    locale: str
    variables: dict[bytes, bytes]
    handlers: dict[int, bytes]
    actions: dict[int, bytes] = field(compare=False)
    """All of C's ``struct sigaction`` by signal, whose padding may differ; ``handlers`` are the addresses in there."""

    @classmethod
    def now(cls) -> Surroundings:
        """What there is."""
        actions = _actions()
        handlers = {number: action[: ctypes.sizeof(ctypes.c_void_p)] for number, action in actions.items()}
        return cls(_folder(), locale.setlocale(locale.LC_ALL), _variables(), handlers, actions)

    def put_back(self) -> list[str]:
        """Put back what has changed since; what that was, in words."""
        found, changed = Surroundings.now(), []
        ways: dict[str, tuple[str, Callable[[Surroundings], None]]] = {
            "folder": ("the working directory", self._put_back_folder),
            "locale": ("the locale", self._put_back_locale),
            "variables": ("environment variables", self._put_back_variables),
            "handlers": ("signal handlers", self._put_back_actions),
        }
        if self == found:
            return []
        for name, (what, put_back) in ways.items():
            if getattr(self, name) != getattr(found, name):
                changed.append(f"{what}{_named(self, found) if name == 'variables' else ''}")
                with suppress(Exception):  # a folder that is gone, say
                    put_back(found)
        return changed

    def _put_back_folder(self, _: Surroundings) -> None:
        os.chdir(self.folder)

    def _put_back_locale(self, _: Surroundings) -> None:
        locale.setlocale(locale.LC_ALL, self.locale)

    def _put_back_variables(self, found: Surroundings) -> None:
        for name in _differing(self, found):
            text = os.fsdecode(name)
            if name in self.variables:
                os.environ[text] = os.fsdecode(self.variables[name])
            else:
                os.environ.pop(text, None)
                os.unsetenv(text)  # C's own, of which Python may not have known

    def _put_back_actions(self, found: Surroundings) -> None:
        for number, action in self.actions.items():
            if found.handlers.get(number) != self.handlers[number]:
                _C.sigaction(number, ctypes.create_string_buffer(action, _ACTION), None)


def _differing(before: Surroundings, after: Surroundings) -> list[bytes]:
    names = before.variables.keys() | after.variables.keys()
    return sorted(name for name in names if before.variables.get(name) != after.variables.get(name))


def _named(before: Surroundings, after: Surroundings) -> str:
    return f" ({', '.join(os.fsdecode(name) for name in _differing(before, after)[:5])})"


def _folder() -> str:
    try:
        return os.getcwd()
    except OSError:  # somebody has removed it
        return ""


def _variables() -> dict[bytes, bytes]:
    """The environment as C has it, which is not told to Python where C changes it."""
    if not sys.platform.startswith("linux") or _C is None:
        return {os.fsencode(name): os.fsencode(value) for name, value in os.environ.items()}
    entries = ctypes.POINTER(ctypes.c_char_p).in_dll(_C, "environ")
    found: dict[bytes, bytes] = {}
    k = 0
    while entries and (entry := entries[k]) is not None:
        name, _, value = entry.partition(b"=")
        found[name] = value
        k += 1
    return found


def _actions() -> dict[int, bytes]:
    """What the process does at signals, as C has it; nothing on Windows."""
    found = {}
    with suppress(Exception):
        for number in _SIGNALS:
            action = ctypes.create_string_buffer(_ACTION)
            if _C.sigaction(number, None, action) == 0:
                found[number] = action.raw
    return found


@contextmanager
def kept(tell: Callable[[str], None]) -> Iterator[None]:
    """Let code of an FMU do what it likes to what it shares with others, and put it back.

    Args:
        tell: told of each thing that was put back.
    """
    before = Surroundings.now()
    try:
        yield
    finally:
        if are_floats_disturbed():
            mend_floats()
            tell(FLOATS)
        for what in before.put_back():
            tell(what)
