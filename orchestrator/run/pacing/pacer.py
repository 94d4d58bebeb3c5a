"""`Pacer`: holds a run back until its points are due by the clock, and tells of those that come too late."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from ... import world
from ...errors import LateError, ScenarioError
from ...times import digits

Late = Literal["warn", "catch-up", "fail"]
LATE = get_args(Late)
_log = logging.getLogger(__name__)
_SHORT, _SLICE = 3e-4, 0.05
"""What is left to wait, in s, that is not slept: a sleep may last as much longer. The longest sleep, for signals."""
_EVERY = 1.0
"""How often, in s, late points are told of."""
_FINEST, _DECADES, _PER_DECADE = 1e-7, 10, 20
"""Delays are counted in classes that are so many times longer than one another, from the finest in s on."""


@dataclass(frozen=True)
class RealTime:
    """How a run keeps pace with the clock.

    Attributes:
        factor: how many s of the run pass in one of the clock.
        late: what happens where a point is computed too late: ``"warn"`` tells of it at once, ``"catch-up"`` at the end
            alone, ``"fail"`` ends the run. What comes later is due when it would have been.
    """

    factor: float = 1.0
    late: Late = "warn"

    def __post_init__(self) -> None:
        if not 0.0 < self.factor < math.inf:
            raise ScenarioError(f"real time: its factor must be a positive number, not {self.factor!r}")
        if self.late not in LATE:
            raise ScenarioError(f"real time: {self.late!r} is none of {', '.join(LATE)}")


class Pacer:
    """Waits for the clock. The point at the time t is due at begin + (t - first) / factor, never after the one before.

    Args:
        real_time: how.
        time: of the first point, s: it is due now.
        is_over: whether the run is to end, so that waiting has no sense.
    """

    def __init__(self, real_time: RealTime, time: float, is_over: Callable[[], bool]) -> None:
        self._real_time, self._is_over = real_time, is_over
        self._first, self._begin = time, world.perf_counter()
        self._counts = np.zeros(_DECADES * _PER_DECADE + 1, np.int64)
        self._points = self._late = 0
        self._sum = self._squares = self._most = self._last = 0.0
        self._worst, self._worst_at = 0.0, time
        self._untold: list[tuple[int, float]] = []
        self._told = -math.inf

    def due(self, time: float, step: float) -> int:
        """How many steps to take before there is something to wait for: one, or all that are late, where they may be.

        Args:
            time: reached, s.
            step: s.
        """
        if self._real_time.late == "fail":
            return 1
        passed = (world.perf_counter() - self._begin) * self._real_time.factor - (time - self._first)
        return max(1, int(passed / step))

    def meet_all(self, numbers: range, start: float, step: float) -> None:
        """Wait for points that were computed together.

        Args:
            numbers: of the steps.
            start: of the run, s.
            step: s.

        Raises:
            LateError: one is too late, and that is not allowed.
        """
        for number in numbers:
            self.meet(number, start + number * step)

    def meet(self, number: int, time: float) -> None:
        """Wait until a point is due that has been computed.

        Args:
            number: of the step that led there.
            time: of the point, s.

        Raises:
            LateError: it is too late, and that is not allowed.
        """
        due = self._begin + (time - self._first) / self._real_time.factor
        late = world.perf_counter() - due
        if late > 0.0:
            self._note_late(number, time, late)
        else:
            self._wait(due)
        delay = max(0.0, world.perf_counter() - due)
        self._points += 1
        self._sum, self._squares = self._sum + delay, self._squares + delay * delay
        self._most, self._last = max(self._most, delay), delay
        place = round(_PER_DECADE * math.log10(max(delay, _FINEST) / _FINEST))
        self._counts[min(place, len(self._counts) - 1)] += 1
        if self._untold and world.perf_counter() - self._told >= _EVERY:
            self._tell()

    def _wait(self, due: float) -> None:
        while (left := due - world.perf_counter()) > 0.0 and not self._is_over():
            world.sleep(min(left - _SHORT, _SLICE) if left > _SHORT else 0.0)

    def _note_late(self, number: int, time: float, late: float) -> None:
        self._late += 1
        if late > self._worst:
            self._worst, self._worst_at = late, time
        if self._real_time.late == "fail":
            raise LateError(
                f"step {number}, to t = {digits(time)} s, was done {_milliseconds(late)} after it was due; take a "
                "smaller factor, longer steps, or --late warn"
            )
        if self._real_time.late == "warn":
            self._untold.append((number, late))

    def _tell(self) -> None:
        """One line for all that came too late since the last."""
        (first, _), (last, _) = self._untold[0], self._untold[-1]
        steps = f"step {first} was" if first == last else f"{len(self._untold)} steps from {first} to {last} were"
        _log.warning("late: %s done up to %s after the clock", steps, _milliseconds(max(x for _, x in self._untold)))
        self._untold.clear()
        self._told = world.perf_counter()

    def report(self) -> dict[str, Any]:
        """How well the points met the clock, delays in s; what was not yet told of is told."""
        if self._untold:
            self._tell()
        points = max(1, self._points)
        mean = self._sum / points
        found: dict[str, Any] = {
            "factor": self._real_time.factor,
            "points": self._points,
            "late": self._late,
            "worst_late": self._worst,
            "worst_at": self._worst_at,
            "mean_delay": mean,
            "deviation": math.sqrt(max(0.0, self._squares / points - mean * mean)),
            "median_delay": self._quantile(0.5),
            "delay_of_99_percent": self._quantile(0.99),
            "longest_delay": self._most,
            "last_delay": self._last,
        }
        late = f"{self._late} late, by up to {_milliseconds(self._worst)} at t = {digits(self._worst_at)} s"
        late = late if self._late else "none late"
        found["summary"] = (
            f"real time x {digits(self._real_time.factor)}: {self._points} points, {late};"
            f" after they were due: median {_milliseconds(found['median_delay'])}, 99 % "
            f"within {_milliseconds(found['delay_of_99_percent'])}, the last {_milliseconds(self._last)}"
        )
        return found

    def _quantile(self, part: float) -> float:
        """The delay that a part of the points kept, to a twentieth of a decade upwards."""
        place = int(np.searchsorted(np.cumsum(self._counts), part * self._points))
        return min(self._most, _FINEST * math.pow(10.0, (place + 0.5) / _PER_DECADE))


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"
