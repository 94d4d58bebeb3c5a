"""PD-type iterative learning control: the force of the trip before, corrected by the speed error."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Parameter, Tape
from ..maths import where
from .pid import PidFeedback
from .port import Errors


class PdIlc(PidFeedback):
    """PD-type iterative learning control (PDILC, Liu & Hou 2020, eq. 61); PID drives its first trip (eq. 60)."""

    source = "Liu & Hou 2020, eqs. 60-61"
    equations = (
        r"$u_i(\tau) = u_{i-1}(\tau) + k_\mathrm{p}\,\varepsilon + k_\mathrm{d}\,\dot\varepsilon, \qquad \varepsilon ="
        r" v_\mathrm{r} - v$",
        r"with force $u_i$ on trip $i$, learned_force $u_{i-1}$, learning_proportional $k_\mathrm{p}$ and"
        r" learning_derivative $k_\mathrm{d}$; where nothing is learned yet, $u$ is that of the PID law.",
    )
    recommended_step = 0.05

    learning_proportional = Parameter(
        "N.s/m", 1.05e5, tunable=True, minimum=0.0, description="learning gain on the speed error"
    )
    learning_derivative = Parameter(
        "N.s2/m", 1.0, tunable=True, minimum=0.0, description="learning gain on its difference quotient"
    )

    learned_force = Tape("N", 0.0, description="force of the trip before at this instant")
    driven = Tape("1", 0.0, description="1 where a trip has been driven, 0 where nothing is learned yet")

    def outputs(self) -> Values:
        errors = self._errors()
        return self._report(self._total(errors), errors)

    def update(self) -> Values:
        errors = self._errors()
        return {**self._advance(errors), "learned_force": self._total(errors), "driven": 1.0}

    def _total(self, errors: Errors) -> Any:
        learned = self.learned_force - self.learning_proportional * errors.speed
        learned = learned + self.learning_derivative * self._change(errors)
        return where(self.driven > 0.5, learned, self._pid(errors))
