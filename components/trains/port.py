"""The train port: what every train takes and gives, so that one can replace another."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..component import Component
from ..declarations import Input, Parameter


class Train(Component, ABC):
    """A train: total force, disturbance and line resistance in; position, speed and acceleration out.

    A subclass provides ``position`` (m), ``speed`` (m/s) and ``acceleration`` (m/s2), as outputs or shown states.
    """

    force = Input("N", description="total traction (+) or braking (-) force at the wheels")
    disturbance = Input("m/s2", optional=True, description="disturbing force per mass, positive forwards")
    line_resistance = Input("N/kg", optional=True, description="resistance of slope, curve and tunnel per mass")


class DavisResistance(Component, ABC):
    """Running resistance per mass, R(v) = c0 + c1 v + c2 v^2 (Davis 1926), for components that know their train.

    The defaults are the coefficients of the high-speed train in Wang et al. 2020, Table 2.
    """

    c0 = Parameter("N/kg", 0.01176, minimum=0.0, description="Davis coefficient: constant part")
    c1 = Parameter("N.s/(m.kg)", 0.00077616, minimum=0.0, description="Davis coefficient: part linear in speed")
    c2 = Parameter("N.s2/(m2.kg)", 0.00016, minimum=0.0, description="Davis coefficient: part quadratic in speed")

    def _davis(self, speed: Any) -> Any:
        return self.c0 + self.c1 * speed + self.c2 * speed * speed
