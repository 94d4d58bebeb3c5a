"""What the compiled step loop is given of a system and an algorithm, as flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import addressof, c_void_p

import numpy as np
from numpy.typing import NDArray

from ...fmi import Channel, Slave
from ...fmi.binding import ElementsChannel, Fmi3Slave, FmuSlave, LoadedSlave, is_watched
from ...isolation import IsolatedChannel, IsolatedSlave, Ride, may_ride
from ..algorithms import HEAD, Iteration, Operation, Programmed, Repeated
from ..coupling import Coupling
from ..exchange import Change, Exchange, Yield
from ..refresh import Refresher
from .courses import Courses
from .flattening import TYPES, Entry, Wide, can_exchange, parts_of
from .layout import (
    AS_IT_IS,
    CHANNEL,
    CIRCLE,
    ENTRY,
    INSTANCE,
    ITERATION,
    LOOP,
    METHODS,
    NONE,
    OPERATION,
    STATE,
    TRUE_ABOVE,
    Kind,
)

Called = FmuSlave | Fmi3Slave | Ride
"""What the kernel calls."""
_NOBODY = None, ""


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
        late: of each, whether what it sets is of the step's end, or its step is not the last word.
        culprits: whom each of them calls, and by which function.
        changes: what events do, with the place among the values and whether it is a real number.
        channels: arrays that are set as a whole.
        courses: the inputs that go on during a step.
        rounds: by operation, what it is repeated for. iterations: by the operation that ends a round.
        states: by instance, the number of its saved state.
        threads: how many threads there is work for.
    """

    def __init__(self, coupling: Coupling, algorithm: Programmed, *, can_share: bool) -> None:
        self._coupling = coupling
        self._exchange = coupling.exchange
        self.wide = Wide(coupling.exchange)
        self.courses = Courses(coupling.extrapolator, coupling.exchange)
        self._channels: list[tuple[int, ...]] = []
        self.channels: list[ElementsChannel] = []
        self._entries: list[Entry] = []
        self._feeds: list[tuple[str, int, list[int], bool, int]] = []
        self._changed_links = self._exchange.changed_links
        self._references: list[int] = []
        self.operations: list[tuple[int, int, int, int]] = []
        self.late: list[bool] = []
        self.culprits: list[tuple[Called | None, str]] = []
        self._instances: list[tuple[int, int, int]] = []
        self.changes: list[tuple[Change, int, bool]] = []
        self._slaves = {name: _called(slave) for name, slave in coupling.slaves.items()}
        self.rides = [slave for slave in self._slaves.values() if isinstance(slave, Ride)]
        self.rounds: dict[int, Iteration] = {}
        self.iterations: dict[int, Iteration] = {}
        self._loops: list[tuple[float, ...]] = []
        self._passed: list[int] = []
        self._work: list[tuple[int, Iteration]] = []
        self._room = 0
        self.states: dict[str, int] = {}
        is_shared = can_share and algorithm.takes_threads and coupling.refresher is None
        self.threads = max(1, min(coupling.settings.threads, len(self._slaves))) if is_shared else 1
        ends: list[int] = []
        for part in algorithm.program():
            if isinstance(part, Repeated):
                self._repeat(part)
                continue
            names = list(part.names)
            for share in np.array_split(names, self.threads) if self.threads > 1 else [names]:
                self._add(list(share), part.operations)
                ends.append(len(self.operations))
        if coupling.refresher is not None:
            self._refresh(coupling.refresher)
        self.arrays = (
            np.array(
                [
                    (*operation, isinstance(slave, FmuSlave) and is_watched(slave), late)
                    for operation, late, (slave, _) in zip(self.operations, self.late, self.culprits, strict=True)
                ],
                OPERATION,
            ),
            np.array(ends if self.threads > 1 else [len(self.operations)], dtype=np.int64),
            np.array(self._channels, dtype=CHANNEL),
            np.array(self._instances, dtype=INSTANCE),
            np.array(self._entries, dtype=ENTRY),
            np.array(self._references, dtype=np.uint32),
            self.wide.forms,
            self.courses.courses,
            np.array(self._loops, dtype=LOOP),
            np.array(self._passed, dtype=np.int64),
            self.courses.points,
            self._made_states(),
            self._made_work(),
            self.courses.stamps,
        )

    @staticmethod
    def is_able(coupling: Coupling, algorithm: Programmed) -> bool:
        """Whether the kernel can do all that is asked for."""
        exchange, slaves, refresher = coupling.exchange, coupling.slaves, coupling.refresher
        repeated = [n for part in algorithm.program() if isinstance(part, Repeated) for n in part.batch.names]
        able = all(_can_be_called(x, exchange) for x in slaves.values())
        able = able and not any(link.mapping is not None for link in exchange.every_link)
        able = able and all(can_be_restored(slaves[name]) for name in repeated)
        able = able and Courses.are_able(coupling.extrapolator, exchange)
        here = not any(isinstance(slave, IsolatedSlave) for slave in slaves.values())
        able = able and (refresher is None or (here and refresher.is_decided))
        return able and coupling.loops is None and can_exchange(exchange)

    def forget(self, time: float) -> None:
        """Give back the states that have been saved at a time in s and not been given back."""
        for name, n in self.states.items():
            handle, slave = int(self._handles[n]), self._slaves[name]
            self._handles[n] = 0
            if handle:
                assert isinstance(slave, LoadedSlave)
                slave.forget((time, c_void_p(handle)))

    def rank(self, operation: int) -> tuple[bool, int]:
        """Where an operation of several that failed would stand without threads: all are set before any steps."""
        return self.operations[operation][0] not in (Kind.SET, Kind.EXTEND, Kind.SLOPES), operation

    def follow(self) -> None:
        """Let inputs follow what they are connected to now."""
        if self._changed_links == self._exchange.changed_links:
            return
        self._changed_links, entries = self._exchange.changed_links, self.arrays[4]
        for name, n, changes, late, begin in self._feeds:
            feed = self._exchange.feeds[name][n]
            places = [k for _, places in parts_of(feed.channel) or () for k in places]
            made = self.wide.entries(feed, changes, late=late)
            entries[begin : begin + len(places)] = [made[k] for k in places]

    def _add(self, names: Sequence[str], operations: Sequence[Operation], *, final: bool = True) -> None:
        for operation in operations:
            for name in names:
                slave, rate = self._slaves[name], self._coupling.settings.rates.get(name, 1)
                if operation == Operation.SET:
                    self._add_sets(slave, rate)
                elif operation == Operation.STEP:
                    self._add_step(slave, rate, final=final)
                else:
                    self._add_gets(slave, rate, {Operation.GET_DIRECT: True, Operation.GET_REST: False}.get(operation))

    def _repeat(self, part: Repeated) -> None:
        """Add what is repeated from saved states: see ``native/kernel.h``."""
        names, iteration = part.batch.names, part.iteration
        passed, real_count = [*iteration.reals, *iteration.others], len(iteration.reals)
        method, relaxation = METHODS[iteration.stepping.acceleration], iteration.stepping.relaxation
        counts = real_count, iteration.guess_count, len(iteration.others)
        number, begin = len(self._loops), len(self._passed)
        self._loops.append(
            (ITERATION, iteration.stepping.max_iterations, self._room, begin, *counts, method, relaxation)
        )
        self._passed += passed
        self._work.append((self._room, iteration))
        u = iteration.guess_count
        self._room += len(iteration.numbers) + 2 * u + (0, 1 + u, 1 + 24 * u)[method]
        self._add_state(names, Kind.SAVE)
        self._add_operation(Kind.BEGIN, number, _NOBODY, (1, 0))
        self._add_state(names, Kind.RESTORE)
        self._add_operation(Kind.MARK, number, _NOBODY, (1, 0))
        first = len(self.operations)
        for name in names:
            self._add([name], part.batch.operations, final=False)
        self.rounds.update(dict.fromkeys(range(first, len(self.operations)), iteration))
        self.iterations[len(self.operations)] = iteration
        self._add_operation(Kind.END, number, _NOBODY, (1, 0))
        self._add_state(names, Kind.FORGET)

    def _add_state(self, names: Sequence[str], kind: Kind) -> None:
        for name in names:
            slave = self._slaves[name]
            assert isinstance(slave, LoadedSlave)
            index = self.states.setdefault(name, len(self.states))
            self._add_operation(kind, index, (slave, slave.STATE[kind - Kind.SAVE]), (1, 0))

    def _made_states(self) -> NDArray[np.void]:
        made = np.zeros(len(self.states), STATE)
        for name, n in self.states.items():
            slave = self._slaves[name]
            assert isinstance(slave, LoadedSlave)
            functions = [slave.addresses(call)[0] for call in slave.STATE[:3]]
            made[n] = (*functions, slave.pointer, 0)
        self._handles = made["handle"]
        return made

    def _made_work(self) -> NDArray[np.float64]:
        """Room for the numbers of what is repeated; those of iterations stand there from now on."""
        work = np.zeros(self._room)
        for begin, iteration in self._work:
            own = work[begin : begin + len(iteration.numbers)]
            own[:] = iteration.numbers
            iteration.use(own)
        return work

    def _refresh(self, refresher: Refresher) -> None:
        """Add what brings feed-through up to date."""
        for stage, is_circle in refresher.stages:
            names = [name for name in stage if name not in refresher.refused]
            number = len(self._loops)
            if is_circle:
                self._loops.append((CIRCLE, len(stage) + 1, self._room, *[0] * 5, 0.0))
                self._room += HEAD + 2 * len(self._exchange.values)
                self._add_operation(Kind.BEGIN, number, _NOBODY, (1, 0))
                self._add_operation(Kind.MARK, number, _NOBODY, (1, 0))
            for name in names:
                self._add_sets(self._slaves[name], 1, late=True)
                self._add_gets(self._slaves[name], 1, None, kind=Kind.READ)
            if is_circle:
                self._add_operation(Kind.END, number, _NOBODY, (1, 0))
            for name in names:
                for part in self._exchange.yields[name]:
                    if part.is_real:
                        self._add_reads(Kind.LOOK, self._slaves[name], part, (1, 0))

    def _add_operation(
        self, kind: int, index: int, culprit: tuple[Called | None, str], due: tuple[int, int], *, late: bool = False
    ) -> None:
        self.operations.append((kind, index, *due))
        self.late.append(late)
        self.culprits.append(culprit)

    def _add_sets(self, slave: Called, rate: int, *, late: bool = False) -> None:
        """Set inputs: as of a step's begin, continued if they are to be, or ``late``, at a communication point."""
        extrapolator = self._coupling.extrapolator
        course = None if extrapolator is None or late else extrapolator.courses.get(slave.name)
        for n, feed in enumerate(self._exchange.feeds[slave.name]):
            slots = feed.changes or [None] * len(feed.targets)
            changes = [-1 if slot is None else self._add_change(slot, -1, feed.is_real) for slot in slots]
            self._feeds.append((slave.name, n, changes, late, len(self._entries)))
            entries = self.wide.entries(feed, changes, late=late)
            if course is None or n != course.feed:
                self._add_channels(Kind.SET, slave, feed.channel, entries, feed.is_real, due=(rate, 0), late=late)
                continue
            number = self.courses.number(slave.name)
            self.courses.courses["channel"][number] = len(self._channels)
            self._add_channels(Kind.EXTEND, slave, feed.channel, entries, feed.is_real, due=(rate, 0))
            self._add_operation(Kind.SLOPES, number, (slave, FmuSlave.INTERPOLATE), (rate, 0))

    def _add_gets(self, slave: Called, rate: int, direct: bool | None, kind: Kind = Kind.GET) -> None:
        """Read outputs, all or those that are ``direct`` or not; with what events make of them."""
        for part in self._exchange.yields[slave.name]:
            if direct is not None and part.direct != direct:
                continue
            due = (rate, 0 if part.direct else rate - 1)
            self._add_reads(kind, slave, part, due)
            for place, change in self._exchange.output_changes.items():
                if part.begin <= place < part.end:
                    index = self._add_change(change, place, part.is_real)
                    self._add_operation(Kind.CHANGE, index, (None, "an event"), due)

    def _add_reads(self, kind: Kind, slave: Called, part: Yield, due: tuple[int, int]) -> None:
        whole = TRUE_ABOVE if part.kind == "Boolean" else AS_IT_IS
        entries = [(place, -1, -1, 1.0, 0.0, whole, 0.0, 0) for place in range(part.begin, part.end)]
        first = len(self._channels)
        self._add_channels(kind, slave, part.channel, entries, part.is_real, due=due)
        for channel in range(first, len(self._channels)) if self._exchange.stamps and kind != Kind.LOOK else ():
            self._add_operation(Kind.STAMP, channel, _NOBODY, due)

    def _add_change(self, change: Change, place: int, is_real: bool) -> int:
        self.changes.append((change, place, is_real))
        return len(self.changes) - 1

    def _add_channels(
        self,
        kind: int,
        slave: Called,
        channel: Channel,
        entries: Sequence[Entry],
        is_real: bool,
        *,
        due: tuple[int, int],
        late: bool = False,
    ) -> None:
        if isinstance(channel, ElementsChannel):
            self.channels.append(channel)
        for own, places in parts_of(channel) or ():
            call = own.calls[kind not in (Kind.SET, Kind.EXTEND)]
            index = self.courses.number(slave.name) if kind == Kind.EXTEND else len(self._channels)
            self._add_operation(kind, index, (slave, call), due, late=late)
            if isinstance(slave, Ride):
                assert isinstance(own, IsolatedChannel)
                addresses = slave.add(own, is_get=kind == Kind.GET)
            else:
                addresses = slave.addresses(call)
            what = len(self._entries), len(places), int(is_real), TYPES.get(own.kind, 0) * isinstance(slave, Fmi3Slave)
            self._channels.append((*addresses, *what, len(own.references)))
            self._entries += [entries[k] for k in places]
            self._references += [*own.references, *[NONE] * (len(places) - len(own.references))]

    def _add_step(self, slave: Called, rate: int, *, final: bool) -> None:
        call = FmuSlave.DO_STEP if isinstance(slave, Ride) else slave.DO_STEP
        self._add_operation(Kind.STEP, len(self._instances), (slave, call), (rate, 0), late=not final)
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


def can_be_restored(slave: Slave) -> bool:
    """Whether the kernel can save an instance's state and come back to it."""
    if not isinstance(slave, FmuSlave | Fmi3Slave) or not slave.interface.can_save_state:
        return False
    return all(call in slave.functions for call in slave.STATE[:3])
