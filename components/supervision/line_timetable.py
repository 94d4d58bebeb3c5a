"""Timetables over a line: one that stops at every stop and keeps the limits, one along a profile that is given."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

from ..declarations import Data
from ..environment.line import POINT
from ..environment.profile import Profile
from ..environment.track import DESCRIPTION, Track, read_line
from ..tables import FASTEST, Column, Table
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


_STAY = 5.0
"""s at the end of a profile: who arrives a little later is still on the trip."""


class _Row(NamedTuple):
    """A row of a profile: place in m, time in s, speed in m/s, forces in N."""

    position: float
    time: float
    speed: float
    traction_force: float
    braking_force: float


def _plan_through(rows: Sequence[_Row]) -> Plan:
    """The plan through the rows of a profile, from rest and to rest.

    Raises:
        ValueError: it has a single row, or it begins or ends at a speed that it does not gain or lose there.
    """
    if len(rows) < 2:
        raise ValueError("a profile has at least two rows")
    first, last = rows[0], rows[-1]
    points = [(row.time - first.time, row.position, row.speed) for row in rows]
    if first.speed > 0.0:
        lead = _to_rest(first, rows[1], "begins")
        way = first.speed * lead / 3.0
        points = [(0.0, first.position - way, 0.0), *((t + lead, x, v) for t, x, v in points)]
    if last.speed > 0.0:
        rest = _to_rest(last, rows[-2], "ends")
        points.append((points[-1][0] + rest, last.position + last.speed * rest / 3.0, 0.0))
    arrival, place, _ = points[-1]
    return Plan(Profile.through([*points, (arrival + _STAY, place, 0.0)]), arrival + _STAY, place)


def _to_rest(end: _Row, inside: _Row, verb: str) -> float:
    """How long it takes, in s, from rest to the speed at an end by an even rise to the acceleration beside it."""
    change = inside.speed - end.speed
    if change <= 0.0:
        raise ValueError(f"it {verb} at {end.speed:g} m/s without a change of speed that leads to rest")
    return 2.0 * end.speed * abs(inside.time - end.time) / change


PROFILE = Table(
    "profile row",
    [
        Column("position", "m", after="position"),
        Column("time", "s", after="time"),
        Column("speed", "m/s", sign="non-negative", within=(0.0, FASTEST)),
        Column("traction_force", "N", default=0.0),
        Column("braking_force", "N", default=0.0),
    ],
    make=_Row,
    whole=_plan_through,
)
_HOP = [
    {"position": 1.0, "time": 0.0, "speed": 1.0},
    {"position": 201.0, "time": 19.0476190476, "speed": 20.0},
    {"position": 801.0, "time": 49.0476190476, "speed": 20.0},
    {"position": 1001.0, "time": 68.0952380952, "speed": 1.0},
]
"""Speeding up, running, and slowing down."""
_LIMITED = {"sections": [{"position": 0.0}], "speed_limits": [[0.0, 22.0], [950.0, 10.0]]}
"""A line on which it keeps the limits."""


class ProfileTimetable(TripTimetable):
    """Trips along a profile over place, such as ``orchestrate drive`` finds.

    Between two rows the jerk is constant, so that places, times and speeds are met. A profile begins and ends on the
    way, at 1 m/s for instance: from rest the acceleration rises evenly to that beside the first row, and falls as
    evenly to nothing behind the last one, so that the trip departs ahead of the profile's first place and arrives
    beyond its last, where it lasts for 5 s more. ``speed_limit`` is
    that at the reference position.
    """

    source = "own"
    equations = (
        r"$j = 12\,\dfrac{(v_0 + v_1)\,T / 2 - (x_1 - x_0)}{T^3}, \qquad a_0 = \dfrac{v_1 - v_0}{T} - \dfrac{j T}{2}$",
        r"with the positions $x$ and speeds $v$ of two rows, the time $T$ between them, the acceleration $a_0$ at the"
        r" first and the jerk $j$ until the second.",
    )

    profile = Data(
        _HOP,
        convert=PROFILE.read,
        description=f"{PROFILE.description}; or a .csv file with these columns, the forces being left out or not used",
    )
    line = Data(_LIMITED, convert=read_line, description=DESCRIPTION)
    train = Data(POINT, convert=TRAIN.record, description=TRAIN_DESCRIPTION)

    def _planned(self) -> Plan:
        plan: Plan = self.profile
        return plan

    def _limit(self, trip_time: Any, position: Any) -> Any:
        return self.line.speed_limit(position, self.train.length)
