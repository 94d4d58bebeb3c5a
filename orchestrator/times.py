"""Points in time as floating-point numbers: how far apart two may be that are meant to be one; how they are written."""

from __future__ import annotations

import math

_LAST_BITS = 4
"""So many bits of the last place rounding takes: of a start, a step, their product and their sum."""
_PART = 1e-6
"""The part of a step up to which points are the same, where their rounding is less."""


def slack(step: float, *times: float) -> float:
    """How far apart two points may be that are meant to be one, in s.

    Args:
        step: between communication points, in s.
        times: the points, or others as large, in s: seconds since 1970 are rounded to some 1e-7 s.
    """
    finite = [abs(time) for time in times if math.isfinite(time)]
    return max(_PART * step, _LAST_BITS * math.ulp(max(finite, default=0.0)))


def count_steps(start: float, stop: float, step: float) -> int | None:
    """How many steps lead from a start to a stop, all in s; None where that is no whole number from 1 on.

    A step that is not a few times as long as the distance of neighbouring numbers there leads nowhere.
    """
    duration = stop - start
    if not (math.isfinite(duration) and 0.0 < duration / step < math.inf) or is_lost(step, start, stop):
        return None
    count = round(duration / step)
    allowed = min(slack(step, start, stop), 0.25 * step)  # so that it is one number and no other
    return count if count >= 1 and abs(count * step - duration) <= allowed else None


def is_lost(step: float, *times: float) -> bool:
    """Whether a step is so short that points at such times, all in s, cannot be told apart."""
    return step < 2.0 * math.ulp(max(map(abs, times)))


def digits(time: float, *others: float) -> str:
    """A time in s, with as many digits as tell it from the numbers beside it, and none that are rounding alone.

    Args:
        time: the number.
        others: larger ones that it was computed from, with whose rounding.
    """
    if not math.isfinite(time):
        return repr(float(time))
    rounding = _LAST_BITS * math.ulp(max(map(abs, (time, *others))))
    for count in range(1, 17):
        rounded = float(f"{time:.{count}g}")
        if abs(rounded - time) <= rounding:
            return repr(rounded).removesuffix(".0")
    return repr(float(time)).removesuffix(".0")
