"""The toy components, once: small enough that what a system of them does is known by hand.

The file is one as a user writes it: ``{path of this file}:Lag`` names a component wherever a scenario takes one.
"""

from railcosim.components import Component, Input, Memory, Noise, Output, Parameter, State, Tape, maths

# -------------------------------------------------------------------- continuous


class Lag(Component):
    """x' = rate (gain u - x): no feed-through."""

    rate = Parameter("1/s", 1.0, tunable=True)
    gain = Parameter("1", 1.0)
    u = Input("1", optional=True)
    x = State("1", 1.0, output=True)

    def derivatives(self):
        return {"x": self.rate * (self.gain * self.u - self.x)}


class LagWithSlope(Component):
    """A lag whose slope is an output: with feed-through."""

    rate = Parameter("1/s", 1.0, tunable=True)
    u = Input("1", 0.25, optional=True)
    x = State("1", 1.0, output=True)
    slope = Output("1/s")

    def derivatives(self):
        return {"x": self.rate * (self.u - self.x)}

    def outputs(self):
        return {"slope": self.rate * (self.u - self.x)}


class LagWithRow(Component):
    """A lag, and an array that decays."""

    u = Input("1", optional=True)
    x = State("1", 1.0, output=True)
    row = State("1", shape=(2,), output=True)

    def derivatives(self):
        return {"x": self.u - self.x, "row": -self.row}


class Resting(Component):
    """A lag that starts in equilibrium with its input."""

    u = Input("1", optional=True)
    x = State("1", 0.0, output=True)

    def initial(self):
        return {"x": self.u}

    def derivatives(self):
        return {"x": self.u - self.x}


class Ramp(Component):
    """x = t."""

    x = State("1", 0.0, output=True)

    def derivatives(self):
        return {"x": 1.0}


class Integral(Component):
    """x' = u."""

    u = Input("1", optional=True)
    x = State("1", 0.0, output=True)

    def derivatives(self):
        return {"x": self.u}


class Heater(Component):
    """Rises while on, falls while off."""

    on = Input("1", False, optional=True)
    x = State("1", 0.0, output=True)

    def derivatives(self):
        return {"x": maths.where(self.on, 1.0, -1.0)}


class Mass(Component):
    """A mass under an acceleration."""

    a = Input("m/s2", optional=True)
    x = State("m", 1.0, output=True)
    v = State("m/s", 0.0, output=True)

    def derivatives(self):
        return {"x": self.v, "v": self.a}


class Cart(Component):
    """A train of another maker: what pushes it moves it, backwards too."""

    force = Input("N", optional=True)
    position = State("m", 0.0, output=True)
    speed = State("m/s", 0.0, output=True)

    def derivatives(self):
        return {"position": self.speed, "speed": self.force}


class Loco(Component):
    """The same, and nothing is called as we call it."""

    pull = Input("N", optional=True)
    place = State("km", 0.0, output=True)
    pace = State("m/s", 0.0, output=True)

    def derivatives(self):
        return {"place": self.pace / 1000.0, "pace": self.pull}


class Fragile(Component):
    """x' = -gain u; its root has no value below nought, where too long a step leads."""

    gain = Parameter("1/s", 1.0)
    u = Input("1", 1.0, optional=True)
    x = State("1", 1.0, output=True)
    root = Output("1")

    def derivatives(self):
        return {"x": -self.gain * self.u}

    def outputs(self):
        return {"root": maths.sqrt(self.x)}


# -------------------------------------------------------------------- at one instant


class Pass(Component):
    """y = gain u + bias."""

    gain = Parameter("1", 1.0, tunable=True)
    bias = Parameter("1", 0.0, tunable=True)
    u = Input("1", optional=True)
    y = Output("1")

    def outputs(self):
        return {"y": self.gain * self.u + self.bias}


class Affine(Component):
    """y = gain u + w."""

    gain = Parameter("1", 1.0)
    u = Input("1", optional=True)
    w = Input("1", optional=True)
    y = Output("1")

    def outputs(self):
        return {"y": self.gain * self.u + self.w}


class Mix(Component):
    """A linear combination of three signals, and of the time."""

    a = Parameter("1", 0.0)
    b = Parameter("1", 0.0)
    c = Parameter("1", 0.0)
    bias = Parameter("1", 1.0)
    u = Input("1", optional=True)
    v = Input("1", optional=True)
    w = Input("1", optional=True)
    y = Output("1")

    def outputs(self):
        return {"y": self.a * self.u + self.b * self.v + self.c * self.w + self.bias * (1.0 + self.time)}


class Square(Component):
    """y = u^2 + bias."""

    bias = Parameter("1", 0.0)
    u = Input("1", optional=True)
    y = Output("1")

    def outputs(self):
        return {"y": self.u * self.u + self.bias}


class Root(Component):
    """y = 1 + t - gain sqrt(u)."""

    gain = Parameter("1", 1.0)
    u = Input("1", 0.04, optional=True)
    x = State("1", 0.0)
    y = Output("1")

    def derivatives(self):
        return {"x": 1.0}

    def outputs(self):
        return {"y": 1.0 + self.x - self.gain * maths.sqrt(self.u)}


class Spring(Component):
    """The acceleration of a mass at a place."""

    stiffness = Parameter("1/s2", 1.0)
    x = Input("m", 1.0, optional=True)
    a = Output("m/s2")

    def outputs(self):
        return {"a": -self.stiffness * self.x}


class Not(Component):
    """The opposite."""

    u = Input("1", False, optional=True)
    y = Output("1", bool)

    def outputs(self):
        return {"y": maths.logical_not(self.u)}


class Level(Component):
    """Whether the input is above a level; or below, upside down."""

    level = Parameter("1", 5.0)
    upside_down = Parameter("1", False)
    u = Input("1", optional=True)
    on = Output("1", bool)

    def outputs(self):
        return {"on": maths.where(self.upside_down, self.u < self.level, self.u > self.level)}


class Switch(Component):
    """y = low or high, as it is told, plus w."""

    on = Input("1", False, optional=True)
    w = Input("1", optional=True)
    low = Parameter("1", 0.0)
    high = Parameter("1", 10.0)
    y = Output("1")

    def outputs(self):
        return {"y": maths.where(self.on, self.high, self.low) + self.w}


class Whole(Component):
    """A whole number into a whole number."""

    n = Input("1", 0, type=int, optional=True)
    m = Output("1", int)

    def outputs(self):
        return {"m": self.n + 1}


class Metres(Component):
    """What arrives, in m."""

    u = Input("m", optional=True)
    y = Output("m")

    def outputs(self):
        return {"y": self.u}


class Fails(Component):
    """y = sqrt(until - t) + u, which has no value once its time is up."""

    until = Parameter("s", 5.0)
    u = Input("1", optional=True)
    x = State("s", 0.0, output=True)
    y = Output("1")

    def derivatives(self):
        return {"x": 1.0}

    def outputs(self):
        return {"y": maths.sqrt(self.until - self.time) + self.u}


# -------------------------------------------------------------------- of the time alone


class Clock(Component):
    """The time."""

    t = Output("s")

    def outputs(self):
        return {"t": self.time}


class Course(Component):
    """a + b t + c t^2, without feed-through."""

    a = Parameter("1", 1.0)
    b = Parameter("1", 0.0)
    c = Parameter("1", 0.0)
    y = Output("1")

    def outputs(self):
        return {"y": self.a + self.b * self.time + self.c * self.time * self.time}


class Wave(Component):
    """A sine."""

    y = Output("1")

    def outputs(self):
        return {"y": maths.sin(3.0 * self.time)}


class Wall(Component):
    """Zero up to a time, then one."""

    at = Parameter("s", 1.0)
    y = Output("1")

    def outputs(self):
        return {"y": maths.where(self.time > self.at, 1.0, 0.0)}


class Trips(Component):
    """Trips of one second, and a quarter of one before each to go back to the beginning."""

    trip = Output("1", int)
    trip_time = Output("s")

    def outputs(self):
        trip = maths.floor((self.time + 1e-9) / 1.25)
        return {"trip": trip, "trip_time": self.time - 1.25 * trip - 0.25}


# -------------------------------------------------------------------- sampled


class Count(Component):
    """10, 11, 12, ...: one more at each sample, without feed-through."""

    sample_time = Parameter("s", 0.0)
    n = Memory("1", 10.0, output=True)

    def update(self):
        return {"n": self.n + 1.0}


class Keep(Component):
    """What the input was when the last step began, and the number of steps, from 10 on."""

    u = Input("1", optional=True)
    seen = Memory("1", -1.0, output=True)
    n = Memory("1", 10.0, output=True)

    def update(self):
        return {"seen": self.u, "n": self.n + 1.0}


class Sampled(Component):
    """What it is given at each sample, and how many samples there have been: both pass through at once."""

    sample_time = Parameter("s", 0.0)
    u = Input("1", optional=True)
    count = Memory("1", 0.0)
    y = Output("1")
    k = Output("1")

    def outputs(self):
        return {"y": self.u, "k": self.count + 0.0 * self.u}

    def update(self):
        return {"count": self.count + 1.0}


class Sampler(Component):
    """Its input when the last step began, and twice what it is given."""

    u = Input("1", optional=True)
    seen = Memory("1", -1.0, output=True)
    y = Output("1")

    def outputs(self):
        return {"y": 2.0 * self.u}

    def update(self):
        return {"seen": self.u}


class Kilometres(Component):
    """A distance in km: 1, 2, 3, ..."""

    d = Memory("km", 1.0, output=True)

    def update(self):
        return {"d": self.d + 1.0}


class Noisy(Component):
    """Random numbers, held, and their sum."""

    seed = Parameter("1", 1, type=int)
    hold = Parameter("s", 0.3)
    w = Noise(hold)
    sum = Memory("1", 0.0, output=True)
    y = Output("1")

    def outputs(self):
        return {"y": self.w}

    def update(self):
        return {"sum": self.sum + self.w}


class Repeater(Component):
    """Adds to what it did at the same place of the trip before."""

    sample_time = Parameter("s", 0.05)
    trip = Input("1", 0, type=int)
    trip_time = Input("s")
    effort = Tape("1")
    y = Output("1")

    def outputs(self):
        return {"y": 0.75 * self.effort + self.trip_time}

    def update(self):
        return {"effort": 0.75 * self.effort + self.trip_time}


# -------------------------------------------------------------------- of every type


class EveryType(Component):
    """Passes every type on, from memory."""

    n = Input("1", 0, type=int, optional=True)
    on = Input("1", False, optional=True)
    word = Input("1", "", optional=True)
    m = Memory("1", 1, type=int, output=True)
    off = Memory("1", True, output=True)
    said = Memory("1", "a", output=True)

    def update(self):
        return {"m": self.n + 1, "off": self.on, "said": self.word + "b"}


class TypesAndRow(Component):
    """Numbers, a truth and an array that change with each step, and no text."""

    n = Input("1", 0, type=int, optional=True)
    on = Input("1", False, optional=True)
    m = Memory("1", 1, type=int, output=True)
    off = Memory("1", True, output=True)
    row = Memory("1", 0.1, shape=(3,), output=True)

    def update(self):
        m = maths.where(self.m > 99, 1, self.n + self.m)
        return {"m": m, "off": maths.logical_not(self.on), "row": self.row * 1.7 - 0.3 * self.m}


class Row(Component):
    """An array that counts in each element, and one that is received."""

    u = Input("1", shape=(3,), optional=True)
    x = Memory("1", 1.0, shape=(3,), output=True)
    seen = Memory("1", 0.0, shape=(3,), output=True)

    def update(self):
        return {"x": self.x + 1.0, "seen": self.u}


class Said(Component):
    """A text that takes quotes, and the number of steps."""

    word = Input("1", "", optional=True)
    said = Memory("1", "a, b", output=True)
    n = Memory("1", 0, type=int, output=True)

    def update(self):
        return {"said": self.word + '"', "n": self.n + 1}


class Word(Component):
    """A text of growing length."""

    word = Memory("1", "", output=True)
    n = Memory("1", 0, type=int, output=True)

    def update(self):
        return {"word": self.word + maths.where(self.n > 0, ", ", "") if self.n else "a", "n": self.n + 1}
