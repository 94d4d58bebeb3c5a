"""What the compiled step loop is given of a system and an algorithm, as flat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import addressof, c_void_p

import numpy as np
from numpy.typing import NDArray

from ...fmi import Channel, Type
from ...fmi.binding import ElementsChannel, Fmi3Slave, Held, LoadedSlave, arrays_in, is_watched
from ...isolation import IsolatedPart, Ride
from ..algebraic import LoopSolver
from ..algorithms import Batch, Iteration, Operation, Repeated
from ..coupling import Coupling
from ..exchange import Change, Yield
from .ability import called
from .courses import Called, Courses
from .flattening import Entry, Wide, noted, parts_of, type_of
from .layout import (
    AS_IT_IS,
    AS_NOTED,
    AT_END,
    CHANNEL,
    ENTRY,
    INSTANCE,
    ITERATION,
    LOOP,
    METHODS,
    NOBODY,
    NONE,
    NOTING,
    OPERATION,
    PARTY,
    POINTS,
    SOLVER,
    STATE,
    TERM,
    TRUE_ABOVE,
    Kind,
)
from .points import Algebra, add_point

_STATES = {Operation.SAVE + n: (Kind(Kind.SAVE + n % 3), n // 3) for n in range(6)}
"""What is done to a state, and to which of an instance's."""


class Plan:
    """The operations of an algorithm on a system's instances, for the kernel.

    Args:
        coupling: the instances and what they exchange.
        sections: what is done at once. Behind that of the number ``refreshing`` feed-through is brought up to date.
        threads: how many there are to share the work.
        watched: places of values that are compared, and how many numbers that takes beside all the values.

    Attributes:
        wide: what each of the values is.
        arrays: the plan, in the sequence in which the kernel takes it.
        operations: kind, index, period and phase of each.
        late: of each, whether what it sets is of the step's end, or its step is not the last word.
        culprits: whom each of them calls, and by which function.
        changes: what events do, with the place among the values and of which type.
        channels: arrays that are set as a whole.
        courses: the inputs that go on during a step.
        rounds: by operation, what it is repeated for. iterations: by the operation that ends a round.
        slaves: whom it calls. loops: what is repeated. algebra: what is solved.
        passed: places of values that are compared, or solved for. feeds: inputs, and where their entries begin.
        room: how many numbers there is room for so far.
        states: by instance, and by which of its states, its number.
        threads: how many threads there is work for.
        width: how many numbers there are, the values first.
        work: room for numbers. spare: where that begins which is left of it.
    """

    def __init__(
        self,
        coupling: Coupling,
        sections: Sequence[Sequence[Batch | Repeated]],
        *,
        threads: int = 1,
        refreshing: int = 0,
        watched: Sequence[int] = (),
    ) -> None:
        self._coupling = coupling
        self.exchange = coupling.exchange
        self.wide = Wide(coupling.exchange)
        self._channels: list[tuple[int, ...]] = []
        self.channels: list[ElementsChannel] = []
        self._entries: list[Entry] = []
        self.feeds: list[tuple[str, int, list[int], bool, int]] = []
        self._changed_links = self.exchange.changed_links
        self._references: list[int] = []
        self.operations: list[tuple[int, int, int, int]] = []
        self.late: list[bool] = []
        self.culprits: list[tuple[Called | None, str]] = []
        self._instances: list[tuple[int, int, int]] = []
        self.changes: list[tuple[Change, int, Type]] = []
        self.slaves = {name: called(slave) for name, slave in coupling.slaves.items()}
        self.rides = [slave for slave in self.slaves.values() if isinstance(slave, Ride)]
        way = len(sections) > 1
        self.courses = Courses(self.slaves, coupling.extrapolator, coupling.exchange, in_every_way=way)
        self.rounds: dict[int, Iteration] = {}
        self.iterations: dict[int, Iteration] = {}
        self.loops: list[tuple[float, ...]] = []
        self.passed: list[int] = [*watched]
        self.algebra = Algebra()
        self._work: list[tuple[int, Iteration]] = []
        self.room = 0
        self.states: dict[tuple[str, int], int] = {}
        self._notes: list[tuple[int, int, int, int]] = []
        self._sets: dict[str, list[tuple[int, str]]] = {}
        self._shown: dict[str, list[tuple[int, int, str]]] = {}
        self.width = len(self.exchange.values)
        self.threads = threads
        ends: list[int] = []
        for n, section in enumerate(sections):
            for part in section:
                if isinstance(part, Repeated):
                    self._repeat(part)
                    continue
                names = list(part.names)
                for share in np.array_split(names, threads) if threads > 1 else [names]:
                    self._add(list(share), part.operations, final=len(sections) == 1)
                    ends += [len(self.operations)] * (threads > 1)
            if n == refreshing:
                add_point(self, coupling)
            ends += [len(self.operations)] * (threads == 1)
        self.spare = self.room
        if len(sections) > 1:
            self.room += 2 * len(watched) + 7 * self.width + 2 * self.courses.count * POINTS.itemsize // 8
        self.work = self._made_work()
        self.wide.widen(self.width - len(self.exchange.values))
        self.courses.widen(self.width - len(self.exchange.values))
        self.arrays = (
            np.array(
                [
                    (*operation, isinstance(slave, LoadedSlave) and is_watched(slave), late)
                    for operation, late, (slave, _) in zip(self.operations, self.late, self.culprits, strict=True)
                ],
                OPERATION,
            ),
            np.array(ends, dtype=np.int64),
            np.array(self._channels, dtype=CHANNEL),
            np.array(self._instances, dtype=INSTANCE),
            np.array(self._entries, dtype=ENTRY),
            np.array(self._references, dtype=np.uint32),
            self.wide.forms,
            self.courses.courses,
            np.array(self._notes, dtype=NOTING),
            np.array(self.loops, dtype=LOOP),
            np.array(self.algebra.solvers, dtype=SOLVER),
            np.array(self.algebra.parties, dtype=PARTY),
            np.array(self.algebra.terms, dtype=TERM),
            np.array(self.passed, dtype=np.int64),
            self.courses.points,
            self._made_states(),
            self.work,
            self.courses.stamps,
        )

    def forget(self, time: float) -> None:
        """Give back the states that have been saved at a time in s and not been given back."""
        for (name, _), n in self.states.items():
            handle, slave = int(self._handles[n]), self.slaves[name]
            self._handles[n] = 0
            if handle:
                slave.forget((time, c_void_p(handle)))

    def forget_arrays(self) -> None:
        """What stands in arrays that were set as a whole is to be asked of the FMUs."""
        for array in self.channels:
            array.forget()

    @property
    def holds_states(self) -> bool:
        """Whether states that have been saved were not given back."""
        return bool(self._handles.any())

    def come_back(self, time: float) -> None:
        """Restore the first states of those that have one saved, which was at a time in s, and give all back."""
        for (name, which), n in self.states.items():
            handle, slave = int(self._handles[n]), self.slaves[name]
            if handle and not which:
                slave.restore((time, c_void_p(handle)))
        self.forget(time)

    def rank(self, operation: int) -> tuple[bool, int]:
        """Where an operation of several that failed would stand without threads: all are set before any steps."""
        return self.operations[operation][0] not in (Kind.SET, Kind.EXTEND, Kind.SLOPES), operation

    def follow(self) -> None:
        """Let inputs follow what they are connected to now."""
        if self._changed_links == self.exchange.changed_links:
            return
        self._changed_links, entries = self.exchange.changed_links, self.arrays[4]
        for name, n, changes, late, begin in self.feeds:
            feed = self.exchange.feeds[name][n]
            places = [k for _, places in parts_of(feed.channel) or () for k in places]
            made = self.wide.entries(feed, changes, late=late)
            for at, k in enumerate(places, begin):
                if not isinstance(k, Held):
                    entries[at] = made[k]

    def _add(self, names: Sequence[str], operations: Sequence[Operation], *, final: bool = True) -> None:
        for operation in operations:
            for name in names:
                slave, rate = self.slaves[name], self._coupling.settings.rates.get(name, 1)
                if operation in (Operation.SET, Operation.SET_OF_END):
                    self.add_sets(slave, rate, way=AT_END if operation == Operation.SET_OF_END else None)
                elif operation == Operation.STEP:
                    self._add_step(slave, rate, final=final)
                elif operation == Operation.NOTE:
                    self._add_notes(slave)
                elif operation == Operation.SHOW:
                    self._add_shown(slave)
                elif operation in _STATES:
                    self._add_state([name], *_STATES[operation])
                else:
                    self.add_gets(slave, rate, {Operation.GET_DIRECT: True, Operation.GET_REST: False}.get(operation))

    def _repeat(self, part: Repeated) -> None:
        """Add what is repeated from saved states: see ``native/kernel.h``."""
        names, iteration = part.batch.names, part.iteration
        passed, real_count = [*iteration.reals, *iteration.others], len(iteration.reals)
        method, relaxation = METHODS[iteration.stepping.acceleration], iteration.stepping.relaxation
        counts = real_count, iteration.guess_count, len(iteration.others)
        number, begin = len(self.loops), len(self.passed)
        self.loops.append((ITERATION, iteration.stepping.max_iterations, self.room, begin, *counts, method, relaxation))
        self.passed += passed
        self._work.append((self.room, iteration))
        u = iteration.guess_count
        self.room += len(iteration.numbers) + 2 * u + (0, 1 + u, 1 + 24 * u)[method]
        self._add_state(names, Kind.SAVE)
        self.add_operation(Kind.BEGIN, number, NOBODY, (1, 0))
        self._add_state(names, Kind.RESTORE)
        self.add_operation(Kind.MARK, number, NOBODY, (1, 0))
        first = len(self.operations)
        for name in names:
            self._add([name], part.batch.operations, final=False)
        self.rounds.update(dict.fromkeys(range(first, len(self.operations)), iteration))
        self.iterations[len(self.operations)] = iteration
        self.add_operation(Kind.END, number, NOBODY, (1, 0))
        self._add_state(names, Kind.FORGET)

    def _add_state(self, names: Sequence[str], kind: Kind, which: int = 0) -> None:
        for name in names:
            slave = self.slaves[name]
            index = self.states.setdefault((name, which), len(self.states))
            self.add_operation(kind, index, (slave, slave.STATE[kind - Kind.SAVE]), (1, 0))

    def _made_states(self) -> NDArray[np.void]:
        made = np.zeros(len(self.states), STATE)
        for (name, which), n in self.states.items():
            slave = self.slaves[name]
            if isinstance(slave, Ride):
                made[n] = (*slave.add_state(n, at_once=bool(which)), 0)
            else:
                made[n] = (*(slave.addresses(call)[0] for call in slave.STATE[:3]), slave.pointer, 0)
        self._handles = made["handle"]
        return made

    def _made_work(self) -> NDArray[np.float64]:
        """Room for the numbers of what is repeated; those of iterations and solvers stand there from now on."""
        work = np.zeros(self.room)
        counting: list[tuple[int, Iteration | LoopSolver]] = [*self._work, *self.algebra.work]
        for begin, one in counting:
            own = work[begin : begin + len(one.numbers)]
            own[:] = one.numbers
            one.use(own)
        return work

    def add_operation(
        self, kind: int, index: int, culprit: tuple[Called | None, str], due: tuple[int, int], *, late: bool = False
    ) -> None:
        """Add an operation: whom it calls, and in which steps it is due."""
        self.operations.append((kind, index, *due))
        self.late.append(late)
        self.culprits.append(culprit)

    def add_sets(self, slave: Called, rate: int, *, late: bool = False, way: int | None = None) -> None:
        """Set inputs: for a step, continued if they are to be, in one of several ways, or ``late``, as it has ended."""
        extrapolator = self._coupling.extrapolator
        course = None if extrapolator is None or late else extrapolator.courses.get(slave.name)
        made = self._sets[slave.name] = []
        for n, feed in enumerate(self.exchange.feeds[slave.name]):
            slots = feed.changes or [None] * len(feed.targets)
            changes = [-1 if slot is None else self._add_change(slot, -1, feed.kind) for slot in slots]
            self.feeds.append((slave.name, n, changes, late, len(self._entries)))
            entries = self.wide.entries(feed, changes, late=late)
            if course is None or n != course.feed:
                made += self._add_channels(
                    Kind.SET, slave, feed.channel, entries, feed.is_real, due=(rate, 0), late=late
                )
                continue
            number = self.courses.number(slave.name, way)
            self.courses.courses["channel"][number] = len(self._channels)
            made += self._add_channels(
                Kind.EXTEND, slave, feed.channel, entries, feed.is_real, due=(rate, 0), index=number
            )
            self.add_operation(Kind.SLOPES, number, (slave, slave.INTERPOLATE), (rate, 0))

    def _add_notes(self, slave: Called) -> None:
        """Note the inputs that have just been set, behind the values."""
        shown = self._shown[slave.name] = []
        for source, call in self._sets[slave.name]:
            function, component, begin, count, *what = self._channels[source]
            continued = np.flatnonzero(self.courses.courses["channel"] == source)
            courses = (-1, -1)
            if len(continued):
                courses = int(continued[0]), self.courses.number(slave.name, AS_NOTED)
                self.courses.courses["channel"][courses[1]] = len(self._channels)
            shown.append((len(self._channels), courses[1], call))
            self.add_operation(Kind.NOTE, len(self._notes), NOBODY, (1, 0))
            self._notes.append((source, len(self._channels), *courses))
            self._channels.append((function, component, len(self._entries), count, *what))
            self._references += self._references[begin : begin + count]
            self._entries += [noted(entry, self.width + k) for k, entry in enumerate(self._entries[begin:][:count])]
            self.width += count

    def _add_shown(self, slave: Called) -> None:
        """Set inputs as they were noted."""
        for channel, course, call in self._shown[slave.name]:
            if course < 0:
                self.add_operation(Kind.SET, channel, (slave, call), (1, 0))
                continue
            self.add_operation(Kind.EXTEND, course, (slave, call), (1, 0))
            self.add_operation(Kind.SLOPES, course, (slave, slave.INTERPOLATE), (1, 0))

    def add_gets(self, slave: Called, rate: int, direct: bool | None, kind: Kind = Kind.GET) -> None:
        """Read outputs, all or those that are ``direct`` or not; with what events make of them."""
        for part in self.exchange.yields[slave.name]:
            if direct is not None and part.direct != direct:
                continue
            due = (rate, 0 if part.direct else rate - 1)
            self.add_reads(kind, slave, part, due)
            for place, change in self.exchange.output_changes.items():
                if part.begin <= place < part.end:
                    index = self._add_change(change, place, part.kind)
                    self.add_operation(Kind.CHANGE, index, (None, "an event"), due)

    def add_reads(self, kind: Kind, slave: Called, part: Yield, due: tuple[int, int]) -> None:
        """Read outputs of one type, or look at them."""
        whole = TRUE_ABOVE if part.kind == "Boolean" else AS_IT_IS
        entries = [(place, -1, -1, 1.0, 0.0, whole, 0.0, 0) for place in range(part.begin, part.end)]
        first = len(self._channels)
        self._add_channels(kind, slave, part.channel, entries, part.is_real, due=due)
        for channel in range(first, len(self._channels)) if self.exchange.stamps and kind != Kind.LOOK else ():
            self.add_operation(Kind.STAMP, channel, NOBODY, due)

    def _add_change(self, change: Change, place: int, kind: Type) -> int:
        self.changes.append((change, place, kind))
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
        index: int | None = None,
    ) -> list[tuple[int, str]]:
        """Add operations on a channel, each on one of its parts, or the one of this index; the channels and calls."""
        made = []
        self.channels += arrays_in(channel)
        for own, places in parts_of(channel) or ():
            call = own.calls[kind not in (Kind.SET, Kind.EXTEND)]
            made.append((len(self._channels), call))
            self.add_operation(kind, len(self._channels) if index is None else index, (slave, call), due, late=late)
            if isinstance(slave, Ride):
                assert isinstance(own, IsolatedPart)
                addresses = slave.add(own, is_get=kind not in (Kind.SET, Kind.EXTEND))
            else:
                addresses = slave.addresses(call)
            what = len(self._entries), len(places), int(is_real), type_of(slave.interface.version, own.kind)
            self._channels.append((*addresses, *what, len(own.references)))
            self._entries += [self._held(k, own.kind) if isinstance(k, Held) else entries[k] for k in places]
            self._references += [*own.references, *[NONE] * (len(places) - len(own.references))]
        return made

    def _held(self, element: Held, kind: str) -> Entry:
        """An element of an array that is set with others of it, which are connected."""
        entry = self.wide.hold(element, kind, self.width)
        self.width = max(self.width, entry[0] + 1)
        return entry

    def _add_step(self, slave: Called, rate: int, *, final: bool) -> None:
        self.add_operation(Kind.STEP, len(self._instances), (slave, slave.DO_STEP), (rate, 0), late=not final)
        addresses = slave.add_step(final=final) if isinstance(slave, Ride) else slave.addresses(slave.DO_STEP)
        self._instances.append((*addresses, addressof(slave.told) if isinstance(slave, Fmi3Slave) else 0))
