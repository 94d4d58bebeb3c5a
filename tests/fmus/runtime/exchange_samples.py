"""Components for the tests of model exchange: every kind of choice, and a sampled block with a standstill."""

from railcosim.components import Component, Input, Memory, Output, Parameter, State
from railcosim.components.maths import floor, log, maximum, piecewise_constant, sin, sqrt, where


class Choices(Component):
    """A state that grows, and every kind of choice on it and on time."""

    level = Parameter("1", 2.0, tunable=True)
    begin = Parameter("s", 1.0, tunable=True)
    u = Input("1", 0.5)
    on = Input("1", False)
    x = State("1", 0.25, output=True)
    under = Output("1", bool)
    up_to = Output("1", bool)
    early = Output("1", bool)
    late = Output("1", bool)
    whole = Output("1", int, description="the part before the point")
    stair = Output("1", description="by the state")
    clock = Output("1", description="by the time")
    safe = Output("1", description="has no value in a branch that is not chosen")
    bounded = Output("1", description="with a kink, and no event")
    chosen = Output("1", description="by an input that changes at events")
    either = Output("1", description="two choices, one in the other")

    def derivatives(self):
        return {"x": where(self.on, -self.u, self.u) + 0.0 * self._safe()}

    def outputs(self):
        return {
            "under": self.x < self.level,
            "up_to": self.x <= 1.0,
            "early": self.time < self.begin,
            "late": self.time - 1.0 >= self.begin,
            "whole": floor(self.x),
            "stair": piecewise_constant(self.x, [0.0, 1.0, 4.0], [1.0, 2.0, 3.0]),
            "clock": piecewise_constant(0.5 + self.time, [0.0, 1.5, 2.0], [1.0, 2.0, 3.0]),
            "safe": self._safe(),
            "bounded": maximum(self.x, 1.0),
            "chosen": where(self.on, self.level, self.x),
            "either": where(where(self.x > 1.0, self.u, 0.0) > 0.25, 1.0, -1.0),
        }

    def _safe(self):
        beyond = self.x > 3.0
        return where(beyond, log(where(beyond, self.x - 3.0, 1.0)), 0.0)


class Close(Component):
    """One comparison, and nothing else."""

    x = State("1", 0.0)
    up_to = Output("1", bool)

    def derivatives(self):
        return {"x": 1.0}

    def outputs(self):
        return {"up_to": self.x <= 1.0}


class Sampler(Component):
    """A block that stops, and counts and holds at samples; at one where it is told to it is put back."""

    sample_time = Parameter("s", 0.0, minimum=0.0)
    u = Input("1", 0.0)
    back = Input("1", False)
    v = State("m/s", 1.0, output=True, standstill=True)
    n = Memory("1", 0, type=int, output=True)
    y = Output("1", description="with feed-through: held")
    z = Output("1", description="without: fresh")

    def derivatives(self):
        return {"v": self.u}

    def outputs(self):
        return {"y": 2.0 * self.u + self.n, "z": 3.0 * self.v}

    def update(self):
        return {"n": self.n + 1, "v": where(self.back, -1.0, self.v)}


class Driven(Component):
    """A block that stops, and that time sets off again."""

    v = State("m/s", 0.0, output=True, standstill=True)

    def derivatives(self):
        return {"v": sin(self.time)}


class Nothing(Component):
    """Without inputs, outputs and choices."""

    x = State("1", 1.0)

    def derivatives(self):
        return {"x": -self.x}


class Stairs(Component):
    """Steps over time, whose ends are not where the roundings of one and of the other meet."""

    after = Parameter("s", 3.7)
    stair = Output("1")
    whole = Output("1", int)
    begun = Output("1", bool)

    def outputs(self):
        ends = [0.1 * k for k in range(1, 41)]
        return {
            "stair": piecewise_constant(self.time - self.after, ends, [float(k) for k in range(1, 41)]),
            "whole": floor(self.time - self.after),
            "begun": self.time >= 2.1,
        }


class Inverse(Component):
    """A sampled block: its output has no value where its state is zero, nor its comparison below an input of zero."""

    u = Input("1", 1.0)
    w = Input("1", 1.0)
    x = State("1", 1.0)
    n = Memory("1", 0, type=int)
    y = Output("1")

    def derivatives(self):
        return {"x": where(self.x > self.u, 1.0, -1.0) * where(sqrt(self.w) > 0.5, 1.0, 0.5)}

    def outputs(self):
        return {"y": 1.0 / self.x}

    def update(self):
        return {"n": self.n + 1}


class Kinds(Component):
    """Branches of other slopes, by a state, an input, a place in a table and the time; one has no value below 2."""

    u = Input("1", 0.5)
    x = State("1", 0.25, output=True)
    branch = Output("1")
    piece = Output("1")
    timed = Output("1")
    root = Output("1")

    def derivatives(self):
        return {"x": where(self.x < 1.0, self.u * self.x, -self.x * self.x * self.x)}

    def outputs(self):
        beyond = self.x > 2.0
        return {
            "branch": where(self.x < 1.0, self.u * self.x, 3.0 * self.x * self.x - self.u),
            "piece": self.x * piecewise_constant(self.x, [0.0, 1.0, 3.0], [1.0, 2.0, -1.0]),
            "timed": where(self.time < 1.0, self.x, self.u * self.u),
            "root": self.x + where(beyond, log(where(beyond, self.x - 2.0, 1.0)), 0.0),
        }


class Rooted(Component):
    """A rate with a branch that has no value below its end, and no output."""

    x = State("1", 2.0)

    def derivatives(self):
        beyond = self.x > 1.0
        return {"x": where(beyond, log(where(beyond, self.x - 1.0, 1.0)), -self.x)}


class Unbounded(Component):
    """A comparison with a place that is nowhere, as that after the last stop of a line is."""

    x = State("1", 0.0)
    before = Output("1", bool)

    def derivatives(self):
        return {"x": 1.0}

    def outputs(self):
        return {"before": self.x < float("inf")}


class Blind(Component):
    """An output that has no value where its state is negative, and a rate that has one everywhere."""

    u = Input("1", 1.0)
    x = State("1", 1.0)
    y = Output("1")

    def derivatives(self):
        return {"x": self.u - 3.0 * self.x}

    def outputs(self):
        return {"y": log(self.x)}


class Draining(Component):
    """A rate that has no value where the state is negative, and one whose slope alone has none at its end."""

    x = State("1", 1.0)
    z = State("1", 1.0)

    def derivatives(self):
        return {"x": -log(self.x), "z": -sqrt(self.z)}
