"""What is watched in a system: rules on sums of signals, out of its wiring and of what its controllers say."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from ...fmi import Interface
from ...names import SignalName
from ...times import digits
from ...wiring import Following, Quantity, Train, Wiring, find_followings, find_trains
from .finding import Finding, Kind

STANDSTILL = 0.01
"""m/s: slower is no reversing. A train that is held creeps by rounding, and by a few mm/s on a stiff brake; one that
rolls back passes this within a tenth of a second."""
FASTEST = 340.0
"""m/s, the speed of sound: no train is as fast (the record is 168 m/s), so what exceeds it has left every domain."""
_TOUCH = 1e-3
"""m: by so little nobody is past anybody."""
_FLAGS: dict[str, tuple[Kind, str, bool]] = {
    "refused": ("refused", "refuses to drive", True),
    "range_violated": ("left its domain", "has a gap outside the range it is made for", True),
    "barrier_violated": ("left its domain", "has an error outside the ranges of its barrier", True),
    "barrier_reached": ("left its domain", "has reached its barrier", True),
    "conditions_met": ("left its domain", "does not meet the conditions of its design", False),
    "degraded": ("degraded", "falls back because what it hears is too old", True),
}
"""Boolean outputs by which a controller tells on itself: kind, what it does then, and the value that says so."""


class Seen(NamedTuple):
    """Where a rule was broken: first and last time and when it was worst, in s, and the worst value."""

    since: float
    last: float
    worst: float
    worst_time: float


@dataclass(frozen=True)
class Rule:
    """A quantity that is to stay above 0.

    Attributes:
        quantity: what is watched.
        tell: what to say where it does not.
        begin, end: from and until when in s it is watched.
    """

    quantity: Quantity
    tell: Callable[[Seen], Finding]
    begin: float = -math.inf
    end: float = math.inf


def rules_of(interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Rule]:
    """Everything that is watched in a system."""
    trains = find_trains(interfaces, wiring)
    return [
        *_gaps(interfaces, wiring, {train.name for train in trains}),
        *(rule for train in trains for rule in _speeds(train)),
        *(rule for name, face in interfaces.items() for rule in _flags(name, face)),
    ]


def _gaps(interfaces: Mapping[str, Interface], wiring: Wiring, trains: Collection[str]) -> Iterator[Rule]:
    """Of each pair of trains that run one behind the other, for as long as they do: one may leave."""
    found = [
        (since, {(one.ahead, one.behind): one for one in find_followings(interfaces, now, trains)})
        for since, now in [(-math.inf, wiring), *wiring.later]
    ]
    stays = all(route.event.duration is None for route in wiring.routes)
    before: Collection[tuple[str, str]] = ()
    for n, (since, pairs) in enumerate(found if stays else found[:1]):
        for pair in pairs:
            if pair not in before:
                end = next((other for other, later in found[n:] if pair not in later), math.inf)
                yield _gap(pairs[pair], since, end)
        before = pairs


def _gap(following: Following, begin: float, end: float) -> Rule:
    ahead, behind = following.ahead, following.behind

    def tell(seen: Seen) -> Finding:
        past = (
            f", and is up to {-seen.worst:.6g} m past it (t = {digits(seen.worst_time)} s)"
            if seen.worst < -_TOUCH
            else ""
        )
        what = f"{behind} reaches {ahead}, which runs ahead of it, at t = {digits(seen.since)} s{past}"
        signal = f"{ahead}.position - {behind}.position"
        return Finding("collision", (behind, ahead), signal, seen.since, seen.worst, seen.worst_time, what)

    return Rule(following.gap, tell, begin, end)


def _speeds(train: Train) -> Iterator[Rule]:
    name, signal = train.name, str(train.speed.terms[0][0])

    def backwards(seen: Seen) -> Finding:
        worst, when = seen.worst - STANDSTILL, seen.worst_time
        what = f"{name} runs backwards from t = {digits(seen.since)} s on, with {worst:.6g} m/s at t = {digits(when)} s"
        return Finding("reversing", (name,), signal, seen.since, worst, when, what)

    def away(seen: Seen) -> Finding:
        worst, when = FASTEST - seen.worst, seen.worst_time
        limit = f"{name} is faster than any train, {FASTEST:g} m/s, from t = {digits(seen.since)} s on"
        what = f"{limit}: {worst:.6g} m/s at t = {digits(when)} s"
        return Finding("runaway", (name,), signal, seen.since, worst, when, what)

    yield Rule(Quantity(train.speed.terms, train.speed.offset + STANDSTILL), backwards)
    yield Rule(Quantity((), FASTEST).minus(train.speed), away)


def _flags(name: str, face: Interface) -> Iterator[Rule]:
    for flag, (kind, what, raised) in _FLAGS.items():
        variable = face.variables.get(flag)
        if variable is not None and variable.causality == "output" and variable.type == "Boolean":
            sign = -1.0 if raised else 1.0
            raised_or_not = Quantity(((SignalName(name, flag), sign),), -0.5 * sign)
            yield Rule(raised_or_not, partial(_tell_flag, name, flag, kind, what, float(raised)))


def _tell_flag(name: str, flag: str, kind: Kind, what: str, value: float, seen: Seen) -> Finding:  # noqa: PLR0917
    last = f", last at t = {digits(seen.last)} s" if seen.last > seen.since else ""
    message = f"{name} {what} ({name}.{flag}), first at t = {digits(seen.since)} s{last}"
    return Finding(kind, (name,), f"{name}.{flag}", seen.since, value, seen.since, message)
