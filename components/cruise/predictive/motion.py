"""Motion over a horizon of equal intervals: piecewise linear acceleration, so that positions are cubic in time."""

from __future__ import annotations

from typing import Any, NamedTuple

from ...maths import clip, floor, maximum, minimum, where


class Motion(NamedTuple):
    """Positions (m), speeds (m/s) and accelerations (m/s2) at the ends of the intervals, the present first."""

    position: Any
    speed: Any
    acceleration: Any


def rolled(position: Any, speed: Any, acceleration: Any, jerks: Any, interval: Any) -> Motion:
    """The motion that follows from jerks, which are constant in each interval.

    Args:
        position: at present, m.
        speed: at present, m/s.
        acceleration: at present, m/s2.
        jerks: shape (stages,), m/s3.
        interval: s.
    """
    motion = Motion([position], [speed], [acceleration])
    p, v, a = position, speed, acceleration
    for j in jerks:
        p, v, a = (
            p + interval * (v + interval * (0.5 * a + interval / 6.0 * j)),
            v + interval * (a + 0.5 * interval * j),
            a + interval * j,
        )
        for column, value in zip(motion, (p, v, a), strict=True):
            column.append(value)
    return motion


def planned(position: Any, speed: Any, plan: Any, age: Any, interval: Any) -> Motion:
    """What a train said it would do, seen ``age`` later; after its horizon it soon goes on at constant speed.

    Args:
        position: when it said so, m.
        speed: when it said so, m/s.
        plan: accelerations at the ends of the intervals, shape (stages + 1,), m/s2.
        age: s; more than the horizon counts as the horizon.
        interval: s.
    """
    stages = len(plan) - 1
    jerks = [(after - before) / interval for before, after in zip([*plan], [*plan[1:], 0.0], strict=True)]
    columns: list[list[Any]] = list(rolled(position, speed, plan[0], [*jerks, *[0.0] * stages], interval))
    passed = clip(age / interval, 0.0, float(stages))
    whole = floor(passed)
    part = (passed - whole) * interval
    shift = 1 << (stages.bit_length() - 1)
    while shift:  # by the binary digits of the whole intervals that have passed
        far = whole >= float(shift)
        whole = where(far, whole - float(shift), whole)
        columns = [
            [where(far, later, cell) for cell, later in zip(column, [*column[shift:], *column[-shift:]], strict=True)]
            for column in columns
        ]
        shift //= 2
    p, v, a = columns
    seen = Motion([], [], [])
    for k in range(stages + 1):
        jerk = (a[k + 1] - a[k]) / interval
        seen.position.append(p[k] + part * (v[k] + part * (0.5 * a[k] + part / 6.0 * jerk)))
        seen.speed.append(v[k] + part * (a[k] + 0.5 * part * jerk))
        seen.acceleration.append(a[k] + part * jerk)
    return seen


def extrapolated(position: Any, speed: Any, acceleration: Any, fastest: Any, times: list[Any]) -> Motion:
    """Constant acceleration until the train stands, or runs as fast as it may.

    Args:
        position: as last heard, m.
        speed: as last heard, m/s.
        acceleration: as last known, m/s2.
        fastest: speed that it is not taken to exceed, but where it did, m/s.
        times: since then, s.
    """
    speed = maximum(speed, 0.0)
    room = where(acceleration < 0.0, speed, maximum(fastest - speed, 0.0))
    end = room / maximum(abs(acceleration), 1e-3)
    seen = Motion([], [], [])
    for time in times:
        changing = minimum(time, end)
        after = speed + acceleration * changing
        seen.position.append(position + changing * (speed + 0.5 * acceleration * changing) + (time - changing) * after)
        seen.speed.append(after)
        seen.acceleration.append(where(time < end, acceleration, 0.0))
    return seen
