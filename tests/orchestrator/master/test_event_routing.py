"""Inputs that follow other outputs from a time on: what passes when, with answers known by hand."""

import json

import numpy as np
import pytest
from railcosim.orchestrator import Batch
from railcosim.orchestrator.linearization.closed_loop import linearize
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import execute, resume, run
from railcosim.orchestrator.system import Connection, Event, System

ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture(params=["plain", "compiled"])
def go(request, monkeypatch):
    """Run a system: as Python objects, or as FMUs in the compiled loop, which then must have been used."""
    if request.param == "compiled" and compiled.kernel is None:
        pytest.skip("installed without the compiled step loop")
    blocks, loop = [], compiled.CompiledLoop.run
    monkeypatch.setattr(compiled.CompiledLoop, "run", lambda *args, **how: blocks.append(1) or loop(*args, **how))

    def attempt(system, **how):
        result = run(system, kind="plain" if request.param == "plain" else "python", **how)
        assert (request.param == "compiled") == bool(blocks)
        return result

    return attempt


@pytest.fixture
def switched(mine):
    """10, 11, 12, ... and -100, -99, ..., of which `end` sees the first, and by events the second."""

    def make(*events, **how):
        system = System(**{"stop_time": 5.0, "step": 1.0} | how, events=list(events))
        system.add("end", mine("Keep"))
        system.add("one", mine("Count"))
        system.add("two", mine("Count"), n=-100.0)
        system.connect("one.n", "end.u")
        return system

    return make


def connect(at, source="two.n", signal="end.u", *, delay=0, scale=None, **how):
    return Event(signal, "connect", at, source=Connection(source, signal, delay, scale), **how)


CASES = {
    "for ever": (connect(2.0), [10, 11, -98, -97, -96]),
    "for a while": (connect(2.0, duration=2.0), [10, 11, -98, -97, 14]),
    "between points": (connect(1.5, duration=2.0), [10, 11, -98, -97, 14]),
    "again and again": (connect(1.0, duration=1.0, every=2.0), [10, -99, 12, -97, 14]),
    "from before the start": (connect(-1.0, fade=9.0), [-100, -99, -98, -97, -96]),
    "from the start": (connect(0.0, duration=1.0), [-100, 11, 12, 13, 14]),
    "what was two points ago": (connect(2.0, delay=2), [10, 11, -100, -99, -98]),
    "twice as much": (connect(2.0, scale=2.0), [10, 11, -196, -194, -192]),
    # The difference is 110, of which a half is left after 1 s.
    "with a fade": (connect(2.0, fade=2.0), [10, 11, 12, -97 + 55, -96]),
    # Nothing is connected anew while that fades: when it ends, the difference of then fades as well.
    "with a fade there and back": (connect(1.0, fade=4.0, duration=2.0), [10, 11, -98 + 82.5, -97 + 55, 14 - 41.25]),
}


@pytest.mark.sample(14)
@ALGORITHMS
@pytest.mark.parametrize("name", CASES)
def test_an_input_follows_another_output(go, switched, algorithm, name):
    event, seen = CASES[name]
    result = go(switched(event, algorithm=algorithm))
    assert list(result["end.seen"]) == [-1, *seen]
    assert list(result["one.n"]) == [10, 11, 12, 13, 14, 15]


def test_of_several_the_last_that_began_counts_and_then_the_one_before(go, switched, mine):
    system = switched(connect(1.0), connect(2.0, "three.n", duration=2.0))
    system.add("three", mine("Count"), n=1000.0)
    assert list(go(system)["end.seen"]) == [-1, 10, -99, 1002, 1003, -96]


def test_a_fault_that_begins_later_hides_a_fade(go, switched):
    """And a fade that begins anew has in it what was left of the one before."""
    events = [connect(1.0, fade=4.0), Event("end.u", "override", 2.0, 7.0, duration=1.0)]
    assert list(go(switched(*events))["end.seen"]) == [-1, 10, 11, 7, -97 + 55, -96 + 27.5]
    twice = [connect(1.0, fade=4.0), connect(3.0, "one.n", fade=2.0)]
    assert list(go(switched(*twice))["end.seen"]) == [-1, 10, 11, -98 + 82.5, -97 + 55, 14 + (-42 - 13) / 2]


def test_what_happened_is_told_with_what_the_input_follows_then(switched):
    outcome = execute(switched(connect(2.0, fade=1.0, duration=2.0)), kind="plain")
    told = [(one["time"], one["action"], one["phase"], one["value"]) for one in outcome.coupling["events"]]
    assert told == [(2.0, "connect", "begin", "two.n"), (4.0, "connect", "end", "one.n")]
    assert json.dumps(outcome.coupling)


@pytest.mark.parametrize("fade", [None, 2.5])
def test_a_run_that_goes_on_from_a_checkpoint_is_the_same(switched, tmp_path, fade):
    """The checkpoint is of 3 s, in the middle of it."""
    system = switched(connect(2.0, fade=fade, duration=2.0), connect(4.5, delay=3))
    whole = run(system, kind="plain", output=tmp_path / "run", checkpoint_every=3.0)
    again = resume(tmp_path / "run")
    assert list(again.results["end.seen"]) == list(whole["end.seen"])


def test_each_run_of_a_batch_begins_with_the_first_connections(switched):
    system = switched(connect(2.0, fade=1.0)).changed(metrics={"end": "final(end.seen)"})
    with Batch(system, kind="plain", record=["end.seen"]) as batch:
        rows = [batch.run({"events[1].at": at}) for at in (2.0, 4.0, 2.0)]
    assert [list(row.series["end.seen"]) for row in rows] == [
        [-1, 10, 11, 12, -97, -96],
        [-1, 10, 11, 12, 13, 14],
        [-1, 10, 11, 12, -97, -96],
    ]


def test_whole_numbers_truths_and_texts_are_led_elsewhere(mine):
    def event(name, other):
        return connect(2.0, f"b.{other}", f"a.{name}")

    events = [event("n", "m"), event("on", "off"), event("word", "said")]
    system = System(stop_time=3.0, step=1.0, events=events)
    for name, start in (("a", {}), ("b", {"n": 40, "on": True, "word": "x"})):
        system.add(name, mine("EveryType"), **start)
    for other, name in (("m", "n"), ("off", "on"), ("said", "word")):
        system.connect(f"a.{other}", f"a.{name}")
    result = run(system, kind="plain")
    assert [result[f"a.{name}"][-1] for name in ("m", "off", "said")] == [42, 1, "xbb"]


def test_an_array_is_led_elsewhere_as_a_whole_and_by_element(go, mine):
    system = System(stop_time=3.0, step=1.0)
    for name, start in (("a", 0.0), ("b", 100.0), ("c", 50.0)):
        system.add(name, mine("Row"), x=[start + 0.25, start + 0.5, start + 0.75])
    system.connect("a.x", "c.u")
    system.events += [connect(1.0, "b.x", "c.u"), connect(2.0, "c.x[1]", "c.u[3]")]
    result = go(system)
    rows = [[result[f"c.seen[{k}]"][n] for k in (1, 2, 3)] for n in (1, 2, 3)]
    assert rows == [[0.25, 0.5, 0.75], [101.25, 101.5, 101.75], [102.25, 102.5, 52.25]]


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi", "iterative", "adaptive"])
def test_every_algorithm_takes_what_follows_from_then_on(mine, algorithm):
    """x' = 1 up to 1 s, then -2: adaptive lands there, the others have a point there."""
    system = System(stop_time=2.0, step=0.5, algorithm=algorithm, events=[connect(1.0, "two.y", "end.u")])
    system.add("end", mine("Integral"))
    system.add("one", mine("Course"), a=1.0)
    system.add("two", mine("Course"), a=-2.0)
    system.connect("one.y", "end.u")
    assert run(system, kind="plain")["end.x"][-1] == pytest.approx(-1.0, abs=1e-9)


def test_a_loop_that_an_event_closes_is_told_and_solved(mine, workspace):
    """y = 1 + u / 2 and z = u / 2: apart, z = 1.5; once u = z, y = 1 + y / 4."""
    system = System(stop_time=3.0, step=1.0, algebraic_loops="solve", events=[connect(2.0, "b.y", "a.u")])
    system.add("a", mine("Pass"), gain=0.5, bias=1.0)
    system.add("b", mine("Pass"), gain=0.5)
    system.add("source", mine("Course"), a=4.0)
    system.connect("source.y", "a.u")
    system.connect("a.y", "b.u")
    outcome = execute(system, kind="plain")
    assert outcome["a.y"] == pytest.approx([3.0, 3.0, 4 / 3, 4 / 3])
    assert outcome["b.y"] == pytest.approx([1.5, 1.5, 2 / 3, 2 / 3])
    loop = "algebraic loop through b.y, a.y: it is solved at each communication point"
    assert f"from 2 s on: {loop}" in check(system, workspace, "plain").notes


def test_a_loop_is_linearized_as_it_is_connected_then(mine):
    """x' = u, with u = 0 before and -3 x from 1 s on."""
    system = System(stop_time=3.0, step=0.1, events=[connect(1.0, "feedback.y", "x.u")])
    system.add("x", mine("Integral"), x=1.0)
    system.add("feedback", mine("Pass"), gain=-3.0)
    system.add("rest", mine("Course"))
    system.connect("x.x", "feedback.u")
    system.connect("rest.y", "x.u")
    poles = [np.linalg.eigvals(linearize(system, at=at, kind="plain").a) for at in (0.5, 2.0)]
    assert poles[0] == pytest.approx([1.0])
    assert poles[1] == pytest.approx([1.0 - 0.3], abs=0.05)
