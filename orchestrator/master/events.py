"""Events on the way: new values of inputs and parameters, faults of signals, and inputs that follow other outputs.

An event that changes a signal fills a slot that the exchange applies whenever the value passes. An output is changed
for all who receive it, and so recorded; an input for that instance alone. What fades after an input was connected anew
is such a change as well.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..fmi import Variable
from ..names import SignalName
from ..system import Event
from ..times import slack
from ..wiring import as_text
from .exchange import Change, Exchange
from .settings import Settings


@dataclass(frozen=True, order=True)
class _Due:
    """Something that is due, of those at one time the ends first: an end or a begin of an event's ``count``-th time."""

    time: float
    is_begin: bool
    number: int
    count: int

    @property
    def occurrence(self) -> tuple[int, int]:
        """Which one it is, whether it begins or ends."""
        return self.number, self.count


@dataclass
class _Fault:
    """An occurrence of an event that acts on a signal now.

    ``held`` is the value that a freeze keeps, or the difference that fades since an input was connected anew.
    """

    occurrence: tuple[int, int]
    since: float
    held: Any = None


class Schedule:
    """The events of a run, in the order in which they are due.

    Args:
        settings: with events that were found fit by `check_events`; arrays may be named as a whole.
        exchange: where they act.
        start_time: of the run in s; what began before acts from then on.
    """

    def __init__(self, settings: Settings, exchange: Exchange, start_time: float) -> None:
        self._exchange = exchange
        self._start_time, rates = start_time, settings.rates
        self._events = [
            (event, SignalName(signal.instance, scalar))
            for event, signal in ((event, SignalName.parse(event.signal)) for event in settings.events)
            for scalar in exchange.slaves[signal.instance].interface.scalars(signal.variable) or ()
        ]
        ways = [link for made in settings.routes for link in made]
        self._ways = dict(zip((n for n, (x, _) in enumerate(self._events) if x.action == "connect"), ways, strict=True))
        """What an input follows by an event, by the event's number."""
        self._first = {link.target: exchange.links[link.target] for link in ways}
        self._led: dict[SignalName, list[tuple[int, int]]] = {target: [] for target in self._first}
        """The events by which an input does not follow its first output now, the one that counts last."""
        self._slots = {target: self._slot(target) for event, target in self._events if _changes(event)}
        self._acting: dict[SignalName, list[_Fault]] = {target: [] for target in self._slots}
        self._parts = {
            target: part
            for target in self._slots
            for part in exchange.yields[target[0]]
            if target in exchange.places and part.begin <= exchange.places[target] < part.end
        }
        self._slow = {t: rates[t[0]] for t, part in self._parts.items() if t[0] in rates and not part.direct}
        """Outputs that appear at the end of a longer step only, with the number of steps in it."""
        self._kept: dict[SignalName, Any] = {}
        """What those were, unchanged, at the last end of such a step."""
        self.happened: list[dict[str, Any]] = []
        """What has happened so far, for the record of the run."""
        self._due: list[_Due] = []
        for number, (event, _) in enumerate(self._events):
            first = _first(event, start_time)
            if first is not None:
                self._plan(number, first)

    def _slot(self, target: SignalName) -> Change:
        place = self._exchange.places.get(target)
        if place is None:
            return self._exchange.change_of_input(*target)
        return self._exchange.output_changes.setdefault(place, Change())

    def _plan(self, number: int, count: int) -> None:
        """Note when an occurrence of an event begins, and ends."""
        event, _ = self._events[number]
        at = event.at + count * (event.every or 0.0)
        heapq.heappush(self._due, _Due(at, True, number, count))
        if event.duration is not None:
            heapq.heappush(self._due, _Due(at + event.duration, False, number, count))

    def next_time(self) -> float:
        """When the next thing is due, in s; infinite where there is none."""
        return self._due[0].time if self._due else math.inf

    def next_point(self, start: float, step: float, after: int) -> float:
        """Number of the first communication point, later than number ``after``, at which something is to be done."""
        time = self.next_time()
        steps = (time - start - slack(step, start, time)) / step
        due = math.inf if math.isinf(time) else max(after + 1, math.ceil(steps))
        changed = [rate for target, rate in self._slow.items() if self._slots[target].active]
        return min([due, *(after - after % rate + rate for rate in changed)])

    def apply(self, time: float, number: int, late: float = 0.0) -> bool:
        """Let everything happen that is due at a communication point; whether anything did.

        Args:
            time: of the point in s.
            number: of the point.
            late: by how many s an event may be due later and still happen now.

        Raises:
            FmuError: an FMU refused the value.
        """
        for target, rate in self._slow.items():
            if self._slots[target].active and number % rate == 0:
                self._kept[target] = self._read(target)
        due = self._take(time + late)
        targets = {self._events[d.number][1] for d in due} & self._slots.keys()
        # Before anything is set: an FMU may show at once what that changes.
        true = {target: self._true(target, number) for target in targets if target in self._parts}
        for one in due:
            event, target = self._events[one.number]
            held = None
            if event.action == "set":
                self._set(event, target, time)
            elif event.action == "connect":
                held = self._connect(one, time)
            elif one.is_begin:
                held = self._present(target, time) if event.action == "freeze" else None
                self._acting[target].append(_Fault(one.occurrence, one.time, held))
            else:
                self._acting[target] = [f for f in self._acting[target] if f.occurrence != one.occurrence]
            if _changes(event):
                self._fill(target)
                if target in true:
                    self._show(target, true[target], time)
            if one.count >= 0:
                self._note(time, event, target, one.is_begin, held)
        return bool(due)

    def _take(self, until: float) -> list[_Due]:
        """What is due until a time in s, ends first; what would end at the point it begins at is left out."""
        taken: list[_Due] = []
        while self._due and self._due[0].time <= until:
            one = heapq.heappop(self._due)
            taken.append(one)
            if one.is_begin and self._events[one.number][0].every is not None:
                self._plan(one.number, one.count + 1)
        begun = {one.occurrence for one in taken if one.is_begin}
        void = {one.occurrence for one in taken if not one.is_begin and one.occurrence in begun}
        return sorted((one for one in taken if one.occurrence not in void), key=lambda one: one.is_begin)

    def _read(self, target: SignalName) -> Any:
        """What an instance says of an output now."""
        part = self._parts[target]
        return part.channel.get()[self._exchange.places[target] - part.begin]

    def _true(self, target: SignalName, number: int) -> Any:
        """The value of an output as it would be without events."""
        if not self._slots[target].active:
            return self._exchange.values[self._exchange.places[target]]
        return self._kept[target] if number % self._slow.get(target, 1) else self._read(target)

    def _show(self, target: SignalName, true: Any, time: float) -> None:
        """Change the present value of an output, of which the true one is given."""
        place, slot = self._exchange.places[target], self._slots[target]
        self._exchange.values[place] = slot.apply(true, self._exchange.kinds[place], time) if slot.active else true
        if target in self._slow:
            self._kept[target] = true

    def _set(self, event: Event, target: SignalName, time: float) -> None:
        slave = self._exchange.slaves[target[0]]
        variable = slave.interface.variables[target[1]]
        before, slave.time = slave.time, time  # for what it says if it fails
        slave.channel(variable.type, [target[1]]).set([given(event.value, variable)])
        slave.time = before

    def _connect(self, one: _Due, time: float) -> str:
        """Let an input follow another output, or the one before; what it follows now.

        A fade, which has a count below 0, begins with that and is over later.
        """
        event, target = self._events[one.number]
        faults = self._acting.get(target, [])
        if one.count < 0:
            self._acting[target] = [fault for fault in faults if fault.occurrence != one.occurrence]
            return ""
        fades = event.fade is not None and not one.time < self._start_time
        before = self._present(target, time) if fades else 0.0
        led = [occurrence for occurrence in self._led[target] if occurrence != one.occurrence]
        self._led[target] = [*led, one.occurrence] if one.is_begin else led
        self._lead(target)
        if fades:
            self._slots[target].active = False
            occurrence = one.number, -1 - 2 * one.count - one.is_begin
            fault = _Fault(occurrence, time, before - self._present(target, time))
            self._acting[target] = [*(other for other in faults if other.occurrence[1] >= 0), fault]
            heapq.heappush(self._due, _Due(time + (event.fade or 0.0), False, *occurrence))
        return str(self._exchange.links[target].source)

    def _lead(self, target: SignalName) -> None:
        led = self._led[target]
        self._exchange.lead(self._ways[led[-1][0]] if led else self._first[target])

    def _present(self, target: SignalName, time: float) -> Any:
        """The value that passes now."""
        if target in self._exchange.places:
            return self._exchange.values[self._exchange.places[target]]
        feed = next(feed for feed in self._exchange.feeds[target[0]] if target[1] in feed.targets)
        return self._exchange.inputs(feed, time)[feed.targets.index(target[1])]

    def _fill(self, target: SignalName) -> None:
        """Let the event that began last act on the signal."""
        slot = self._slots[target]
        slot.active = bool(self._acting[target])
        if not slot.active:
            return
        fault = self._acting[target][-1]
        event, _ = self._events[fault.occurrence[0]]
        slot.scale, slot.offset, slot.slope, slot.since, slot.text = 1.0, 0.0, 0.0, fault.since, ""
        if event.action in ("freeze", "override"):
            variable = self._exchange.slaves[target[0]].interface.variables[target[1]]
            value = fault.held if event.action == "freeze" else given(event.value, variable)
            slot.scale = 0.0
            if isinstance(value, str):
                slot.text = value
            else:
                slot.offset = float(value)
        elif event.action == "bias":
            slot.offset = float(event.value)
        elif event.action == "connect":
            slot.offset, slot.slope = fault.held, -fault.held / float(event.fade or 1.0)
        else:
            slot.slope = float(event.rate or 0.0)

    def _note(self, time: float, event: Event, target: SignalName, is_begin: bool, held: Any) -> None:
        """For the record: what a freeze holds is its value."""
        value = event.value if held is None else held
        what = {"signal": str(target), "action": event.action, "phase": "begin" if is_begin else "end"}
        self.happened.append({"time": time, **what, "value": value, "rate": event.rate})

    # ---------------------------------------------------------------- checkpoints

    def save(self) -> dict[str, Any]:
        """What acts now and what is due, as JSON-ready values."""
        return {
            "acting": [
                [*target, *f.occurrence, f.since, f.held] for target, acting in self._acting.items() for f in acting
            ],
            "due": [[one.time, one.is_begin, one.number, one.count] for one in self._due],
            "led": [[*target, *occurrence] for target, led in self._led.items() for occurrence in led],
            "kept": [[*target, value] for target, value in self._kept.items()],
            "happened": list(self.happened),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on where `save` was called."""
        for acting in self._acting.values():
            acting.clear()
        for instance, variable, number, count, since, held in saved["acting"]:
            self._acting[SignalName(instance, variable)].append(_Fault((int(number), int(count)), float(since), held))
        self._due = [
            _Due(float(time), bool(begin), int(number), int(count)) for time, begin, number, count in saved["due"]
        ]
        heapq.heapify(self._due)
        self._led = {target: [] for target in self._led}
        for instance, variable, number, count in saved["led"]:
            self._led[SignalName(instance, variable)].append((int(number), int(count)))
        for target in self._led:
            self._lead(target)
        self._kept = {SignalName(instance, variable): value for instance, variable, value in saved["kept"]}
        self.happened = list(saved["happened"])
        for target in self._slots:
            self._fill(target)


def _changes(event: Event) -> bool:
    """Whether it changes values that pass, while it lasts or for a while."""
    return event.action not in ("set", "connect") or event.fade is not None


def _first(event: Event, start: float) -> int | None:
    """Number of the first occurrence that is not over at the start, if any. What is set lasts until the next."""
    lasts = event.every if event.action == "set" else event.duration
    if lasts is None or event.at + lasts > start:
        return 0
    if event.every is None:
        return None
    return max(0, math.floor((start - event.at - lasts) / event.every) + 1)


def given(value: Any, variable: Variable) -> float | int | str:
    """An event's value as the FMU takes it; an item of an enumeration may be named."""
    if variable.type == "String":
        return as_text(value, variable)
    if variable.type == "Real":
        return float(value)
    return int(dict(variable.choices).get(value, value))
