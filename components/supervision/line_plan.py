"""A plan over a line: from stop to stop below its speed limits, in exact jerk-limited pieces."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

from ..environment.profile import Phase, Profile, speed_change
from ..environment.track import Track
from ..tables import Column, Table
from .running_plan import Plan

_HALVINGS = 60
_SAME = 1e-9
"""m/s: a speed that halving has not changed by more has not changed."""


class Service(NamedTuple):
    """How a line is run: accelerations in m/s2, jerk in m/s3, how far below the limits in m/s, stand at a stop in s."""

    acceleration: float
    deceleration: float
    jerk: float
    margin: float
    dwell: float


SERVICE = Table(
    "service",
    [
        Column("acceleration", "m/s2", sign="positive", within=(0.0, 3.0)),
        Column("deceleration", "m/s2", sign="positive", within=(0.0, 3.0)),
        Column("jerk", "m/s3", sign="positive", within=(0.0, 10.0)),
        Column("margin", "m/s", sign="non-negative", note="below the limits"),
        Column("dwell", "s", sign="non-negative", note="at each stop"),
    ],
    make=Service,
    single=True,
)


class _Stretch(NamedTuple):
    """Begin and end in m of a stretch of one speed limit, and the speed to cruise at there in m/s."""

    begin: float
    end: float
    speed: float


def plan(track: Track, length: float, most: float, service: Service) -> Plan:
    """The plan for a train of a length in m that runs no faster than ``most`` m/s.

    Raises:
        ValueError: the line has fewer than two stops, or a limit leaves no speed to run at.
    """
    if len(track.stops) < 2:
        raise ValueError("the line has fewer than two stops: a plan leads from the first to the last")
    phases: list[Phase] = []
    time = 0.0
    for departure, arrival in itertools.pairwise(track.stops):
        run = _run(_stretches(track, (departure.position, arrival.position), length, most, service), service)
        phases += [Phase(phase.begin + time, phase.duration, phase.jerk) for phase in run[0]]
        time += run[1] + service.dwell
    return Plan(Profile(0.0, phases), time - service.dwell, track.stops[-1].position - track.stops[0].position)


def _stretches(track: Track, ends: tuple[float, float], length: float, most: float, service: Service) -> list[_Stretch]:
    """Between two stops, by the lowest limit under the train.

    Raises:
        ValueError: a limit leaves no speed to run at.
    """
    begin, end = ends
    places = {begin, end, *(p for b, _ in track.limits.steps for p in (b, b + length) if begin < p < end)}
    found: list[_Stretch] = []
    for a, b in itertools.pairwise(sorted(places)):
        middle = 0.5 * (a + b)
        speed = min(most, float(track.speed_limit(middle, length)) - service.margin)
        if speed <= 0.0:
            raise ValueError(f"the limit at {middle:g} m leaves no speed with a margin of {service.margin:g} m/s")
        if found and found[-1].speed == speed:
            found[-1] = found[-1]._replace(end=b)
        else:
            found.append(_Stretch(a, b, speed))
    return found


def _way(one: float, other: float, service: Service) -> float:
    """How far a change of speed leads, in m."""
    rate = service.acceleration if other > one else service.deceleration
    parts = speed_change(0.0, other - one, rate, service.jerk)
    return 0.5 * (one + other) * sum(part.duration for part in parts)


def _fits(stretch: _Stretch, before: float, speed: float, after: float, service: Service) -> bool:
    """Whether a stretch is long enough to speed up to a speed in it, and to slow down for the next."""
    up = _way(before, speed, service) if speed > before else 0.0
    down = _way(speed, after, service) if speed > after else 0.0
    return up + down <= stretch.end - stretch.begin


def _run(stretches: Sequence[_Stretch], service: Service) -> tuple[list[Phase], float]:
    """Phases from the departure on, and how long they last: each stretch as fast as it can be, from rest to rest."""
    speeds = [stretch.speed for stretch in stretches]
    changed = True
    while changed:
        changed = False
        for k, stretch in enumerate(stretches):
            before = speeds[k - 1] if k else 0.0
            after = speeds[k + 1] if k + 1 < len(speeds) else 0.0
            if _fits(stretch, before, speeds[k], after, service):
                continue
            low, high = 0.0, speeds[k]
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if _fits(stretch, before, middle, after, service) else (low, middle)
            changed = changed or speeds[k] - low > _SAME
            speeds[k] = low
    phases: list[Phase] = []
    time = before = 0.0
    for k, stretch in enumerate(stretches):
        speed, after = speeds[k], speeds[k + 1] if k + 1 < len(speeds) else 0.0
        left = stretch.end - stretch.begin
        if speed > before:
            parts = speed_change(time, speed - before, service.acceleration, service.jerk)
            left -= _way(before, speed, service)
            phases, time = phases + parts, parts[-1].begin + parts[-1].duration
        down = _way(speed, after, service) if speed > after else 0.0
        time += (left - down) / speed
        if speed > after:
            parts = speed_change(time, after - speed, service.deceleration, service.jerk)
            phases, time = phases + parts, parts[-1].begin + parts[-1].duration
        before = min(speed, after) if k + 1 < len(speeds) else 0.0
    return phases, time
