"""Small components, written as a user would write them, that exercise every kind of declaration.

The tests of the declarations, of `Simulation` and of the FMUs share them. Each has an answer that can be had by hand.
"""

import itertools

from railcosim.components import (
    Component,
    Data,
    Input,
    Memory,
    Noise,
    Output,
    Parameter,
    Size,
    State,
    Tape,
    maths,
)


class Chain(Component):
    """Arrays: masses in a row joined by springs; ``masses`` of them, one spring fewer.

    Two masses, k = 1, m = 1: the stretch swings with sqrt(2) rad/s.
    """

    masses = Size(3, minimum=2, description="how many masses")

    stiffness = Parameter("N/m", 1.0, shape=(masses - 1,), minimum=0.0, description="of each spring")
    mass = Parameter("kg", 1.0, description="of every mass")
    force = Input("N", shape=(masses,), description="on each mass")
    position = State("m", 0.0, shape=(masses,), output=True, description="of each mass")
    speed = State("m/s", 0.0, shape=(masses,), description="of each mass")
    tension = Output("N", shape=(masses - 1,), description="in each spring, positive when stretched")
    momentum = Output("kg.m/s", description="of all masses together")

    def _tension(self):
        return self.stiffness * (self.position[:-1] - self.position[1:])

    def derivatives(self):
        pull = self._tension()
        acceleration = [(self.force[0] - pull[0]) / self.mass]
        for k in range(1, self.masses - 1):
            acceleration.append((self.force[k] + pull[k - 1] - pull[k]) / self.mass)
        acceleration.append((self.force[-1] + pull[-1]) / self.mass)
        return {"position": self.speed, "speed": acceleration}

    def outputs(self):
        return {"tension": self._tension(), "momentum": self.mass * maths.total(self.speed)}


class Types(Component):
    """Integers, booleans, texts, an optional input and a tunable parameter, and arrays of them."""

    gear_ratio = Parameter("1", 2, type=int, minimum=1, maximum=9, description="teeth per tooth")
    label = Parameter("1", "train", description="what the text begins with")
    gain = Parameter("1", 1.5, tunable=True, minimum=0.0, description="factor on the offset")
    teeth = Input("1", 0, type=int, description="teeth on the first wheel")
    doors = Input("1", False, shape=(2,), description="which doors are open")
    remark = Input("1", "", description="what the text ends with")
    offset = Input("m", optional=True, description="may stay unconnected")
    turned = Output("1", int, description="teeth times ratio")
    closed = Output("1", bool, shape=(2,), description="which doors are closed")
    may_go = Output("1", bool, description="whether all doors are closed")
    text = Output("1", str, description="label and remark, or a warning while a door is open")
    shift = Output("m", description="gain times offset")

    def outputs(self):
        may_go = maths.logical_not(maths.logical_or(self.doors[0], self.doors[1]))
        return {
            "turned": self.gear_ratio * self.teeth,
            "closed": maths.logical_not(self.doors),
            "may_go": may_go,
            "text": maths.where(may_go, self.label + " " + self.remark, "door open"),
            "shift": self.gain * self.offset,
        }


class Counter(Component):
    """Memory, sampled every 0.1 s whatever the communication step: after n samples of a constant u the total is n u."""

    sample_time = Parameter("s", 0.1, minimum=0.0, description="own sample period")
    u = Input("1", 0.0, description="what is added at each sample")
    total = Memory("1", 0.0, output=True, description="sum of the samples so far")
    samples = Memory("1", 0, type=int, description="how many")
    last_time = Memory("s", -1.0, output=True, description="time of the last sample")
    last_step = Memory("s", 0.0, output=True, description="length of the last sample")
    through = Output("1", description="total plus input: direct feed-through")
    count = Output("1", int, description="number of samples: from memory alone")

    def outputs(self):
        return {"through": self.total + self.u, "count": self.samples}

    def update(self):
        return {
            "total": self.total + self.u,
            "samples": self.samples + 1,
            "last_time": self.time,
            "last_step": self.step,
        }


class Learner(Component):
    """Tape: P-type iterative learning against a disturbance that repeats with every trip.

    With error = disturbance - command and command = learned + gain error the error of trip k is the one of trip 1 times
    (1 - gain)^(k-1) where the tape is not filtered: here the caller closes the loop.
    """

    gain = Parameter("1", 0.5, description="share of the error that is learned")
    trip = Input("1", 1, type=int, description="number of the trip")
    trip_time = Input("s", 0.0, description="time since departure; negative while waiting")
    error = Input("1", 0.0, description="what is to be learned away")
    spoiled = Input("1", False, description="whether this trip is not to be kept")
    learned = Tape("1", 0.0, description="feed-forward of the last kept trip")
    pair = Tape("1", 7.0, shape=(2,), description="an array on the tape: its halves of the error")
    was_spoiled = Memory("1", False, description="whether anything was wrong on this trip")
    command = Output("1", description="feed-forward")
    pair_seen = Output("1", shape=(2,), description="what the array reads")

    def outputs(self):
        return {"command": self.learned, "pair_seen": self.pair}

    def update(self):
        waiting = self.trip_time < 0.0
        return {
            "learned": self.learned + self.gain * self.error,
            "pair": self.pair + maths.where(self.error > 0.0, 0.5, -0.5) * self.error,
            "was_spoiled": maths.where(waiting, False, maths.logical_or(self.was_spoiled, self.spoiled)),
        }

    def keep(self):
        return maths.logical_not(self.was_spoiled)


class Dice(Component):
    """Noise: one normal, two uniform streams."""

    deviation = Parameter("1", 1.0, minimum=0.0, description="standard deviation")
    hold = Parameter("s", 0.1, description="how long a number is held")
    slow_hold = Parameter("s", 0.4, description="how long the uniform ones are held")
    u = Input("1", 0.0, description="what the noise is added to")
    normal = Noise(hold, description="standard normal")
    pair = Noise(slow_hold, "uniform", shape=(2,), description="on [0, 1)")
    noisy = Output("1", description="input plus noise")
    alone = Output("1", description="the noise")
    pair_seen = Output("1", shape=(2,), description="the uniform pair")

    def outputs(self):
        return {
            "noisy": self.u + self.deviation * self.normal,
            "alone": self.deviation * self.normal,
            "pair_seen": self.pair,
        }


def read_profile(raw):
    """[[position, height], ...] with rising positions, as two tuples."""
    positions, heights = zip(*[(float(x), float(y)) for x, y in raw], strict=True)
    if any(b <= a for a, b in itertools.pairwise(positions)):
        raise ValueError("positions must rise")
    return positions, heights


class Slope(Component):
    """Data: a profile baked in when the FMU is built; so is the unit of what it gives."""

    profile = Data([[0.0, 0.0], [100.0, 1.0]], convert=read_profile, description="[[position m, height], ...]")
    height_unit = Data("m", description="unit of the height")
    position = Input("m", 0.0, description="where")
    height = Output(height_unit, description="height there, constant outside the profile")

    def outputs(self):
        positions, heights = self.profile
        return {"height": maths.piecewise_linear(self.position, positions, heights)}


class Shuttle(Component):
    """State re-initialised in `update`: a cart at constant speed, put back to its start when a new trip begins."""

    home = Parameter("m", 3.0, description="where every trip starts")
    speed = Parameter("m/s", 2.0, description="constant speed")
    trip = Input("1", 1, type=int, description="number of the trip")
    position = State("m", 0.0, output=True, description="position")
    last_trip = Memory("1", 1, type=int, description="the trip under way")
    seen = Output("m", description="position, without feed-through")

    def derivatives(self):
        return {"position": self.speed}

    def outputs(self):
        return {"seen": self.position}

    def update(self):
        departs = maths.logical_or(self.trip > self.last_trip, self.trip < self.last_trip)
        return {"last_trip": self.trip, "position": maths.where(departs, self.home, self.position)}


class Estimator(Component):
    """`initial`: the first estimate is the first measurement; also a sampled block with a continuous state."""

    bias = Parameter("m", 0.25, description="known bias of the measurement")
    rate = Parameter("1/s", 2.0, description="of convergence")
    measured = Input("m", 0.0, description="measured position")
    estimate = State("m", 0.0, output=True, description="estimated position")
    innovation = Memory("m", 0.0, description="held over the sample")
    error = Output("m", description="measurement without bias, minus estimate")

    def initial(self):
        return {"estimate": self.measured - self.bias, "innovation": 0.0}

    def derivatives(self):
        return {"estimate": self.rate * self.innovation}

    def outputs(self):
        return {"error": self._innovation()}

    def update(self):
        return {"innovation": self._innovation()}

    def _innovation(self):
        return self.measured - self.bias - self.estimate


class Everything(Component):
    """One of each kind at once: for saved states, resets and comparisons of packagings."""

    axes = Size(2, description="length of the arrays")
    table = Data([0.5, 0.25], description="weights of the first two axes")

    sample_time = Parameter("s", 0.1, minimum=0.0, description="sample period")
    hold = Parameter("s", 0.1, description="how long a random number is held")
    mode = Parameter("1", "normal", description="a text that goes through")
    u = Input("1", 0.0, shape=(axes,), description="drives the state")
    trip = Input("1", 1, type=int, description="number of the trip")
    trip_time = Input("s", 0.0, description="time since departure")
    x = State("1", 1.0, shape=(axes,), output=True, description="decays towards memory and noise")
    m = Memory("1", 0.0, shape=(axes,), description="filtered state")
    n = Memory("1", 0, type=int, output=True, description="samples so far")
    flag = Memory("1", False, output=True, description="whether n is odd")
    tape = Tape("1", 0.0, shape=(axes,), description="sum over trips of the state")
    noise = Noise(hold, shape=(axes,), description="drives the state")
    y = Output("1", shape=(axes,), description="with feed-through")
    z = Output("1", description="without")
    echo = Output("1", str, description="the text")

    def derivatives(self):
        return {"x": -0.5 * self.x + 0.1 * self.m + 0.2 * self.noise + self.u}

    def outputs(self):
        weight = self.table[0] * self.x[0] + self.table[1] * self.x[-1]
        return {"y": self.x + self.u + self.tape, "z": maths.tanh(weight), "echo": self.mode}

    def update(self):
        return {
            "m": 0.9 * self.m + 0.1 * self.x + 0.01 * self.step,
            "n": self.n + 1,
            "flag": maths.logical_not(self.flag),
            "tape": self.tape + self.x,
        }
