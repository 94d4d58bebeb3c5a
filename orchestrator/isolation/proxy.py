"""An instance in another process behind the same face: its crash, hang or leak is an `FmuError`, not our end.

What is set is written into shared memory and waits there; a step takes it along, and brings back what was read after
the step before: one round trip per communication step. A step whose outputs will be read is not waited for until they
are: instances that step one after the other in ``jacobi`` compute at the same time.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ..errors import FmuError, LostError
from ..fmi import Interface, Type
from ..fmi.binding import call_name
from . import messages
from .channel import IsolatedChannel
from .messages import Cells, Report, Saved, frame
from .process import HostProcess
from .riding import Ride
from .seats import Guest, HostLostError

_LOG = logging.getLogger(__name__)


class IsolatedSlave:
    """An FMU in a process of its own, or one that it shares.

    The process is awaited when it is first needed, so that many start at the same time: an FMU that cannot be
    instantiated is an error of the first call.

    Args:
        guest: the instance.
        process: where it lives; whoever lives there takes a seat in the order in which it was told of them.
    """

    def __init__(self, guest: Guest, process: HostProcess) -> None:
        self.name = guest.name
        self.interface: Interface = guest.interface
        self.time, self.rolls_back = 0.0, False
        self.log: list[str] = []
        self.disturbed: dict[str, None] = {}
        self._ride: Ride | None = None
        self._process, self._seat = process, len(process.seated)
        process.seated.append(self)
        self._begin = process.begins[self._seat] + messages.HEAD
        self._room, self._used = guest.cells, 0
        slopes, question = (self._begin + 8 * place for place in guest.places)
        self.slopes = slopes, guest.slopes
        """Where derivatives of inputs stand, and how many may."""
        self.question = question, guest.asked
        """The same for what is asked for directional ones."""
        self.functions: frozenset[str] = frozenset()  # that its library has, once the process has told
        self._is_made = self._is_gone = False
        self._lost: FmuError | None = None
        self._channels: list[IsolatedChannel] = []
        self._known: dict[tuple[Type, tuple[str, ...]], IsolatedChannel] = {}
        self._saved = 0
        self._queue = b""
        """Frames that need no answer and go with the next that does."""
        self._dirty: list[int] = []
        """Channels that were set, in that order, and not yet sent."""
        self.end: float | None = None
        """The end in s of a step that is under way and was not waited for."""
        self.moment = 0
        """Counts what makes values that were read old."""
        self._after_step = False
        self.reads: dict[IsolatedChannel, None] = {}
        """Channels read at this moment."""
        self._habits: dict[bool, tuple[IsolatedChannel, ...]] = {False: (), True: ()}
        """Those read the last time when there had been no step, or one: they are fetched together."""
        self._watched: tuple[IsolatedChannel, ...] = ()
        """Those that the process reads after a step."""

    @property
    def pid(self) -> int:
        """The number of its process; until that is ready, of its guard."""
        return self._process.pid

    # ---------------------------------------------------------------- the face of an instance

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment."""
        self.ask("setup", start_time, stop_time)

    def enter_initialization(self) -> None:
        """Enter initialization mode."""
        self.ask("enter_initialization")

    def exit_initialization(self) -> None:
        """Leave initialization mode."""
        self.ask("exit_initialization")

    def channel(self, kind: Type, names: Sequence[str]) -> IsolatedChannel:
        """Prepare variables of one type for being set or read together."""
        key = kind, tuple(names)
        if key not in self._known:
            for name in names:
                self.interface.variables[name]  # a KeyError here, as without isolation
            offset = None
            if kind != "String" and self._used + len(names) <= self._room:
                offset = self._begin + 8 * self._used
                self._used += len(names)
            self._queue += frame(messages.CHANNEL, (kind, key[1], offset))
            cells = None if offset is None else Cells(self._process.memory, offset, kind, len(names))
            self._known[key] = IsolatedChannel(self, len(self._channels), *key, cells)
            self._channels.append(self._known[key])
        return self._known[key]

    def step(self, time: float, length: float, *, final: bool = True) -> None:
        """Advance from ``time`` by ``length``, both in s; not ``final`` where an older state may be restored."""
        if self.end is not None:
            self._finish()
        self.outdate()
        watched = self._habits[True]
        if watched != self._watched:
            self._queue += frame(messages.WATCH, [channel.index for channel in watched])
            self._watched = watched
        dirty = self._dirty
        size = messages.STEP_BODY.size + 4 * len(dirty)
        ring = messages.STEP_FRAME.pack(messages.STEP, size, time, length, final)
        self.time = time
        self._send(ring + struct.pack(f"={len(dirty)}I", *dirty))
        self.end, self._after_step = time + length, True
        if not (final and watched):
            self._finish()

    def roll_back(self) -> None:
        """From now on be restored after steps that it discards."""
        self.rolls_back = True
        self.ask("roll_back")

    def save(self) -> Saved:
        """The present state: a handle of the process's."""
        self._saved += 1
        self.ask("save", self._saved)
        return Saved(self._saved, self.time)

    def restore(self, state: Saved) -> None:
        """Come back to a saved state; it stays saved."""
        self.ask("restore", state.number)

    def forget(self, state: Saved) -> None:
        """Give a saved state back."""
        if self._lost is None and not self._is_gone:
            self.ask("forget", state.number)

    def serialize(self, state: Saved) -> bytes:
        """A saved state as bytes, as they are without isolation."""
        return bytes(self.ask("serialize", state.number))

    def deserialize(self, content: bytes) -> Saved:
        """A saved state, out of its bytes."""
        self._saved += 1
        return Saved(self._saved, self.ask("deserialize", self._saved, content))

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """How the unknowns change when the knowns change by ``seed``; all are Real variables."""
        return list(self.ask("directional_derivatives", list(unknowns), list(knowns), list(seed)))

    def interpolate(self, names: Sequence[str], orders: Sequence[int], values: Sequence[float]) -> None:
        """Time derivatives of inputs over the coming step: one name, order (from 1) and value each."""
        self.ask("interpolate", list(names), list(orders), list(values))

    def terminate(self) -> None:
        """End the run."""
        self.ask("terminate")

    def reset(self) -> None:
        """Come back to where it was when it was instantiated: another run may follow."""
        self.ask("reset")
        self.log, self.rolls_back = [], False

    def free(self) -> None:
        """Give everything back, with the last its process. Never raises: what goes wrong now is no more than logged."""
        if self._is_gone:
            return
        self._is_gone, is_last = True, self._process.leave()
        try:
            if self._lost is None and self._is_made:
                if self.end is not None:
                    self.end = None
                    self._process.receive(self._seat)
                self._leave_lane()
                self._process.send(self._seat, frame(messages.CALL, (self._dirty, "free", (is_last,))))
                self._process.receive(self._seat)
                if is_last:
                    self._process.wait()
        except HostLostError as lost:
            _LOG.warning("%s: %s", self._process.seated[lost.seat].name, lost)
            self._bury(lost)
        finally:
            if is_last:
                self._process.kill()

    # ---------------------------------------------------------------- for the compiled step loop

    def ride(self) -> Ride:
        """A new plan of calls through the lane, in the place of an older one."""
        if not self._is_made:
            self._await()
        self._leave_lane()
        self._ride = Ride(self, self._process, self._seat)
        return self._ride

    @property
    def has_news(self) -> bool:
        """Whether there is anything that its process has not been told yet."""
        return bool(self._queue or self._dirty or self.end is not None)

    def _leave_lane(self) -> None:
        if self._ride is not None:
            self._ride.end()

    def enter_lane(self) -> None:
        """Let its process take calls from the lane.

        Raises:
            FmuError: it is lost.
        """
        with self._mourning():
            self._process.enter_lane()

    def await_lane(self) -> None:
        """Wait for what is under way in the lane.

        Raises:
            FmuError: it is lost.
        """
        assert self._ride is not None
        self.time, self.end = self._ride.time_of("step"), self._ride.time_of("get")
        with self._mourning():
            self._process.await_lane(self._seat)
        self.end = None

    # ---------------------------------------------------------------- for the channels

    def outdate(self) -> None:
        """Values that were read are old from now on; what was read together will be fetched together."""
        self.moment += 1
        if self.reads or self._after_step:
            self._habits[self._after_step] = tuple(self.reads)
            self.reads = {}
            self._after_step = False

    def set_later(self, channel: IsolatedChannel, values: Sequence[Any]) -> None:
        """Keep values for the next call."""
        if self._lost is not None:
            raise self._lost
        if self.end is not None:
            self._finish()
        if channel.index in self._dirty:
            self.ask("")
        self.outdate()
        if channel.cells is None or not channel.cells.write(values):
            self._queue += frame(messages.VALUES, (channel.index, list(values)))
        self._dirty.append(channel.index)

    def refresh(self, channel: IsolatedChannel) -> None:
        """See to it that what a channel shows is of this moment."""
        if self.end is not None:
            self._finish()
        if channel.moment == self.moment:
            return
        if channel.problem is None or channel.problem[0] != self.moment:
            habit = (x for x in self._habits[self._after_step] if x is not channel and x.moment != self.moment)
            wanted = [channel, *habit]
            self._take(wanted, self._call("get", [x.index for x in wanted]))
        if channel.problem is not None and channel.problem[0] == self.moment:
            self.log = channel.problem[1].log
            raise channel.problem[1]

    # ---------------------------------------------------------------- talk

    def _finish(self) -> None:
        """Wait for a step that is under way."""
        report = self._receive()
        end, self.end = self.end, None
        if report is None and end is not None:
            self.time = end
            for channel in self._watched:
                channel.moment, channel.texts = self.moment, None
        elif report is not None:
            self._take(self._watched, self._checked(report))

    def ask(self, operation: str, *arguments: Any) -> Any:
        """Let the process do something that may change every value, as all but a few do."""
        if self.end is not None:
            self._finish()
        if operation not in ("save", "forget", "serialize"):
            self.outdate()
        return self._call(operation, *arguments).result

    def _call(self, operation: str, *arguments: Any) -> Report:
        # The queue first: what waits to be set may stand in it.
        self._send(frame(messages.CALL, (self._dirty, operation, arguments)))
        return self._checked(self._receive())

    def _send(self, ring: bytes) -> None:
        if self._lost is not None:
            raise self._lost
        if not self._is_made:
            self._await()
        ring, self._queue, self._dirty = self._queue + ring, b"", []
        self._leave_lane()
        with self._mourning():
            self._process.send(self._seat, ring)

    def _await(self) -> None:
        """Wait for the process and for the instance in it."""
        with self._mourning():
            self._process.wait_until_ready()
        try:
            self.functions = frozenset(map(str, self._checked(self._receive()).result or ()))
        except FmuError as error:
            self._lost = error
            raise
        self._is_made = True

    def _receive(self) -> Report | None:
        """What the process tells; None if there is nothing to tell."""
        if self._lost is not None:
            raise self._lost
        with self._mourning():
            kind, body = self._process.receive(self._seat)
            try:
                return Report.read(body, self.name) if kind == messages.REPORT else None
            except ValueError as error:
                raise self._process.garbled(error) from error

    @contextmanager
    def _mourning(self) -> Iterator[None]:
        """Make an error of what ends the process, and nothing to be waited for of a process that is given up."""
        try:
            yield
        except HostLostError as lost:
            error = self._bury(lost)
            if lost.is_stopped:
                _LOG.warning("%s", error)
                raise KeyboardInterrupt from lost
            raise error from lost
        except BaseException:  # a second Ctrl-C: it is not waited for
            self._process.kill()
            for one in self._process.seated:
                one.lose(FmuError("was interrupted", instance=one.name, time=one.time))
            raise

    def _bury(self, lost: HostLostError) -> FmuError:
        """Let everybody in the process know who has ended it."""
        error = self._process.seated[lost.seat].mourn(lost)
        for one in self._process.seated:
            one.lose(error)
        return error

    def mourn(self, lost: HostLostError) -> FmuError:
        """The error that tells that it was lost, with its process."""
        call = self._process.last_call()[0]
        if self._ride is not None and self._process.is_riding:  # the master's may be that of another's step
            self.time = self._ride.time_of(call)
        elif call == "get" and self.end is not None:
            self.time = self.end
        self.log = lost.log
        return LostError(str(lost), instance=self.name, time=self.time if self._is_made else None, log=lost.log)

    def lose(self, error: FmuError) -> None:
        """Let everything that is asked of it from now on be this error."""
        self.moment += 1
        self._lost = error

    def _checked(self, report: Report | None) -> Report:
        """A report of something that went well; anything else is raised."""
        if report is None:
            return Report(self.time)
        self.time = report.time
        if report.error is not None:
            self.log = report.error.log
            raise report.error
        return report

    def _take(self, channels: Iterable[IsolatedChannel], report: Report) -> None:
        """Note what was read."""
        failed, error = report.failed or (None, None)
        for channel in channels:
            if channel.index == failed and error is not None:
                channel.problem = self.moment, error
                break
            channel.moment, channel.texts = self.moment, report.texts.get(channel.index)

    def name_call(self, call: str, channel: int, part: int) -> str:
        """The function of the standard behind a name of `messages.CALLS`, called for a part of a channel."""
        if call in ("set", "get") and 0 <= channel < len(self._channels):
            return self._channels[channel].name_call(call, part)
        return call_name(self.interface, call, "Real", ())
