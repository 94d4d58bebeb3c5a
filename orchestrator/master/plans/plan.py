"""What the compiled step loop is given of a system and an algorithm, as flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import addressof

import numpy as np

from ...fmi import Channel, Slave
from ...fmi.binding import ElementsChannel, Fmi3Slave, FmuSlave, is_watched
from ...isolation import IsolatedChannel, IsolatedSlave, Ride, may_ride
from ..algorithms import Explicit, Operation
from ..coupling import Coupling
from ..exchange import Change, Exchange
from .flattening import TYPES, Wide, can_exchange, parts_of

_CHANGE = 3
"""The kernel's number for what an event does to values that have been read; the others are `Operation`."""
_AS_IT_IS, _TRUE_ABOVE, _ROUNDED_UP = 0, 1, 2
"""The kernel's numbers for what a threshold does."""
_NONE = 2**32 - 1
"""What stands where there is no value reference, so that lists of other lengths are others."""

CHANNEL = np.dtype(
    [(name, "u8") for name in ("function", "component")]
    + [(name, "i8") for name in ("begin", "count", "is_real", "type", "reference_count")]
)
INSTANCE = np.dtype([("function", "u8"), ("component", "u8"), ("told", "u8")])
ENTRY = np.dtype(
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
CHANGES = np.dtype(
    [("active", "i8"), ("place", "i8"), ("is_real", "i8"), *((n, "f8") for n in ("scale", "offset", "slope", "since"))]
)
OPERATION = np.dtype([(name, "i4") for name in ("kind", "index", "period", "phase", "is_watched")])
PLACE = np.dtype([(name, "i8") for name in ("begin", "failed", "status")])

SWING = np.dtype(
    [(name, "f8") for name in ("peak", "last", "from", "size")] + [(x, "i8") for x in ("way", "rises", "is_begun")]
)
"""What the kernel notes of how a signal grows, as growth.h has it."""

_OWN = [each.itemsize for each in (OPERATION, CHANNEL, INSTANCE, ENTRY, CHANGES, PLACE)]
SIZES = (_OWN[0], 8, *_OWN[1:4], 4, 8, _OWN[4], 8, 8, 8, 8, _OWN[5], 8)
"""Of what the kernel's buffers hold, in bytes, in the order in which it takes them."""

_Entry = tuple[int, int, int, float, float, int, float, int]
Called = FmuSlave | Fmi3Slave | Ride
"""What the kernel calls."""


class Plan:
    """The operations of an algorithm on a system's instances, for the kernel.

    Args:
        coupling: the instances and what they exchange.
        algorithm: what is done in a step.
        can_share: whether threads are there to share the work.

    Attributes:
        wide: what each of the values is.
        arrays: the plan, in the sequence in which the kernel takes it.
        operations: kind, index, period and phase of each.
        culprits: whom each of them calls, and by which function.
        changes: what events do, with the place among the values and whether it is a real number.
        channels: arrays that are set as a whole.
        threads: how many threads there is work for.
    """

    def __init__(self, coupling: Coupling, algorithm: Explicit, *, can_share: bool) -> None:
        self._coupling = coupling
        self._exchange = coupling.exchange
        self.wide = Wide(coupling.exchange)
        self._channels: list[tuple[int, ...]] = []
        self.channels: list[ElementsChannel] = []
        self._entries: list[_Entry] = []
        self._references: list[int] = []
        self.operations: list[tuple[int, int, int, int]] = []
        self.culprits: list[tuple[Called | None, str]] = []
        self._instances: list[tuple[int, int, int]] = []
        self.changes: list[tuple[Change, int, bool]] = []
        self._slaves = {name: _called(slave) for name, slave in coupling.slaves.items()}
        self.rides = [slave for slave in self._slaves.values() if isinstance(slave, Ride)]
        is_shared = can_share and algorithm.takes_threads
        self.threads = max(1, min(coupling.settings.threads, len(self._slaves))) if is_shared else 1
        ends: list[int] = []
        for batch in algorithm.batches():
            names = list(batch.names)
            for share in np.array_split(names, self.threads) if self.threads > 1 else [names]:
                self._add(list(share), batch.operations)
                ends.append(len(self.operations))
        self.arrays = (
            np.array(
                [
                    (*operation, isinstance(slave, FmuSlave) and is_watched(slave))
                    for operation, (slave, _) in zip(self.operations, self.culprits, strict=True)
                ],
                OPERATION,
            ),
            np.array(ends if self.threads > 1 else [len(self.operations)], dtype=np.int64),
            np.array(self._channels, dtype=CHANNEL),
            np.array(self._instances, dtype=INSTANCE),
            np.array(self._entries, dtype=ENTRY),
            np.array(self._references, dtype=np.uint32),
            self.wide.forms,
        )

    @staticmethod
    def is_able(coupling: Coupling) -> bool:
        """Whether the kernel can do all that is asked for."""
        able = all(_can_be_called(x, coupling.exchange) for x in coupling.slaves.values())
        mapped = any(link.mapping is not None for link in coupling.exchange.links)
        held = not coupling.settings.stepping.extrapolation and coupling.loops is None and coupling.refresher is None
        return able and held and not mapped and can_exchange(coupling.exchange)

    def rank(self, operation: int) -> tuple[bool, int]:
        """Where an operation of several that failed would stand without threads: all are set before any steps."""
        return self.operations[operation][0] != Operation.SET, operation

    def _add(self, names: Sequence[str], operations: Sequence[Operation]) -> None:
        add = {Operation.SET: self._add_sets, Operation.STEP: self._add_step, Operation.GET: self._add_gets}
        for operation in operations:
            for name in names:
                add[operation](self._slaves[name], self._coupling.settings.rates.get(name, 1))

    def _add_operation(self, kind: int, index: int, culprit: tuple[Called | None, str], due: tuple[int, int]) -> None:
        self.operations.append((kind, index, *due))
        self.culprits.append(culprit)

    def _add_sets(self, slave: Called, rate: int) -> None:
        for feed in self._exchange.feeds[slave.name]:
            entries = []
            for k, source in enumerate(feed.sources):
                age, slot = feed.ages[k], feed.changes[k] if feed.changes else None
                threshold = feed.thresholds[k]
                whole = _AS_IT_IS if threshold is None else _TRUE_ABOVE if feed.kind == "Boolean" else _ROUNDED_UP
                change = -1 if slot is None else self._add_change(slot, -1, feed.is_real)
                place = (source, -1 if age is None else age, change)
                changed = feed.scales[k], feed.offsets[k], whole, threshold or 0.0
                entries.append((*place, *changed, self.wide.form(source)))
            self._add_channels(Operation.SET, slave, feed.channel, entries, feed.is_real, due=(rate, 0))

    def _add_gets(self, slave: Called, rate: int) -> None:
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
        self.changes.append((change, place, is_real))
        return len(self.changes) - 1

    def _add_channels(
        self,
        kind: int,
        slave: Called,
        channel: Channel,
        entries: Sequence[_Entry],
        is_real: bool,
        *,
        due: tuple[int, int],
    ) -> None:
        if isinstance(channel, ElementsChannel):
            self.channels.append(channel)
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

    def _add_step(self, slave: Called, rate: int) -> None:
        call = FmuSlave.DO_STEP if isinstance(slave, Ride) else slave.DO_STEP
        self._add_operation(Operation.STEP, len(self._instances), (slave, call), (rate, 0))
        addresses = slave.add_step() if isinstance(slave, Ride) else slave.addresses(call)
        self._instances.append((*addresses, addressof(slave.told) if isinstance(slave, Fmi3Slave) else 0))


def _can_be_called(slave: Slave, exchange: Exchange) -> bool:
    """Whether the kernel can call an instance, and set and read what is exchanged."""
    if isinstance(slave, IsolatedSlave):
        given = [part.channel for part in exchange.yields[slave.name]]
        return may_ride(slave, [*(feed.channel for feed in exchange.feeds[slave.name]), *given])
    return isinstance(slave, FmuSlave | Fmi3Slave) and not slave.rolls_back


def _called(slave: Slave) -> Called:
    """What the kernel calls."""
    if isinstance(slave, IsolatedSlave):
        return slave.ride()
    assert isinstance(slave, FmuSlave | Fmi3Slave)
    return slave
