"""Choices that model exchange keeps between events: which are modes, and which have an event indicator."""

import pytest
from railcosim.components import Component, Input, Lookup, Memory, Output, Parameter, State, maths
from railcosim.components.declarations import Data
from railcosim.fmus.native.relations import exchange
from railcosim.fmus.native.tables import held_outputs
from railcosim.fmus.native.trace import trace


class Law(Component):
    """The tests replace its outputs."""

    table = Data(
        {"breakpoints": [[-1, 0, 2], [0, 1, 3]], "values": [[1, 2, 2], [0, -1, 3], [4, 9, 5]]}, convert=Lookup.read
    )
    flat = Data({"breakpoints": [[0, 1]], "values": [3, 4]}, convert=Lookup.read)
    gain = Parameter("1", 2.0)
    u = Input("1", 1.0)
    w = Input("1", 1.0)
    n = Input("1", 1, type=int)
    x = State("1", 0.0)
    v = State("m/s", 0.0, standstill=True)
    y = Output("1")

    def derivatives(self):
        return {"x": self.u - self.x, "v": maths.where(self.v > 0.0, self.u, maths.where(self.v < 0.0, self.w, 0.0))}

    def outputs(self):
        return {"y": self.gain * self.x}


class Sampled(Law):
    """A sampled block."""

    m = Memory("1", 0.0)

    def update(self):
        return {"m": self.u}


def exchanged(outputs, base=Law):
    component = type("Changed", (base,), {"__doc__": "Changed.", "outputs": outputs})()
    added = exchange(component, "Changed", trace(component, "Changed"), held_outputs(component))
    return added, component


def modes(expression, base=Law):
    """Of an output the modes, without the two of a standstill's own."""
    added, component = exchanged(lambda s: {"y": maths.where(True, expression(s), 0.0)}, base)
    own = [mode for mode in added.modes if mode.kind == "LESS" and not mode.indicated]
    assert len(own) == 2
    assert added.indicators(component) == 1 + sum(mode.indicated for mode in added.modes)
    return [mode.kind for mode in added.modes if mode not in own]


@pytest.mark.parametrize(
    ("expression", "found"),
    [
        (lambda s: maths.where(s.x < s.gain, 1.0, 0.0), ["LESS"]),
        (lambda s: maths.where(s.u >= s.x, 1.0, 0.0), ["NOT_ABOVE"]),
        (lambda s: maths.where(s.x < s.gain, 1.0, 0.0) + maths.where(s.x < s.gain, s.u, s.w), ["LESS"]),
        (lambda s: maths.where(s.gain < 1.0, 1.0, 0.0), []),
        (lambda s: maths.where(s.n < 2, s.u, 0.0), []),
        (lambda s: maths.where(s.u == s.w, 1.0, 0.0), []),
        (lambda s: maths.where(s.time < s.gain, 1.0, 0.0), ["BEFORE"]),
        (lambda s: maths.where(s.gain <= s.time, 1.0, 0.0), ["AFTER"]),
        (lambda s: maths.where(s.gain + s.time > 1.0, 1.0, 0.0), ["AFTER"]),
        (lambda s: maths.where(s.time - s.gain > s.n, 1.0, 0.0), ["AFTER"]),
        (lambda s: maths.where(s.gain - s.time > 1.0, 1.0, 0.0), ["LESS"]),
        (lambda s: maths.where(s.time + s.u > 1.0, 1.0, 0.0), ["LESS"]),
        (lambda s: maths.where(s.u + s.gain > 1.0, 1.0, 0.0), ["LESS"]),
        (lambda s: maths.where(s.gain + s.u > 1.0, 1.0, 0.0), ["LESS"]),
        (lambda s: maths.where(s.time < s.x, 1.0, 0.0), ["LESS"]),
        (lambda s: maths.floor(s.x), ["PIECE"]),
        (lambda s: maths.floor(s.time), ["TIME_PIECE"]),
        (lambda s: maths.floor(s.gain), []),
        (lambda s: s.table(s.x, s.u), ["PIECE", "PIECE"]),
        (lambda s: s.table(s.gain, s.time), ["TIME_PIECE"]),
        (lambda s: s.table(s.gain, 0.5), []),
        (lambda s: s.flat(s.x), []),
        (lambda s: maths.minimum(s.u, s.x) + maths.clip(s.w, -1.0, 1.0) + abs(s.x), []),
        (lambda s: maths.where(s.x < s.u, s.w, s.u), ["LESS"]),
        (lambda s: maths.where(s.x < s.u, s.x, s.u) + maths.where(s.x < s.u, s.x, 0.0), ["LESS"]),
        (lambda s: maths.where(maths.where(s.x > 1.0, s.u, 0.0) > 0.5, 1.0, 0.0), ["LESS", "LESS"]),
    ],
)
def test_what_moves_in_continuous_time_becomes_a_mode(expression, found):
    assert modes(expression) == found


def test_choices_that_are_held_from_sample_to_sample_are_none():
    assert modes(lambda s: maths.where(s.x < s.u, 1.0, 0.0), Sampled) == []
    assert modes(lambda s: maths.where(s.x < s.m, 1.0, 0.0), Sampled) == ["LESS"]


def test_repeated_equations_stand_as_they_are():
    def newton(values, given):
        return [maths.where(values[0] > 1.0, 0.5, 2.0) * given[0]]

    assert modes(lambda s: maths.repeat(newton, 3, [s.x], [s.u])[0]) == []


def test_what_stands_in_the_traced_code_is_not_written_again():
    added, component = exchanged(lambda s: {"y": s.table(s.x, s.u)})
    both = trace(component, "Changed").code + added.code
    lines = [line for line in both.splitlines() if line.startswith("static const double")]
    assert len(lines) == len(set(lines)) > 3


def test_without_choices_there_is_no_code():
    class Plain(Component):
        """Nothing to choose."""

        x = State("1", 1.0)

        def derivatives(self):
            return {"x": -self.x}

    component = Plain()
    added = exchange(component, "Plain", trace(component, "Plain"), held_outputs(component))
    assert (added.code, added.modes, added.indicators(component)) == ("", (), 0)
