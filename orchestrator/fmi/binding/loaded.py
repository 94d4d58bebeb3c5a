"""What FMUs of every version of FMI share when they are loaded into this process: log, statuses, saved states.

The versions differ in names and arguments of their functions: see `fmi1`, `fmi2` and `fmi3`.
"""

from __future__ import annotations

import ctypes
import math
import os
import struct
from abc import abstractmethod
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, ClassVar

from ...errors import FmuError, LostError
from ..guard import dismiss, introduce, noted
from ..interface import Interface, Type
from ..slave import STATUS, Channel
from .arrays import by_type, heads, prepared
from .channel import MixedChannel, NegatedChannel
from .libraries import Signatures, close_library, library, open_library, threads
from .messages import LOGS, without_head
from .stepping import FATAL, OK, PENDING, WARNING, Stepping
from .surroundings import FLOATS, ONE, SMALL, TINY, kept, mend_floats

_LOG_LINES = 50
_NO_INSTANCE = ", and says nothing; the library may belong to another modelDescription.xml, or miss a file or a licence"
_TIME = struct.Struct("=d")
STATE_HEAD = _TIME.size
"""Bytes of ours before the FMU's own in a serialized state: the time."""


class LoadedSlave(Stepping):
    """An FMU loaded into this process.

    Args:
        name: the instance's name in the system.
        interface: its interface.
        folder: where the FMU was unpacked.
        log: where what it says is kept; the last lines by default.
        events: whether its events are handled here, in its event mode (FMI 3.0), and not by itself.

    Raises:
        FmuError: it cannot be loaded or instantiated.
    """

    SIGNATURES: ClassVar[Signatures]
    TYPES: ClassVar[Mapping[str, tuple[str, Any]]]
    """By type of variable: the end of the names of its functions, and what it is in C."""
    SET: ClassVar[str]
    GET: ClassVar[str]
    DO_STEP: ClassVar[str]
    TERMINATE: ClassVar[str]
    RESET: ClassVar[str]
    FREE: ClassVar[str]
    CANCEL: ClassVar[str] = ""
    INTERPOLATE: ClassVar[str] = ""
    DERIVE: ClassVar[str] = ""
    """The function that gives directional derivatives."""
    STATE: ClassVar[tuple[str, str, str, str, str, str]]
    """The functions that get, set, free, measure, serialize and deserialize a saved state."""
    COUNTS_VALUES: ClassVar[bool] = False
    """Whether functions that set and get want to know the number of values, too."""
    PREFIXED: ClassVar[bool] = False
    """Whether the names of its functions begin with the model identifier."""

    def __init__(
        self, name: str, interface: Interface, folder: Path, log: deque[str] | None = None, *, events: bool = False
    ) -> None:
        self.name = name
        self.interface = interface
        self.time, self.rolls_back = 0.0, False
        self.log: deque[str] = deque(maxlen=_LOG_LINES) if log is None else log
        self._dead = False
        self._events = events
        self._span = (0.0, 0.0)
        self._keys: list[int | bytes] = []
        self._given: dict[str, Any] = {}
        self._channels: dict[tuple[Type, tuple[str, ...]], Channel] = {}
        self._library = None
        self.disturbed: dict[str, None] = {}
        self.hear_as(id(self), name.encode())
        # pythonfmu passes even its errors on only while debug logging is on; others then flood us with details.
        self._talks = interface.annotation is not None or "pythonfmu" in interface.generator.lower()
        prefix = f"{interface.identifier}_" if self.PREFIXED else ""
        introduce(id(self), self, interface.model)
        try:
            with self._carefully(), noted(self, "loading"):
                self._library = open_library(library(folder, interface, interface.model), self.SIGNATURES, prefix)
                self.functions, self._addresses = self._library.functions, self._library.addresses
                self.pointer = self._instantiate(folder) or self._ask_why(folder)
            if not self.pointer:
                raise RuntimeError("it gives no instance" + ("" if self.log else _NO_INSTANCE))
            introduce(self.pointer, self, interface.model)
            self._do_step = self.function(self.DO_STEP)
            self._configure()
        except Exception as error:
            self._release()
            what = without_head(error).replace(f"{folder}{os.sep}", "")
            raise FmuError(f"cannot be instantiated: {what}", instance=name, log=self.log) from error

    def _ask_why(self, folder: Path) -> int:
        """Once more, with debug logging: what the matter is, many say only then."""
        talks, self._talks = self._talks, True
        return 0 if talks or self.log else self._instantiate(folder) or 0

    @abstractmethod
    def _instantiate(self, folder: Path) -> int | None:
        """The address of a new instance."""

    @abstractmethod
    def _configure(self) -> None:
        """Give a new instance, or one that was reset, its structural parameters."""

    # ---------------------------------------------------------------- calls and what they say

    def hear_as(self, *keys: int | bytes) -> None:
        """Messages that come with one of these keys are this instance's."""
        self._keys += keys
        LOGS.update(dict.fromkeys(keys, self.log))

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
        if ONE + SMALL != ONE or ONE - SMALL != ONE or TINY * ONE == 0.0:
            self.mend()
        if status:
            self.check(name, status)

    def call_once(self, name: str, *arguments: Any) -> None:
        """Make a call of those that an instance gets once in a run: time enough to look at all that it may change."""
        with self._carefully():
            self.call(name, *arguments)

    @contextmanager
    def _carefully(self) -> Iterator[None]:
        """Put back what the instance changes meanwhile, and note which threads it starts."""
        if self._is_tame:
            yield
            return
        before = threads()
        with kept(self.tell):
            yield
        if self._library is not None:
            self._library.own(threads() - before)

    @property
    def _is_tame(self) -> bool:
        """Whether it is one of our own, which changes nothing, and need not be looked at: see `watch`."""
        return self.interface.own_kind == "native"

    def tell(self, what: str) -> None:
        """Note what it has changed of what all share."""
        self.disturbed[f"changed {what}, put back since"] = None

    def mend(self) -> None:
        """Put the floating-point environment back, which it has changed, and note that."""
        mend_floats()
        self.tell(FLOATS)

    def check(self, call: str, status: int) -> None:
        """Raise unless the status of a call is ok or warning."""
        if 0 <= status <= WARNING:
            return
        self.settle(status)
        raise self.complaint(call, status)

    def settle(self, status: int) -> None:
        """See to what a failed call leaves behind: a fatal one must be the last, a step that is pending is stopped."""
        self._dead = status == FATAL
        if status == PENDING:
            self._cancel()

    def complaint(self, call: str, status: int) -> FmuError:
        """The error of a call that failed."""
        is_pending = status == PENDING
        what = f"{call} is pending: asynchronous FMUs are not supported" if is_pending else f"{call} failed"
        return self._failure(what, status)

    def _failure(self, what: str, status: int) -> FmuError:
        label = STATUS[status] if 0 <= status < len(STATUS) else f"{status} (unknown)"
        return FmuError(what, instance=self.name, time=self.time, status=label, log=self.log)

    def _cancel(self) -> None:
        """Stop a step under way, without which an FMU must not be freed; where that fails, it is left alone."""
        cancel = self.functions.get(self.CANCEL)
        self._dead = cancel is None or cancel(self.pointer) not in (OK, WARNING)

    def lose(self, what: str) -> FmuError:
        """It has left a call instead of returning from it, and must not be called any more: the error of that."""
        self._dead = True
        return LostError(what, instance=self.name, time=self.time, log=self.log)

    def refuse(self, what: str) -> FmuError:
        """An error about something that this FMU does not do."""
        return FmuError(what, instance=self.name, time=self.time)

    # ---------------------------------------------------------------- values

    def references(self, names: Sequence[str]) -> Any:
        """The value references of variables, for C; of the elements of an array, which stand together, the first's."""
        found = heads(names, self.interface)
        return (ctypes.c_uint * len(found))(*found)

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables of one type for being set or read together; once for all runs."""
        key = kind, tuple(names)
        if key not in self._channels:
            self._channels[key] = self._prepared(*key)
        return self._channels[key]

    def _prepared(self, kind: Type, names: Sequence[str]) -> Channel:
        parts = by_type(kind, names, self.interface).items()
        own = [(prepared(self, each, [names[k] for k in ks], self._given), ks) for each, ks in parts]
        channel = own[0][0] if len(own) == 1 else MixedChannel(own, len(names))
        negated = [self.interface.variables[name].negated for name in names]
        return NegatedChannel(channel, negated, kind) if any(negated) else channel

    # ---------------------------------------------------------------- initialization

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment; of one that may go on beyond its end, the stop time is infinite.

        The stop time is a trifle late: the last step may end after it by a rounding error, and some FMUs refuse that.
        """
        self.time = start_time
        self._span = (start_time, stop_time + 8.0 * math.ulp(max(abs(start_time), abs(stop_time))))
        self._announce()

    @abstractmethod
    def _announce(self) -> None:
        """Tell the FMU about the experiment, if the standard has a call for that before initialization."""

    def _end(self) -> tuple[bool, float]:
        """Whether an end of the experiment was announced, and which, in s."""
        stop = self._span[1]
        return math.isfinite(stop), stop if math.isfinite(stop) else 0.0

    @abstractmethod
    def enter_initialization(self) -> None:
        """Enter initialization mode."""

    @abstractmethod
    def exit_initialization(self) -> None:
        """Leave initialization mode."""

    # ---------------------------------------------------------------- saved states

    def save(self) -> Any:
        """The present state: a handle of the FMU's, and the time.

        Raises:
            FmuError: it cannot.
        """
        handle = ctypes.c_void_p()
        self._state_call(0, ctypes.byref(handle))
        return self.time, handle

    def _state_call(self, which: int, *arguments: Any) -> None:
        interface = self.interface
        if not (interface.can_save_state if which < 3 else interface.can_serialize_state):
            what = "save its state" if which < 3 else "write its state down"
            raise self.refuse(f"it cannot {what} (FMI {interface.version})")
        self.call(self.STATE[which], *arguments)

    def restore(self, state: Any) -> None:
        """Come back to a saved state; it stays saved."""
        self._state_call(1, state[1])
        self.time = state[0]

    def forget(self, state: Any) -> None:
        """Give a saved state back."""
        if not self._dead and self._library is not None:
            self._state_call(2, ctypes.byref(state[1]))

    def serialize(self, state: Any) -> bytes:
        """A saved state as bytes: the time, and what the FMU makes of its own."""
        size = ctypes.c_size_t()
        self._state_call(3, state[1], ctypes.byref(size))
        content = ctypes.create_string_buffer(size.value)
        self._state_call(4, state[1], content, size.value)
        return _TIME.pack(state[0]) + content.raw

    def deserialize(self, content: bytes) -> Any:
        """A saved state, out of its bytes."""
        if len(content) < STATE_HEAD:
            raise self.refuse("these bytes are no saved state")
        (time,) = _TIME.unpack_from(content)
        own = content[STATE_HEAD:]
        handle = ctypes.c_void_p()
        self._state_call(5, ctypes.create_string_buffer(own, len(own)), len(own), ctypes.byref(handle))
        return time, handle

    # ---------------------------------------------------------------- derivatives

    @abstractmethod
    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """How the unknowns change when the knowns change by ``seed``; all are Real variables."""

    def interpolate(self, names: Sequence[str], orders: Sequence[int], values: Sequence[float]) -> None:
        """Time derivatives of inputs over the coming step: one name, order (from 1) and value each."""
        if not self.INTERPOLATE:
            raise self.refuse(f"FMI {self.interface.version} takes no derivatives of inputs")
        if not self.interface.interpolates_inputs:
            raise self.refuse("it does not interpolate its inputs")
        variables, count = self.interface.variables, len(names)
        signed = [-x if variables[name].negated else x for name, x in zip(names, values, strict=True)]
        given = (ctypes.c_int * count)(*orders), (ctypes.c_double * count)(*signed)
        self.call(self.INTERPOLATE, self.references(names), count, *given)

    # ---------------------------------------------------------------- the end

    def terminate(self) -> None:
        """End the run."""
        self.call_once(self.TERMINATE)

    def reset(self) -> None:
        """Come back to where it was when it was instantiated: another run may follow.

        Raises:
            FmuError: it cannot; nothing but `free` may follow.
        """
        self.time, self.rolls_back = 0.0, False
        self.log.clear()
        self._given.clear()
        self.call_once(self.RESET)
        self._configure()

    def free(self) -> None:
        """Give the instance and its library back; after a fatal status neither, as FMI 2.0 (2.1.3) has it.

        An FMU made with pythonfmu 0.7 has dropped its Python objects by then, and drops them again when freed: the
        process would crash.
        """
        with nullcontext() if self._is_tame else kept(self.tell):
            if not self._dead and self._library is not None:
                try:
                    self.function(self.FREE)(self.pointer)
                except FmuError as error:
                    self.disturbed[without_head(error)] = None
            with noted(self, "unloading"):
                self._release()

    def _release(self) -> None:
        if not self._dead and self._library is not None:
            if not close_library(self._library):
                self.disturbed["left threads behind: its library stays loaded"] = None
            self._library = None
        dismiss(self)
        for key in self._keys:
            if LOGS.get(key) is self.log:
                del LOGS[key]
