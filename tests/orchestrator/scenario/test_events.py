"""`[[events]]`: what they become, and what is said about every mistake."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario.loading import loads
from railcosim.orchestrator.scenario.values import changed, is_structural
from railcosim.orchestrator.scenario.writer import dump
from railcosim.orchestrator.system import Connection, Event

TEXT = """[simulation]
stop_time = 100.0
[instances.gust]
component = "A"
[instances.cruise]
component = "B"
count = 3
"""
BIAS = {"signal": '"gust.size"', "action": '"bias"', "at": "10", "value": "0.5"}


def entry(**keys):
    """An entry; TEXT has 7 lines, so that its header is line 8 and its keys follow in the order given."""
    return "[[events]]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items() if value is not None)


def events(*entries, **changes):
    return loads(TEXT + "".join(entries), "x.toml", **changes).events


def problems(*entries, **changes):
    with pytest.raises(ScenarioError) as caught:
        events(*entries, **changes)
    return [str(problem) for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("keys", "event"),
    [
        ({"action": '"set"', "value": "3"}, Event("gust.size", "set", 10.0, 3)),
        ({"action": '"set"', "value": "true", "every": "20"}, Event("gust.size", "set", 10.0, True, every=20.0)),
        ({"action": '"override"', "value": '"north"'}, Event("gust.size", "override", 10.0, "north")),
        (
            {"action": '"bias"', "value": "-1e-3", "duration": "5", "every": "5"},
            Event("gust.size", "bias", 10.0, -1e-3, duration=5.0, every=5.0),
        ),
        ({"action": '"ramp"', "rate": "-2"}, Event("gust.size", "ramp", 10.0, rate=-2.0)),
        ({"action": '"freeze"', "duration": "0.5"}, Event("gust.size", "freeze", 10.0, duration=0.5)),
    ],
)
def test_each_action(keys, event):
    assert events(entry(signal='"gust.size"', at=10, **keys)) == [event]


def test_truth_and_numbers_are_kept_apart():
    (made,) = events(entry(**BIAS | {"action": '"override"', "value": "true"}))
    assert made.value is True


@pytest.mark.parametrize(
    ("signal", "names"),
    [
        ('"cruise.x"', ["cruise[1].x", "cruise[2].x", "cruise[3].x"]),
        ('" cruise[ 2 ] . x "', ["cruise[2].x"]),
        ('["cruise[3].x", "gust.size[2]", "cruise[1].force"]', ["cruise[3].x", "gust.size[2]", "cruise[1].force"]),
        ('["cruise.x", "cruise.y[1, 2]"]', [f"cruise[{k}].{x}" for x in ("x", "y[1,2]") for k in (1, 2, 3)]),
        ('"gust.engine.torque"', ["gust.engine.torque"]),
    ],
)
def test_signals(signal, names):
    assert [event.signal for event in events(entry(**BIAS | {"signal": signal}))] == names


def test_they_stand_as_written_each_with_its_place():
    system = loads(
        TEXT + entry(**BIAS | {"at": 50}) + entry(**BIAS | {"signal": '"cruise.x"', "at": -3}), "folder/x.toml"
    )
    assert [(event.signal, event.at) for event in system.events] == [
        ("gust.size", 50.0),
        ("cruise[1].x", -3.0),
        ("cruise[2].x", -3.0),
        ("cruise[3].x", -3.0),
    ]
    assert [event.origin for event in system.events] == ["folder/x.toml:8"] + ["folder/x.toml:13"] * 3
    assert (system.provenance.origins["events[1]"], system.provenance.origins["events[2]"]) == (
        "folder/x.toml:8",
        "folder/x.toml:13",
    )
    assert system.provenance.modified is False


def test_they_follow_the_number_of_instances():
    assert len(events(entry(**BIAS | {"signal": '"cruise.x"'}), settings=["cruise.count=5"])) == 5
    one = entry(**BIAS | {"signal": '"cruise[3].x"'})
    assert problems(one, settings=["cruise.count=2"]) == [
        "x.toml:9: events[1].signal: there is no 'cruise[3]'; there are cruise[1] to cruise[2]"
    ]


@pytest.mark.parametrize(
    ("keys", "line", "message"),
    [
        ({"signal": None}, 8, ': signal is missing; name what it happens to: signal = "instance.variable"'),
        ({"signal": "3"}, 9, '.signal: takes "instance.variable", or a list of such texts, not 3'),
        ({"signal": "[]"}, 9, '.signal: takes "instance.variable", or a list of such texts, not []'),
        ({"signal": '["gust.size", 3]'}, 9, '.signal: takes "instance.variable", or a list of such texts, not [\'gust'),
        ({"signal": '["gust.size", "gst.size"]'}, 9, ".signal[2]: there is no instance 'gst'; did you mean 'gust'?"),
        (
            {"signal": '"gust"'},
            9,
            ".signal: 'gust' is not of the form instance.variable, as in train[4].speed or train.speed; "
            "instances are gust, cruise",
        ),
        ({"signal": '"gust[1].size"'}, 9, ".signal: 'gust' has no count: write gust without [1]"),
        (
            {"signal": '"cruise[i].x"'},
            9,
            ".signal: 'cruise[i].x': i has no meaning here; write cruise.x for all or cruise[1].x for one",
        ),
        (
            {"signal": '"cruise[:].x"'},
            9,
            ".signal: 'cruise[:].x': an index is a number here; write cruise.x for all or cruise[1].x for one",
        ),
        (
            {"signal": '"gust.x[i-1]"'},
            9,
            ".signal: 'gust.x[i-1]': i has no meaning here; write gust.x for the whole array or gust.x[1] for one",
        ),
        ({"signal": '"cruise[4].x"'}, 9, ".signal: there is no 'cruise[4]'; there are cruise[1] to cruise[3]"),
        (
            {"signal": '["cruise.x", "cruise[2].x"]'},
            9,
            ".signal[2]: 'cruise[2].x' stands there twice; an event happens to a signal once",
        ),
        ({"action": None}, 8, ": action is missing; say what happens: set, override, freeze, bias, ramp, connect"),
        ({"action": '"frezee"'}, 10, ".action: there is no action 'frezee'; did you mean 'freeze'?"),
        ({"action": "1"}, 10, ".action: there is no action 1; there are set, override, freeze, bias, ramp, connect"),
        ({"at": None}, 8, ": at is missing; say when it begins, in s: at = 60.0"),
        ({"at": '"later"'}, 11, ".at: takes a finite number, not 'later'"),
        ({"at": "inf"}, 11, ".at: takes a finite number, not inf"),
        ({"value": None}, 8, ": value is missing; say what is added: value = 1.5"),
        ({"value": "true"}, 12, ".value: takes a finite number, not true"),
        ({"value": '"much"'}, 12, ".value: takes a finite number, not 'much'"),
        ({"rate": "1"}, 13, ".rate: 'bias' takes no rate; take 'ramp' for an added value that grows"),
        ({"duration": "0"}, 13, ".duration: takes a number greater than 0, in s, not 0"),
        ({"duration": "5", "every": "-5"}, 14, ".every: takes a number greater than 0, in s, not -5"),
        (
            {"duration": "5", "every": "4.5"},
            14,
            ".every: the period, 4.5 s, must not be shorter than the duration, 5 s",
        ),
        (
            {"every": "5"},
            13,
            ".every: what begins again must end before; give a duration, in s: duration = 5.0",
        ),
        ({"values": "5"}, 13, ".values: unknown key 'values'; did you mean 'value'?"),
    ],
)
def test_what_is_said_about_a_mistake(keys, line, message):
    (found,) = problems(entry(**BIAS | keys))
    assert found.startswith(f"x.toml:{line}: events[1]{message}")


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"action": '"set"'}, ": value is missing; say what is set: value = 1.5"),
        ({"action": '"override"'}, ": value is missing; say what takes the signal's place: value = 1.5"),
        ({"action": '"ramp"'}, ": rate is missing; say what is added in each second: rate = 0.1"),
        (
            {"action": '"ramp"', "rate": 1, "value": 1},
            ".value: 'ramp' takes no value; say what is added in each second: rate = 0.1",
        ),
        (
            {"action": '"freeze"', "value": 1},
            ".value: 'freeze' takes no value; it keeps the value of the beginning; take 'override' for another one",
        ),
        (
            {"action": '"freeze"', "rate": 1},
            ".rate: 'freeze' takes no rate; take 'ramp' for an added value that grows",
        ),
        (
            {"action": '"set"', "value": 1, "duration": 5},
            ".duration: 'set' takes no duration; what is set stays; take 'override' for a value that lasts a while",
        ),
        ({"action": '"ramp"', "rate": '"fast"'}, ".rate: takes a finite number, not 'fast'"),
        ({"action": '"set"', "value": "nan"}, ".value: takes a finite number, not nan"),
        (
            {"action": '"set"', "value": "[1, 2]"},
            ".value: takes a number, true or false, or a text, not [1, 2]; write an event for each element",
        ),
        (
            {"action": '"override"', "value": "{ a = 1 }"},
            ".value: takes a number, true or false, or a text, not {'a': 1}",
        ),
    ],
)
def test_what_an_action_needs_and_what_it_does_not_take(keys, message):
    (found,) = problems(entry(signal='"gust.size"', at=1, **keys))
    place, _, said = found.partition(": ")
    assert said == f"events[1]{message}"
    wrong = message.partition(":")[0].removeprefix(".")
    assert place == f"x.toml:{8 + (['', 'signal', 'at', *keys].index(wrong))}"


def test_every_entry_is_read_and_all_is_told_at_once():
    found = problems(entry(**BIAS), entry(), entry(**BIAS | {"action": '"hold"', "at": '"x"'}))
    assert found == [
        "x.toml:13: events[2]: action is missing; say what happens: set, override, freeze, bias, ramp, connect",
        "x.toml:13: events[2]: at is missing; say when it begins, in s: at = 60.0",
        'x.toml:13: events[2]: signal is missing; name what it happens to: signal = "instance.variable"',
        "x.toml:16: events[3].action: there is no action 'hold'; there are set, override, freeze, bias, ramp, connect",
        "x.toml:17: events[3].at: takes a finite number, not 'x'",
    ]


def test_one_table_is_no_list_of_them_and_the_name_is_taken():
    assert problems("[events]\nat = 3\n") == ["x.toml:8: events: is a list of tables; each begins with [[events]]"]
    assert problems('[instances.events]\ncomponent = "A"\n') == [
        "x.toml:8: instances.events: an instance's name is taken; choose another for 'events'"
    ]


def connects(**keys):
    return entry(**{"signal": '"cruise[i].u"', "action": '"connect"', "at": "5", "from": '"gust.y"'} | keys)


@pytest.mark.parametrize(
    ("keys", "found"),
    [
        ({"signal": '"cruise[2].u"'}, [("cruise[2].u", "gust.y")]),
        ({}, [("cruise[1].u", "gust.y"), ("cruise[2].u", "gust.y"), ("cruise[3].u", "gust.y")]),
        ({"from": '"cruise[i-1].y"'}, [("cruise[2].u", "cruise[1].y"), ("cruise[3].u", "cruise[2].y")]),
        (
            {"signal": '["gust.u", "cruise[1].u[3]"]', "from": '["cruise[2].y", "gust.z[1]"]'},
            [("gust.u", "cruise[2].y"), ("cruise[1].u[3]", "gust.z[1]")],
        ),
    ],
)
def test_what_follows_what(keys, found):
    made = events(connects(**keys))
    assert [(event.signal, event.source.source) for event in made] == found
    assert {(event.action, event.at, event.fade, event.number) for event in made} == {("connect", 5.0, None, 1)}


def test_a_table_has_what_connections_have():
    table = '{ from = "gust.y", delay = 2, scale = 3.0, offset = -1, convert = false }'
    (event,) = events(connects(signal='"cruise[1].u"', fade=2, duration=7, **{"from": table}))
    assert event.source == Connection("gust.y", "cruise[1].u", 2, 3.0, -1.0, convert=False)
    assert (event.fade, event.duration) == (2.0, 7.0)
    (event,) = events(
        connects(signal='"gust.u"', **{"from": '{ from = "gust.m", map = { "1" = 2 }, threshold = 0.5 }'})
    )
    assert (event.source.map, event.source.threshold) == ({"1": 2}, 0.5)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"from": None}, 'events[1]: from is missing; say what the input follows: from = "instance.output"'),
        ({"from": 3}, '.from: takes "instance.output" or { from = "instance.output", ... }, not 3'),
        ({"from": "[]"}, ".from: has 0 sources for 1 signals; give one for each"),
        ({"from": "{ delay = 1 }"}, '.from: names no source; write { from = "instance.output", ... }'),
        ({"from": '{ from = "gust.y", dely = 1 }'}, ".from.dely: unknown key 'dely'; did you mean 'delay'?"),
        (
            {"from": '{ from = "gust.y", delay = -1 }'},
            "takes a whole number of communication steps, at least 0, not -1",
        ),
        ({"from": '{ from = "gust.y", map = 3 }'}, ".from.map: takes a table of what becomes of which value, not 3"),
        ({"from": '"gusty.y"'}, "there is no instance 'gusty'; did you mean 'gust'?"),
        ({"value": 3}, ".value: 'connect' takes no value; say what the input follows: from = \"instance.output\""),
        ({"fade": 0}, ".fade: takes a number greater than 0, in s, not 0"),
        ({"every": 3}, ".every: what begins again must end before; give a duration, in s: duration = 5.0"),
    ],
)
def test_what_is_wrong_with_what_follows(keys, message):
    found = problems(connects(**{"signal": '"cruise[1].u"'} | keys))
    assert any(message in problem for problem in found), found


def test_fade_and_from_are_for_connect_alone():
    found = problems(entry(**BIAS, fade=1, **{"from": '"gust.y"'}))
    why = "take 'connect' for an input that follows another output"
    assert [one.partition(": ")[2] for one in found] == [
        f"events[1].from: 'bias' takes no from; {why}",
        f"events[1].fade: 'bias' takes no fade; {why}",
    ]


def test_it_is_written_and_changed_as_it_was_read():
    text = connects(fade=1.5, **{"from": '{ from = "cruise[i].y", delay = 1 }'}) + connects(signal='"gust.u"')
    system = loads(TEXT + text, "x.toml")
    assert loads(dump(system), "y.toml").events == system.events
    later = changed(system, {"events[1].at": 9.0})
    assert [event.at for event in later.events] == [9.0, 9.0, 9.0, 5.0]
    assert [event.source for event in later.events] == [event.source for event in system.events]
    assert is_structural("events[1].from")
    assert not is_structural("events[1].fade")
