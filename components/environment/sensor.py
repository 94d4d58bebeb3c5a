"""A train's odometer and speed sensor: noisy, quantised and late."""

from __future__ import annotations

from typing import Any

from ..component import Component, Values
from ..declarations import Input, Memory, Noise, Output, Parameter, Size
from ..maths import floor, where


class Sensor(Component):
    """Measured position and speed: normal noise, a resolution, and a delay of whole samples. All are off by default.

    Noise is added first and what results is rounded to the resolution. A value that is late is the measured one of
    ``delay`` samples ago; before there was one, the first.
    """

    equations = (
        r"$y_k = Q(x_{k-d} + \sigma n_{k-d})$, with $Q$ rounding to whole multiples of the resolution,",
        r"for position and speed each, with the true value $x_k$ of sample $k$, its noise $\sigma$ times independent"
        r" normal numbers $n_k$, and the delay $d$.",
    )

    longest_delay = Size(10, description="longest delay in samples")

    true_position = Input("m", description="position of the train")
    true_speed = Input("m/s", description="speed of the train")

    position_noise = Parameter(
        "m", 0.0, tunable=True, minimum=0.0, description="standard deviation of the position's noise"
    )
    speed_noise = Parameter(
        "m/s", 0.0, tunable=True, minimum=0.0, description="standard deviation of the speed's noise"
    )
    noise_hold = Parameter("s", 0.01, minimum=1e-6, description="how long a random value is held")
    position_resolution = Parameter(
        "m", 0.0, tunable=True, minimum=0.0, description="resolution of the position; 0 is unlimited"
    )
    speed_resolution = Parameter(
        "m/s", 0.0, tunable=True, minimum=0.0, description="resolution of the speed; 0 is unlimited"
    )
    delay = Parameter("1", 0, type=int, minimum=0, description="delay in samples, at most longest_delay")

    gauss = Noise(noise_hold, shape=(2,), description="one stream for the position, one for the speed")

    past_position = Memory("m", 0.0, shape=(longest_delay,), description="measured positions, the latest first")
    past_speed = Memory("m/s", 0.0, shape=(longest_delay,), description="measured speeds, the latest first")

    position = Output("m", description="measured position")
    speed = Output("m/s", description="measured speed")

    def initial(self) -> Values:
        position, speed = self._measured()
        return {"past_position": [position] * self.longest_delay, "past_speed": [speed] * self.longest_delay}

    def outputs(self) -> Values:
        position, speed = self._measured()
        return {"position": self._late(position, self.past_position), "speed": self._late(speed, self.past_speed)}

    def update(self) -> Values:
        position, speed = self._measured()
        last = self.longest_delay - 1
        return {
            "past_position": [position, *(self.past_position[k] for k in range(last))],
            "past_speed": [speed, *(self.past_speed[k] for k in range(last))],
        }

    def _measured(self) -> tuple[Any, Any]:
        position = self.true_position + self.position_noise * self.gauss[0]
        speed = self.true_speed + self.speed_noise * self.gauss[1]
        return _rounded(position, self.position_resolution), _rounded(speed, self.speed_resolution)

    def _late(self, present: Any, past: Any) -> Any:
        value = present
        for k in range(self.longest_delay):
            value = where(self.delay > k + 0.5, past[k], value)
        return value


def _rounded(value: Any, resolution: Any) -> Any:
    """The nearest multiple of a resolution; the value itself where that is 0."""
    unit = where(resolution > 0.0, resolution, 1.0)
    return where(resolution > 0.0, floor(value / unit + 0.5) * unit, value)
