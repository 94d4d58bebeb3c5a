"""What all FMUs of a process share with it, so that one could change another's numbers: noted before, put back after.

The floating-point environment (rounding mode, flushing of subnormal numbers to zero: per thread, and changed by merely
loading a library that was compiled with ``-ffast-math``), the working directory, the locale, environment variables, the
mask of new files' rights, limits of resources, and what the process does at the signals by which it is controlled, and
whether they reach it. Handlers of crashes are left alone: Java, .NET and Go live by theirs.
"""

from __future__ import annotations

import ctypes
import locale
import os
import platform
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

try:
    import resource
except ImportError:  # pragma: no cover: Windows has none
    resource = None  # type: ignore[assignment]

FLOATS = "the floating-point mode (rounding, precision, traps, or tiny numbers taken for zero)"
"""The floating-point environment, in words."""
_SIGNALS = [
    int(getattr(signal, name))
    for name in ("SIGHUP", "SIGINT", "SIGPIPE", "SIGTERM", "SIGCHLD")
    if hasattr(signal, name)
]
_LIMITED = [
    getattr(resource, f"RLIMIT_{name}")
    for name in ("FSIZE", "NOFILE", "STACK", "AS", "DATA", "CPU", "CORE")
    if resource is not None
]
_ACTION, _FLOATS = 512, 512
"""Bytes that hold C's ``struct sigaction`` and ``fenv_t`` on every platform."""

# Variables, not constants: the sums are to be made when they are asked for.
ONE, SMALL, TINY = 1.0, 1e-30, 5e-324
"""``ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0`` tells of another rounding mode and of flushing, not
of what traps, nor of the precision of x86's old unit."""


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


_CONTROLS = {"x86_64": ((0, 2, 0xFFFF), (28, 32, 0xFFC0)), "aarch64": ((0, 4, 0xFFFFFFFF),)}
"""Where Linux' ``fenv_t`` says how to compute, and in which bits: of x86 its old unit and its new one, of ARM."""


def _controls(floats: Any) -> list[int]:
    """How a thread computes that has this floating-point environment; nothing where that is not known."""
    places = _CONTROLS.get(platform.machine(), ()) if sys.platform == "linux" and floats is not None else ()
    return [int.from_bytes(floats[begin:end], sys.byteorder) & mask for begin, end, mask in places]


def are_floats_changed() -> bool:
    """Whether this thread computes in any way otherwise than it did at first; that takes some 2 us."""
    # Before any sum is made: that might trap.
    return _controls(_environment_of_floats()) != _controls(_AT_FIRST) or are_floats_disturbed()


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
    locale: tuple[str, int]
    """That of the process, and of this thread, which is C's ``LC_GLOBAL_LOCALE`` where it has none of its own."""
    variables: dict[bytes, bytes]
    mask: int
    limits: dict[int, tuple[int, int]]
    blocked: frozenset[int]
    handlers: dict[int, bytes]
    actions: dict[int, bytes] = field(compare=False)
    """All of C's ``struct sigaction`` by signal, whose padding may differ; ``handlers`` are the addresses in there."""

    @classmethod
    def now(cls) -> Surroundings:
        """What there is."""
        actions = _actions()
        handlers = {number: action[: ctypes.sizeof(ctypes.c_void_p)] for number, action in actions.items()}
        place, language = _folder(), (locale.setlocale(locale.LC_ALL), _locale_of_thread())
        return cls(place, language, _variables(), _mask(), _limits(), _blocked(), handlers, actions)

    def put_back(self) -> list[str]:
        """Put back what has changed since; what that was, in words."""
        found, changed = Surroundings.now(), []
        ways: dict[str, tuple[str, Callable[[Surroundings], None]]] = {
            "folder": ("the working directory", self._put_back_folder),
            "locale": ("the locale", self._put_back_locale),
            "variables": ("environment variables", self._put_back_variables),
            "mask": ("the mask of new files' rights (umask)", self._put_back_mask),
            "limits": ("limits of resources", self._put_back_limits),
            "blocked": ("which signals reach it", self._put_back_blocked),
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
        locale.setlocale(locale.LC_ALL, self.locale[0])
        _locale_of_thread(self.locale[1])

    def _put_back_mask(self, _: Surroundings) -> None:
        os.umask(self.mask)

    def _put_back_limits(self, found: Surroundings) -> None:
        for kind, (soft, _) in self.limits.items():
            hard = found.limits[kind][1]  # which may be lowered, and never raised again
            resource.setrlimit(kind, (soft if hard == resource.RLIM_INFINITY else min(soft, hard), hard))

    def _put_back_blocked(self, _: Surroundings) -> None:
        signal.pthread_sigmask(signal.SIG_SETMASK, self.blocked)

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


def _locale_of_thread(new: int = 0) -> int:
    """C's locale of this thread; a new one where that is given."""
    with suppress(Exception):
        _C.uselocale.restype, _C.uselocale.argtypes = ctypes.c_ssize_t, [ctypes.c_ssize_t]
        return int(_C.uselocale(new))
    return 0  # pragma: no cover: Windows has none


def _mask() -> int:
    """The mask of new files' rights, which must be set to be read."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _limits() -> dict[int, tuple[int, int]]:
    """Limits of resources, the present ones and the highest; nothing on Windows."""
    return {} if resource is None else {kind: resource.getrlimit(kind) for kind in _LIMITED}


def _blocked() -> frozenset[int]:
    """The signals that do not reach this thread."""
    return frozenset(signal.pthread_sigmask(signal.SIG_BLOCK, ())) if sys.platform != "win32" else frozenset()


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
        if are_floats_changed():
            mend_floats()
            tell(FLOATS)
        for what in before.put_back():
            tell(what)
