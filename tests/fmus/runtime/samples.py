"""Components for the tests of the C runtime: one that fails on request, and integrators of its inputs."""

from railcosim.components import Component, Input, Memory, Output, Parameter, State, Tape


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
