"""The timetable (ATS): which trip it is, the time along it, and where the train is to be."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from ..component import Component, Values
from ..declarations import Data, Memory, Output, Parameter
from ..environment.profile import Motion
from ..maths import floor, maximum, minimum, where
from .running_plan import PLAN, PLANS, Plan
from .speed_limit import LIMITS, STEPS


class TripTimetable(Component, ABC):
    """What timetables share: trips one after another, the clock along each, and the reference of its plan."""

    sample_time = Parameter("s", 0.01, minimum=1e-6, description="sample period, the controller's")
    wait = Parameter("s", 10.0, minimum=0.0, description="wait before each departure; at least two samples are taken")
    first_trip = Parameter("1", 1, type=int, description="number of the first trip")
    preview = Parameter("1", 0, type=int, minimum=0, description="delay d of the loop in samples that is previewed")
    mean_acceleration = Parameter(
        "1", True, description="whether the acceleration is the mean over a sample; else the value at trip_time"
    )

    sample = Memory("1", 0, type=int, description="samples since the start")

    trip = Output("1", int, description="trip number; changes at the start of the wait")
    trip_number = Output("1", description="the same as a real number, for tools that connect only those")
    trip_time = Output("s", description="time since departure; negative while waiting")
    reference_position = Output("m", description="where the train is to be")
    reference_speed = Output("m/s", description="how fast it is to be")
    reference_acceleration = Output("m/s2", description="mean of the planned acceleration over a coming sample")
    speed_limit = Output("m/s", description="speed limit at this trip time")

    def outputs(self) -> Values:
        h = self.sample_time
        # Half a sample inside: a quotient of whole numbers is never rounded across one.
        waiting = maximum(floor(self.wait / h + 0.999), 2.0)
        cycle = waiting + floor(self._planned().duration / h + 0.999) + 1.0
        trip = floor((self.sample + 0.5) / cycle)
        trip_time = (self.sample - trip * cycle - waiting) * h
        now = self._motion(trip_time)
        begin = self._motion(trip_time + self.preview * h)
        end = self._motion(trip_time + (self.preview + 1) * h)
        mean = (end.speed - begin.speed) / h
        return {
            "trip": self.first_trip + trip,
            "trip_number": self.first_trip + trip,
            "trip_time": trip_time,
            "reference_position": now.position,
            "reference_speed": now.speed,
            "reference_acceleration": where(self.mean_acceleration, mean, now.acceleration),
            "speed_limit": self._limit(trip_time, now.position),
        }

    def update(self) -> Values:
        return {"sample": self.sample + 1}

    def _motion(self, trip_time: Any) -> Motion:
        """The plan's motion; at rest before departure and after arrival."""
        plan = self._planned()
        motion = plan.profile.at(minimum(maximum(trip_time, 0.0), plan.duration))
        under_way = trip_time < plan.duration
        return Motion(
            where(under_way, motion.position, plan.distance),
            where(under_way, motion.speed, 0.0),
            where(under_way, motion.acceleration, 0.0),
            where(under_way, motion.jerk, 0.0),
        )

    @abstractmethod
    def _planned(self) -> Plan:
        """The plan of every trip."""

    @abstractmethod
    def _limit(self, trip_time: Any, position: Any) -> Any:
        """The speed limit in m/s at a time since departure, and at the place where the reference is then."""


class Timetable(TripTimetable):
    """Trips from station to station, one after another, and the reference along each.

    A cycle is a wait, the run and one sample. The trip number changes at the *start* of the wait: a plant that resets
    at departure would show a controller beside it one stale sample. ``trip_time`` is a whole number of samples,
    counted, not added up. ``reference_acceleration`` is the mean over the sample in which a force computed now will
    act: the coming one, or with ``preview`` samples of delay in the loop a later one. Outputs bear the names of an
    ATO's inputs.
    """

    source = "Liu & Hou 2020, section VI and eq. 64; phase speeds and accelerations chosen"
    note = "The source's Fig. 3 is not available: counts, times, distance and limits are its own, the phases ours."
    equations = (
        r"$\tau = h k - t_\mathrm{wait}$ at sample $k$ of a cycle of length $t_\mathrm{wait} + T + h$, wait and run"
        r" taken up to whole samples",
        r"$a = \dfrac{v_\mathrm{r}(\tau + (d+1) h) - v_\mathrm{r}(\tau + d h)}{h}$",
        r"with trip_time $\tau$, sample_time $h$, wait $t_\mathrm{wait}$, the plan's duration $T$, preview $d$,"
        r" reference_speed $v_\mathrm{r}$ and reference_acceleration $a$; at rest before departure and after arrival.",
    )

    plan = Data(
        PLAN,
        convert=PLANS.record,
        description="'duration' (s), 'distance' (m), 'jerk' (m/s3) and 'phases', each a change to 'speed' (m/s) or "
        "'speed_km_h' with 'acceleration' (m/s2), from 'begin' or until 'end' (s); one speed may be 'solve'",
    )
    limits = Data(LIMITS, convert=STEPS.read, description="speed limit over trip time, pairs of begin (s) and m/s")

    def _planned(self) -> Plan:
        plan: Plan = self.plan
        return plan

    def _limit(self, trip_time: Any, position: Any) -> Any:
        return self.limits.at(trip_time)
