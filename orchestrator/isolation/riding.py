"""How the compiled step loop calls an isolated instance: through shared memory, by functions like those of an FMU.

A step is then one hand-over between two processes that both watch for the other's, instead of a message that wakes one
of them: see ``native/lane.h``. Where there is no such lane, or for what it does not do, calls go as messages.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

from ..fmi import Interface
from .channel import IsolatedChannel
from .lanes import HAS_LANES, lane
from .messages import GET_INTEGERS, GET_REALS, LANE_STEP, NOTE_FAILED, SET_INTEGERS, SET_REALS
from .process import HostProcess

_DISCARD = 2
_VERSION = "2.0"
"""Of FMI, whose functions the lane calls."""
_CALLS = {SET_REALS: "set", SET_INTEGERS: "set", LANE_STEP: "step", GET_REALS: "get", GET_INTEGERS: "get"}


class Rider(Protocol):
    """What a ride needs of its instance."""

    name: str
    interface: Interface
    time: float
    rolls_back: bool

    @property
    def has_news(self) -> bool:
        """Whether there is anything that its process has not been told yet."""

    def ask(self, operation: str, *arguments: Any) -> Any:
        """Let its process do something."""

    def enter_lane(self) -> None:
        """Let its process take calls from the lane."""

    def await_lane(self, end: float) -> None:
        """Wait for a call that is under way in the lane, in or after a step to a time in s."""

    def name_call(self, call: str, channel: int) -> str:
        """The function of the standard behind a name of `messages.CALLS`, called for a channel."""


def may_ride(slave: Rider, channels: Iterable[Any]) -> bool:
    """Whether an isolated instance can be called through a lane, with these channels of its."""
    able = HAS_LANES and slave.interface.version == _VERSION and not slave.rolls_back
    return able and all(channel.cells is not None for channel in channels)


class Ride:
    """The calls of one isolated instance by the compiled step loop, in the order in which they are added.

    Args:
        slave: the instance. process: its process. seat: its number there.
    """

    def __init__(self, slave: Rider, process: HostProcess, seat: int) -> None:
        self._slave, self.name = slave, slave.name
        self._process, self._lane = process, process.open_lane()
        self._seat = seat
        self._rider = lane.Rider(self._lane, process.begins[seat], seat)
        self._table: list[tuple[int, int]] = []
        self._is_on = False

    def add_step(self) -> tuple[int, int]:
        """The function that takes a step, and what stands for the instance in its calls, as addresses."""
        self._table.append((LANE_STEP, -1))
        return lane.FUNCTIONS[LANE_STEP], self._rider.add(LANE_STEP, 0, 0)

    def add(self, channel: IsolatedChannel, *, is_get: bool) -> tuple[int, int]:
        """The same for a function that reads or sets variables."""
        assert channel.cells is not None
        kinds = (GET_REALS, GET_INTEGERS) if is_get else (SET_REALS, SET_INTEGERS)
        kind = kinds[channel.kind != "Real"]
        self._table.append((kind, channel.index))
        return lane.FUNCTIONS[kind], self._rider.add(kind, channel.cells.offset, channel.cells.count)

    def board(self) -> None:
        """Tell the process what its calls are, unless it knows that.

        Raises:
            FmuError: it is lost, or what was set before is refused.
        """
        if not self._is_on or self._slave.has_news:
            self._rider.begin()
            self._slave.ask("board", self._table)
            self._is_on = True

    def begin(self) -> None:
        """Let the process take calls from the lane, once all who live there have boarded.

        Raises:
            FmuError: it is lost.
        """
        self._slave.enter_lane()

    def end(self) -> None:
        """Let the process take messages again, of which one is for this instance: it boards anew then."""
        self._is_on = False
        self._process.leave_lane()

    @property
    def last_step(self) -> tuple[float, float]:
        """Time and length in s of the last step; of length 0 if there was none."""
        begin, length = self._rider.last_step()
        return float(begin), float(length)

    @property
    def last_end(self) -> float | None:
        """The end in s of the last step, if there was one."""
        begin, length = self.last_step
        return begin + length if length else None

    def recover(self, call: str, status: int, time: float) -> bool:
        """See to a call that failed: whether it is to be made again, because nothing is wrong in the end.

        Args:
            call: the function of the standard.
            status: what it returned; it may be that of an earlier call.
            time: what this call gives or takes is of this time in s.

        Raises:
            FmuError: the instance failed, or is lost.
        """
        slave = self._slave
        begin, length = self._rider.last_step()
        if status == lane.SILENT:
            slave.time = begin
            slave.await_lane(begin + length)
            return True
        kind, channel = self._table[abs(self._process.note(NOTE_FAILED, self._seat)) - 1]
        if kind == LANE_STEP and status == _DISCARD:
            slave.ask("resume", begin, length, status, True)
            return not call.endswith("DoStep")
        slave.time = time if _CALLS[kind] == "get" else begin
        self.check(slave.name_call(_CALLS[kind], channel), status)
        return False

    def check(self, call: str, status: int) -> None:
        """Raise unless the status of a call is ok or warning, and what was set before was taken."""
        self._slave.ask("check", call, status)
