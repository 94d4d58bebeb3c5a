"""Components for tests of native FMUs: every declaration at once (no computed text), and every function of maths."""

import numpy as np
from railcosim.components import (
    Component,
    Data,
    Input,
    Lookup,
    Memory,
    Network,
    Noise,
    Output,
    Parameter,
    Size,
    State,
    Tape,
    maths,
)
from railcosim.components.lookup.network import ACTIVATIONS


class Mixed(Component):
    """One of each kind at once: held and fresh outputs, computed starts, re-initialised states, tape and noise."""

    axes = Size(2, minimum=2, description="length of the arrays")

    sample_time = Parameter("s", 0.25, minimum=0.0, description="sample period")
    hold = Parameter("s", 0.5, minimum=1e-3, description="how long a random number is held")
    gain = Parameter("1", 0.5, tunable=True, minimum=0.0, maximum=2.0, description="share that is learned")
    teeth = Parameter("1", 3, type=int, minimum=1, maximum=9, description="added at each sample")
    reverse = Parameter("1", False, description="whether the first state counts backwards")
    label = Parameter("1", "a label", description="a text that nothing reads")
    u = Input("1", 0.25, shape=(axes,), description="drives the state")
    count = Input("1", 1, type=int, description="an integer")
    door = Input("1", False, description="a boolean")
    remark = Input("1", "none", description="a text that nothing reads")
    trip = Input("1", 1, type=int, description="number of the trip")
    trip_time = Input("s", -1.0, description="time since departure")
    x = State("m", 1.0, shape=(axes,), output=True, description="decays towards memory and noise")
    v = State("m/s", 0.0, description="its start is computed")
    m = Memory("m", 0.0, shape=(axes,), description="filtered state")
    n = Memory("1", 0, type=int, output=True, description="grows by teeth at each sample")
    odd = Memory("1", False, output=True, description="whether the number of samples is odd")
    last_trip = Memory("1", 1, type=int, description="the trip under way")
    learned = Tape("1", 0.5, shape=(axes,), description="what the trip before recorded")
    noise = Noise(hold, shape=(axes,), description="drives the state")
    coin = Noise(hold, "uniform", description="on [0, 1)")
    y = Output("m", shape=(axes,), description="with feed-through: held")
    z = Output("1", description="without: fresh")
    tossed = Output("1", bool, description="whether the coin fell above a half")
    total = Output("1", int, description="integers added: held")

    def _sign(self):
        return maths.where(self.reverse, -1.0, 1.0)

    def initial(self):
        return {"v": self._sign() * self.u[0] * self.u[0], "m": 2.0 * self.u}

    def derivatives(self):
        return {"x": -0.5 * self.x + 0.1 * self.m + 0.2 * self.noise + self.u, "v": -self.v + self.x[0]}

    def outputs(self):
        return {
            "y": self.x + self.u + self.learned,
            "z": maths.tanh(self.x[0] + self.v),
            "tossed": self.coin > 0.5,
            "total": self.n + self.count,
        }

    def update(self):
        departs = maths.logical_or(self.trip > self.last_trip, self.trip < self.last_trip)
        return {
            "m": 0.9 * self.m + 0.1 * self.x + 0.01 * self.step,
            "n": self.n + self.teeth,
            "odd": maths.logical_not(self.odd),
            "last_trip": self.trip,
            "learned": self.learned + self.gain * self.x,
            "v": maths.where(departs, self._sign(), self.v),
        }

    def keep(self):
        return maths.logical_not(self.door)


class Functions(Component):
    """Every function and operator that equations may use, on scalars and arrays."""

    a = Parameter("1", 1.5, tunable=True, minimum=0.1, maximum=5.0, description="positive")
    whole = Parameter("1", 3, type=int, minimum=-5, maximum=5, description="an integer in real arithmetic")
    table = Parameter("1", [0.0, 1.0, 4.0], shape=(3,), description="values of the table")
    u = Input("1", 0.3, minimum=-20.0, maximum=20.0, description="any number")
    w = Input("1", [0.5, -0.25, 2.0], shape=(3,), minimum=-3.0, maximum=3.0, description="an array")
    flag = Input("1", False, description="a condition")
    s = State("1", 0.5, description="a state")
    scalars = Output("1", shape=(24,), description="of scalars")
    arrays = Output("1", shape=(12,), description="of arrays")
    flags = Output("1", bool, shape=(6,), description="conditions")
    integer = Output("1", int, description="an integer")

    def derivatives(self):
        return {"s": maths.sin(self.u) - self.s**2}

    def _newton(self, values, given):
        """Towards the square root of the first of two; how often the other was exceeded."""
        root, count = values
        return [0.5 * (root + given[0] / root), count + maths.where(root > given[1], 1.0, 0.0)]

    def outputs(self):
        a, u, w = self.a, self.u, self.w
        positive = maths.absolute(u) + a
        return {
            "scalars": [
                maths.sqrt(positive),
                maths.exp(-positive),
                maths.log(positive),
                maths.sin(u),
                maths.cos(u),
                maths.tan(0.05 * u),
                maths.tanh(u),
                maths.floor(u),
                abs(-u),
                u**2,
                u**3,
                a**u,
                a**0.5,
                2.0**u,
                (u / a - 1) / (-a),
                maths.minimum(u, a),
                maths.maximum(u, a),
                maths.clip(u, -1.0, a),
                maths.sign(u),
                maths.piecewise_constant(u, [0.0, 1.0], self.table[:2]),
                maths.piecewise_linear(u, [-1.0, 0.0, 2.0], self.table),
                self.whole / 2 + self.whole * u - self.whole,
                *maths.repeat(self._newton, 4, [positive, 0.0], [positive, u]),
            ],
            "arrays": [
                *(w * a - u / (w * w + 1.0)),
                *maths.tanh(w),
                *maths.where(w > 0.0, w, u),
                *maths.clip(w, -1, a),
            ],
            "flags": [
                u < a,
                u <= a,
                u > a,
                u == 0.0,
                maths.logical_and(self.flag, u != a),
                maths.logical_not(self.flag),
            ],
            "integer": maths.where(self.flag, self.whole, 2 * self.whole),
        }


_RANDOM = np.random.default_rng(5)
_LAYERS = [
    {"weights": _RANDOM.normal(size=(4, 2)).tolist(), "bias": _RANDOM.normal(size=4).tolist(), "activation": "tanh"},
    {"weights": _RANDOM.normal(size=(len(ACTIVATIONS), 4)).tolist()},
]


class Tables(Component):
    """Look-up tables and a network, alone and inside choices, with every activation."""

    line = Data({"breakpoints": [-1, 0, 2], "values": [1, 3, -2]}, convert=Lookup.read, description="straight")
    curve = Data(
        {"breakpoints": [-1, 0, 2, 3], "values": [1, 3, 3.5, 0], "method": "cubic"},
        convert=Lookup.read,
        description="smooth",
    )
    surface = Data(
        {"breakpoints": [[-1, 0, 2], [0, 1]], "values": [[1, 2], [0, -1], [4, 9]], "method": "cubic"},
        convert=Lookup.read,
        description="over two variables",
    )
    network = Data({"layers": _LAYERS}, convert=Network.read, description="dense layers")

    u = Input("1", 0.3, minimum=-3.0, maximum=4.0, description="any number")
    w = Input("1", [0.5, -0.25], shape=(2,), minimum=-3.0, maximum=3.0, description="an array")
    tables = Output("1", shape=(10,), description="what is looked up")
    activations = Output("1", shape=(len(ACTIVATIONS),), description="of what the network gives")

    def outputs(self):
        rows = self.network(self.w)
        return {
            "tables": [
                self.line(self.u),
                self.curve(self.u),
                self.surface(self.u, self.w[0]),
                self.surface(0.5, self.w[1]),
                maths.where(self.u > 0.0, self.curve(self.w[0]) * self.u, self.line(self.w[1])),
                maths.piecewise_constant(self.u, [0.0, 1.0, 1.5], [-0.5, 2.0, 1.0]),
                *maths.piecewise_linear(self.w, [-1.0, 0.5, 2.0], [3.0, 1.0, 1.5]),
                maths.piecewise_linear(self.u, [0.0, 1.0, 1.0, 1.5, 1.5], [0.0, 0.0, 5.0, 7.0, 6.0]),
                maths.piecewise_constant(self.u, [1.0, 0.0], [2.0, 4.0]),
            ],
            "activations": [ACTIVATIONS[name](row) for name, row in zip(ACTIVATIONS, rows, strict=True)],
        }
