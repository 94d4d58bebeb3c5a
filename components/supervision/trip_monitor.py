"""Largest errors of each trip, found at every sample whatever is recorded."""

from __future__ import annotations

from typing import Any

from ..component import Component, Values
from ..declarations import Input, Memory
from ..maths import maximum, where
from ..trains.multiple_unit import WAITING

_NEVER = -1e3
"""m/s: an overspeed before the first sample of a trip."""


class TripMonitor(Component):
    """Largest errors of the trip under way, and of the last one that has ended.

    A trip has ended when the trip number changes. Over ``finished_trip``, the ``finished_...`` values draw a curve over
    the trips.
    """

    equations = (
        r"$y_i = \max_{\tau \geq 0}\,|x_i(\tau)|$ over the samples of trip $i$, for each of the errors $x$; of the"
        r" overspeed the largest value with its sign.",
    )

    trip = Input("1", 0, type=int, description="trip number; changes only while trip_time is negative")
    trip_time = Input("s", 0.0, description="time since departure; negative while waiting")
    position_error = Input("m", optional=True, description="position less reference")
    speed_error = Input("m/s", optional=True, description="speed less reference")
    augmented_error = Input("m/s", optional=True, description="augmented error")
    speed = Input("m/s", optional=True, description="speed")
    speed_limit = Input("m/s", optional=True, description="speed limit")

    present_trip = Memory("1", -1, type=int, description="trip that is watched")
    largest_position_error = Memory("m", 0.0, output=True, description="largest |position error| so far on this trip")
    largest_speed_error = Memory("m/s", 0.0, output=True, description="largest |speed error| so far on this trip")
    largest_augmented_error = Memory("m/s", 0.0, output=True, description="largest |augmented error| so far")
    largest_overspeed = Memory("m/s", _NEVER, output=True, description="largest speed less limit so far on this trip")
    finished_trip = Memory("1", 0, type=int, output=True, description="the last trip that has ended")
    finished_position_error = Memory("m", 0.0, output=True, description="largest |position error| on it")
    finished_speed_error = Memory("m/s", 0.0, output=True, description="largest |speed error| on it")
    finished_augmented_error = Memory("m/s", 0.0, output=True, description="largest |augmented error| on it")
    finished_overspeed = Memory("m/s", _NEVER, output=True, description="largest speed less limit on it")

    def initial(self) -> Values:
        return {"present_trip": self.trip, "finished_trip": self.trip - 1}

    def update(self) -> Values:
        changed = self.trip != self.present_trip
        changes: Values = {
            "present_trip": self.trip,
            "finished_trip": where(changed, self.present_trip, self.finished_trip),
        }
        values = {
            "position_error": (abs(self.position_error), 0.0),
            "speed_error": (abs(self.speed_error), 0.0),
            "augmented_error": (abs(self.augmented_error), 0.0),
            "overspeed": (self.speed - self.speed_limit, _NEVER),
        }
        for name, (value, least) in values.items():
            largest, finished = getattr(self, f"largest_{name}"), getattr(self, f"finished_{name}")
            changes[f"finished_{name}"] = where(changed, largest, finished)
            changes[f"largest_{name}"] = self._largest(where(changed, least, largest), value)
        return changes

    def _largest(self, largest: Any, value: Any) -> Any:
        """The larger one; while waiting nothing is added."""
        return where(self.trip_time < WAITING, largest, maximum(largest, value))
