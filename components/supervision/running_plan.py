"""A trip's plan: changes of speed with limited jerk, their times, and the one speed that gives the exact arrival."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..environment.profile import Phase, Profile, moved, speed_change
from ..tables import FASTEST, Column, Table

PLAN = {
    "duration": 190.0,
    "distance": 3512.0,
    "jerk": 0.75,
    "phases": [
        {"begin": 0.0, "speed_km_h": 70.0, "acceleration": 0.9},
        {"begin": 26.0, "speed_km_h": 80.0, "acceleration": 0.4},
        {"end": 98.5, "speed_km_h": 69.0, "acceleration": 0.6},
        {"begin": 111.0, "speed_km_h": 80.0, "acceleration": 0.4},
        {"end": 158.5, "speed": "solve", "acceleration": 0.7},
        {"end": 190.0, "speed": 0.0, "acceleration": 0.8},
    ],
}
"""3512 m in 190 s with five cruises and three brakings (Liu & Hou 2020); phase speeds and accelerations are ours."""

_HALVINGS = 60


@dataclass(frozen=True)
class Plan:
    """A trip: its motion, its duration in s and its distance in m."""

    profile: Profile
    duration: float
    distance: float


@dataclass(frozen=True)
class _Change:
    """A change to a speed (m/s, None where it is to be found), by the time it begins or ends at."""

    begin: float | None
    end: float | None
    speed: float | None
    acceleration: float


def _change(
    begin: float | None, end: float | None, speed: float | str | None, speed_km_h: float | None, acceleration: float
) -> _Change:
    if (begin is None) == (end is None) or (speed is None) == (speed_km_h is None):
        raise ValueError("has either 'begin' or 'end', and either 'speed' or 'speed_km_h'")
    target = speed_km_h / 3.6 if speed_km_h is not None else None if isinstance(speed, str) else speed
    return _Change(begin, end, target, acceleration)


def _plan(duration: float, distance: float, jerk: float, changes: Sequence[_Change]) -> Plan:
    """The plan of these changes.

    Raises:
        ValueError: it cannot be, or arrives at another place than the distance says.
    """
    unknown = sum(change.speed is None for change in changes)
    if unknown > 1:
        raise ValueError("only one phase may have the speed 'solve'")
    if unknown:
        known = [change.speed for change in changes if change.speed is not None]
        profile = _solve(changes, jerk, duration, distance, max(known))
    else:
        profile = _profile(changes, jerk, 0.0)
    reached = profile.at(duration)
    if abs(reached.position - distance) > 1e-6 or abs(reached.speed) > 1e-9:
        raise ValueError(
            f"after {duration:g} s the plan is at {reached.position:.6f} m with {reached.speed:.6f} m/s, not at "
            f"rest at {distance:g} m; give one phase the speed 'solve' and end with the speed 0"
        )
    return Plan(profile, duration, distance)


PHASES = Table(
    "phase",
    [
        Column("begin", "s", default=None),
        Column("end", "s", default=None),
        Column("speed", "m/s", default=None, within=(0.0, FASTEST), word="solve"),
        Column("speed_km_h", "km/h", default=None, within=(0.0, 3.6 * FASTEST)),
        Column("acceleration", "m/s2", sign="positive"),
    ],
    make=_change,
)
PLANS = Table(
    "plan",
    [Column("duration", "s"), Column("distance", "m"), Column("jerk", "m/s3"), Column("phases", type=PHASES)],
    make=_plan,
)
"""A trip's plan. Each phase changes the speed with at most ``acceleration``, from ``begin`` or until ``end``.

One speed may be ``"solve"``: it is found such that the train arrives exactly.
"""


def _profile(changes: Sequence[_Change], jerk: float, solved: float) -> Profile:
    phases: list[Phase] = []
    speed = 0.0
    for change in changes:
        target = solved if change.speed is None else change.speed
        parts = speed_change(0.0, target - speed, change.acceleration, jerk)
        length = sum(part.duration for part in parts)
        begin = change.begin if change.begin is not None else (change.end or 0.0) - length
        phases += [Phase(begin + part.begin, part.duration, part.jerk) for part in parts]
        speed = target
    return Profile(0.0, phases)


def _solve(changes: Sequence[_Change], jerk: float, duration: float, distance: float, top: float) -> Profile:
    """The profile whose unknown speed, between 0 and the largest other one, leads to the distance."""

    def reached(speed: float) -> float:
        try:
            profile = _profile(changes, jerk, speed)
        except ValueError:  # so slow that a braking would begin before the phase ahead of it has ended
            return -1.0
        return float(moved(profile.motions[-1], duration - profile.times[-1]).position)

    _profile(changes, jerk, top)  # phases that overlap at that speed, too, are the plan's own mistake
    low, high = 0.0, top
    if not reached(low) <= distance <= reached(high):
        raise ValueError(f"no speed of the phase 'solve' between 0 and {top:g} m/s leads to {distance:g} m")
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reached(middle) < distance else (low, middle)
    return _profile(changes, jerk, 0.5 * (low + high))
