"""A gust of wind."""

from __future__ import annotations

from ..component import Component, Values
from ..declarations import Output, Parameter
from ..maths import logical_and, where

_ROUNDING = 1e-9
"""s: a window's edge that is a communication point belongs to it whatever the rounding of k * step."""


class Gust(Component):
    """A constant retarding gust in a time window.

    The source gives only the window [210, 240] s on the first train; shape and size are ours. The window is closed at
    its start and open at its end, so that held over communication steps it lasts exactly ``stop_time - start_time``.
    """

    source = "window: Wang et al. 2020, section 4; size: chosen"
    equations = (
        r"$a(t) = -A$ for $t_1 \leq t < t_2$, else $a(t) = 0$,",
        r"with acceleration $a$, size $A$, start_time $t_1$ and stop_time $t_2$.",
    )

    size = Parameter("m/s2", 0.5, tunable=True, description="retarding force per mass in the window; negative pushes")
    start_time = Parameter("s", 210.0, description="begin of the window")
    stop_time = Parameter("s", 240.0, description="end of the window")

    acceleration = Output("m/s2", description="disturbance for a train, positive forwards")

    def outputs(self) -> Values:
        now = self.time + _ROUNDING
        return {"acceleration": where(logical_and(now >= self.start_time, now < self.stop_time), -self.size, 0.0)}
