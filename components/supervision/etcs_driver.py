"""A driver who keeps the speed that ETCS permits, whatever a controller demands."""

from __future__ import annotations

from ..component import Component, Values
from ..declarations import Input, Output, Parameter
from ..maths import clip, minimum


class EtcsDriver(Component):
    """Lets a controller's force pass where the train stays below the permitted speed, and brakes in time where not.

    The acceleration it allows is proportional to what is missing to the permitted speed less a margin, between the
    comfortable deceleration and acceleration. Without a controller it drives at the permitted speed.
    """

    note = "Gain, margin and accelerations are chosen."
    equations = (
        r"$F = \min(F_\mathrm{d},\; m\,(a + r)), \quad a = \min(\max(k\,(v_\mathrm{P} - \Delta v - v),"
        r" -b), a_\mathrm{m})$",
        r"with demanded_force $F_\mathrm{d}$, mass $m$, line_resistance $r$, gain $k$, permitted_speed $v_\mathrm{P}$,"
        r" margin $\Delta v$, speed $v$, deceleration $b$, acceleration $a_\mathrm{m}$",
    )

    speed = Input("m/s", description="speed of the train")
    permitted_speed = Input("m/s", description="permitted speed")
    demanded_force = Input("N", 1e9, optional=True, description="a controller's force; without one, none limits")
    line_resistance = Input("N/kg", optional=True, description="resistance of slope, curve and tunnel per mass")

    mass = Parameter("kg", 134.2e3, minimum=1.0, description="mass of the train, rotating parts included")
    gain = Parameter("1/s", 0.5, tunable=True, minimum=0.0, description="acceleration for each m/s that is missing")
    margin = Parameter(
        "m/s", 0.6, tunable=True, description="how far below the permitted speed to stay; negative: a reckless one"
    )
    allowed_acceleration = Parameter("m/s2", 0.8, tunable=True, minimum=0.0, description="largest acceleration")
    allowed_deceleration = Parameter("m/s2", 0.9, tunable=True, minimum=0.0, description="largest deceleration")

    force = Output("N", description="force for the train, or for its supervision")

    def outputs(self) -> Values:
        wanted = self.gain * (self.permitted_speed - self.margin - self.speed)
        bounded = clip(wanted, -self.allowed_deceleration, self.allowed_acceleration)
        return {"force": minimum(self.demanded_force, self.mass * (bounded + self.line_resistance))}
