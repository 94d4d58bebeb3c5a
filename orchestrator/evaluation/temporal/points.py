"""The points of a run that a formula looks at, wherever they are: in memory or in a file."""

from bisect import bisect_left, bisect_right
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...times import slack
from .. import signals as runs
from ..signals import Part
from ..terms import Prepared

Array = NDArray[np.float64]
Places = NDArray[np.int64]
_KEPT = 4


class Windows(NamedTuple):
    """Which points lie in an interval seen from each of some points: from `first` up to `last`, that one excluded.

    `begin` and `end` hold them all. `beyond` says of which windows more would lie behind the end of the run, `unknown`
    which hold nothing although the run was going on: between two points.
    """

    begin: int
    end: int
    first: Places
    last: Places
    beyond: NDArray[np.bool_]
    unknown: NDArray[np.bool_]


class Points:
    """Looks points of a run up by their times, a block at a time.

    Args:
        signals: the run. ahead: how many points further ahead expressions look.
    """

    def __init__(self, signals: Prepared, ahead: int) -> None:
        self.signals, self._ahead = signals, ahead
        self.count = signals.points
        self._parts: dict[tuple[int, int], Part] = {}
        self._times: dict[int, float] = {}
        self.begin, self.end = signals.ends
        self.forgiven = slack(signals.step, self.begin, self.end)

    def part(self, first: int, last: int) -> Part:
        """Some points of the run."""
        found = self._parts.get((first, last))
        if found is None:
            end = min(last + self._ahead, self.count)
            found = Part(self.signals, self.signals.part(first, end), first, beyond=end - last)
            if len(self._parts) == _KEPT:
                del self._parts[next(iter(self._parts))]
            self._parts[first, last] = found
        return found

    def times(self, first: int, last: int) -> Array:
        """Of these points, in s."""
        return np.asarray(self.part(first, last).time[: last - first], dtype=np.float64)

    def time(self, k: int) -> float:
        """Of one point, in s."""
        if k not in self._times:
            self._times[k] = float(self.signals.part(k, k + 1)["time"][0])
        return self._times[k]

    def _place(self, time: float, *, behind: bool = False) -> int:
        """How many points are earlier than a time, or as early."""
        find = bisect_right if behind else bisect_left
        block = find(range(0, self.count, runs.BLOCK), time, key=self.time)
        start = max(block - 1, 0) * runs.BLOCK
        times = self.times(start, min(start + runs.BLOCK, self.count))
        return start + int(np.searchsorted(times, time, "right" if behind else "left"))

    def ahead(self, first: int, last: int, low: float, high: float) -> Windows:
        """The windows from `low` to `high` s behind each of some points; without end, up to the run's."""
        now = self.times(first, last)
        begins, ends = self._between(first, now, now + low if low else now, now + high if high else now)
        beyond = now + high > self.end + self.forgiven if np.isfinite(high) else np.full(now.shape, self.is_cut)
        unknown = (begins >= ends) & ~beyond
        return Windows(first, int(ends[-1]), begins, ends, beyond, unknown)

    def back(self, first: int, last: int, low: float, high: float) -> Windows:
        """The windows from `high` to `low` s before each of some points; without end, from the run's begin."""
        now = self.times(first, last)
        begins, ends = self._between(first, now, now - high if high else now, now - low if low else now)
        unknown = (begins >= ends) & (now - low >= self.begin - self.forgiven)
        return Windows(int(begins[0]), last, begins, ends, np.zeros(now.shape, np.bool_), unknown)

    @property
    def is_cut(self) -> bool:
        """Whether the run ended before its time."""
        return not self.signals.completed

    def _between(self, first: int, now: Array, low: Array, high: Array) -> tuple[Places, Places]:
        """The first point in each window and the one behind its last. Now is that point alone, whatever its time."""
        from_now, to_now = low is now, high is now
        own = np.arange(first, first + len(now))
        if from_now and to_now:
            return own, own + 1
        all_before, all_after = low[0] == -np.inf, high[0] == np.inf
        start = 0
        if not all_before:
            start = first if from_now else self._place(float(low[0]) - self.forgiven)
        ends_at = low[-1] if all_after else high[-1]
        end = first + len(now) if to_now else self._place(float(ends_at) + self.forgiven, behind=True)
        times = self.times(start, max(end, start))
        begins, ends = own, own + 1
        if not from_now:
            begins = np.zeros_like(own) if all_before else start + np.searchsorted(times, low - self.forgiven)
        if not to_now:
            found = start + np.searchsorted(times, high + self.forgiven, "right")
            ends = np.full_like(own, self.count) if all_after else found
        return begins, np.maximum(ends, begins)
