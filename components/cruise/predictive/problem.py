"""The problem of one sample: what a train should do over the horizon, and what it must not."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .motion import Motion, rolled

ROWS = 8
"""Inequalities at each stage."""
GAP, SPEED, ACCELERATION = 100.0, 10.0, 1.0
"""m, m/s, m/s2: what one of an inequality means; that of the jerk is scaled by its limit."""


class Problem(NamedTuple):
    """The problem's data: scalars in front, then columns of one value for each stage, shape (stages,).

    Minimised is half the sum over the stages of
        gap_weight (wanted - p - headway v)^2 + follow_weight (ahead_speed - v)^2 + speed_weight (target_speed - v)^2
        + acceleration_weight a^2 + jerk_weight j^2,
    so that p + reaction v + v^2 / (2 braking) <= stop, 0 <= v <= fastest, -braking <= a <= most, a + slope v <= pull
    and |j| <= jerk_limit, with position p, speed v and acceleration a at the end of the stage and jerk j in it.
    """

    position: Any
    speed: Any
    acceleration: Any
    interval: Any
    headway: Any
    reaction: Any
    braking: Any
    target_speed: Any
    fastest: Any
    most: Any
    slope: Any
    pull: Any
    jerk_limit: Any
    gap_weight: Any
    follow_weight: Any
    speed_weight: Any
    acceleration_weight: Any
    jerk_weight: Any
    wanted: Any
    ahead_speed: Any
    stop: Any

    def flat(self) -> list[Any]:
        """All values in a row."""
        return [*self[:-3], *self.wanted, *self.ahead_speed, *self.stop]

    @classmethod
    def of(cls, flat: Any) -> Problem:
        """The problem whose values stand in a row."""
        scalars = len(cls._fields) - 3
        return cls(*flat[:scalars].tolist(), *flat[scalars:].reshape(3, -1))

    def motion(self, jerks: Any) -> Motion:
        """The motion that follows from jerks: the ends of the stages, shape (stages,) each."""
        present = self.position, self.speed, self.acceleration
        columns = rolled(*present, jerks.tolist(), self.interval)
        return Motion(*(np.array(column[1:]) for column in columns))

    def excess(self, motion: Motion, jerks: Any) -> Any:
        """By how much each inequality is violated where positive, scaled; shape (ROWS, stages)."""
        p, v, a = motion
        return np.stack(
            [
                (p + v * (self.reaction + v / (2.0 * self.braking)) - self.stop) / GAP,
                -v / SPEED,
                (v - self.fastest) / SPEED,
                (-a - self.braking) / ACCELERATION,
                (a - self.most) / ACCELERATION,
                (a + self.slope * v - self.pull) / ACCELERATION,
                jerks / self.jerk_limit - 1.0,
                -jerks / self.jerk_limit - 1.0,
            ]
        )

    def cost(self, motion: Motion, jerks: Any) -> Any:
        """What is minimised."""
        p, v, a = motion
        terms = (
            (self.gap_weight, self.wanted - p - self.headway * v),
            (self.follow_weight, self.ahead_speed - v),
            (self.speed_weight, self.target_speed - v),
            (self.acceleration_weight, a),
            (self.jerk_weight, jerks),
        )
        return 0.5 * sum(weight * (value * value).sum() for weight, value in terms)
