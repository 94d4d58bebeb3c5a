"""How the compiled step loop calls an isolated instance: through shared memory, by functions like those of an FMU.

A step is then one hand-over between two processes that both watch for the other's, instead of a message that wakes one
of them: see ``native/lane.h``. Where there is no such lane, or for what it does not do, calls go as messages.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from ctypes import c_void_p
from typing import Any, Protocol

from ..errors import LostError
from ..fmi import Interface
from ..fmi.binding import DISCARD, FATAL, SLAVES
from .channel import IsolatedPart
from .lanes import HAS_LANES, lane
from .messages import (
    ASK,
    ASK_3,
    LANE_FORGET,
    LANE_GET,
    LANE_GET_3,
    LANE_RESTORE,
    LANE_RESTORE_NOW,
    LANE_SAVE,
    LANE_SET,
    LANE_SET_3,
    LANE_STEP,
    LANE_STEP_3,
    NOTE_FAILED,
    NOTE_STATUS,
    SET_SLOPES,
)
from .process import HostProcess

_CALLS = {
    LANE_SET: "set", LANE_SET_3: "set", LANE_STEP: "step", LANE_STEP_3: "step", LANE_GET: "get", LANE_GET_3: "get",
    SET_SLOPES: "interpolate", ASK: "directional_derivatives", ASK_3: "directional_derivatives",
    LANE_SAVE: "save", LANE_RESTORE: "restore", LANE_FORGET: "forget",
}  # fmt: skip
_STATE = LANE_SAVE, LANE_RESTORE, LANE_FORGET


class Rider(Protocol):
    """What a ride needs of its instance."""

    name: str
    interface: Interface
    time: float
    rolls_back: bool
    slopes: tuple[int, int]
    question: tuple[int, int]
    functions: frozenset[str]

    @property
    def has_news(self) -> bool:
        """Whether there is anything that its process has not been told yet."""

    def ask(self, operation: str, *arguments: Any) -> Any:
        """Let its process do something."""

    def enter_lane(self) -> None:
        """Let its process take calls from the lane."""

    def await_lane(self) -> None:
        """Wait for what is under way in the lane."""

    def name_call(self, call: str, channel: int, part: int) -> str:
        """The function of the standard behind a name of `messages.CALLS`, called for a part of a channel."""


def may_ride(slave: Rider) -> bool:
    """Whether an isolated instance can be called through a lane, where its channels have parts."""
    return HAS_LANES and not slave.rolls_back


class Ride:
    """The calls of one isolated instance by the compiled step loop, in the order in which they are added.

    Args:
        slave: the instance. process: its process. seat: its number there.

    Attributes:
        name, interface, functions: of the instance. DO_STEP, INTERPOLATE, DERIVE, STATE: what its version of FMI calls
            its functions.
    """

    def __init__(self, slave: Rider, process: HostProcess, seat: int) -> None:
        self._slave, self.name = slave, slave.name
        self.interface, self.functions = slave.interface, slave.functions
        own = SLAVES[slave.interface.version]
        self.DO_STEP, self.INTERPOLATE, self.DERIVE = own.DO_STEP, own.INTERPOLATE, own.DERIVE
        self.STATE: tuple[str, ...] = getattr(own, "STATE", ())  # FMI 1.0 has none
        self._is_third = own.COUNTS_VALUES
        self._process, self._lane = process, process.open_lane()
        self._seat = seat
        self._rider = lane.Rider(self._lane, process.begins[seat], seat)
        self._table: list[tuple[int, int, int, int, int]] = []
        self._made: dict[tuple[int, int, int], int] = {}
        self._is_final = True
        self._is_on = False

    # ---------------------------------------------------------------- what the kernel calls

    def add_step(self, *, final: bool) -> tuple[int, int]:
        """The function that takes a step, ``final`` or not, and what stands for the instance there: addresses."""
        self._is_final = final
        kind = LANE_STEP_3 if self._is_third else LANE_STEP
        return lane.FUNCTIONS[kind], self._add(kind)

    def add(self, part: IsolatedPart, *, is_get: bool) -> tuple[int, int]:
        """The same for a function that reads or sets variables."""
        kind = ((LANE_SET, LANE_GET), (LANE_SET_3, LANE_GET_3))[self._is_third][is_get]
        return lane.FUNCTIONS[kind], self._add(kind, part.channel, part.number, part.place)

    def add_slopes(self) -> int:
        """The function that takes derivatives of inputs; what sets these inputs stands for the instance."""
        self._add(SET_SLOPES, place=(*self._slave.slopes, 0))
        return lane.FUNCTIONS[SET_SLOPES]

    def add_question(self) -> tuple[int, int]:
        """The function that gives directional derivatives, and what stands for the instance there: addresses."""
        kind = ASK_3 if self._is_third else ASK
        return lane.FUNCTIONS[kind], self._add(kind, place=(*self._slave.question, 0))

    def add_state(self, number: int, *, at_once: bool) -> tuple[int, int, int, int]:
        """The functions that save, restore and give back the state of a number, and what stands for the instance.

        ``at_once``: nothing is asked of the instance after it was restored that would tell how that went.
        """
        first, *_ = [self._add(kind, number) for kind in _STATE]
        save, restore, forget = _STATE[0], LANE_RESTORE_NOW if at_once else _STATE[1], _STATE[2]
        return lane.FUNCTIONS[save], lane.FUNCTIONS[restore], lane.FUNCTIONS[forget], first

    def _add(self, kind: int, number: int = -1, part: int = 0, place: tuple[int, int, int] = (0, 0, 0)) -> int:
        """What is called in several places of a plan is one: its values stand in one place of the memory."""
        key = kind, number, part
        if key not in self._made:
            self._made[key] = self._rider.add(kind, *place)
            self._table.append((*key, *place[:2]))
        return self._made[key]

    def references(self, names: Iterable[str]) -> list[int]:
        """The value references of variables."""
        return [self.interface.variables[name].reference for name in names]

    # ---------------------------------------------------------------- on and off the lane

    def board(self) -> None:
        """Tell the process what its calls are, unless it knows that.

        Raises:
            FmuError: it is lost, or what was set before is refused.
        """
        if not self._is_on or self._slave.has_news:
            self._slave.ask("board", self._table)
            self._rider.begin(self._slave.time)
            self._is_on = True

    def begin(self) -> None:
        """Let the process take calls from the lane, once all who live there have boarded.

        Raises:
            FmuError: it is lost.
        """
        self._slave.enter_lane()

    def settle(self) -> None:
        """See to steps whose outputs are not due yet, before anything else is asked of the instance.

        Raises:
            FmuError: it failed, or is lost.
        """
        if self._is_on:
            time = self._slave.time
            self._slave.await_lane()
            if self.failed:
                status = self._process.note(NOTE_STATUS, self._seat)
                self.recover(self._failed_call(), status, self.time_of(self.failed), apart=False)
            self._slave.time = time

    def end(self) -> None:
        """Let the process take messages again, of which one is for this instance: it boards anew then."""
        self._is_on = False
        self._process.leave_lane()

    def time_of(self, call: str) -> float:
        """The time in s at which it was last asked for something, by its name in `messages.CALLS`."""
        begin, length, left, now = self._rider.last_step()
        if call in ("save", "restore", "forget"):
            return left
        if call in ("set", "interpolate", "directional_derivatives"):
            return now
        return begin + length if call == "get" else begin

    # ---------------------------------------------------------------- failures

    @property
    def failed(self) -> str:
        """What it has failed of since it boarded, by its name in `messages.CALLS`; empty if nothing."""
        found = abs(self._process.note(NOTE_FAILED, self._seat))
        return _CALLS[self._table[found - 1][0]] if found else ""

    def recover(self, call: str, status: int, time: float, *, apart: bool) -> bool:
        """See to a call that failed: whether it is to be made again, because nothing is wrong in the end.

        Args:
            call: the function of the standard.
            status: what it returned; it may be that of an earlier call.
            time: what this call gives or takes is of this time in s.
            apart: whether it is no part of a step, so that what was set before is of that time as well.

        Raises:
            FmuError: the instance failed, or is lost.
        """
        slave = self._slave
        self._raise_failure()
        if self.failed == "step" and (status == DISCARD or status >= lane.CUT_SHORT):
            begin, length, *_ = self._rider.last_step()
            own = status - lane.CUT_SHORT if status >= lane.CUT_SHORT else status
            slave.ask("resume", begin, length, own, self._is_final)
            return not call.endswith("DoStep")
        slave.time = self._time_of_failure(time, apart=apart)
        self._complain(status)
        return False

    def leave(self, time: float, *, apart: bool) -> None:
        """See to a step that is given up, to be taken in another way from restored states.

        Args:
            time: what the call that failed gives or takes is of this time in s.
            apart: whether that is no part of a step.

        Raises:
            FmuError: the instance is lost, or cannot be called any more.
        """
        self._raise_failure()
        self._slave.await_lane()
        status = self._process.note(NOTE_STATUS, self._seat)
        if not self.failed:
            return
        self._slave.time = self._time_of_failure(time, apart=apart)
        if status == FATAL or self.failed == "forget":
            self._complain(status)

    def _raise_failure(self) -> None:
        """Raise what ended the wait for a call in the loop."""
        failure = self._lane.failure()
        if failure is not None:
            raise failure

    def _failed_call(self) -> str:
        _, channel, part, *_ = self._table[abs(self._process.note(NOTE_FAILED, self._seat)) - 1]
        return self._slave.name_call(self.failed, channel, part)

    def _time_of_failure(self, time: float, *, apart: bool) -> float:
        if self.failed in ("save", "restore"):
            return self.time_of(self.failed)
        is_of_step = self.failed == "step" or (self.failed == "set" and not apart)
        return self.time_of("step") if is_of_step else time

    def _complain(self, status: int) -> None:
        """Raise what it has failed of."""
        self._slave.ask("complain", self._failed_call(), status)

    # ---------------------------------------------------------------- saved states that the kernel has left

    def restore(self, state: tuple[float, c_void_p]) -> None:
        """Come back to a state, of which the time in s is given, and what the kernel has for it."""
        self._slave.ask("come_back", self._number_of(state), state[0])

    def forget(self, state: tuple[float, c_void_p]) -> None:
        """Give it back, unless the instance is lost with it."""
        with suppress(LostError):
            self._slave.ask("give_back", self._number_of(state), state[0])

    def _number_of(self, state: tuple[float, c_void_p]) -> int:
        return self._table[(state[1].value or 0) - 1][1]
