"""The components of benchmarks/ring.py and benchmarks/iterations.py."""

from railcosim.components import Component, Input, Output, Parameter, State, maths


class Lag(Component):
    """A first-order lag: der(x) = rate (u - x)."""

    rate = Parameter("1/s", 1.0, description="how fast the state follows")
    u = Input("1", 0.0, description="what it follows")
    x = State("1", 0.0, output=True, description="the state")

    def derivatives(self):
        return {"x": self.rate * (self.u - self.x)}


class DrivenLag(Component):
    """A first-order lag that never rests: der(x) = u / 2 + sin(t) - x."""

    u = Input("1", 0.0, description="what it follows")
    x = State("1", 0.0, output=True, description="the state")

    def derivatives(self):
        return {"x": 0.5 * self.u + maths.sin(self.time) - self.x}


class Bend(Component):
    """A soft saturation of what it is given at the same instant: y = cos(t) - 2 tanh(u)."""

    u = Input("1", 0.0, description="what it depends on at once")
    y = Output("1", description="what comes of it")

    def outputs(self):
        return {"y": maths.cos(self.time) - 2.0 * maths.tanh(self.u)}
