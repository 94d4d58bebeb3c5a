"""PID control of the speed, with an integral that starts anew at each departure."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..component import Values
from ..declarations import Memory, Parameter
from ..maths import where
from .port import AtoController, Errors


class PidFeedback(AtoController, ABC):
    """The PID law on the speed error, for controllers that use it."""

    proportional_gain = Parameter("N.s/m", 300201.0, tunable=True, minimum=0.0, description="gain on the speed error")
    integral_gain = Parameter(
        "N/m", 1.0, tunable=True, minimum=0.0, description="gain on the integral of the speed error"
    )
    derivative_gain = Parameter(
        "N.s2/m", 10.0, tunable=True, minimum=0.0, description="gain on the speed error's difference quotient"
    )

    integral = Memory("m", 0.0, description="integral of reference speed less speed on this trip")
    last_error = Memory("m/s", 0.0, description="reference speed less speed at the last sample")

    def _change(self, errors: Errors) -> Any:
        """Backward difference quotient of reference speed less speed; 0 at departure."""
        return (-errors.speed - self.last_error) / self.sample_time

    def _pid(self, errors: Errors) -> Any:
        feedback = -self.proportional_gain * errors.speed + self.integral_gain * self.integral
        return feedback + self.derivative_gain * self._change(errors)

    def _advance(self, errors: Errors) -> Values:
        waiting = self._waiting()
        return {
            "integral": where(waiting, 0.0, self.integral - self.step * errors.speed),
            "last_error": where(waiting, 0.0, -errors.speed),
        }


class PidAto(PidFeedback):
    """PID control of the speed (Liu & Hou 2020, eq. 60): knows neither position nor resistance, and does not learn."""

    source = "Liu & Hou 2020, eq. 60"
    note = "The proportional gain is printed as gamma_D."
    equations = (
        r"$u = k_\mathrm{P}\,\varepsilon + k_\mathrm{I} \int_0^\tau \varepsilon\,dt + k_\mathrm{D}\,\dot\varepsilon,"
        r" \qquad \varepsilon = v_\mathrm{r} - v$",
        r"with force $u$, proportional_gain $k_\mathrm{P}$, integral_gain $k_\mathrm{I}$, derivative_gain"
        r" $k_\mathrm{D}$,"
        r" reference_speed $v_\mathrm{r}$ and speed $v$; the derivative is a backward difference.",
    )
    recommended_step = 0.05

    def outputs(self) -> Values:
        errors = self._errors()
        return self._report(self._pid(errors), errors)

    def update(self) -> Values:
        return self._advance(self._errors())
