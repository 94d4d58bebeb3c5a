"""Parts of the radio campaign that no shipped component is: a leader that brakes for good, and windows of silence."""

from railcosim.components import Component, Output, Parameter
from railcosim.components.maths import logical_and, logical_not, where

_ROUNDING = 1e-9


class BrakingLeader(Component):
    """A train that runs at constant speed and brakes to a stand, from ``brake_time`` on, by its kinematics alone.

    Position and speed are exact at every communication point, whatever the step.
    """

    begin = Parameter("m", 0.0, description="position at the start")
    cruising_speed = Parameter("m/s", 50.0, minimum=0.0, description="speed before it brakes")
    brake_time = Parameter("s", 20.0, minimum=0.0, description="when it begins to brake")
    strength = Parameter("m/s2", 1.0, minimum=1e-3, description="its deceleration")

    position = Output("m", description="position of the front")
    speed = Output("m/s", description="speed")

    def outputs(self):
        braked = where(self.time > self.brake_time, self.time - self.brake_time, 0.0)
        rest = self.cruising_speed / self.strength
        braked = where(braked < rest, braked, rest)
        before = where(self.time < self.brake_time, self.time, self.brake_time)
        travelled = self.cruising_speed * (before + braked) - 0.5 * self.strength * braked * braked
        return {"position": self.begin + travelled, "speed": self.cruising_speed - self.strength * braked}


class Channel(Component):
    """Whether a sender is heard at all: not in a window of silence, its begin included, its end not."""

    begin = Parameter("s", 1e9, description="begin of the window")
    end = Parameter("s", 1e9, description="end of the window")

    sending = Output("1", bool, description="whether messages pass")

    def outputs(self):
        now = self.time + _ROUNDING
        return {"sending": logical_not(logical_and(now >= self.begin, now < self.end))}
