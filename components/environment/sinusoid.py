"""A sinusoid over time."""

from __future__ import annotations

from ..component import Component, Values
from ..declarations import Data, Output, Parameter
from ..maths import logical_and, pi, sin, where


class Sinusoid(Component):
    """A sinusoid around a mean in a time window; outside it the mean.

    value = mean + amplitude sin(2 pi (t - start_time) / period + phase)
    """

    source = "own"
    equations = (r"$y = \bar y + A \sin(2 \pi\, (t - t_0)\,/\,T + \varphi)$ for $t_0 \leq t < t_1$, else $\bar y$",)

    unit = Data("m/s2", description="unit of the signal")

    mean = Parameter(unit, 0.0, tunable=True, description="value around which it swings")
    amplitude = Parameter(unit, 1.0, tunable=True, description="amplitude A")
    period = Parameter("s", 60.0, minimum=1e-6, description="period T")
    phase = Parameter("rad", 0.0, description="phase at the begin")
    start_time = Parameter("s", 0.0, description="begin of the window, t0")
    stop_time = Parameter("s", 1e9, description="end of the window, t1")

    value = Output(unit, description="the signal")

    def outputs(self) -> Values:
        angle = 2.0 * pi * (self.time - self.start_time) / self.period + self.phase
        inside = logical_and(self.time >= self.start_time - 1e-9, self.time < self.stop_time - 1e-9)
        return {"value": self.mean + where(inside, self.amplitude * sin(angle), 0.0)}
