"""An FMI 2.0 co-simulation FMU behind the face of an instance (FMPy underneath)."""

from __future__ import annotations

import copy
import ctypes
import math
import os
import struct
import sys
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import fmpy
from fmpy import fmi2
from fmpy.fmi1 import printLogMessage
from fmpy.logging import addLoggerProxy

from .errors import FmuError, FmuFileError, StoppedError
from .interface import Interface, Type
from .slave import STATUS, Channel

_OK, _WARNING, _DISCARD, _FATAL = 0, 1, 2, 4
_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3
"""What fmi2GetRealStatus and fmi2GetBooleanStatus are asked for."""
_SHORTEST_PART = 1e-6
"""The smallest part of a communication step in which an FMU that discards it is asked to take it."""
_MOST_PARTS = 10_000
_LOG_LINES = 50
_TIME = struct.Struct("=d")
_C_TYPES: dict[str, Any] = {
    "Real": ctypes.c_double,
    "Integer": ctypes.c_int,
    "Enumeration": ctypes.c_int,
    "Boolean": ctypes.c_int,
    "String": ctypes.c_char_p,
}
_SUFFIX = {"Enumeration": "Integer"}


_LOGS: dict[int, deque[str]] = {}
"""What living FMUs said, by the environment pointer that each hands back with its messages."""


def _log(environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
    if environment not in _LOGS:  # an FMU that FMPy runs beside us
        printLogMessage(environment, instance, status, category, message)  # type: ignore[arg-type]
        return
    label = STATUS[status] if 0 <= status < len(STATUS) else str(status)
    lines = (message or b"").decode(errors="replace").splitlines()
    _LOGS[environment].extend(f"[{label}] {line}" for line in lines)


_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_log)
"""One for all FMUs: FMPy's proxy, which fills a message's arguments in, knows only the logger it was given last."""


_SIGNATURES: dict[str, list[Any]] = {
    "fmi2DoStep": [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int],
    **{
        f"fmi2{verb}{suffix}": [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        for verb in ("Set", "Get")
        for suffix in ("Real", "Integer", "Boolean", "String")
    },
    **{f"fmi2Get{suffix}Status": [ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p] for suffix in ("Real", "Boolean")},
}
"""What is called at steps. FMPy's own methods check and log in Python at each call: here the library's functions are
called directly."""


class _Library:
    """A loaded library with its functions bound, shared by all instances of one FMU: FMPy binds for each anew."""

    def __init__(self, path: Path, interface: Interface, folder: Path) -> None:
        make: Any = fmi2.FMU2Slave
        here = os.getcwd()
        try:
            self.fmu = make(
                guid=interface.guid,
                unzipDirectory=str(folder),
                modelIdentifier=interface.identifier,
                libraryPath=str(path),
            )
        finally:
            os.chdir(here)
        self.path = path
        self.users = 0
        self.functions = {name: self._function(name, types) for name, types in _SIGNATURES.items()}
        self.addresses = {name: address(function) for name, function in self.functions.items()}

    def _function(self, name: str, argtypes: list[Any]) -> Any:
        function = self.fmu.dll[name]
        function.argtypes, function.restype = argtypes, ctypes.c_int
        return function


_LIBRARIES: dict[Path, _Library] = {}
"""The libraries in use, by path."""


def _open_library(path: Path, interface: Interface, folder: Path) -> _Library:
    if path not in _LIBRARIES:
        _LIBRARIES[path] = _Library(path, interface, folder)
    _LIBRARIES[path].users += 1
    return _LIBRARIES[path]


def _close_library(it: _Library) -> None:
    it.users -= 1
    if not it.users:
        del _LIBRARIES[it.path]
        it.fmu.freeLibrary()


def _callbacks(environment: int, log: deque[str]) -> Any:
    _LOGS[environment] = log
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = _LOGGER
    callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
    callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
    callbacks.componentEnvironment = environment
    addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


class FmuSlave:
    """An FMU loaded into this process.

    ``STATE_HEAD`` is how many bytes of ours stand before the FMU's own in a serialized state.

    Args:
        name: the instance's name in the system.
        interface: its interface.
        folder: where the FMU was unpacked.

    Raises:
        FmuError: it cannot be loaded or instantiated.
    """

    STATE_HEAD = _TIME.size

    def __init__(self, name: str, interface: Interface, folder: Path) -> None:
        self.name = name
        self.interface = interface
        self.time = 0.0
        self.log: deque[str] = deque(maxlen=_LOG_LINES)
        self._dead = False
        try:
            self._library: _Library | None = _open_library(
                library(folder, interface, interface.model), interface, folder
            )
            self._fmu = copy.copy(self._library.fmu)
            self._fmu.instanceName = name
            self._callbacks = _callbacks(id(self), self.log)
            # pythonfmu passes even its errors on only while debug logging is on; others then flood us with details.
            talks = bool(interface.vendor) or "pythonfmu" in interface.generator.lower()
            self._fmu.instantiate(callbacks=self._callbacks, loggingOn=talks)
        except Exception as error:
            _LOGS.pop(id(self), None)
            raise FmuError(f"cannot be instantiated: {error}", instance=name, log=list(self.log)) from error
        self.functions, self._addresses = self._library.functions, self._library.addresses
        self.pointer = int(self._fmu.component)
        self._do_step = self.functions["fmi2DoStep"]

    def check(self, call: str, status: int) -> None:
        """Raise unless the status of a call is ok or warning."""
        if 0 <= status <= _WARNING:
            return
        self._dead = status == _FATAL
        what = f"{call} failed"
        if (call, status) == ("fmi2DoStep", _DISCARD):
            what = "discarded the step"
        if status == len(STATUS) - 1:
            what = f"{call} is pending: asynchronous FMUs are not supported"
        label = STATUS[status] if 0 <= status < len(STATUS) else f"{status} (unknown)"
        raise FmuError(what, instance=self.name, time=self.time, status=label, log=list(self.log))

    def _call(self, name: str, *arguments: Any) -> None:
        self._guarded(name, getattr(self._fmu, name), self.pointer, *arguments)

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment."""
        self.time = start_time
        self._call("fmi2SetupExperiment", 0, 0.0, start_time, 1, stop_time)

    def enter_initialization(self) -> None:
        """Enter initialization mode."""
        self._call("fmi2EnterInitializationMode")

    def exit_initialization(self) -> None:
        """Leave initialization mode."""
        self._call("fmi2ExitInitializationMode")

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables of one type for being set or read together."""
        return FmuChannel(self, kind, [self.interface.variables[name].reference for name in names])

    def step(self, time: float, length: float, *, final: bool = True) -> None:
        """Advance from ``time`` by ``length``, both in s; not ``final`` where an older state may be restored."""
        self.time = time
        status = self._do_step(self.pointer, time, length, final)
        if status:
            self.resume(time, length, status, final)
        self.time = time + length

    def resume(self, time: float, length: float, status: int, final: bool) -> None:
        """Go on after a step returned something else than ok: an FMU that discarded it may take it in parts.

        The standard (FMI 2.0, 4.2.2) lets an FMU stop early, at its last successful time, or refuse a step that is too
        long for it. The rest, or half of it, is then tried with the inputs held.

        Raises:
            StoppedError: it asks for the end of the simulation.
            FmuError: it failed, or does not get on.
        """
        end, part = time + length, length
        for _ in range(_MOST_PARTS):
            if status in (_OK, _WARNING):
                time, part = time + part, end - time - part
            elif status == _DISCARD and (reached := self._last_successful_time()) is not None:
                time, part = (reached, end - reached) if reached > time else (time, 0.5 * part)
            else:
                break
            self.time = time
            if status == _DISCARD and self._is_terminated():
                raise StoppedError("asks for the end of the simulation", instance=self.name, time=time)
            if time >= end - _SHORTEST_PART * length:
                return
            if part < _SHORTEST_PART * length or not self.interface.variable_step:
                break
            status = self._do_step(self.pointer, time, part, final)
        self.check("fmi2DoStep", _DISCARD if status in (_OK, _WARNING) else status)

    def _last_successful_time(self) -> float | None:
        found = ctypes.c_double(math.nan)
        status = self.functions["fmi2GetRealStatus"](self.pointer, _LAST_SUCCESSFUL_TIME, ctypes.byref(found))
        return found.value if status in (_OK, _WARNING) and math.isfinite(found.value) else None

    def _is_terminated(self) -> bool:
        found = ctypes.c_int(0)
        status = self.functions["fmi2GetBooleanStatus"](self.pointer, _TERMINATED, ctypes.byref(found))
        return status in (_OK, _WARNING) and bool(found.value)

    def save(self) -> Any:
        """The present state: a handle of the FMU's, and the time."""
        return self.time, self._guarded("fmi2GetFMUstate", self._fmu.getFMUstate)

    def restore(self, state: Any) -> None:
        """Come back to a saved state; it stays saved."""
        self._guarded("fmi2SetFMUstate", self._fmu.setFMUstate, state[1])
        self.time = state[0]

    def forget(self, state: Any) -> None:
        """Give a saved state back."""
        if not self._dead and self._library is not None:
            self._guarded("fmi2FreeFMUstate", self._fmu.freeFMUstate, state[1])

    def serialize(self, state: Any) -> bytes:
        """A saved state as bytes: the time, and what the FMU makes of its own."""
        content = self._guarded("fmi2SerializeFMUstate", self._fmu.serializeFMUstate, state[1])
        return _TIME.pack(state[0]) + bytes(content)

    def deserialize(self, content: bytes) -> Any:
        """A saved state, out of its bytes."""
        (time,) = _TIME.unpack_from(content)
        own = content[_TIME.size :]
        return time, self._guarded("fmi2DeSerializeFMUstate", self._fmu.deSerializeFMUstate, own)

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """How the unknowns change when the knowns change by ``seed``; all are Real variables."""
        rows, columns = ([self.interface.variables[name].reference for name in names] for names in (unknowns, knowns))
        call = self._fmu.getDirectionalDerivative
        found: list[float] = self._guarded("fmi2GetDirectionalDerivative", call, rows, columns, list(seed))
        return found

    def interpolate(self, names: Sequence[str], orders: Sequence[int], values: Sequence[float]) -> None:
        """Time derivatives of inputs over the coming step: one name, order (from 1) and value each."""
        count = len(names)
        references = (ctypes.c_uint * count)(*(self.interface.variables[name].reference for name in names))
        call = self._fmu.fmi2SetRealInputDerivatives
        given = (ctypes.c_int * count)(*orders), (ctypes.c_double * count)(*values)
        self._guarded("fmi2SetRealInputDerivatives", call, self.pointer, references, count, *given)

    def _guarded(self, name: str, call: Callable[..., Any], *arguments: Any) -> Any:
        """The result of a call of FMPy's, whose failures become ours."""
        try:
            return call(*arguments)
        except Exception as error:
            status = getattr(error, "status", None)
            if status is not None:
                self.check(name, status)
            raise FmuError(str(error), instance=self.name, time=self.time, log=list(self.log)) from error

    def addresses(self, call: str) -> tuple[int, int]:
        """Where a function and the instance stand in memory, for the kernel."""
        return self._addresses[call], self.pointer

    def terminate(self) -> None:
        """End the run."""
        self._call("fmi2Terminate")

    def free(self) -> None:
        """Give the instance and its library back; after a fatal status neither, as FMI 2.0 (2.1.3) has it.

        An FMU made with pythonfmu 0.7 has dropped its Python objects by then, and drops them again when freed: the
        process would crash.
        """
        if not self._dead and self._library is not None:
            self._fmu.fmi2FreeInstance(self.pointer)
            _close_library(self._library)
            self._library = None
        _LOGS.pop(id(self), None)


class FmuChannel:
    """Some variables of one type of an FMU: value references and a buffer, prepared once.

    ``calls`` names the functions that set and get.
    """

    def __init__(self, slave: FmuSlave, kind: Type, references: Sequence[int]) -> None:
        count = len(references)
        suffix = _SUFFIX.get(kind, kind)
        self._slave = slave
        self._component = slave.pointer
        self.calls = f"fmi2Set{suffix}", f"fmi2Get{suffix}"
        self._set, self._get = (slave.functions[call] for call in self.calls)
        self.references = references
        self._references = (ctypes.c_uint * count)(*references)
        self._values = (_C_TYPES[kind] * count)()
        self._count = count
        self._text = kind == "String"

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        self._values[:] = [v.encode() for v in values] if self._text else values
        status = self._set(self._component, self._references, self._count, self._values)
        if status:
            self._slave.check(self.calls[0], status)

    def get(self) -> list[Any]:
        """Read all of them."""
        status = self._get(self._component, self._references, self._count, self._values)
        if status:
            self._slave.check(self.calls[1], status)
        if self._text:
            return [(v or b"").decode(errors="replace") for v in self._values]
        return list(self._values)


def address(function: Any) -> int:
    """Where a function of a loaded library stands in memory."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def library(folder: Path, interface: Interface, name: str) -> Path:
    """The shared library of an unpacked FMU for this platform, even if it is not named after the model.

    Args:
        folder: where the FMU was unpacked.
        interface: its interface.
        name: the file as the user knows it, for messages.

    Raises:
        FmuFileError: there is none; the message says for which platforms there are.
    """
    binaries = folder / "binaries"
    place = binaries / fmpy.platform
    expected = place / f"{interface.identifier}{fmpy.sharedLibraryExtension}"
    if expected.is_file():
        return expected
    others = sorted(place.glob(f"*{fmpy.sharedLibraryExtension}")) if place.is_dir() else []
    if len(others) == 1:
        return others[0]
    found = sorted(p.name for p in binaries.iterdir() if any(p.iterdir())) if binaries.is_dir() else []
    raise FmuFileError(f"{name} has no binary for {fmpy.platform}; it brings {', '.join(found) or 'none at all'}")


def forget_paths(folder: Path) -> None:
    """Take an unpack folder's entries off ``sys.path``, where Python FMUs put them at every instantiation."""
    sys.path[:] = [entry for entry in sys.path if not entry.startswith(str(folder))]
