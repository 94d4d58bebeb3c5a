"""The values that instances exchange: where each comes from and goes to, and what happens to it on the way.

A `Feed` sets inputs and a `Yield` reads outputs, some of one type of one instance each. All values that are read stand
in one list, in the order in which they are recorded.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..errors import FmuError
from ..fmi import Channel, Slave, Type
from ..names import SignalName
from ..wiring import Link, is_direct


@dataclass
class Change:
    """What an event makes of a value: ``scale * value + offset + slope * (time - since)``; a text is replaced.

    Attributes:
        active: whether it does so now.
    """

    active: bool = False
    scale: float = 1.0
    offset: float = 0.0
    slope: float = 0.0
    since: float = 0.0
    text: str = ""

    def apply(self, value: Any, kind: Type, time: float) -> Any:
        """The changed value at a time in s."""
        if kind == "String":
            return self.text
        changed = self.scale * value + self.offset + self.slope * (time - self.since)
        return changed if kind == "Real" else int(changed)


@dataclass(frozen=True)
class Feed:
    """Inputs of one type of one instance: where each value comes from, and how it is changed on the way.

    ``sources`` are indices into the values; ``ages`` say how many recorded points back to look (None: the live value),
    and ``ages_at_point`` the same at a communication point that is not recorded yet; ``targets`` are the inputs' names.
    """

    channel: Channel
    kind: Type
    targets: tuple[str, ...]
    sources: tuple[int, ...]
    plain: bool
    scales: tuple[float, ...]
    offsets: tuple[float, ...]
    thresholds: tuple[float | None, ...]
    mappings: tuple[Mapping[int, int] | None, ...]
    ages: tuple[int | None, ...]
    ages_at_point: tuple[int | None, ...]
    changes: list[Change | None] = field(default_factory=list)

    @property
    def is_real(self) -> bool:
        """Whether the values are real numbers, which may be scaled."""
        return self.kind == "Real"


@dataclass(frozen=True)
class Yield:
    """Outputs of one type of one instance, and where they stand among the values.

    ``direct`` says whether they depend directly on inputs, where that decides when they are read.
    """

    channel: Channel
    kind: Type
    begin: int
    end: int
    direct: bool = False

    @property
    def is_real(self) -> bool:
        """Whether the values are real numbers, which must be finite."""
        return self.kind == "Real"


class Exchange:
    """Values, and the way they take between instances.

    Args:
        slaves: the instances by name, in the sequence in which they are recorded.
        links: scalar connections, as they are in the beginning.
        others: those that events may make in their place.
        sweeping: whether instances are read one by one while others have not stepped yet, as in a Gauss-Seidel sweep.
        parted: instances whose direct outputs are read apart from the others: they are due at different points.
        refreshing: whether direct outputs of what is not sampled are brought up to date before a point is recorded.
    """

    def __init__(
        self,
        slaves: Mapping[str, Slave],
        links: Sequence[Link],
        others: Sequence[Link] = (),
        *,
        sweeping: bool = True,
        parted: Collection[str] = (),
        refreshing: bool = False,
    ) -> None:
        self.slaves = slaves
        self.links = {link.target: link for link in links}
        """The present connections, by the input that they lead to."""
        self.every_link = [*links, *others]
        """All connections that there are at some time."""
        self.changed_links = 0
        """How often one of them has taken the place of another."""
        self.signals: list[str] = []
        """Names of the values, in the order in which they are recorded."""
        self.places: dict[tuple[str, str], int] = {}
        """Where the value of (instance, variable) stands."""
        self._sweeping, self._refreshing = sweeping, refreshing
        self.is_at_point = False
        """Whether values are exchanged at a communication point that is not recorded yet, not for a step from one."""
        wanted: dict[str, set[str]] = {name: set() for name in slaves}
        incoming: dict[str, list[Link]] = {name: [] for name in slaves}
        for link in self.every_link:
            wanted[link.source[0]].add(link.source[1])
        for link in links:
            incoming[link.target[0]].append(link)
        self.yields = {name: self._plan_outputs(slave, wanted[name], name in parted) for name, slave in slaves.items()}
        self.kinds: list[Type] = [
            p.kind for parts in self.yields.values() for p in parts for _ in range(p.begin, p.end)
        ]
        self.owners = [name for name, parts in self.yields.items() for p in parts for _ in range(p.begin, p.end)]
        """The instance that each of the values comes from."""
        self.values: list[Any] = [0.0] * len(self.signals)
        self.stamps: list[float] = []
        """What time in s each of the values belongs to; kept only if there is an entry for each."""
        deepest = max((link.delay for link in self.every_link), default=0)
        self.depth = deepest + 1 if deepest else 0
        """How many recorded points delayed connections look back on, the present one included."""
        self.history: deque[list[Any]] = deque(maxlen=self.depth)
        self.feeds = {name: self._plan_inputs(slave, incoming[name]) for name, slave in slaves.items()}
        self.output_changes: dict[int, Change] = {}
        """What events do to outputs, by place."""

    def clear(self) -> None:
        """Forget all values, for another run."""
        self.values[:] = [0.0] * len(self.values)
        self.history.clear()

    # ---------------------------------------------------------------- plan

    def _plan_outputs(self, slave: Slave, wanted: Collection[str], parted: bool) -> list[Yield]:
        """Every output, and whatever else is connected."""
        shown = [v for v in slave.interface.variables.values() if v.causality == "output" or v.name in wanted]
        plan = []
        for direct in (True, False) if parted else (False,):
            group = [v for v in shown if not parted or is_direct(slave.interface, v) == direct]
            for kind in types_of(v.type for v in group):
                names = [v.name for v in group if v.type == kind]
                begin = len(self.signals)
                for name in names:
                    self.places[slave.name, name] = len(self.signals)
                    self.signals.append(f"{slave.name}.{name}")
                plan.append(Yield(slave.channel(kind, names), kind, begin, len(self.signals), direct))
        return plan

    def _plan_inputs(self, slave: Slave, mine: Sequence[Link]) -> list[Feed]:
        variables = slave.interface.variables
        plan = []
        for kind in types_of(variables[link.target[1]].type for link in mine):
            links = [link for link in mine if variables[link.target[1]].type == kind]
            channel = slave.channel(kind, [link.target[1] for link in links])
            plan.append(self._plan_feed(channel, kind, links, []))
        return plan

    def _plan_feed(self, channel: Channel, kind: Type, links: Sequence[Link], changes: list[Change | None]) -> Feed:
        return Feed(
            channel=channel,
            kind=kind,
            targets=tuple(link.target[1] for link in links),
            sources=tuple(self.places[link.source] for link in links),
            plain=all(x.is_linear and (x.scale, x.offset, x.delay) == (1.0, 0.0, 0) for x in links),
            scales=tuple(link.scale for link in links),
            offsets=tuple(link.offset for link in links),
            thresholds=tuple(link.threshold for link in links),
            mappings=tuple(link.mapping for link in links),
            ages=tuple(self.age(link) for link in links),
            ages_at_point=tuple(self._age_at_point(link) for link in links),
            changes=changes,
        )

    def lead(self, link: Link) -> None:
        """Let the input that a connection leads to follow this one from now on."""
        self.links[link.target] = link
        self.changed_links += 1
        instance, variable = link.target
        for n, feed in enumerate(self.feeds[instance]):
            if variable in feed.targets:
                links = [self.links[SignalName(instance, target)] for target in feed.targets]
                self.feeds[instance][n] = self._plan_feed(feed.channel, feed.kind, links, feed.changes)

    def age(self, link: Link) -> int | None:
        """How many recorded points back a delayed connection reads; 0 is the point at the begin of the step.

        A feed-through output recorded at a point was computed from the inputs of the point before: read there, it is
        already one communication point older than the live value of a sweep.
        """
        if not link.delay:
            return None
        return link.delay - 1 if self._is_recorded_late(link) else link.delay

    def _is_recorded_late(self, link: Link) -> bool:
        """Whether a value recorded at a point was computed from the inputs of the point before."""
        refreshed = self._refreshing and not self.slaves[link.source[0]].interface.sampled
        return link.direct and self._sweeping and not refreshed

    def _age_at_point(self, link: Link) -> int | None:
        """The same for the point that comes after the last one recorded."""
        return link.delay - 1 if link.delay else None

    # ---------------------------------------------------------------- exchange

    def write(self, name: str, time: float) -> None:
        """Set the inputs of an instance, at a time in s."""
        values = self.values
        for feed in self.feeds[name]:
            if feed.plain and not feed.changes:
                feed.channel.set([values[k] for k in feed.sources])
            else:
                feed.channel.set(self.inputs(feed, time))

    def inputs(self, feed: Feed, time: float) -> list[Any]:
        """Input values with delay, scale, offset, threshold and mapping applied, and what events make of them."""
        result = []
        ages = feed.ages_at_point if self.is_at_point else feed.ages
        for k, scale, offset, age in zip(feed.sources, feed.scales, feed.offsets, ages, strict=True):
            value = self.values[k] if age is None else self._aged(age, k)
            result.append(scale * value + offset if (scale, offset) != (1.0, 0.0) else value)
        for k, threshold in enumerate(feed.thresholds):
            if threshold is not None:
                result[k] = made_whole(result[k], threshold, feed.kind)
        for k, mapping in enumerate(feed.mappings):
            if mapping is not None:
                result[k] = mapping.get(result[k], result[k])
        for k, change in enumerate(feed.changes):
            if change is not None and change.active:
                result[k] = change.apply(result[k], feed.kind, time)
        return result

    def _aged(self, age: int, k: int) -> Any:
        if not self.history:  # still initializing
            return self.values[k]
        return self.history[max(0, len(self.history) - 1 - age)][k]

    def remember(self) -> None:
        """Note the present values as those of a communication point, for delayed connections."""
        if self.depth:
            self.history.append(list(self.values))

    def read(self, slave: Slave, time: float) -> None:
        """Read all outputs of an instance, finite or not, at a time in s: nothing has settled yet."""
        for part in self.yields[slave.name]:
            self.values[part.begin : part.end] = part.channel.get()
            if self.stamps:
                self._stamp(part, slave)
            if self.output_changes:
                self._change(part, time)

    def read_finite(self, slave: Slave, time: float, *, direct: bool | None = None) -> None:
        """Read, and stop before anyone else is given what is not finite, so that the blame falls on its source.

        Args:
            slave: whose outputs.
            time: what they belong to, in s.
            direct: chooses those that depend directly on inputs, or the others, where they are read apart.

        Raises:
            FmuError: a value is not finite.
        """
        for part in self.yields[slave.name]:
            if direct is not None and part.direct != direct:
                continue
            found = part.channel.get()
            self.values[part.begin : part.end] = found
            # One sum instead of one test per value: it is finite unless a value is not (or all are astronomic).
            if part.is_real and not math.isfinite(sum(found)):
                self.check_finite(slave)
            if self.stamps:
                self._stamp(part, slave)
            if self.output_changes:
                self._change(part, time)

    def _stamp(self, part: Yield, slave: Slave) -> None:
        self.stamps[part.begin : part.end] = [slave.time] * (part.end - part.begin)

    def _change(self, part: Yield, time: float) -> None:
        for place, change in self.output_changes.items():
            if change.active and part.begin <= place < part.end:
                self.values[place] = change.apply(self.values[place], part.kind, time)

    def check_finite(self, slave: Slave) -> None:
        """Raise if a real output of an instance is not finite, naming it."""
        for part in self.yields[slave.name]:
            for k in range(part.begin, part.end):
                if part.is_real and not math.isfinite(self.values[k]):
                    variable = self.signals[k].removeprefix(f"{slave.name}.")
                    raise FmuError(f"output {variable!r} is {self.values[k]!r}", instance=slave.name, time=slave.time)

    def change_of_input(self, name: str, variable: str) -> Change:
        """The slot for what events do to an input of an instance."""
        for feed in self.feeds[name]:
            if variable in feed.targets:
                if not feed.changes:
                    feed.changes.extend([None] * len(feed.targets))
                k = feed.targets.index(variable)
                slot = feed.changes[k] or Change()
                feed.changes[k] = slot
                return slot
        raise KeyError(variable)


def made_whole(value: float, threshold: float, kind: Type) -> int:
    """A number as one that is no Real: true above the threshold, or rounded up above that fraction."""
    if kind == "Boolean":
        return int(value > threshold)
    if not math.isfinite(value):  # before anything has settled, or astronomic: no FMU takes what comes of that
        return 0 if math.isnan(value) else int(math.copysign(_BEYOND, value))
    return math.ceil(value - threshold)


_BEYOND = 2.0**64
"""More than any whole number of an FMU's."""


def types_of(kinds: Iterable[Type]) -> tuple[Type, ...]:
    """Each of them once, in order."""
    return tuple(dict.fromkeys(kinds))
