"""The bridge to the compiled step loop: an explicit algorithm's operations as flat arrays, and blocks of steps with it.

The kernel is an optional extension: without it, or for what it does not do (components as Python objects, text
signals), steps are taken in Python with identical results.
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import addressof
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import world
from ..fmi import Channel, Slave
from ..fmi.binding import ElementsChannel, Fmi3Slave, FmuSlave, is_watched
from ..fmi.guard import GUARD, NOTE_SIZE, NOTES, own_note, said
from ..isolation import IsolatedChannel, IsolatedSlave, Ride, may_ride
from .algorithms import Explicit, Operation
from .coupling import Coupling
from .exchange import Change, Exchange
from .flattening import TYPES, Wide, can_exchange, parts_of
from .observer import Observer, Table

try:
    from . import kernel
except ImportError:  # installed without a C compiler
    kernel = None  # type: ignore[assignment]

HAS_KERNEL = kernel is not None
_look: Any = getattr(kernel, "look", None)
HAS_THREADS = HAS_KERNEL and bool(kernel.HAS_THREADS)
_CHANGE = 3
"""The kernel's number for what an event does to values that have been read; the others are `Operation`."""
_AS_IT_IS, _TRUE_ABOVE, _ROUNDED_UP = 0, 1, 2
"""The kernel's numbers for what a threshold does."""
_DISCARD = 2
_NONE = 2**32 - 1
"""What stands where there is no value reference, so that lists of other lengths are others."""
_BLOCK_SECONDS = 0.05
"""Wall time a block is meant to take: short enough for Ctrl-C and a progress bar, long enough to cost nothing."""
_GROWTH = 256
"""How many times longer than the last a block may be: the first is a single step, of which nothing is known."""
_MOST_VALUES = 4_000_000
"""Numbers a block may record, so that its buffer stays small."""

_CHANNEL = np.dtype(
    [(name, "u8") for name in ("function", "component")]
    + [(name, "i8") for name in ("begin", "count", "is_real", "type", "reference_count")]
)
_INSTANCE = np.dtype([("function", "u8"), ("component", "u8"), ("told", "u8")])
_ENTRY = np.dtype(
    [
        ("place", "i8"),
        ("age", "i8"),
        ("change", "i8"),
        ("scale", "f8"),
        ("offset", "f8"),
        ("whole", "i8"),
        ("threshold", "f8"),
        ("form", "i8"),
    ]
)
_CHANGES = np.dtype(
    [("active", "i8"), ("place", "i8"), ("is_real", "i8"), *((n, "f8") for n in ("scale", "offset", "slope", "since"))]
)
_OPERATION = np.dtype([(name, "i4") for name in ("kind", "index", "period", "phase", "is_watched")])
_PLACE = np.dtype([(name, "i8") for name in ("begin", "failed", "status")])

SWING = np.dtype(
    [(name, "f8") for name in ("peak", "last", "from", "size")] + [(x, "i8") for x in ("way", "rises", "is_begun")]
)
"""What the kernel notes of how a signal grows, as growth.h has it."""

_OWN = [each.itemsize for each in (_OPERATION, _CHANNEL, _INSTANCE, _ENTRY, _CHANGES, _PLACE)]
_SIZES = (_OWN[0], 8, *_OWN[1:4], 4, 8, _OWN[4], 8, 8, 8, 8, _OWN[5], 8)
"""Of what the kernel's buffers hold, in bytes, in the order in which it takes them."""


def _check_layout(found: int) -> None:
    """Raise unless the kernel was compiled from the sources that stand beside this file."""
    if found != reduce(lambda total, size: 31 * total + size & 0x7FFFFFFF, _SIZES, NOTE_SIZE + SWING.itemsize):
        raise RuntimeError(
            "the compiled step loop (orchestrator/master/kernel) is of another version than its Python files: install "
            "the package again (`pip install -e . --no-deps` in a checkout)"
        )


if HAS_KERNEL:
    _check_layout(getattr(kernel, "LAYOUT", 0))
    if GUARD:
        kernel.watch(GUARD)

_Entry = tuple[int, int, int, float, float, int, float, int]
_Called = FmuSlave | Fmi3Slave | Ride


class CompiledLoop:
    """An explicit algorithm's plan for the kernel."""

    @classmethod
    def of(cls, coupling: Coupling, algorithm: Explicit) -> CompiledLoop | None:
        """One that takes these steps, where the kernel is there and can do all that is asked for."""
        able = kernel is not None and all(_can_be_called(x, coupling.exchange) for x in coupling.slaves.values())
        mapped = any(link.mapping is not None for link in coupling.exchange.links)
        held = not coupling.settings.stepping.extrapolation and coupling.loops is None and coupling.refresher is None
        able = able and held and not mapped and can_exchange(coupling.exchange)
        return cls(coupling, algorithm) if able else None

    def __init__(self, coupling: Coupling, algorithm: Explicit) -> None:
        self._coupling = coupling
        self._exchange = coupling.exchange
        self._wide = Wide(coupling.exchange)
        self._under_way: tuple[Table, Observer, float, float] | None = None
        self._note = 0
        self._channels: list[tuple[int, ...]] = []
        self._arrays: list[ElementsChannel] = []
        self._entries: list[_Entry] = []
        self._references: list[int] = []
        self._operations: list[tuple[int, int, int, int]] = []
        self._culprits: list[tuple[_Called | None, str]] = []
        self._instances: list[tuple[int, int, int]] = []
        self._changes: list[tuple[Change, int, bool]] = []
        self._slaves = {name: _called(slave) for name, slave in coupling.slaves.items()}
        self._rides = [slave for slave in self._slaves.values() if isinstance(slave, Ride)]
        self._whole = [place for place, kind in enumerate(self._exchange.kinds) if kind != "Real"]
        is_shared = kernel.HAS_THREADS and algorithm.takes_threads
        self.threads = max(1, min(coupling.settings.threads, len(self._slaves))) if is_shared else 1
        ends: list[int] = []
        for batch in algorithm.batches():
            names = list(batch.names)
            for share in np.array_split(names, self.threads) if self.threads > 1 else [names]:
                self._add(list(share), batch.operations)
                ends.append(len(self._operations))
        self._plan = (
            np.array(
                [
                    (*operation, isinstance(slave, FmuSlave) and is_watched(slave))
                    for operation, (slave, _) in zip(self._operations, self._culprits, strict=True)
                ],
                _OPERATION,
            ),
            np.array(ends if self.threads > 1 else [len(self._operations)], dtype=np.int64),
            np.array(self._channels, dtype=_CHANNEL),
            np.array(self._instances, dtype=_INSTANCE),
            np.array(self._entries, dtype=_ENTRY),
            np.array(self._references, dtype=np.uint32),
            self._wide.forms,
        )

    def _add(self, names: Sequence[str], operations: Sequence[Operation]) -> None:
        add = {Operation.SET: self._add_sets, Operation.STEP: self._add_step, Operation.GET: self._add_gets}
        for operation in operations:
            for name in names:
                add[operation](self._slaves[name], self._coupling.settings.rates.get(name, 1))

    def _rank(self, operation: int) -> tuple[bool, int]:
        """Where an operation of several that failed would stand without threads: all are set before any steps."""
        return self._operations[operation][0] != Operation.SET, operation

    def _add_operation(self, kind: int, index: int, culprit: tuple[_Called | None, str], due: tuple[int, int]) -> None:
        self._operations.append((kind, index, *due))
        self._culprits.append(culprit)

    def _add_sets(self, slave: _Called, rate: int) -> None:
        for feed in self._exchange.feeds[slave.name]:
            entries = []
            for k, source in enumerate(feed.sources):
                age, slot = feed.ages[k], feed.changes[k] if feed.changes else None
                threshold = feed.thresholds[k]
                whole = _AS_IT_IS if threshold is None else _TRUE_ABOVE if feed.kind == "Boolean" else _ROUNDED_UP
                change = -1 if slot is None else self._add_change(slot, -1, feed.is_real)
                place = (source, -1 if age is None else age, change)
                changed = feed.scales[k], feed.offsets[k], whole, threshold or 0.0
                entries.append((*place, *changed, self._wide.form(source)))
            self._add_channels(Operation.SET, slave, feed.channel, entries, feed.is_real, due=(rate, 0))

    def _add_gets(self, slave: _Called, rate: int) -> None:
        for part in self._exchange.yields[slave.name]:
            due = (rate, 0 if part.direct else rate - 1)
            whole = _TRUE_ABOVE if part.kind == "Boolean" else _AS_IT_IS
            entries = [(place, -1, -1, 1.0, 0.0, whole, 0.0, 0) for place in range(part.begin, part.end)]
            self._add_channels(Operation.GET, slave, part.channel, entries, part.is_real, due=due)
            for place, change in self._exchange.output_changes.items():
                if part.begin <= place < part.end:
                    index = self._add_change(change, place, part.is_real)
                    self._add_operation(_CHANGE, index, (None, "an event"), due)

    def _add_change(self, change: Change, place: int, is_real: bool) -> int:
        self._changes.append((change, place, is_real))
        return len(self._changes) - 1

    def _add_channels(
        self,
        kind: int,
        slave: _Called,
        channel: Channel,
        entries: Sequence[_Entry],
        is_real: bool,
        *,
        due: tuple[int, int],
    ) -> None:
        if isinstance(channel, ElementsChannel):
            self._arrays.append(channel)
        for own, places in parts_of(channel) or ():
            call = own.calls[kind == Operation.GET]
            self._add_operation(kind, len(self._channels), (slave, call), due)
            if isinstance(slave, Ride):
                assert isinstance(own, IsolatedChannel)
                addresses = slave.add(own, is_get=kind == Operation.GET)
            else:
                addresses = slave.addresses(call)
            what = len(self._entries), len(places), int(is_real), TYPES.get(own.kind, 0) * isinstance(slave, Fmi3Slave)
            self._channels.append((*addresses, *what, len(own.references)))
            self._entries += [entries[k] for k in places]
            self._references += [*own.references, *[_NONE] * (len(places) - len(own.references))]

    def _add_step(self, slave: _Called, rate: int) -> None:
        call = FmuSlave.DO_STEP if isinstance(slave, Ride) else slave.DO_STEP
        self._add_operation(Operation.STEP, len(self._instances), (slave, call), (rate, 0))
        addresses = slave.add_step() if isinstance(slave, Ride) else slave.addresses(call)
        self._instances.append((*addresses, addressof(slave.told) if isinstance(slave, Fmi3Slave) else 0))

    def run(
        self,
        start_time: float,
        step: float,
        points: tuple[int, int, int],
        every: int,
        observe: Observer,
        *,
        table: Table | None = None,
    ) -> bool:
        """Take communication steps in blocks; True unless the observer stopped the run.

        Args:
            start_time: in s.
            step: in s.
            points: numbers of the communication points to begin at, to stop at, and of the run's last.
            every: a row is due after every so many steps, and after the last.
            observe: given the rows.
            table: where they are kept; without one they may go when they were observed.

        Raises:
            FmuError: a model failed, or a value is not finite.
        """
        coupling, exchange = self._coupling, self._exchange
        done, stop, count = points
        self._note = own_note()
        places = np.zeros(self.threads, _PLACE)
        places["failed"] = -1
        disturbed = np.zeros(len(self._operations), np.int64)
        values = self._wide.packed(exchange.values)
        history, newest = self._unrolled(len(values))
        changes = np.array(
            [
                (slot.active, place, is_real, slot.scale, slot.offset, slot.slope, slot.since)
                for slot, place, is_real in self._changes
            ],
            dtype=_CHANGES,
        )
        goes_on, block = True, 1
        most = max(1, _MOST_VALUES // (len(values if table is None else table.kept) + 1)) * every
        while done < stop and goes_on:
            block = min(block, stop - done, most)
            due = _rows_due(done, block, every, count)
            into = Table(range(len(values)), due) if table is None else table
            cells = into.room(due)
            self._under_way = into, observe, start_time, step
            for ride in self._rides:
                ride.begin()
            begin = world.perf_counter()
            taken, written, newest = kernel.run(
                *(*self._plan, changes, into.kept, values, history, newest, cells, into.count, places, disturbed),
                *(every, start_time, step, done, block, count),
            )
            seconds = world.perf_counter() - begin
            self._under_way = None
            done += taken
            self._tell_disturbers(disturbed, done, places)
            coupling.steps, coupling.time = done, start_time + done * step
            exchange.values[:] = self._wide.unpacked(values)
            for place in self._whole:  # the kernel's values are all doubles
                exchange.values[place] = int(exchange.values[place])
            if taken:
                self._roll(history, newest)
                goes_on = observe(done, into.filled(written))
            if goes_on:
                self._go_on(places, start_time + done * step, step)
            block = max(1, int(taken * min(_BLOCK_SECONDS / max(seconds, 1e-9), _GROWTH)))
        for slave in coupling.slaves.values():
            slave.time = start_time + done * step
        for array in self._arrays:
            array.forget()
        return goes_on

    def rescue(self) -> None:
        """Tell the observer of the rows that the block under way has written, which does not return any more."""
        if self._under_way is None:
            return
        table, observe, start_time, step = self._under_way
        written = int(NOTES.note(self._note)[3])
        if written:
            rows = table.filled(written)
            time, *values = rows[-1].tolist()
            self._coupling.steps, self._coupling.time = round((time - start_time) / step), time
            for place, value in zip(table.kept.tolist(), values, strict=True):
                self._exchange.values[place] = value
            observe(self._coupling.steps, rows)

    def _tell_disturbers(self, disturbed: NDArray[np.int64], done: int, places: NDArray[np.void]) -> None:
        """Note who did it, in a step that was left up to what failed first: without threads there is nothing after."""
        failed = min((self._rank(n) for n in places["failed"].tolist() if n >= 0), default=None)
        for operation in np.flatnonzero(disturbed).tolist():
            slave = self._culprits[operation][0]
            if isinstance(slave, FmuSlave) and (
                disturbed[operation] <= done or (failed is not None and self._rank(operation) <= failed)
            ):
                slave.mend()
                disturbed[operation] = 0

    def _unrolled(self, width: int) -> tuple[NDArray[np.float64], int]:
        """The recorded points that delayed connections look back on, as the kernel's ring, and its newest row."""
        kept = list(self._exchange.history)
        rows = [*[kept[0]] * (self._exchange.depth - len(kept)), *kept] if kept else []
        packed = np.array([self._wide.packed(row) for row in rows], dtype=np.float64)
        return packed.reshape(len(rows), width), max(0, len(rows) - 1)

    def _roll(self, history: NDArray[np.float64], newest: int) -> None:
        if len(history):
            self._exchange.history.extend(map(self._wide.unpacked, np.roll(history, -newest - 1, axis=0)))

    def _go_on(self, places: NDArray[np.void], time: float, step: float) -> None:
        """After the first failure of a step let its part of the step go on; those after it wait for their turn."""
        failed: list[int] = places["failed"].tolist()
        if max(failed) >= 0:
            part = min((n for n, operation in enumerate(failed) if operation >= 0), key=lambda n: self._rank(failed[n]))
            again = self._recover(failed[part], int(places[part]["status"]), time, step)
            places[part] = failed[part] + (not again), -1, 0

    def _recover(self, failed: int, status: int, time: float, step: float) -> bool:
        """Go on where an FMU discarded a step that it takes in parts; raise what happens in Python otherwise.

        True where the operation that failed is to be done again.
        """
        slave, call = self._culprits[failed]
        assert slave is not None
        period, phase = self._operations[failed][2:]
        when = time + (period - phase) * step if "Get" in call else time
        if isinstance(slave, Ride):
            if not 0 <= status <= 1:
                return slave.recover(call, status, when)
        elif call == slave.DO_STEP and 0 <= status <= _DISCARD:  # it was discarded, or ended early
            slave.resume(time, period * step, status, final=True)
            return False
        owner = self._coupling.slaves[slave.name]
        owner.time = when
        if "Set" in call and 0 <= status <= 1:  # a number that its type does not hold
            self._exchange.write(slave.name, time)
        if status >> 32 > 0 and not isinstance(slave, Ride):  # a call that was left, how, and with which exit code
            raise slave.lose(said(call, status >> 32, (status & 0x7FFFFFFF) - (status & 0x80000000)))
        slave.check(call, status)
        self._exchange.check_finite(owner)
        return False


def _can_be_called(slave: Slave, exchange: Exchange) -> bool:
    """Whether the kernel can call an instance, and set and read what is exchanged."""
    if isinstance(slave, IsolatedSlave):
        given = [part.channel for part in exchange.yields[slave.name]]
        return may_ride(slave, [*(feed.channel for feed in exchange.feeds[slave.name]), *given])
    return isinstance(slave, FmuSlave | Fmi3Slave) and not slave.rolls_back


def _called(slave: Slave) -> _Called:
    """What the kernel calls."""
    if isinstance(slave, IsolatedSlave):
        return slave.ride()
    assert isinstance(slave, FmuSlave | Fmi3Slave)
    return slave


def _rows_due(done: int, block: int, every: int, count: int) -> int:
    """How many of the next steps are recorded: every so many, and the last."""
    end = done + block
    return end // every - done // every + int(end == count and count % every != 0)


def note_swings(swings: NDArray[np.void], number: int, values: NDArray[np.float64]) -> None:
    """Take the next values of a signal in, whose `SWING` has this number; without the kernel nothing is noted."""
    if HAS_KERNEL:
        _look(swings, number, np.ascontiguousarray(values))
