"""Routings: which connections there are from when on, where events connect inputs to other outputs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush

from ..errors import ScenarioError
from ..fmi import Interface
from ..names import SignalName
from ..system import Event, System
from .inputs import check_fed_once
from .links import Link, Route, Wiring, find_links


def find_routes(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    """Note the connections that events make, the wiring of each routing, and what is wrong with them.

    What can be said of the event alone is said where events are checked.
    """
    fed = {link.target for link in wiring.links}
    for event in system.events:
        signal = SignalName.parse(event.signal)
        scalars = interfaces[signal.instance].scalars(signal.variable) if signal.instance in interfaces else None
        targets = {SignalName(signal.instance, scalar) for scalar in scalars or ()}
        if event.action != "connect" or event.source is None or not targets or not targets <= fed:
            continue
        if not all(isinstance(x, int | float) and math.isfinite(x) for x in (event.at, event.duration or 0.0)):
            continue
        made = replace(event.source, target=event.signal, optional=False)
        try:
            wiring.routes.append(Route(event, tuple(find_links(made, interfaces, wiring))))
        except ScenarioError as error:
            place = f"event on {event.signal!r}, from {made.source!r}"
            told = error.at(place, signal, SignalName.parse(made.source))
            wiring.problems += [problem.at(event.origin) for problem in told]
    stepping = system.stepping
    for since, links in _routings(wiring, stepping.start_time, stepping.stop_time):
        later = replace(wiring, links=links, starts=_starts(system.events, wiring, since), routes=[], later=[])
        check_fed_once(interfaces, later)
        wiring.later.append((since, later))


def _starts(events: Sequence[Event], wiring: Wiring, since: float) -> dict[str, dict[str, object]]:
    """What inputs and parameters are set to at a time in s, flags among them, as far as events set them."""
    starts = {name: dict(given) for name, given in wiring.starts.items()}
    for event in sorted((e for e in events if e.action == "set" and e.at <= since), key=lambda event: event.at):
        instance, name = SignalName.parse(event.signal)
        if instance in starts:
            starts[instance][name] = event.value
    return starts


def _routings(wiring: Wiring, start: float, stop: float) -> Iterator[tuple[float, list[Link]]]:
    """Each set of connections but the first, and when in s there is that for the first time."""
    first = {link.target: link for link in wiring.links}
    acting: dict[SignalName, list[tuple[tuple[int, int], Link]]] = {}
    due = [_begin(n, route.event, _count_before(route.event, start)) for n, route in enumerate(wiring.routes)]
    heapify(due)
    seen = {_identity(wiring.links)}
    while due and due[0][0] < stop:
        time, is_begin, number, count = heappop(due)
        event, links = wiring.routes[number].event, wiring.routes[number].links
        for link in links:
            others = [one for one in acting.get(link.target, []) if one[0] != (number, count)]
            acting[link.target] = [*others, ((number, count), link)] if is_begin else others
        if is_begin and event.duration is not None:
            heappush(due, (time + event.duration, False, number, count))
        if is_begin and _repeats(event):
            heappush(due, _begin(number, event, count + 1))
        if due and due[0][0] <= max(time, start):
            continue
        now = [acting[target][-1][1] if acting.get(target) else link for target, link in first.items()]
        if _identity(now) not in seen:
            seen.add(_identity(now))
            yield max(time, start), now


def _begin(number: int, event: Event, count: int) -> tuple[float, bool, int, int]:
    """When an event begins for the ``count``-th time."""
    return event.at + count * (event.every or 0.0), True, number, count


def _identity(links: Sequence[Link]) -> tuple[int, ...]:
    return tuple(map(id, links))


def _repeats(event: Event) -> bool:
    """Whether it comes again, as far as what it says of that makes sense."""
    return event.every is not None and event.duration is not None and 0.0 < event.duration <= event.every < math.inf


def _count_before(event: Event, start: float) -> int:
    """How many times it has been over at the start."""
    if not _repeats(event):
        return 0
    return max(0, math.floor((start - event.at - (event.duration or 0.0)) / (event.every or 1.0)) + 1)
