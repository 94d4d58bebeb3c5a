"""The ATO port: what every automatic-train-operation controller takes and gives, so that one can replace another."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from typing import Any, NamedTuple

from ..component import Component, Values
from ..declarations import Input, Output, Parameter
from ..maths import where
from ..trains.multiple_unit import WAITING


class Errors(NamedTuple):
    """Position error e = x - x_r (m), speed error de/dt = v - v_r (m/s), and alpha e + de/dt (m/s)."""

    position: Any
    speed: Any
    augmented: Any


class AtoController(Component, ABC):
    """A controller that drives a train along a timetable's reference, trip after trip.

    While ``trip_time`` is negative the train waits: the force and the errors are zero, whatever the inputs say.
    """

    trip = Input("1", 0, type=int, description="trip number; changes only while trip_time is negative")
    trip_time = Input("s", 0.0, description="time since departure; negative while waiting")
    position = Input("m", description="position since departure")
    speed = Input("m/s", description="speed")
    reference_position = Input("m", description="where the train is to be")
    reference_speed = Input("m/s", description="how fast it is to be")
    reference_acceleration = Input("m/s2", description="mean of the planned acceleration over the coming sample")
    speed_limit = Input("m/s", 1000.0, optional=True, description="speed limit")

    sample_time = Parameter("s", 0.01, minimum=1e-6, description="sample period")
    tape_duration = Parameter("s", 200.0, minimum=0.0, description="longest trip the tape can hold")
    mass = Parameter("kg", 194295.0, minimum=1.0, description="mass of the train as the controller knows it")
    alpha = Parameter(
        "1/s", 8.0, tunable=True, minimum=0.0, description="weight of the position error in the augmented error"
    )

    force = Output("N", description="force for the train")
    position_error = Output("m", description="position less reference; 0 while waiting")
    speed_error = Output("m/s", description="speed less reference; 0 while waiting")
    augmented_error = Output("m/s", description="alpha times position error plus speed error; 0 while waiting")
    estimate = Output(
        "1", shape=(3,), description="estimates of R1 (N), R2 (N.s/m) and R3 (N.s2/m2); 0 of a controller without"
    )
    barrier_reached = Output("1", bool, description="whether the augmented error reached the barrier on this trip")

    def _waiting(self) -> Any:
        return self.trip_time < WAITING

    def _errors(self) -> Errors:
        """Errors of this sample, zero while waiting: the position is then still that of the last trip's end."""
        waiting = self._waiting()
        position = where(waiting, 0.0, self.position - self.reference_position)
        speed = where(waiting, 0.0, self.speed - self.reference_speed)
        return Errors(position, speed, self.alpha * position + speed)

    def _report(
        self, force: Any, errors: Errors, estimate: Sequence[Any] = (0.0, 0.0, 0.0), barrier_reached: Any = False
    ) -> Values:
        """The port's outputs; no force while waiting."""
        return {
            "force": where(self._waiting(), 0.0, force),
            "position_error": errors.position,
            "speed_error": errors.speed,
            "augmented_error": errors.augmented,
            "estimate": list(estimate),
            "barrier_reached": barrier_reached,
        }
