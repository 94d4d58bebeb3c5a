"""The component of benchmarks/ring.py."""

from railcosim.components import Component, Input, Parameter, State


class Lag(Component):
    """A first-order lag: der(x) = rate (u - x)."""

    rate = Parameter("1/s", 1.0, description="how fast the state follows")
    u = Input("1", 0.0, description="what it follows")
    x = State("1", 0.0, output=True, description="the state")

    def derivatives(self):
        return {"x": self.rate * (self.u - self.x)}
