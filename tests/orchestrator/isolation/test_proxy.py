"""One instance in a process of its own: the face of any other."""

import os
import random
import sys
from ctypes import sizeof

import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.fmi.binding import Held, calls_of, heed_parts
from railcosim.orchestrator.isolation import choice as isolated
from railcosim.orchestrator.isolation import launch

pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.usefixtures("in_time", "nothing_left"),
]
VARIABLES = {"Real": (["u", "v"], ["x", "y", "calls"]), "Integer": (["m"], ["n"]), "Boolean": (["on"], ["off"]),
             "String": (["word"], ["said"])}  # fmt: skip
VALUES = {
    "Real": lambda dice: [dice.uniform(-9.0, 9.0), dice.choice([-0.0, 1e-320, 1e308, float("inf")])],
    "Integer": lambda dice: [dice.randrange(-(2**31), 2**31 - 1)],
    "Boolean": lambda dice: [dice.randrange(2)],
    "String": lambda dice: [dice.choice(["", "Zürich", "a b\nc", "x" * 90])],
}


# -------------------------------------------------------------------- the face of an instance


def test_every_type_is_set_stepped_and_read(apart):
    it = apart(begun=True)
    for kind, values in (("Real", [2.0, 0.5]), ("Integer", [41]), ("Boolean", [1]), ("String", ["zürich "])):
        it.channel(kind, VARIABLES[kind][0]).set(values)
    it.step(0.0, 0.25)
    assert it.channel("Real", ["y", "x"]).get() == [1.0, 0.5]
    assert it.time == 0.25
    assert it.channel("Integer", ["n"]).get() == [42]
    assert it.channel("String", ["said"]).get() == ["zürich zürich "]
    truths = it.channel("Boolean", ["off"]).get()
    assert truths == [0]
    assert type(truths[0]) is int
    assert it.channel("Real", ["pid"]).get() == [it.pid]
    assert it.pid != os.getpid()
    it.terminate()


def test_it_is_fresh_after_a_set_a_step_and_a_restored_state(apart):
    it = apart(begun=True)
    u, y = it.channel("Real", ["u", "v"]), it.channel("Real", ["y"])
    found, state = [], None
    for k in range(4):
        u.set([1.0, 10.0 * k])
        found += y.get()
        state = state or it.save()
        it.step(0.5 * k, 0.5)
        found += y.get()
    it.restore(state)
    assert it.time == 0.0
    assert found + y.get() == [0.0, 0.5, 10.5, 11.0, 21.0, 21.5, 31.5, 32.0, 0.0]


class Pair:
    """The same instance twice, here and in a process of its own, to be asked the same."""

    def __init__(self, here, there, seed):
        self.both, self.dice, self.states, self.now = (here, there), random.Random(seed), [], 0.0
        self.inputs = {kind: self.channels(kind, names) for kind, (names, _) in VARIABLES.items()}
        self.outputs = [self.channels(kind, names) for kind, (_, names) in VARIABLES.items()]
        self.part = self.channels("Real", ["v"])

    def channels(self, kind, names):
        return [one.channel(kind, names) for one in self.both]

    def same(self, ask):
        here, there = map(ask, self.both)
        assert repr(there) == repr(here)

    def set(self):
        kind = self.dice.choice(list(VARIABLES))
        values = VALUES[kind](self.dice)
        for one in self.inputs[kind]:
            one.set(values)

    def set_a_part(self):
        for one in self.part:
            one.set([self.now])

    def get(self):
        here, there = (one.get() for one in self.dice.choice([*self.outputs, *self.inputs.values()]))
        assert repr(there) == repr(here)

    def step(self):
        final = bool(self.dice.randrange(2))
        for one in self.both:
            one.step(self.now, 0.125, final=final)
        self.now += 0.125

    def save(self):
        self.states.append([one.save() for one in self.both])

    def restore(self):
        if self.states:
            for one, state in zip(self.both, self.dice.choice(self.states), strict=True):
                one.restore(state)
            self.now = self.both[0].time

    def serialize(self):
        if self.states:
            chosen = zip(self.both, self.dice.choice(self.states), strict=True)
            self.states.append([one.deserialize(one.serialize(state)) for one, state in chosen])

    def forget(self):
        if self.states:
            for one, state in zip(self.both, self.states.pop(), strict=True):
                one.forget(state)

    def interpolate(self):
        for one in self.both:
            one.interpolate(["u"], [1], [0.25])

    def derive(self):
        self.same(lambda one: one.directional_derivatives(["x", "y"], ["v"], [2.0]))

    def live(self, count):
        acts = [self.set, self.set_a_part, self.get, self.get, self.step, self.step, self.save, self.restore]
        acts += [self.serialize, self.forget, self.interpolate, self.derive]
        for _ in range(count):
            self.dice.choice(acts)()
            if self.dice.randrange(2):  # waits for a step that is under way
                self.same(lambda one: [*one.channel("Real", ["x"]).get(), one.time])


@pytest.mark.sample(4)
@pytest.mark.parametrize("seed", range(6))
def test_whatever_it_is_asked_its_answers_are_those_without_isolation(
    apart, alone, hostile, begin, monkeypatch, *, seed
):
    """Also where there is no room, or not enough, in the shared memory."""
    room = (None, 0, 3)[seed % 3]
    if room is not None:
        monkeypatch.setattr(isolated, "_CELLS_PER_VARIABLE", 0)
        monkeypatch.setattr(isolated, "_SPARE_CELLS", room)
    Pair(begin(alone(hostile())), apart(begun=True), seed).live(500)


def test_a_state_written_here_is_read_in_another_process(apart):
    first, second = apart(begun=True), apart(name="other", begun=True)
    first.channel("Real", ["u"]).set([4.0])
    first.step(0.0, 1.0)
    second.restore(second.deserialize(first.serialize(first.save())))
    assert second.time == 1.0
    assert second.channel("Real", ["x", "pid"]).get() == [4.0, first.pid]


def test_thousands_of_values(apart, workspace, hostile, monkeypatch):
    """More than a frame, and than what a socket holds."""
    it = apart(begun=True)
    names = ["u", "v"] * 40_000
    wide, values = it.channel("Real", names), [float(k) for k in range(80_000)]
    wide.set(values)
    assert wide.get() == [79_998.0, 79_999.0] * 40_000
    words = it.channel("String", ["word"] * 5_000)
    words.set(["w" * 100] * 5_000)
    assert words.get() == ["w" * 100] * 5_000


@pytest.mark.parametrize("version", [1, 3])
def test_other_versions_of_fmi(apart, alone, by_hand, version, begin):
    path = by_hand(version)
    pair = [begin(alone(path)), apart(path=path, begun=True)]
    for k in range(5):
        for one in pair:
            one.channel("Real", ["u"]).set([1.0 + k])
            one.step(0.25 * k, 0.25)
        here, there = (one.channel("Real", ["x", "y"]).get() for one in pair)
        assert there == here


def test_whole_numbers_that_need_64_bits_without_sign(apart, by_hand, begin):
    it = apart(path=by_hand(3))
    names = [v.name for v in it.interface.variables.values() if v.fmi_type == "UInt64" and v.causality == "input"]
    begin(it)
    channel = it.channel("Integer", names)
    channel.set([2**64 - 1] * len(names))
    assert channel.get() == [2**64 - 1] * len(names)


KINDS = {"y u x": "Real", "m n": "Integer", "on off": "Boolean", "minus_x": "Real", "u[1,2] y[1,1]": "Real"}
NUMBERS = "f i8 ui8 i16 ui16 i32 ui32 i64 ui64 gear o8 mode"


@pytest.mark.parametrize("version", ["1", "2", "3", "arrays"])
def test_the_master_knows_which_calls_stand_behind_a_channel(apart, alone, request, version):
    """As an FMU that is loaded has them, by type, but for arrays in part or in another order."""
    path = {"2": "odd", "arrays": "arrays"}.get(version, "by_hand")
    make = request.getfixturevalue(path)
    path = make if version == "2" else make() if version == "arrays" else make(int(version))
    here, there = alone(path), apart(path=path)
    known = here.interface.variables
    wanted = KINDS | {NUMBERS: "Integer", "n[1] n[2] w m[2] m[1]": "Integer", "m[1] m[2] w n[1] n[2]": "Integer"}
    checked = set()
    for text, kind in wanted.items():
        names = [name for name in text.split() if name in known]
        if not names or (version == "1" and text == NUMBERS):
            continue
        calls, parts = calls_of(here.channel(kind, names)), there.channel(kind, names).parts
        checked.add(text)
        if any(list(places) != sorted(k for k in places if not isinstance(k, Held)) for _, places in calls or ()):
            calls = None
        assert (calls is None) == (parts is None) == (text in ("minus_x", "u[1,2] y[1,1]", "n[1] n[2] w m[2] m[1]"))
        for (call, places), (part, own_places) in zip(calls or (), parts or (), strict=True):
            assert (call.kind, call.calls, list(places)) == (part.kind, part.calls, list(own_places))
            assert list(call.references) == part.references
            assert part.place[1:] == (len(call.names), sizeof(here.TYPES[call.kind][1]))
    assert len(checked) >= 3
    assert there.channel("String", ["word"] if version in "13" else []).parts is None


def test_who_makes_several_calls_for_a_channel_tells_which(alone, by_hand, begin):
    third, heard = begin(alone(by_hand(3))), []
    several, single = third.channel("Integer", ["i8", "ui32"]), third.channel("Integer", ["i8"])
    for channel in (several, single):
        heed_parts(channel, heard.append)
    several.set([1, 2])
    single.set([3])
    assert several.get() == [3, 2]
    assert heard == [0, 1, 0, 1]


def test_python_fmus(apart, components, workspace):
    from railcosim.fmus.build import build

    body = "class Sum(Base):\n    '''A sum.'''\n    u = Input('m', 0.0)\n    y = Output('m')\n    x = State('m', 0.0, "
    body += "output=True)\n    def derivatives(self):\n        return {'x': self.u}\n    def outputs(self):\n        "
    body += "return {'y': maths.sqrt(self.u) + 1.0}\n"
    it = apart(path=build(components(body)("Sum"), {}, kind="python"), begun=True)
    u, y = it.channel("Real", ["u"]), it.channel("Real", ["y", "x"])
    u.set([4.0])
    it.step(0.0, 0.5)
    assert y.get() == [3.0, 2.0]
    u.set([-1.0])
    with pytest.raises(FmuError, match="math domain error"):
        y.get()


def test_unknown_variables(apart):
    with pytest.raises(KeyError):
        apart().channel("Real", ["nobody"])


def test_a_pipe_that_is_not_inherited(apart, monkeypatch):
    """As on Windows, where the process connects to a port and shows a password."""
    monkeypatch.setattr(launch, "INHERITS", False)
    it = apart(begun=True)
    it.channel("Real", ["u"]).set([1.0])
    it.step(0.0, 1.0)
    assert it.channel("Real", ["x"]).get() == [1.0]
