"""A trip's plan: changes of speed with limited jerk, their times, and the one speed that gives the exact arrival."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..environment.profile import Phase, Profile, moved, number, speed_change

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

_KEYS = {"begin", "end", "speed", "speed_km_h", "acceleration"}
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


def read_plan(data: Any) -> Plan:
    """A plan from its data: ``duration`` (s), ``distance`` (m), ``jerk`` (m/s3) and ``phases``.

    Each phase changes the speed to ``speed`` (m/s) or ``speed_km_h`` with at most ``acceleration`` (m/s2), from
    ``begin`` or until ``end`` (s). One speed may be ``"solve"``: it is found such that the train arrives exactly.

    Raises:
        ValueError: unusable data, or an arrival at another place than the distance says.
    """
    if not isinstance(data, Mapping) or data.keys() != {"duration", "distance", "jerk", "phases"}:
        raise ValueError("a plan is a table of 'duration', 'distance', 'jerk' and 'phases'")
    duration, distance, jerk = (number(data, name) for name in ("duration", "distance", "jerk"))
    rows = data["phases"]
    if isinstance(rows, str) or not isinstance(rows, Sequence) or not rows:
        raise ValueError("'phases' is a list of tables, at least one")
    changes = [_read_change(row, index) for index, row in enumerate(rows, 1)]
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
            f"rest at "
            f"{distance:g} m; give one phase the speed 'solve' and end with the speed 0"
        )
    return Plan(profile, duration, distance)


def _read_change(row: Any, index: int) -> _Change:
    if not isinstance(row, Mapping) or row.keys() - _KEYS:
        raise ValueError(f"phase {index} must be a table of {', '.join(sorted(_KEYS))}: {row!r}")
    if ("begin" in row) == ("end" in row) or ("speed" in row) == ("speed_km_h" in row):
        raise ValueError(f"phase {index} has either 'begin' or 'end', and either 'speed' or 'speed_km_h': {row!r}")
    if row.get("speed") == "solve":
        speed = None
    else:
        speed = number(row, "speed") if "speed" in row else number(row, "speed_km_h") / 3.6
    begin, end = (number(row, name) if name in row else None for name in ("begin", "end"))
    return _Change(begin, end, speed, number(row, "acceleration"))


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
