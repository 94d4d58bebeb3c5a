"""Components for the tests of the C runtime: some that fail on request, integrators, starts that are computed."""

from railcosim.components import Component, Input, Memory, Noise, Output, Parameter, State, Tape
from railcosim.components.maths import sin, where


class Breaks(Component):
    """Breaks when it is told to."""

    u = Input("1", 1.0)
    rate = Parameter("1/s", 1.0, tunable=True)
    x = State("m", 1.0, output=True)
    y = Output("1", description="infinite at u = 0")
    whole = Output("1", int)
    m = Memory("1", 1.0)

    def derivatives(self):
        return {"x": self.rate * self.x * self.x}

    def outputs(self):
        return {"y": self.m / self.u, "whole": 2.0 * self.u}

    def update(self):
        return {"m": self.m}


class Integrators(Component):
    """Integrators of their inputs."""

    gain = Parameter("1", 1.0)
    slack = Parameter("1", 1.0, tunable=True)
    u = Input("1", 0.0)
    w = Input("1", [0.0, 0.0], shape=(2,))
    count = Input("1", 0, type=int)
    door = Input("1", False)
    label = Input("1", "none")
    x = State("1", 0.0, output=True)
    z = State("1", 0.0, shape=(2,), output=True)
    y = Output("1", description="of the input at this instant")
    late = Output("1", description="of the state at this instant")

    def derivatives(self):
        return {"x": self.gain * self.u, "z": self.w}

    def outputs(self):
        return {"y": 2.0 * self.u + self.w[0], "late": 3.0 * self.x}


class Spoils(Component):
    """Memory, tape and a state that is put back, each with its own way of becoming infinite: an input that is zero."""

    trip = Input("1", 1, type=int)
    trip_time = Input("s", 0.0)
    for_memory = Input("1", 1.0)
    for_tape = Input("1", 1.0)
    for_state = Input("1", 1.0)
    x = State("1", 0.0, output=True)
    m = Memory("1", 0.0, output=True)
    effort = Tape("1")

    def derivatives(self):
        return {"x": 0.0}

    def update(self):
        return {"m": 1.0 / self.for_memory, "effort": 1.0 / self.for_tape, "x": 1.0 / self.for_state}


class Begins(Component):
    """A start that follows from an input, and is infinite where that is zero; a whole memory that is shown."""

    u = Input("1", 0.5)
    x = State("1", 0.0, output=True)
    n = Memory("1", 0, type=int, output=True)
    y = Output("1")

    def initial(self):
        return {"x": 1.0 / self.u}

    def derivatives(self):
        return {"x": -self.x}

    def outputs(self):
        return {"y": 3.0 * self.x}

    def update(self):
        return {"n": self.n + 1}


class Misfits(Component):
    """Outputs that their variables cannot hold: a whole number, and a truth value."""

    u = Input("1", 1.0)
    whole = Output("1", int)
    door = Output("1", bool)

    def outputs(self):
        return {"whole": 1e9 * self.u, "door": where(self.u > 0.0, 1.0, 0.5 * self.u * self.u + self.u)}


class Late(Component):
    """Something that has no value at the end of its first step, and a hold of a random number that may be changed."""

    hold = Parameter("s", 1.0, tunable=True)
    m = Memory("1", 1.0)
    r = Noise(hold)
    u = Input("1", 0.0)
    y = Output("1")
    through = Output("1")

    def outputs(self):
        return {"y": 1.0 / self.m, "through": self.u + self.r}

    def update(self):
        return {"m": self.m - 1.0}


class Swinging(Component):
    """Two states that forces of time turn round, again and again within a step."""

    v = State("m/s", -0.01, output=True, standstill=True)
    w = State("m/s", 0.01, output=True, standstill=True)

    def derivatives(self):
        return {"v": sin(19.0 * self.time + 1.2), "w": sin(55.0 * self.time + 0.9)}


class Pushed(Component):
    """A block at rest that moves, and comes to rest, as an input does."""

    force = Input("m/s2", 0.0)
    v = State("m/s", 1.0, output=True, standstill=True)

    def derivatives(self):
        return {"v": where(self.v > 0.0, self.force, 0.0)}
