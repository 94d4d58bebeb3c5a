"""Jerk-limited running profiles: exact cubic pieces, computed once when a component is built."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..maths import piecewise_constant


class Motion(NamedTuple):
    """Position (m), speed (m/s), acceleration (m/s2) and jerk (m/s3) at one time."""

    position: Any
    speed: Any
    acceleration: Any
    jerk: Any


@dataclass(frozen=True)
class Phase:
    """A stretch of constant jerk: its begin in s, its length in s, its jerk in m/s3."""

    begin: float
    duration: float
    jerk: float


class Profile:
    """A motion of constant jerk between breakpoints.

    It starts at time 0 from position 0 with the given speed and without acceleration; before that, and between its
    phases, the jerk is zero.

    Args:
        speed: at the start, in m/s.
        phases: in order of time, not overlapping; each trapezoid of them returns the acceleration to zero.

    Raises:
        ValueError: the phases overlap or begin before 0.
    """

    def __init__(self, speed: float, phases: Iterable[Phase]) -> None:
        self.times = [0.0]
        self.motions = [Motion(0.0, speed, 0.0, 0.0)]
        for phase in phases:
            self._continue(phase.begin, phase.jerk)
            self._continue(phase.begin + phase.duration, 0.0)

    @classmethod
    def through(cls, rows: Sequence[tuple[float, float, float]]) -> Profile:
        """The motion of one constant jerk from each row to the next, which leads through all.

        Args:
            rows: time in s from 0 on and rising, position in m, speed in m/s.
        """
        made = cls(rows[0][2], ())
        made.times, made.motions = [], []
        for (t0, x0, v0), (t1, x1, v1) in itertools.pairwise(rows):
            length = t1 - t0
            jerk = 12.0 * (0.5 * (v0 + v1) * length - (x1 - x0)) / length**3
            made.times.append(t0)
            made.motions.append(Motion(x0, v0, (v1 - v0) / length - 0.5 * jerk * length, jerk))
        return made

    def _continue(self, time: float, jerk: float) -> None:
        """Change to another jerk at a time."""
        elapsed = time - self.times[-1]
        if elapsed < -1e-9:
            raise ValueError(f"a phase begins at {time:g} s, before the one ahead of it ends at {self.times[-1]:g} s")
        last = moved(self.motions[-1], max(elapsed, 0.0))
        if elapsed <= 1e-9:
            # The end of a phase and the begin of the next are one breakpoint.
            self.motions[-1] = Motion(*self.motions[-1][:3], jerk)
            return
        # Exactly zero after a trapezoid: a rest of 1e-17 would grow with the square of the time.
        acceleration = 0.0 if abs(last.acceleration) < 1e-12 else last.acceleration
        self.times.append(time)
        self.motions.append(Motion(last.position, last.speed, acceleration, jerk))

    def at(self, time: Any) -> Motion:
        """The motion at a time in s, which may be a symbol."""
        start, *values = (
            piecewise_constant(time, self.times, column)
            for column in (self.times, *map(list, zip(*self.motions, strict=True)))
        )
        return moved(Motion(*values), time - start)


def moved(motion: Motion, elapsed: Any) -> Motion:
    """What becomes of a motion after some time of constant jerk."""
    x, v, a, j = motion
    return Motion(
        x + elapsed * (v + elapsed * (0.5 * a + elapsed * (j / 6.0))),
        v + elapsed * (a + elapsed * (0.5 * j)),
        a + elapsed * j,
        j,
    )


def speed_change(begin: float, change: float, acceleration: float, jerk: float) -> list[Phase]:
    """A change of speed with trapezoidal acceleration; triangular where it is too small to reach the acceleration.

    Args:
        begin: in s.
        change: of the speed in m/s, negative for slower.
        acceleration: largest magnitude in m/s2.
        jerk: magnitude in m/s3.

    Raises:
        ValueError: an acceleration or a jerk that is not positive.
    """
    if not (acceleration > 0.0 and jerk > 0.0):
        raise ValueError("acceleration and jerk of a speed change must be positive")
    if change == 0.0:
        return []
    ramp = min(acceleration / jerk, (abs(change) / jerk) ** 0.5)
    constant = max(abs(change) / (jerk * ramp) - ramp, 0.0)
    signed = jerk if change > 0.0 else -jerk
    return [
        Phase(begin, ramp, signed),
        Phase(begin + ramp, constant, 0.0),
        Phase(begin + ramp + constant, ramp, -signed),
    ]
