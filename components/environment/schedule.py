"""A value that follows a timetable."""

from __future__ import annotations

from ..component import Component, Values
from ..declarations import Data, Output, Parameter, Size
from ..maths import piecewise_constant, piecewise_linear, where

_ROUNDING = 1e-9
"""s: a breakpoint that is a communication point belongs to the new value whatever the rounding of k * step."""


class Schedule(Component):
    """A signal over time given by breakpoints: stepwise, or with straight lines between them.

    Before the first breakpoint it has the first value, after the last one the last.
    """

    equations = (
        r"$y(t) = y_k$ for $t_k \leq t < t_{k+1}$, or where interpolate is set",
        r"$y(t) = y_k + (y_{k+1} - y_k)\,\dfrac{t - t_k}{t_{k+1} - t_k}$,",
        r"with the breakpoints $(t_k, y_k)$ given by times and values; $y(t) = y_1$ before the first of them.",
    )

    unit = Data("m/s", description="unit of the signal")
    points = Size(1, description="number of breakpoints")

    times = Parameter("s", 0.0, shape=(points,), rising=True, description="breakpoints, rising")
    values = Parameter(unit, 0.0, tunable=True, shape=(points,), description="value from each breakpoint on")
    interpolate = Parameter("1", False, description="straight lines between the breakpoints instead of steps")

    value = Output(unit, description="the signal")

    def outputs(self) -> Values:
        now = self.time + _ROUNDING
        stepwise = piecewise_constant(now, self.times, self.values)
        linear = piecewise_linear(self.time, self.times, self.values)
        return {"value": where(self.interpolate, linear, stepwise)}
