"""One instance in a library of this process: how it is made, called and heard, and given back.

The face that all versions of FMI share stands on it in `loaded`; the versions differ in names and arguments of their
functions: see `fmi1`, `fmi2` and `fmi3`.
"""

from __future__ import annotations

import ctypes
import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from fmpy import fmi2
from fmpy.fmi1 import printLogMessage

from ...errors import FmuError
from ..interface import Interface
from ..slave import STATUS
from .libraries import Signatures, close_library, library, open_library

OK, WARNING, DISCARD, FATAL, PENDING = 0, 1, 2, 4, 5
_LOG_LINES = 50
_NO_INSTANCE = ", and says nothing; the library may belong to another modelDescription.xml, or miss a file or a licence"

_LOGS: dict[int | bytes, deque[str]] = {}
"""What living FMUs said, by the keys that each may hand back with its messages."""


def keep_message(keys: Sequence[int | bytes | None], status: int, message: bytes | None) -> bool:
    """Put a message into the log of the first key that is known; False if none is."""
    for key in keys:
        log = None if key is None else _LOGS.get(key)
        if log is not None:
            label = STATUS[status] if 0 <= status < len(STATUS) else str(status)
            log.extend(f"[{label}] {line}" for line in (message or b"").decode(errors="replace").splitlines())
            return True
    return False


def _log(environment: int | None, instance: bytes | None, status: int, category: bytes, message: bytes) -> None:
    if not keep_message((environment, instance), status, message):  # an FMU that FMPy runs beside us
        printLogMessage(environment, instance, status, category, message)  # type: ignore[arg-type]


LOGGER = fmi2.fmi2CallbackLoggerTYPE(_log)
"""One for all FMUs of FMI 1.0 and 2.0: FMPy's proxy, which fills a message's arguments in, knows only the logger it was
given last. They pass the same arguments, but for the first: the environment in 2.0, the instance's address in 1.0."""


class LoadedInstance(ABC):
    """An instance whose library is loaded into this process.

    Args:
        name: the instance's name in the system.
        interface: its interface.
        folder: where the FMU was unpacked.
        log: where what it says is kept; the last lines by default.

    Raises:
        FmuError: it cannot be loaded or instantiated.
    """

    SIGNATURES: ClassVar[Signatures]
    TYPES: ClassVar[Mapping[str, tuple[str, Any]]]
    """By type of variable: the end of the names of its functions, and what it is in C."""
    SET: ClassVar[str]
    GET: ClassVar[str]
    DO_STEP: ClassVar[str]
    CANCEL: ClassVar[str] = ""
    COUNTS_VALUES = False
    """Whether functions that set and get want to know the number of values, too."""

    def __init__(self, name: str, interface: Interface, folder: Path, log: deque[str] | None = None) -> None:
        self.name = name
        self.interface = interface
        self.time = 0.0
        self.log: deque[str] = deque(maxlen=_LOG_LINES) if log is None else log
        self._dead = False
        self._keys: list[int | bytes] = []
        self._library = None
        self.hear_as(id(self), name.encode())
        # pythonfmu passes even its errors on only while debug logging is on; others then flood us with details.
        self._talks = bool(interface.vendor) or "pythonfmu" in interface.generator.lower()
        try:
            self._library = open_library(library(folder, interface, interface.model), self.SIGNATURES, self._prefix())
            self.functions, self._addresses = self._library.functions, self._library.addresses
            self.pointer = self._instantiate(folder) or self._ask_why(folder)
            if not self.pointer:
                raise RuntimeError("it gives no instance" + ("" if self.log else _NO_INSTANCE))
            self._do_step = self.function(self.DO_STEP)
        except Exception as error:
            self._release()
            what = _without_head(error).replace(f"{folder}{os.sep}", "")
            raise FmuError(f"cannot be instantiated: {what}", instance=name, log=self.log) from error

    def _ask_why(self, folder: Path) -> int:
        """Once more, with debug logging: what the matter is, many say only then."""
        talks, self._talks = self._talks, True
        return 0 if talks or self.log else self._instantiate(folder) or 0

    def _prefix(self) -> str:
        """What stands before the names of its functions."""
        return ""

    @abstractmethod
    def _instantiate(self, folder: Path) -> int | None:
        """The address of a new instance."""

    # ---------------------------------------------------------------- calls and what they say

    def hear_as(self, *keys: int | bytes) -> None:
        """Messages that come with one of these keys are this instance's."""
        self._keys += keys
        _LOGS.update(dict.fromkeys(keys, self.log))

    def function(self, name: str) -> Any:
        """A function of the library.

        Raises:
            FmuError: the library has none of that name.
        """
        try:
            return self.functions[name]
        except KeyError:
            raise FmuError(f"its library has no function {name}", instance=self.name, time=self.time) from None

    def addresses(self, call: str) -> tuple[int, int]:
        """Where a function and the instance stand in memory, for the kernel."""
        return self._addresses[call], self.pointer

    def call(self, name: str, *arguments: Any) -> None:
        """Make a call that has to succeed."""
        status = self.function(name)(self.pointer, *arguments)
        if status:
            self.check(name, status)

    def check(self, call: str, status: int) -> None:
        """Raise unless the status of a call is ok or warning."""
        if 0 <= status <= WARNING:
            return
        self._dead = status == FATAL
        what = f"{call} failed"
        if status == PENDING:
            self._cancel()
            what = f"{call} is pending: asynchronous FMUs are not supported"
        raise self._failure(what, status)

    def _failure(self, what: str, status: int) -> FmuError:
        label = STATUS[status] if 0 <= status < len(STATUS) else f"{status} (unknown)"
        return FmuError(what, instance=self.name, time=self.time, status=label, log=self.log)

    def _cancel(self) -> None:
        """Stop a step under way, without which an FMU must not be freed; where that fails, it is left alone."""
        cancel = self.functions.get(self.CANCEL)
        self._dead = cancel is None or cancel(self.pointer) not in (OK, WARNING)

    def refuse(self, what: str) -> FmuError:
        """An error about something that this FMU does not do."""
        return FmuError(what, instance=self.name, time=self.time)

    # ---------------------------------------------------------------- values

    def references(self, names: Sequence[str]) -> Any:
        """The value references of variables, for C."""
        return (ctypes.c_uint * len(names))(*(self.interface.variables[name].reference for name in names))

    # ---------------------------------------------------------------- the end

    def _release(self) -> None:
        if not self._dead and self._library is not None:
            close_library(self._library)
            self._library = None
        for key in self._keys:
            if _LOGS.get(key) is self.log:
                del _LOGS[key]


def _without_head(error: Exception) -> str:
    """What went wrong; of an error of ours without instance and time, which are said once."""
    return Exception.__str__(error) if isinstance(error, FmuError) else str(error)
