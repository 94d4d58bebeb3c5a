"""What FMUs of every version of FMI share when they are loaded into this process: values, steps in parts, states."""

from __future__ import annotations

import ctypes
import math
import struct
from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from ...errors import StoppedError
from ..interface import Interface, Type
from ..slave import Channel
from .channel import FmuChannel, MixedChannel
from .instance import DISCARD, OK, WARNING, LoadedInstance

_SHORTEST_PART = 1e-6
"""The smallest part of a communication step in which an FMU that discards it is asked to take it."""
_MOST_PARTS = 10_000
_TIME = struct.Struct("=d")
STATE_HEAD = _TIME.size
"""Bytes of ours before the FMU's own in a serialized state: the time."""


class LoadedSlave(LoadedInstance):
    """An FMU loaded into this process, behind the face of an instance; the arguments are those of `LoadedInstance`."""

    TERMINATE: ClassVar[str]
    FREE: ClassVar[str]
    INTERPOLATE: ClassVar[str] = ""
    STATE: ClassVar[tuple[str, str, str, str, str, str]]
    """The functions that get, set, free, measure, serialize and deserialize a saved state."""

    def __init__(self, name: str, interface: Interface, folder: Path, log: deque[str] | None = None) -> None:
        self._span = (0.0, 0.0)
        super().__init__(name, interface, folder, log)

    # ---------------------------------------------------------------- values

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables of one type for being set or read together."""
        parts: dict[str, list[int]] = {}
        for place, name in enumerate(names):
            parts.setdefault(self.interface.variables[name].fmi_type or kind, []).append(place)
        if len(parts) == 1:
            return FmuChannel(self, next(iter(parts)), names)
        return MixedChannel(
            [(FmuChannel(self, each, [names[k] for k in places]), places) for each, places in parts.items()], len(names)
        )

    # ---------------------------------------------------------------- initialization

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment; of one that may go on beyond its end, the stop time is infinite.

        The stop time is a trifle late: the last step may end after it by a rounding error, and some FMUs refuse that.
        """
        self.time = start_time
        self._span = (start_time, stop_time + 8.0 * math.ulp(max(abs(start_time), abs(stop_time))))

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

    # ---------------------------------------------------------------- steps

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
        self.time, end, part, shortest = time, time + length, length, _SHORTEST_PART * length
        for _ in range(_MOST_PARTS):
            reached = self._reached(time + part, status)
            if self._stops(status):
                when = time if reached is None else reached
                raise StoppedError("asks for the end of the simulation", instance=self.name, time=when)
            if reached is None:
                break
            if reached > end + shortest:
                raise self._failure(f"says that it got to t = {reached:g} s in the step to t = {end:g} s", status)
            on = reached > time + shortest
            time, part = (reached, end - reached) if on else (time, 0.5 * part)
            self.time = time
            if time >= end - shortest:
                return
            if part < shortest or not self.interface.variable_step:
                break
            status = self._attempt(time, part, final, again=not on)
        if status in (OK, WARNING, DISCARD):
            raise self._failure(f"discarded the step{self._why(reached, part)}", DISCARD)
        self.check(self.DO_STEP, status)

    def _why(self, reached: float | None, part: float) -> str:
        """Why what is left of a discarded step is not taken in parts, and what a user can do."""
        if reached is None:
            return " and does not say how far it got, so that nothing else can be tried"
        if not self.interface.variable_step:
            return ", and takes steps of one length only: choose another step"
        return f", and takes none from there on, not even one of {part:.2g} s"

    def _attempt(self, time: float, part: float, final: bool, *, again: bool) -> int:
        """Try a part of a step; ``again`` where a longer one from the same point was discarded."""
        return int(self._do_step(self.pointer, time, part, final))

    def _reached(self, end: float, status: int) -> float | None:
        """How far a step that was to reach ``end`` came; None if it failed."""
        if status in (OK, WARNING):
            return end
        return self._last_successful_time() if status == DISCARD else None

    @abstractmethod
    def _last_successful_time(self) -> float | None:
        """How far a discarded step came; None if the FMU does not say."""

    def _stops(self, status: int) -> bool:
        """Whether the FMU asks for the end of the simulation."""
        return False

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
        if not self.interface.interpolates_inputs:
            raise self.refuse("it does not interpolate its inputs")
        count = len(names)
        given = (ctypes.c_int * count)(*orders), (ctypes.c_double * count)(*values)
        self.call(self.INTERPOLATE, self.references(names), count, *given)

    # ---------------------------------------------------------------- the end

    def terminate(self) -> None:
        """End the run."""
        self.call(self.TERMINATE)

    def free(self) -> None:
        """Give the instance and its library back; after a fatal status neither, as FMI 2.0 (2.1.3) has it.

        An FMU made with pythonfmu 0.7 has dropped its Python objects by then, and drops them again when freed: the
        process would crash.
        """
        if not self._dead and self._library is not None:
            self.function(self.FREE)(self.pointer)
        self._release()
