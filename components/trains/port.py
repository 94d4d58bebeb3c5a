"""The train port: what every train takes and gives, so that one can replace another; and what opposes its motion."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..component import Component
from ..declarations import Input, Parameter
from ..maths import where

STARTING = "resistance that must be overcome at rest, where it is more than that of motion"
"""Description of ``starting_resistance``, a parameter of every train."""


class Train(Component, ABC):
    """A train: total force, disturbance and line resistance in; position, speed and acceleration out.

    Friction (Davis, curve and tunnel resistance) and the brake oppose motion and hold a train that stands; slope and
    disturbance act along the line whatever the train does, and may pull a train that nothing holds. A negative
    ``force`` is the brake's: it never drives a train backwards, because a reverser is not modelled. A train that rolls
    backwards is slowed down by friction, brake and traction.

    A subclass provides ``position`` (m), ``speed`` (m/s) and ``acceleration`` (m/s2), as outputs or shown states.
    """

    force = Input("N", description="total traction (+) or braking (-) force at the wheels; braking never reverses")
    disturbance = Input("m/s2", optional=True, description="disturbing force per mass, positive forwards")
    line_resistance = Input("N/kg", optional=True, description="resistance of slope, curve and tunnel per mass")
    curve_resistance = Input(
        "N/kg",
        optional=True,
        beside=line_resistance,
        description="part of line_resistance that opposes motion either way: curve and tunnel",
    )


class DavisResistance(Component, ABC):
    """Running resistance per mass, R(v) = c0 + c1 v + c2 v^2 (Davis 1926), for components that know their train.

    The defaults are the coefficients of the high-speed train in Wang et al. 2020, Table 2.
    """

    c0 = Parameter("N/kg", 0.01176, minimum=0.0, description="Davis coefficient: constant part")
    c1 = Parameter("N.s/(m.kg)", 0.00077616, minimum=0.0, description="Davis coefficient: part linear in speed")
    c2 = Parameter("N.s2/(m2.kg)", 0.00016, minimum=0.0, description="Davis coefficient: part quadratic in speed")

    def _davis(self, speed: Any) -> Any:
        """R in N/kg against running forwards at a speed; R(-v) = -R(v), and at standstill what resists a start."""
        return where(speed < 0.0, -self._opposing(-speed), self._opposing(speed))

    def _opposing(self, speed: Any) -> Any:
        """R in N/kg against motion in either direction, at a speed in that direction."""
        return self.c0 + self.c1 * speed + self.c2 * speed * speed


def opposed(speed: Any, forward: Any, backward: Any, stuck: Any = 0.0) -> Any:
    """Acceleration of what friction opposes: at rest it sets off only if it then goes on in that direction.

    Args:
        speed: in m/s.
        forward: acceleration of a forward motion at this speed in m/s2, friction taken off.
        backward: of a backward motion, friction added; at rest not below ``forward``.
        stuck: how much more than against motion friction is at rest, per mass, in m/s2.
    """
    at_rest = where(forward > stuck, forward, where(backward < -stuck, backward, 0.0))
    return where(speed > 0.0, forward, where(speed < 0.0, backward, at_rest))


def acting(force: Any, speed: Any) -> Any:
    """A force at the wheels as it acts, forwards positive: both traction and brake slow down what rolls backwards."""
    return where(speed < 0.0, abs(force), force)
