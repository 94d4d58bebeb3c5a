"""Components of the textbook cases: two masses, a ball and the ground, and equations that meet in a loop."""

from railcosim.components import Component, Input, Output, Parameter, State, maths


class Left(Component):
    """A mass on a spring and a damper to the wall, driven by a force."""

    mass = Parameter("kg", 1.0)
    stiffness = Parameter("N/m", 1.0)
    damping = Parameter("N.s/m", 0.0)
    force = Input("N", optional=True)
    x = State("m", 1.0, output=True)
    v = State("m/s", 0.0, output=True)

    def derivatives(self):
        """Newton's law."""
        return {"x": self.v, "v": (self.force - self.stiffness * self.x - self.damping * self.v) / self.mass}


class Right(Component):
    """A mass on a spring and a damper to the wall, and on others to a given displacement, whose force it tells."""

    mass = Parameter("kg", 1.0)
    stiffness = Parameter("N/m", 1.0)
    damping = Parameter("N.s/m", 0.0)
    coupling = Parameter("N/m", 1.0)
    coupling_damping = Parameter("N.s/m", 0.0)
    other_x = Input("m", optional=True)
    other_v = Input("m/s", optional=True)
    x = State("m", 0.0, output=True)
    v = State("m/s", 0.0, output=True)
    force = Output("N")

    def _pull(self):
        return self.coupling * (self.x - self.other_x) + self.coupling_damping * (self.v - self.other_v)

    def derivatives(self):
        """Newton's law."""
        pull = self._pull() + self.stiffness * self.x + self.damping * self.v
        return {"x": self.v, "v": -pull / self.mass}

    def outputs(self):
        """The force on the other mass."""
        return {"force": self._pull()}


class Ball(Component):
    """A mass that falls."""

    mass = Parameter("kg", 1.0)
    gravity = Parameter("m/s2", 9.81)
    force = Input("N", optional=True)
    height = State("m", 1.0, output=True)
    speed = State("m/s", 0.0, output=True)

    def derivatives(self):
        """Newton's law."""
        return {"height": self.speed, "speed": self.force / self.mass - self.gravity}


class Ground(Component):
    """A spring and a damper that push, and never pull, what is below zero."""

    stiffness = Parameter("N/m", 1e4)
    damping = Parameter("N.s/m", 20.0)
    height = Input("m", 1.0)
    speed = Input("m/s", 0.0)
    force = Output("N")

    def outputs(self):
        """The force upwards."""
        push = -self.stiffness * self.height - self.damping * self.speed
        return {"force": maths.where(self.height < 0.0, maths.maximum(push, 0.0), 0.0)}


class Parabola(Component):
    """x2 = (right - swing sin(t) - 2 x1^2) / 5."""

    right = Parameter("1", 42.0)
    swing = Parameter("1", 0.0)
    x1 = Input("1", 4.0)
    x2 = Output("1")

    def outputs(self):
        """The first equation, solved for x2."""
        return {"x2": (self.right - self.swing * maths.sin(self.time) - 2.0 * self.x1 * self.x1) / 5.0}


class Line(Component):
    """x1 = 6 x2 + 4."""

    x2 = Input("1", 0.0)
    x1 = Output("1")

    def outputs(self):
        """The second equation, solved for x1."""
        return {"x1": 6.0 * self.x2 + 4.0}
