"""The cruise port: what every cooperative cruise controller takes and gives, one controller per train."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..declarations import Input, Output, Parameter
from ..maths import where
from ..trains.port import DavisResistance


class CruiseController(DavisResistance, ABC):
    """A cruise controller of one train that hears the trains ahead and behind, and the leader.

    What it compensates, the resistance of train and line, turns with the motion of the train as friction does.

    A missing neighbour (``has_ahead`` false, and so on) contributes nothing: its position and speed are not read.
    Values that came by radio carry their age; what the shipped controllers do about old ones: `GuardedCruise`.
    """

    position = Input("m", description="position of the own train")
    speed = Input("m/s", description="speed of the own train")
    target_speed = Input("m/s", description="speed the trains are asked to run at")
    has_ahead = Input("1", False, optional=True, description="whether there is a train ahead")
    has_behind = Input("1", False, optional=True, description="whether there is a train behind")
    has_leader = Input("1", False, optional=True, description="whether the leader is heard")
    ahead_position = Input("m", flag=has_ahead, description="position of the train ahead")
    ahead_speed = Input("m/s", flag=has_ahead, description="speed of the train ahead")
    behind_position = Input("m", flag=has_behind, description="position of the train behind")
    behind_speed = Input("m/s", flag=has_behind, description="speed of the train behind")
    leader_position = Input("m", flag=has_leader, description="position of the first train")
    leader_speed = Input("m/s", flag=has_leader, description="speed of the first train")
    ahead_age = Input("s", optional=True, description="how old what is known of the train ahead is")
    behind_age = Input("s", optional=True, description="how old what is known of the train behind is")
    leader_age = Input("s", optional=True, description="how old what is known of the first train is")
    line_resistance = Input("N/kg", optional=True, description="resistance of slope, curve and tunnel per mass")
    curve_resistance = Input(
        "N/kg",
        optional=True,
        beside=line_resistance,
        description="part of line_resistance that opposes motion either way: curve and tunnel",
    )

    mass = Parameter("kg", 400e3, minimum=1.0, description="mass of the own train")

    demand = Output("m/s2", description="demanded acceleration, before resistance is compensated")
    force = Output("N", description="force for the own train")
    range_violated = Output("1", bool, description="whether a gap is outside the range the controller is made for")

    def _resistance(self, speed: Any) -> Any:
        """Resistance of the train at a speed and of the line in N/kg, against running forwards."""
        line, backward = self.line_resistance, self.line_resistance - 2.0 * self.curve_resistance
        return self._davis(speed) + where(self.speed < 0.0, backward, line)
