"""FMI 3.0 in the compiled loop (fmi3.c): the same bits as in Python for all types, arrays, and steps cut short."""

import shutil
import sys

import numpy as np
import pytest
from railcosim.orchestrator.fmi.binding import MixedChannel
from railcosim.orchestrator.isolation import isolate
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.plans.flattening import parts_of
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="FMUs by hand need gcc"),
]
ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
MANY = pytest.mark.parametrize("anywhere", ["here", pytest.param("isolated", marks=pytest.mark.long)], indirect=True)
"""Of many cases those in processes of their own are in the long tier."""
WIDTHS = ("8", "16", "32", "64")
BEYOND = 2**53 + 1
"""The first whole number that no double is."""


@pytest.fixture
def plain(arrays):
    """The FMU of arrays3.c without the output of texts."""
    return str(
        arrays(
            ('<String name="copies" valueReference="10" causality="output"><Dimension start="2"/></String>', ""),
            ('<Output valueReference="10"/>', ""),
        )
    )


@ALGORITHMS
@pytest.mark.parametrize("delay", [0, 2])
def test_every_type(anywhere, third, odd, algorithm, delay):
    """The limits of all types go from one to the next, and to an FMU of FMI 2.0; two swing around each other."""
    limits = {}
    for bits in map(int, WIDTHS):
        limits[f"i{bits}"], limits[f"ui{bits}"] = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1), (0, 2**bits - 1)
    limits["ui8"] = (5, 200)
    system = System(stop_time=3.0, step=0.25, algorithm=algorithm)
    system.add("low", third, f=0.1, on=True, gear="high", x=4.0, **{name: least for name, (least, _) in limits.items()})
    system.add("high", third, x=-2.0, **{name: most for name, (_, most) in limits.items()})
    for name in ("p", "q"):
        system.add(name, third)
    system.add("odd", odd)
    for one, other in (("low", "p"), ("high", "q")):
        for name in limits:
            system.connect(f"{one}.{name.replace('i', 'o')}", f"{other}.{name}", delay=delay)
        system.connect(f"{one}.g", f"{other}.f", delay=delay)
        system.connect(f"{one}.shown", f"{other}.gear")
        system.connect(f"{one}.off", f"{other}.on")
    system.connect("low.x", "high.u", scale=-0.5, offset=0.25)
    system.connect("high.x", "low.u", delay=delay)
    system.connect("low.o16", "odd.m")
    system.connect("high.uo32", "odd.u", delay=delay)
    result = anywhere(system)
    for name, ends in limits.items():
        shown = name.replace("i", "o")
        assert tuple(result[f"{of}.{shown}"][-1] for of in "pq") == tuple(map(float, ends))
    assert (result["p.g"][-1], result["p.shown"][-1]) == (np.float32(0.1), 5e9)
    assert [result[f"{name}.off"][-1] for name in ("low", "high", "p", "q")] == [0, 1, 1, 0]
    assert (result["odd.n"][-1], result["odd.x"][-1] > 1e9) == (-(2**15) + 1, True)


@MANY
@ALGORITHMS
@pytest.mark.parametrize("number", [BEYOND, -BEYOND, 2**63 - 1, 2**63, 2**64 - 1])
def test_whole_numbers_that_no_double_is(anywhere, third, odd, algorithm, number):
    """To the bit from one to the other, delayed and not; to a Real, a truth value and C's int as Python converts it."""
    system = System(stop_time=2.0, step=0.25, algorithm=algorithm, order=["a", "b", "c", "odd"])
    wide = "i64" if -(2**63) <= number < 2**63 else "ui64"
    shown = wide.replace("i", "o")
    system.add("a", third, **{wide: number})
    system.add("b", third)
    system.add("c", third)
    system.add("odd", odd)
    system.connect(f"a.{shown}", f"b.{wide}")
    system.connect(f"b.{shown}", f"c.{wide}", delay=2)
    if 0 <= number < 2**63:
        system.connect(f"a.{shown}", "b.ui64")
        system.connect("b.uo64", "c.ui64")
    system.connect(f"a.{shown}", "odd.u")
    system.connect(f"a.{shown}", "b.on", threshold=0.5)
    system.connect(f"a.{shown}", "c.i16", scale=1e-16, threshold=0.5)
    system.connect(f"a.{shown}", "b.f", scale=-1.0)
    result = anywhere(system)
    assert result[f"c.{shown}"][-1] == float(number)


@ALGORITHMS
def test_wide_numbers_that_are_small(anywhere, third, algorithm):
    """Where another type holds them they go there, scaled or not."""
    system = System(stop_time=1.0, step=0.25, algorithm=algorithm, order=["a", "b", "c"])
    system.add("a", third, i64=6, ui64=7)
    for name in "bc":
        system.add(name, third)
    for source, target, how in (
        ("o64", "b.ui64", {}), ("uo64", "b.i64", {}), ("o64", "b.i16", {}), ("uo64", "b.ui16", {"delay": 1}),
        ("o64", "c.i64", {"scale": 0.5, "threshold": 0.5}), ("uo64", "c.ui64", {"scale": 2.0, "threshold": 0.5}),
    ):  # fmt: skip
        system.connect(f"a.{source}", target, **how)
    result = anywhere(system)
    shown = ("b.uo64", "b.o64", "b.o16", "b.uo16", "c.o64", "c.uo64")
    assert [result[name][-1] for name in shown] == [6.0, 7.0, 6.0, 7.0, 3.0, 14.0]


def test_the_bits_themselves(third, instantiated, used):
    """What the FMU has, not what is recorded, is the number to its last bit."""
    system = System(stop_time=1.0, step=0.25, order=["a", "b"])
    system.add("a", third, i64=BEYOND, ui64=2**64 - 3)
    system.add("b", third)
    system.connect("a.o64", "b.i64")
    system.connect("a.uo64", "b.ui64")
    system.connect("b.o64", "a.i32", scale=0.0, threshold=0.5, delay=1)
    master = instantiated(system)
    seen = []
    assert master.run(0.0, 0.25, 4, 1, lambda steps, rows: seen.append(len(rows)) or True)
    assert used
    values = dict(zip(master.signals, master.values, strict=True))
    assert (values["b.o64"], values["b.uo64"]) == (BEYOND, 2**64 - 3)
    assert master.slaves["b"].channel("Integer", ["o64"]).get() == [BEYOND]
    for slave in master.slaves.values():
        slave.free()


@MANY
@ALGORITHMS
@pytest.mark.parametrize(
    ("source", "target", "number"),
    [
        ("i16", "i8", 300),
        ("i16", "ui8", -1),
        ("i32", "i16", 2**20),
        ("i32", "ui16", -1),
        ("ui32", "i32", 2**31),
        ("i64", "ui32", -1),
        ("i64", "ui64", -1),
        ("ui64", "i64", 2**63),
    ],
)
def test_a_number_that_the_type_does_not_hold(anywhere, third, algorithm, *, source, target, number):
    """It stops both with the same sentence."""
    system = System(stop_time=2.0, step=0.25, algorithm=algorithm, order=["a", "b"])
    system.add("a", third, **{source: 7})
    system.add("b", third)
    system.connect(f"a.{source.replace('i', 'o')}", f"b.{target}")
    system.events.append(Event(f"a.{source}", "set", 0.5, value=number))
    result = anywhere(system)
    assert result.status == "failed"
    assert f"'{target}' cannot become {number}: its type" in str(result.error)


@pytest.mark.parametrize(("target", "sign"), [("i64", 1.0), ("i64", -1.0), ("ui64", -1.0), ("ui64", 1.0), ("i8", 1.0)])
def test_a_real_that_no_whole_number_holds(anywhere, third, target, sign):
    system = System(stop_time=2.0, step=0.25, order=["a", "b"])
    system.add("a", third, gain=1e30)
    system.add("b", third)
    system.connect("a.y", f"b.{target}", threshold=0.5)
    system.events.append(Event("a.u", "set", 0.75, value=sign))
    result = anywhere(system)
    assert f"'{target}' cannot become" in str(result.error)


def test_feed_through_that_is_refreshed(anywhere, third):
    """y is x + gain * u: of the point itself."""
    system = System(stop_time=2.0, step=0.25, refresh=True)
    system.add("a", third, x=2.0)
    system.add("b", third)
    system.connect("a.x", "b.u", scale=2.0)
    system.connect("a.o32", "b.i32")
    result = anywhere(system)
    assert result["b.y"] == pytest.approx(result["b.x"] + 2.0 * result["a.x"])


def test_bits_that_are_no_number_agree(anywhere, third):
    """-1 in 64 bits is no number as a double, but the same from one round of a circle of feed-through to the next."""
    system = System(stop_time=2.0, step=0.25, refresh=True)
    for name, other in ("ab", "ba"):
        system.add(name, third, gain=0.5)
        system.connect(f"{other}.y", f"{name}.u", scale=0.0, offset=1.0)
    system.add("c", third, i64=-1)
    result = anywhere(system)
    assert result["c.o64"][-1] == -1.0
    assert result["a.y"] == pytest.approx(result["a.x"] + 0.5)


@MANY
@ALGORITHMS
@pytest.mark.parametrize("mode", [3, 6, 7, 8, 9, 11, 12, 13, 23])
def test_steps_that_are_not_over_or_fail(anywhere, third, algorithm, mode):
    """Discarded, returned from early, ended with the simulation, failed, another status, NaN, a failed set and get."""
    system = System(stop_time=6.0, step=0.25, algorithm=algorithm)
    system.add("a", third, mode=mode)
    system.add("b", third)
    system.connect("a.x", "b.u")
    system.connect("b.x", "a.u", scale=-1.0, offset=2.0)
    result = anywhere(system)
    assert result.status == {6: "completed", 7: "completed", 8: "terminated", 11: "completed"}.get(mode, "failed")


def test_rates_and_events(anywhere, third):
    system = System(stop_time=3.0, step=0.25)
    system.add("a", third, x=2.0)
    system.add("b", third)
    system.instances["b"].step = 0.5
    system.connect("a.x", "b.u", scale=2.0)
    system.connect("b.x", "a.u")
    system.connect("a.o32", "b.i32")
    system.events += [
        Event("a.x", "override", 1.0, value=3.0, duration=0.5),
        Event("b.u", "bias", 2.0, value=1.0),
        Event("a.i32", "set", 1.0, value=-4),
    ]
    result = anywhere(system)
    assert result["a.x"][4] == 3.0
    assert result["b.o32"][-1] == -4


@pytest.mark.parametrize("mode", [0, 6, 7, 11])
def test_a_step_of_its_own_that_is_not_over_before_an_event(anywhere, plainly, mode):
    """From t = 5 s on; its outputs are due at 5.5 s only."""
    path = plainly(3, ('valueReference="3" dependencies="1 2"', 'valueReference="3" dependencies="2"'))
    system = System(stop_time=6.0, step=0.25)
    system.add("a", path, mode=mode, x=4.0)
    system.add("b", path)
    system.instances["a"].step = 0.5
    system.connect("b.x", "a.u")
    system.events.append(Event("a.gain", "set", 5.25, value=2.0))
    assert anywhere(system).status == "completed"


def test_arrays(anywhere, plain):
    """Whole arrays are handed over with one reference each; the ends are numbers of all types."""
    arrays_of(plain, anywhere)


def test_arrays_and_threads(both, plain):
    arrays_of(plain, both, threads=2)


def arrays_of(plain, compared, **how):
    system = System(stop_time=1.0, step=0.25, algorithm="jacobi")
    for name in "abc":
        system.add(name, plain, u=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    for one, other in ("ab", "bc"):
        system.connect(f"{one}.y", f"{other}.u", scale=0.5)
        system.connect(f"{one}.m", f"{other}.n")
        system.connect(f"{one}.off", f"{other}.on")
    result = compared(system, **how)
    assert [result[f"c.y[{i},{j}]"][-1] for i in (1, 2) for j in (1, 2, 3)] == [2.0, 4.0, 6.0, 8.0, 10.0, 12.0]


_PAIR = '<UInt64 name="{}" valueReference="{}" causality="{}"{}><Dimension start="2"/></UInt64>'
WIDE = [
    (before, new + before)
    for before, new in (
        ("<String", _PAIR.format("wide", 13, "input", ' start="0 0"') + _PAIR.format("wider", 12, "output", "")),
        ('<Output valueReference="10"/>', '<Output valueReference="12"/>'),
    )
]
"""Lines of the description of arrays3.c with whole numbers of 64 bits."""


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_parts_of_arrays(both, arrays, algorithm):
    """Of every type, and in another order; beside what is connected stands what was given last, also on the way."""
    system = System(stop_time=2.0, step=0.25, algorithm=algorithm)
    model = str(arrays(*WIDE))
    system.add("a", model, u=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], n=[3, 4], words=["some", "thing"])
    system.add("b", model, u=[[0.0, 0.0, 9.0], [0.0, 8.0, 0.0]], n=[0, 6], on=[True, True], words=["else", "not"])
    system.instances["a"].start["wide"], system.instances["b"].start["wide"] = [2**63 + 1, 5], [2**64 - 1, 0]
    system.connect("a.y[1,1]", "b.u[1,2]", delay=1)
    system.connect("a.y[1,2]", "b.u[1,1]", scale=0.5)
    system.connect("b.m[2]", "a.n[1]")
    system.connect("a.off[2]", "b.on[1]")
    system.connect("a.copies[1]", "b.words[2]")
    system.connect("a.wider[1]", "b.wide[2]")
    system.events.append(Event("b.u[2,2]", "set", 1.0, value=7.0))
    system.events.append(Event("b.u[1,1]", "connect", 1.5, source=Connection("a.y[1,3]", "b.u[1,1]", scale=0.5)))
    result = both(system)
    found = [[result[f"b.y[{i},{j}]"][-1] for j in (1, 2, 3)] for i in (1, 2)]
    assert found == [[6.0, 4.0, 18.0], [0.0, 14.0, 0.0]]
    assert result["b.copies[1]"][-1] == "else"
    assert result["b.copies[2]"][-1] == "some"
    assert result["a.m[2]"][-1] == -4
    assert [result[f"b.wider[{k}]"][-1] for k in (1, 2)] == [float(2**64 - 1), float(2**63 + 1)]


def test_all_of_an_array_in_another_order(both, plain):
    system = System(stop_time=1.0, step=0.25)
    system.add("a", plain, n=[3, 4])
    system.add("b", plain)
    system.connect("a.m[1]", "b.n[2]")
    system.connect("a.m[2]", "b.n[1]")
    result = both(system)
    assert (result["b.m[1]"][-1], result["b.m[2]"][-1]) == (4.0, 3.0)


@pytest.mark.parametrize("isolated", [[], ["together"]])
def test_part_of_an_array_after_all_of_it(plain, instantiated, isolated):
    """It was set past the channels of Python: what stands beside the part is asked of the FMU.

    Also where the array is set with numbers of another type, in two calls.
    """
    system = System(stop_time=1.0, step=0.25, order=["a", "b"])
    for name in "ab":
        system.add(name, plain)
    system.connect("a.y", "b.u")
    system.connect("a.m", "b.n")
    system.connect("a.m[2]", "b.w")
    master = instantiated(isolate(system, isolated))
    a, b = master.slaves.values()
    assert master.run(0.0, 0.25, 4, 1, lambda steps, rows: True, until=2)
    a.channel("Real", [f"u[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]).set([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    a.channel("Integer", ["n[1]", "n[2]"]).set([2, 5])
    assert master.run(0.0, 0.25, 4, 1, lambda steps, rows: True, first=2)
    b.channel("Real", ["u[1,1]"]).set([0.5])
    assert b.channel("Real", ["y[1,1]", "y[1,2]"]).get() == [1.0, 8.0]
    b.channel("Integer", ["n[1]"]).set([3])
    assert b.channel("Integer", ["m[1]", "m[2]"]).get() == [-3, 5]
    for slave in master.slaves.values():
        slave.free()


def test_neighbours_whose_like_references_are_of_other_types(anywhere, plainly):
    """In one call after the other."""
    texts = ['name="f" valueReference="10"', 'name="i8" valueReference="20"']
    others = ['name="f" valueReference="20"', 'name="i8" valueReference="10"']
    system = System(stop_time=1.0, step=0.25, algorithm="jacobi", order=["source", "plain", "other"])
    system.add("source", plainly(3), f=0.1, i8=-5)
    system.add("plain", plainly(3, name="plain.fmu"))
    system.add("other", plainly(3, *zip(texts, others, strict=True), name="other.fmu"))
    system.connect("source.g", "plain.f")
    system.connect("source.o8", "other.i8")
    result = anywhere(system)
    assert (result["plain.g"][-1], result["other.o8"][-1]) == (np.float32(0.1), -5.0)


@pytest.mark.parametrize("what", ["event", "threshold", "binary"])
def test_what_is_left_to_python(third, by_hand, used, what):
    """An event that changes a number of 64 bits, one that is compared beyond doubles, Binary."""
    system = System(stop_time=1.0, step=0.25)
    model = {"binary": str(by_hand(3, name="binary.fmu"))}.get(what, third)
    system.add("a", model)
    system.add("b", model)
    if what == "event":
        system.events.append(Event("a.o64", "override", 0.5, value=3))
    elif what == "threshold":
        system.connect("a.o64", "b.on", threshold=2.0**60)
    result = run(system)
    assert result.status == "completed"
    assert not used


def test_types_of_several_widths_one_of_which_is_set_in_part(anywhere, third, used):
    """Numbers of several widths are one kind here, and several calls for the FMU; each alone goes to the kernel."""
    system = System(stop_time=1.0, step=0.25)
    system.add("a", third, i8=5, ui32=9)
    system.add("b", third)
    system.connect("a.o8", "b.ui32")
    system.connect("a.uo32", "b.i8")
    result = anywhere(system)
    assert (result["b.uo32"][-1], result["b.o8"][-1]) == (5.0, 9.0)


def test_calls_of_several_types_are_those_of_all_or_none():
    """A channel that is none of an FMU's in this process is nobody's call."""
    assert parts_of(MixedChannel([(object(), (0, 1))], 2)) is None
