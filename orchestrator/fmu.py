"""One model instance behind a small face: set, step, get. An FMU (FMPy underneath), or a component in this process."""

from __future__ import annotations

import copy
import ctypes
import functools
import inspect
import os
import sys
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar

import fmpy
from fmpy import fmi2
from fmpy.fmi1 import printLogMessage
from fmpy.logging import addLoggerProxy

from ..components.simulate import Simulation
from .errors import FmuError, FmuFileError
from .interface import Interface, Type

P = ParamSpec("P")
R = TypeVar("R")

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
_WARNING, _FATAL = 1, 4
_LOG_LINES = 50
_C_TYPES: dict[str, Any] = {
    "Real": ctypes.c_double,
    "Integer": ctypes.c_int,
    "Enumeration": ctypes.c_int,
    "Boolean": ctypes.c_int,
    "String": ctypes.c_char_p,
}
_SUFFIX = {"Enumeration": "Integer"}


class Channel(Protocol):
    """Some variables of one type of one instance, prepared for being set or read together."""

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""

    def get(self) -> list[Any]:
        """Read all of them."""


class Slave(Protocol):
    """One instance. Every method raises `FmuError` with instance, time, status and log when the model fails."""

    name: str
    interface: Interface
    time: float

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment and enter nothing yet."""

    def enter_initialization(self) -> None:
        """Enter initialization mode."""

    def exit_initialization(self) -> None:
        """Leave initialization mode: the first step may follow."""

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables of one type for being set or read together."""

    def step(self, time: float, length: float) -> None:
        """Advance from ``time`` by ``length``, both in s."""

    def terminate(self) -> None:
        """End the run."""

    def free(self) -> None:
        """Give everything back; nothing may follow. Never raises."""


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
}
"""What is called at every step. FMPy's own methods check and log in Python at each call: here the library's functions
are called directly."""


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

    Args:
        name: the instance's name in the system.
        interface: its interface.
        folder: where the FMU was unpacked.

    Raises:
        FmuError: it cannot be loaded or instantiated.
    """

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
        what = "discarded the step" if (call, status) == ("fmi2DoStep", 2) else f"{call} failed"
        if status == len(STATUS) - 1:
            what = f"{call} is pending: asynchronous FMUs are not supported"
        label = STATUS[status] if 0 <= status < len(STATUS) else f"{status} (unknown)"
        raise FmuError(what, instance=self.name, time=self.time, status=label, log=list(self.log))

    def _call(self, name: str, *arguments: Any) -> None:
        try:
            getattr(self._fmu, name)(self.pointer, *arguments)
        except Exception as error:
            self.check(name, getattr(error, "status", _FATAL))

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

    def step(self, time: float, length: float) -> None:
        """Advance from ``time`` by ``length``, both in s."""
        self.time = time
        status = self._do_step(self.pointer, time, length, 1)
        if status:
            self.check("fmi2DoStep", status)
        self.time = time + length

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


_RUNTIME = (Path(__file__).parent, Path(inspect.getfile(Simulation)).parent)


def _telling(method: Callable[P, R]) -> Callable[P, R]:
    """Turn any exception of a component into an `FmuError` with instance, time, file and line; it stays the cause."""

    @functools.wraps(method)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return method(*args, **kwargs)
        except Exception as error:
            plain: Any = args[0]
            frames = traceback.extract_tb(error.__traceback__)
            authors = [f for f in frames if Path(f.filename).parent not in _RUNTIME]
            frame = (authors or frames)[-1]
            place = f"{Path(frame.filename).name}:{frame.lineno}, in {frame.name}"
            message = f"{type(error).__name__}: {error} [{place}]"
            raise FmuError(message, instance=plain.name, time=plain.time, status="error") from error

    return wrapped


class PlainSlave:
    """A component as Python objects in this process: easy to debug, the same numbers."""

    def __init__(self, name: str, interface: Interface, simulation: Simulation) -> None:
        self.name = name
        self.interface = interface
        self.time = 0.0
        self.simulation = simulation

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment; a component does not care when it ends."""
        self.time = start_time

    @_telling
    def enter_initialization(self) -> None:
        """Enter initialization mode."""
        self.simulation.initialize(self.time)

    @_telling
    def exit_initialization(self) -> None:
        """Leave initialization mode."""
        self.simulation.start()

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables for being set or read together."""
        return _PlainChannel(self, names)

    @_telling
    def step(self, time: float, length: float) -> None:
        """Advance from ``time`` by ``length``, both in s."""
        self.time = time
        if self.simulation.time != time:
            self.simulation.time = time
        self.simulation.step(length)
        self.time = time + length

    @_telling
    def terminate(self) -> None:
        """End the run."""
        self.simulation.terminate()

    def free(self) -> None:
        """Nothing to give back."""


class _PlainChannel:
    def __init__(self, slave: PlainSlave, names: Sequence[str]) -> None:
        self._slave = slave
        self._places = [_place(slave.simulation, name) for name in names]

    @property
    def name(self) -> str:
        return self._slave.name

    @property
    def time(self) -> float:
        return self._slave.time

    @_telling
    def set(self, values: Sequence[Any]) -> None:
        simulation = self._slave.simulation
        arrays: dict[str, Any] = {}
        for (name, element, kind), value in zip(self._places, values, strict=True):
            if element is None:
                simulation.set(name, kind(value))
            else:
                if name not in arrays:
                    arrays[name] = simulation.get(name).copy()
                arrays[name].flat[element] = kind(value)
        for name, array in arrays.items():
            simulation.set(name, array)

    @_telling
    def get(self) -> list[Any]:
        found = [(self._slave.simulation.get(name), element, kind) for name, element, kind in self._places]
        # A boolean is 0 or 1 here, as it comes from an FMU.
        return [
            (int if kind is bool else kind)(value if element is None else value.flat[element])
            for value, element, kind in found
        ]


def _place(simulation: Simulation, scalar: str) -> tuple[str, int | None, Any]:
    for slot in simulation.component.slots.values():
        if scalar in slot.scalars:
            return slot.name, slot.scalars.index(scalar) if slot.shape else None, slot.type
    raise KeyError(scalar)


def forget_paths(folder: Path) -> None:
    """Take an unpack folder's entries off ``sys.path``, where Python FMUs put them at every instantiation."""
    sys.path[:] = [entry for entry in sys.path if not entry.startswith(str(folder))]
