"""The learning law that AILC and CAILC share: an estimate of the resistance for every instant of the trip."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..component import Values
from ..declarations import Memory, Parameter, Tape
from .port import AtoController, Errors


class LearningAto(AtoController, ABC):
    """An adaptive iterative learning controller (Liu & Hou 2020, eq. 12).

    u = q1 + q2 v + q3 v^2 + M a_r - M alpha de/dt - beta delta. The estimates q are those of the trip before at this
    instant, corrected by the present error at once: the learning gain acts as feedback within the trip, too.
    """

    beta = Parameter("N.s/m", 1.1e5, tunable=True, minimum=0.0, description="gain on the augmented error")
    learning_gain = Parameter(
        "1", (5e5, 0.01, 0.01), tunable=True, shape=(3,), minimum=0.0, description="gains Gamma of the three estimates"
    )

    learned = Tape("1", 0.0, shape=(3,), description="estimates of the trip before at this instant")
    recorded_trip = Memory("1", 0, type=int, description="the trip that is being recorded")

    def _is_numbered(self) -> Any:
        """Whether the recorded trip is one to learn from: those before trip 1 are rehearsals."""
        return self.recorded_trip > 0.5

    def _corrected(self, chi: Any) -> list[Any]:
        """The estimates after this sample's correction, eqs. 13 and 32, for an error or its barrier function chi."""
        powers = (1.0, self.speed, self.speed * self.speed)
        return [self.learned[k] - self.learning_gain[k] * power * chi for k, power in enumerate(powers)]

    def _law(self, estimate: list[Any], errors: Errors) -> Any:
        v = self.speed
        resistance = estimate[0] + (estimate[1] + estimate[2] * v) * v
        feedback = self.mass * self.alpha * errors.speed + self.beta * errors.augmented
        return resistance + self.mass * self.reference_acceleration - feedback

    def _record(self, estimate: list[Any]) -> Values:
        return {"learned": estimate, "recorded_trip": self.trip}
