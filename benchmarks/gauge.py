"""What the archives of single clauses of SSP are made of."""

from railcosim.components import Component, Input, Output, Parameter


class Gauge(Component):
    """y = gain u + bias, and the same in km/h. By itself it shows 10 m/s; behind another of its kind 30 m/s."""

    gain = Parameter("1", 2.0)
    bias = Parameter("m/s", 10.0)
    u = Input("m/s", optional=True)
    y = Output("m/s")
    dial = Output("km/h")

    def outputs(self):
        speed = self.gain * self.u + self.bias
        return {"y": speed, "dial": 3.6 * speed}
