"""A timetable that stops at every stop of a line and keeps its speed limits."""

from __future__ import annotations

import functools
from typing import Any

from ..declarations import Data
from ..environment.line import POINT
from ..environment.track import DESCRIPTION, Track, read_line
from ..trains.rolling_stock import TRAIN, TRAIN_DESCRIPTION, RollingStock
from .line_plan import SERVICE, Service, plan
from .running_plan import Plan
from .timetable import TripTimetable

SHUTTLE = {
    "sections": [{"position": 0.0}],
    "speed_limits": [[0.0, 20.0], [700.0, 12.0], [900.0, 20.0]],
    "stops": [{"position": 0.0}, {"position": 1500.0}],
}
"""A line of two stops."""
_SERVICE = {"acceleration": 0.8, "deceleration": 0.7, "jerk": 0.5, "margin": 1.0, "dwell": 30.0}


class LineTimetable(TripTimetable):
    """Trips along a line from its first stop to its last, stopping at each; back as well where the line has a way back.

    Each trip is planned when the component is built: between two stops as fast as the limits under the whole train,
    less a margin, and the service's acceleration, deceleration and jerk allow, in exact cubic pieces; speeds up where
    the train's rear has left a lower limit, and has slowed down where its front enters one. A stretch too short for its
    limit is run as fast as it is long enough for. ``speed_limit`` is that at the reference position.
    """

    source = "own; jerk-limited pieces as in the project's other profiles"
    equations = (
        r"$\tau = h k - t_\mathrm{wait}$ at sample $k$ of a cycle of length $t_\mathrm{wait} + T + h$, wait and run"
        r" taken up to whole samples; reference_acceleration is $(v_\mathrm{r}(\tau + (d+1) h) - v_\mathrm{r}(\tau + d"
        r" h)) / h$,",
        r"with trip_time $\tau$, sample_time $h$, wait $t_\mathrm{wait}$, the plan's duration $T$, preview $d$ and"
        r" reference_speed $v_\mathrm{r}$.",
    )

    line = Data(SHUTTLE, convert=read_line, description=DESCRIPTION)
    train = Data(POINT, convert=TRAIN.record, description=TRAIN_DESCRIPTION)
    service = Data(_SERVICE, convert=SERVICE.record, description=SERVICE.description)

    def _planned(self) -> Plan:
        return _plan(self.line, self.train, self.service)

    def _limit(self, trip_time: Any, position: Any) -> Any:
        return self.line.speed_limit(position, self.train.length)


@functools.lru_cache(maxsize=8)
def _plan(line: Track, train: RollingStock, service: Service) -> Plan:
    return plan(line, train.length, train.max_speed, service)
