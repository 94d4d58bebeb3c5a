"""A train as one rigid mass."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Output, Parameter, State
from ..maths import clip, maximum, where
from .port import STARTING, DavisResistance, Train, opposed


class PointMassTrain(DavisResistance, Train):
    """A train as a point mass with Davis resistance (Wang et al. 2020, eqs. 1-2).

    m dv/dt = F - m R(v) - m r_line + m a_disturbance, with R(v) = c0 + c1 v + c2 v^2, while the train runs forwards.
    The source uses this formula at every speed; here what opposes motion turns with it, and holds a train at rest.
    """

    source = "Wang et al. 2020, eqs. 1-2, Tables 2-3"
    equations = (
        r"$\dot{s} = v, \qquad \dot{v} = F\,/\,m - R(v) - r + w$ forwards, $v > 0$;"
        r" $\qquad R(v) = c_0 + c_1 v + c_2 v^2$",
        r"$\dot{v} = |F|\,/\,m + R(-v) - r + 2\,r_\mathrm{c} + w$ backwards, $v < 0$",
        r"at rest that of the two which sets the train in motion its own way, if it is more than $c_\mathrm{s} - c_0$"
        r" where that is positive; else $\dot{v} = 0$",
        r"with position $s$, speed $v$, mass $m$, line_resistance $r$, curve_resistance $r_\mathrm{c}$, disturbance"
        r" $w$, starting_resistance $c_\mathrm{s}$ and the applied force",
        r"$F = \min(\max(f, -F_\mathrm{b}), F_\mathrm{t})$ where limit_force is set, else $F = f$,",
        r"of the force asked for $f$, braking_limit $F_\mathrm{b}$ and traction_limit $F_\mathrm{t}$.",
    )

    mass = Parameter("kg", 400e3, minimum=1.0, description="mass of the train")
    limit_force = Parameter("1", False, tunable=True, description="whether the two force limits act")
    traction_limit = Parameter(
        "N", 600e3, tunable=True, minimum=0.0, description="largest traction force, where limits act"
    )
    braking_limit = Parameter(
        "N", 600e3, tunable=True, minimum=0.0, description="largest braking force, where limits act"
    )

    starting_resistance = Parameter("N/kg", 0.0, minimum=0.0, description=STARTING)

    position = State("m", 0.0, output=True, description="position of the front, growing in the running direction")
    speed = State("m/s", 0.0, output=True, standstill=True, description="speed")
    acceleration = Output("m/s2", description="net acceleration")
    applied_force = Output("N", description="force at the wheels after the limits")

    def derivatives(self) -> Values:
        return {"position": self.speed, "speed": self._acceleration()}

    def outputs(self) -> Values:
        return {"acceleration": self._acceleration(), "applied_force": self._applied_force()}

    def _applied_force(self) -> Any:
        return where(self.limit_force, clip(self.force, -self.braking_limit, self.traction_limit), self.force)

    def _acceleration(self) -> Any:
        pull, line = self._applied_force() / self.mass, self.line_resistance
        forward = pull - (self._opposing(self.speed) + line) + self.disturbance
        backward = abs(pull) + self._opposing(-self.speed) - (line - 2.0 * self.curve_resistance) + self.disturbance
        return opposed(self.speed, forward, backward, maximum(self.starting_resistance - self.c0, 0.0))
