"""Events on the way: new values of inputs and parameters, and faults of signals.

An event that changes a signal fills a slot that the exchange applies whenever the value passes. An output is changed
for all who receive it, and so recorded; an input for that instance alone.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .errors import did_you_mean
from .exchange import Change, Exchange
from .interface import Interface, Variable
from .system import Event, split
from .wiring import Wiring

_ROUNDING = 1e-6
"""Part of a communication step by which an event may come late and still count as being of that point."""


def check_events(events: Sequence[Event], interfaces: Mapping[str, Interface], wiring: Wiring) -> list[str]:
    """What is wrong with the events, one sentence each."""
    fed = {link.target for link in wiring.links}
    return [
        f"{event.origin + ': ' if event.origin else ''}event on {event.signal!r}: {problem}"
        for event in events
        for problem in _problems(event, interfaces, fed)
    ]


def _problems(event: Event, interfaces: Mapping[str, Interface], fed: set[tuple[str, str]]) -> Iterator[str]:
    instance, name = split(event.signal)
    if instance not in interfaces:
        yield f"there is no instance {instance!r}{did_you_mean(instance, interfaces)}"
        return
    interface = interfaces[instance]
    scalars = interface.scalars(name)
    if scalars is None:
        valid = [v.name for v in interface.of("input", "output", "parameter")]
        yield f"{interface.model} has no variable {name!r}{did_you_mean(name, [*valid, *interface.arrays])}"
        return
    for scalar in scalars:
        variable = interface.variables[scalar]
        problem = _problem(event, variable, (instance, scalar) in fed) or _value_problem(event, variable)
        if problem:
            yield problem
            return


def _problem(event: Event, variable: Variable, is_fed: bool) -> str:
    """Why such an event cannot happen to such a variable."""
    if event.action == "set":
        if variable.causality == "input":
            return "it is connected; 'override' replaces what it receives" if is_fed else ""
        if variable.causality == "parameter":
            return "" if variable.variability == "tunable" else "it is a fixed parameter: only tunable ones can change"
        return f"'set' is for inputs and tunable parameters, not for a variable of causality {variable.causality}"
    if variable.causality == "input":
        return "" if is_fed else f"nothing is connected to it, so there is nothing to {event.action}; use 'set'"
    if variable.causality != "output":
        return f"'{event.action}' is for outputs and connected inputs, not for causality {variable.causality}"
    return ""


def _value_problem(event: Event, variable: Variable) -> str:
    kind, value = variable.type, event.value
    if event.action in ("bias", "ramp") and kind != "Real":
        return f"'{event.action}' is for Real variables, not for {kind}"
    if event.action not in ("set", "override"):
        return ""
    if kind == "String":
        return "" if isinstance(value, str) else f"takes a text, not {value!r}"
    if kind == "Boolean":
        return "" if isinstance(value, bool) else f"takes true or false, not {value!r}"
    return _number_problem(event, variable)


def _number_problem(event: Event, variable: Variable) -> str:
    value = event.value
    if isinstance(value, bool | str) or not isinstance(value, int | float) or not math.isfinite(value):
        return f"takes a finite number, not {value!r}"
    if variable.type != "Real" and value != int(value):
        return f"takes a whole number, not {value!r}"
    low, high = variable.minimum, variable.maximum
    if (low is not None and value < low) or (high is not None and value > high):
        return f"{value!r} is outside the variable's limits"
    return ""


# -------------------------------------------------------------------- while the run goes


@dataclass(frozen=True, order=True)
class _Due:
    """Something that is due: the begin or the end of the ``count``-th occurrence of an event."""

    time: float
    number: int
    is_begin: bool
    count: int


@dataclass
class _Fault:
    """An event that acts on a signal now. ``held`` is the value that a freeze keeps."""

    number: int
    since: float
    held: Any = None


class Schedule:
    """The events of a run, in the order in which they are due.

    Args:
        events: one signal each; arrays may be named as a whole.
        exchange: where they act.
        start_time: of the run in s; what began before acts from then on.
    """

    def __init__(self, events: Sequence[Event], exchange: Exchange, start_time: float) -> None:
        self._exchange = exchange
        self._events = [
            (event, (split(event.signal)[0], scalar))
            for event in events
            for scalar in exchange.slaves[split(event.signal)[0]].interface.scalars(split(event.signal)[1]) or ()
        ]
        self._slots = {target: self._slot(target) for event, target in self._events if event.action != "set"}
        self._acting: dict[tuple[str, str], list[_Fault]] = {target: [] for target in self._slots}
        self.happened: list[dict[str, Any]] = []
        """What has happened so far, for the record of the run."""
        self._due: list[_Due] = []
        for number, (event, _) in enumerate(self._events):
            self._plan(number, event.at, 0, start_time)

    def _slot(self, target: tuple[str, str]) -> Change:
        place = self._exchange.places.get(target)
        if place is None:
            return self._exchange.change_of_input(*target)
        return self._exchange.output_changes.setdefault(place, Change())

    def _plan(self, number: int, at: float, count: int, not_before: float = -math.inf) -> None:
        """Note when the next occurrence of an event begins, and ends."""
        event, _ = self._events[number]
        while event.every is not None and at + (event.duration or 0.0) < not_before:
            count += 1
            at = event.at + count * event.every
        heapq.heappush(self._due, _Due(at, number, True, count))
        if event.duration is not None:
            heapq.heappush(self._due, _Due(at + event.duration, number, False, count))

    def next_time(self) -> float:
        """When the next thing is due, in s; infinite where there is none."""
        return self._due[0].time if self._due else math.inf

    def next_point(self, start: float, step: float, after: int) -> float:
        """Number of the first communication point, later than number ``after``, at which something is due."""
        time = self.next_time()
        return math.inf if math.isinf(time) else max(after + 1, math.ceil((time - start) / step - _ROUNDING))

    def apply(self, time: float, step: float = 0.0) -> bool:
        """Let everything happen that is due at a communication point; whether anything did.

        Args:
            time: of the point in s.
            step: the communication step in s, for what is due by rounding.

        Raises:
            FmuError: an FMU refused the value.
        """
        touched: dict[tuple[str, str], None] = {}
        while self._due and self._due[0].time <= time + _ROUNDING * step:
            due = heapq.heappop(self._due)
            event, target = self._events[due.number]
            if due.is_begin and event.every is not None:
                self._plan(due.number, event.at + (due.count + 1) * event.every, due.count + 1)
            if event.action == "set":
                self._set(event, target)
            elif due.is_begin:
                self._acting[target].append(_Fault(due.number, time, self._present(target, time)))
                touched[target] = None
            else:
                self._acting[target] = [f for f in self._acting[target] if f.number != due.number]
                touched[target] = None
            what = {"signal": ".".join(target), "action": event.action, "phase": "begin" if due.is_begin else "end"}
            self.happened.append({"time": time, **what, "value": event.value, "rate": event.rate})
        for target in touched:
            self._fill(target)
        for instance in dict.fromkeys(target[0] for target in touched if target in self._exchange.places):
            self._exchange.read(self._exchange.slaves[instance], time)
        return bool(touched)

    def _set(self, event: Event, target: tuple[str, str]) -> None:
        slave = self._exchange.slaves[target[0]]
        kind = slave.interface.variables[target[1]].type
        value = event.value if kind == "String" else float(event.value) if kind == "Real" else int(event.value)
        slave.channel(kind, [target[1]]).set([value])

    def _present(self, target: tuple[str, str], time: float) -> Any:
        """The value that passes now."""
        if target in self._exchange.places:
            return self._exchange.values[self._exchange.places[target]]
        for feed in self._exchange.feeds[target[0]]:
            if target[1] in feed.targets:
                return self._exchange.inputs(feed, time)[feed.targets.index(target[1])]
        raise KeyError(target)

    def _fill(self, target: tuple[str, str]) -> None:
        """Let the event that began last act on the signal."""
        slot = self._slots[target]
        slot.active = bool(self._acting[target])
        if not slot.active:
            return
        fault = self._acting[target][-1]
        event, _ = self._events[fault.number]
        value = fault.held if event.action == "freeze" else event.value
        slot.scale, slot.offset, slot.slope, slot.since = 1.0, 0.0, 0.0, fault.since
        if event.action in ("freeze", "override"):
            slot.scale = 0.0
            slot.text = value if isinstance(value, str) else ""
            slot.offset = 0.0 if isinstance(value, str) else float(value)
        elif event.action == "bias":
            slot.offset = float(event.value)
        else:
            slot.slope = float(event.rate or 0.0)

    # ---------------------------------------------------------------- checkpoints

    def save(self) -> dict[str, Any]:
        """What acts now and what is due, as JSON-ready values."""
        return {
            "acting": [[*target, f.number, f.since, f.held] for target, acting in self._acting.items() for f in acting],
            "due": [[due.time, due.number, due.is_begin, due.count] for due in self._due],
            "happened": list(self.happened),
        }

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on where `save` was called."""
        for acting in self._acting.values():
            acting.clear()
        for instance, variable, number, since, held in saved["acting"]:
            self._acting[instance, variable].append(_Fault(int(number), float(since), held))
        self._due = [
            _Due(float(time), int(number), bool(begin), int(count)) for time, number, begin, count in saved["due"]
        ]
        heapq.heapify(self._due)
        self.happened = list(saved["happened"])
        for target in self._slots:
            self._fill(target)
