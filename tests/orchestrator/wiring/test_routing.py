"""Which connections there are from when on, and what is wrong with those that events make."""

import pytest
from railcosim.orchestrator.system import Connection, Event


def connect(at, source, signal="b.metres", **how):
    return Event(signal, "connect", at, source=Connection(source, signal), **how)


@pytest.fixture
def wired(pair, resolve):
    """Wire b.metres = a.metres, with events that connect it to another source of the same kind, and more."""

    def make(*events, start=0.0):
        system = pair().changed(events=list(events), start_time=start, stop_time=start + 10.0)
        system.add("other", system.instances["a"].model)
        system.add("third", system.instances["a"].model)
        for name in ("metres", "plain", "row"):
            system.connect(f"a.{name}", f"b.{name}")
        return resolve(system)

    return make


def sources(wiring):
    """From when on b.metres follows what."""
    return [
        (since, next(str(x.source) for x in now.links if x.target == ("b", "metres"))) for since, now in wiring.later
    ]


def test_each_routing_is_there_once_with_its_time(wired):
    wiring = wired(connect(2.0, "other.metres", duration=1.0, every=2.0), connect(4.5, "third.metres", duration=2.0))
    assert not wiring.problems
    assert sources(wiring) == [(2.0, "other.metres"), (4.5, "third.metres")]
    assert [when for when, _ in wiring.routings] == ["", "from 2 s on: ", "from 4.5 s on: "]
    assert [len(now.links) for _, now in wiring.routings] == [5, 5, 5]
    assert {str(link.source) for link in wiring.every_link} >= {"a.metres", "other.metres", "third.metres"}


def test_what_is_over_before_the_start_or_begins_after_the_stop_is_no_routing(wired):
    events = [connect(-9.0, "other.metres", duration=1.0, every=2.0), connect(30.0, "third.metres")]
    assert sources(wired(*events, start=0.25)) == [(1.0, "other.metres")]
    assert sources(wired(connect(-3.0, "other.metres"), connect(-2.0, "third.metres"))) == [(0.0, "third.metres")]
    assert sources(wired(connect(1.0, "a.metres"))) == [(1.0, "a.metres")], "another connection of the same two"


def test_flags_that_are_set_until_then_count(wired):
    sets = [Event("b.truth", "set", 3.0, True), Event("b.speed", "set", 8.0, 1.0), Event("nobody.x", "set", 0.0, 1.0)]
    wiring = wired(*sets, connect(3.0, "other.metres"))
    ((_, now),) = wiring.later
    assert now.starts["b"] == {"truth": True}
    assert wiring.starts["b"] == {}


@pytest.mark.parametrize(
    ("source", "signal", "problem"),
    [
        ("other.kmh", "b.metres", "event on 'b.metres', from 'other.kmh': unit 'km/h' does not convert to 'm'"),
        ("other.metre", "b.metres", "has no variable 'metre'; did you mean 'metres'?"),
        ("nobody.x", "b.metres", "from 'nobody.x': there is no instance 'nobody'"),
        ("other.word", "b.metres", "a String output cannot feed a Real input"),
        ("other.row", "b.metres", "the output has 3 elements, the input 1"),
    ],
)
def test_a_source_that_does_not_fit_is_told_with_the_event(wired, source, signal, problem):
    event = connect(2.0, source, signal)
    event.origin = "x.toml:7"
    (told,) = wired(event).problems
    assert str(told).startswith("x.toml:7: event on ")
    assert problem in str(told)


def test_units_are_converted_and_arrays_led_as_a_whole(wired):
    wiring = wired(connect(2.0, "other.kilometres"), connect(3.0, "third.row", "b.row"))
    assert [link.scale for link in wiring.routes[0].links] == [1000.0]
    assert len(wiring.routes[1].links) == 3


@pytest.mark.parametrize(
    "event",
    [
        connect(2.0, "other.metres", "b.speed"),  # follows nothing
        connect(2.0, "other.metres", "b.nothing"),
        connect(2.0, "other.metres", "nobody.u"),
        connect(float("nan"), "other.metres"),
        Event("b.metres", "connect", 2.0),
    ],
)
def test_what_is_wrong_with_the_event_alone_is_left_to_its_check(wired, event):
    wiring = wired(event)
    assert (wiring.problems, wiring.routes, wiring.later) == ([], [], [])
