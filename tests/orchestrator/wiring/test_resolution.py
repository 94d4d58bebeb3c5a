"""A system against the interfaces of its models: what goes where, and everything that is wrong with it."""

import pytest
from railcosim.orchestrator.fmi.models import load_models
from railcosim.orchestrator.system import Connection, System
from railcosim.orchestrator.wiring import is_direct

METRES_TO_TRACK = '<Unit name="km"><BaseUnit m="1" factor="1000"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>'


# -------------------------------------------------------------------- units


@pytest.mark.parametrize(
    ("source", "target", "value", "expected"),
    [
        ("metres", "metres", 5.0, 5.0),
        ("kilometres", "metres", 5.0, 5000.0),
        ("kmh", "speed", 36.0, 10.0),
        ("celsius", "kelvin", 20.0, 293.15),
        ("plain", "plain", 5.0, 5.0),
        ("plain", "metres", 5.0, 5.0),  # a plain number says nothing of its unit
        ("whole", "plain", 5, 5),
    ],
)
def test_units_are_converted(connected, source, target, value, expected):
    wiring = connected(f"a.{source}", f"b.{target}")
    assert wiring.problems == []
    (link,) = wiring.links
    assert link.scale * value + link.offset == pytest.approx(expected, rel=1e-15)


def test_scale_and_offset_apply_after_the_conversion(connected):
    """Both are of the input's unit: twice the kilometres, less 100 m."""
    (link,) = connected("a.kilometres", "b.metres", scale=2.0, offset=-100.0).links
    assert link.scale * 5.0 + link.offset == 2.0 * 5000.0 - 100.0
    (link,) = connected("a.celsius", "b.kelvin", scale=2.0, offset=1.0).links
    assert link.scale * 20.0 + link.offset == pytest.approx(2.0 * 293.15 + 1.0)


def test_another_dimension_is_refused(connected):
    assert [str(problem) for problem in connected("a.seconds", "b.metres").problems] == [
        "'b.metres' = 'a.seconds': unit 's' does not convert to 'm': they are of different dimensions; if the values "
        "fit, give the connection a scale (scale = 1.0)"
    ]


def test_a_unit_that_nobody_defined_passes_values_as_they_are_and_is_told(resolve, foreign, xml, mine):
    """Many tools write units without defining them: the scenario shall run, and say what it takes for granted."""
    path = foreign([xml["variable"]("y", "output", unit="furlong"), xml["variable"]("z", "output", unit="furlong")])
    system = System()
    system.add("a", path)
    system.add("b", mine("Sink"))
    system.connect("a.y", "b.metres")
    system.connect("a.z", "b.speed")
    system.connect("a.z", "b.kelvin", scale=2.0)  # whoever gives a scale knows
    wiring = resolve(system)
    assert wiring.problems == [p for p in wiring.problems if "required input" in p.message]
    assert [(link.scale, link.offset) for link in wiring.links] == [(1.0, 0.0), (1.0, 0.0), (2.0, 0.0)]
    note = "'furlong' is not defined in SI units by Foreign: what is in 'furlong' is taken for"
    assert [text for text in wiring.notes if note in text] == [
        f"'b.{target}' = 'a.{source}': {note} '{unit}' as it is; where they differ, give the connection a scale"
        for source, target, unit in (("y", "metres", "m"), ("z", "speed", "m/s"))
    ]


def test_the_units_of_another_maker_s_fmu(resolve, foreign, xml, mine):
    system = System()
    system.add("a", foreign([xml["variable"]("y", "output", unit="km")], units=METRES_TO_TRACK))
    system.add("b", mine("Sink"))
    system.connect("a.y", "b.metres")
    (link,) = resolve(system).links
    assert (link.scale, link.offset) == (1000.0, 0.0)


# -------------------------------------------------------------------- types


@pytest.mark.parametrize(("source", "target"), [("whole", "whole"), ("truth", "truth"), ("word", "word")])
def test_every_type_connects_to_its_own(connected, source, target):
    wiring = connected(f"a.{source}", f"b.{target}")
    assert wiring.problems == []
    assert [(x.source, x.target) for x in wiring.links] == [(("a", source), ("b", target))]


@pytest.mark.parametrize(
    ("source", "target", "why"),
    [
        ("plain", "whole", "a Real output leads to an Integer input only with a threshold"),
        ("whole", "truth", "an Integer output leads to a Boolean input only with a threshold"),
        ("plain", "truth", "a Real output leads to a Boolean input only with a threshold"),
        ("word", "plain", "a String output cannot feed a Real input"),
        ("plain", "word", "a Real output cannot feed a String input"),
    ],
)
def test_other_types_are_refused(connected, source, target, why):
    wiring = connected(f"a.{source}", f"b.{target}")
    (problem,) = wiring.problems
    assert str(problem).startswith(f"'b.{target}' = 'a.{source}': {why}")
    assert wiring.links == []


def test_types_that_change_on_the_way_are_noted(connected):
    wiring = connected("a.truth", "b.plain", scale=3.0)
    assert wiring.notes == ["'b.plain' = 'a.truth': a Boolean is given to a Real, false as 0, true as 1"]
    (link,) = wiring.links
    assert (link.scale, link.threshold) == (3.0, None)
    (link,) = connected("a.plain", "b.truth", threshold=2.0).links
    assert link.threshold == 2.0


@pytest.mark.parametrize("delay", [-1, 1.0, True, "1"])
def test_a_delay_counts(connected, delay):
    assert [str(problem) for problem in connected("a.metres", "b.metres", delay=delay).problems] == [
        f"'b.metres' = 'a.metres': delay counts communication points: 0, 1, 2, ..., not {delay!r}"
    ]


# -------------------------------------------------------------------- names


@pytest.mark.parametrize(
    ("source", "target", "problem"),
    [
        ("a.metres", "b.meters", "Sink (b) has no variable 'meters'; did you mean 'metres'?"),
        ("a.kilometers", "b.metres", "Source (a) has no variable 'kilometers'; did you mean 'kilometres'?"),
        ("a.rwo", "b.row", "Source (a) has no variable 'rwo'; did you mean 'row'?"),
        ("a.qqq", "b.metres", "Source (a) has no variable 'qqq'; its outputs are metres, kilometres, kmh"),
        ("aa.metres", "b.metres", "there is no instance 'aa'; did you mean 'a'?"),
        ("a.metres", "train[3].metres", "there is no instance 'train[3]'"),
        ("a", "b.metres", "Source (a) has no variable ''"),
        ("b.metres", "b.metres", "b.metres is not an output but input"),
        ("a.metres", "b.y", "b.y is not an input but output"),
    ],
)
def test_a_wrong_name_gets_the_nearest(connected, source, target, problem):
    (found,) = [str(problem) for problem in connected(source, target).problems]
    assert found.startswith(f"{target!r} = {source!r}: {problem}")


def test_all_problems_are_found_and_say_where_they_were_written(pair, resolve):
    system = pair()
    system.connect("a.nothing", "b.nothing")
    system.connect("a.seconds", "b.metres")
    system.connect("a.plain", "b.plain")
    system.connections[0].origin, system.connections[1].origin = "x.toml:8", "x.toml:9"
    system.instances["b"].origin = "x.toml:4"
    system.instances["b"].start["wrod"] = "x"
    found = [str(problem) for problem in resolve(system).problems]
    assert len(found) == 4
    assert found[0].startswith("x.toml:4: b.wrod: Sink has no such variable; did you mean 'word'?")
    assert [text.partition(": ")[0] for text in found] == ["x.toml:4", "x.toml:8", "x.toml:8", "x.toml:9"]


# -------------------------------------------------------------------- arrays


def test_arrays_connect_by_name(connected):
    wiring = connected("a.row", "b.row", delay=2, scale=3.0)
    assert wiring.problems == []
    assert [(x.source[1], x.target[1], x.delay, x.scale) for x in wiring.links] == [
        (f"row[{k}]", f"row[{k}]", 2, 3.0) for k in (1, 2, 3)
    ]


def test_one_element_connects_alone(connected):
    (link,) = connected("a.row[3]", "b.pair[1]").links
    assert (link.source, link.target) == (("a", "row[3]"), ("b", "pair[1]"))


@pytest.mark.parametrize(
    ("source", "target", "lengths"),
    [("row", "pair", "the output has 3 elements, the input 2"), ("metres", "pair", "the output has 1 elements")],
)
def test_arrays_of_other_lengths_are_refused(connected, source, target, lengths):
    (found,) = [str(problem) for problem in connected(f"a.{source}", f"b.{target}").problems]
    assert found.startswith(f"'b.{target}' = 'a.{source}': {lengths}")


# -------------------------------------------------------------------- inputs


def test_a_required_input_that_nothing_feeds(resolve, mine):
    system = System(step=0.2)
    system.add("it", mine("Needy"))
    remedy = "is a required input and nothing feeds it: connect it, or give it a start value to hold it constant"
    assert [str(problem) for problem in resolve(system).problems] == [
        f"it.{n} {remedy}" for n in ("needed", "needed_row[1]", "needed_row[2]")
    ]
    system.instances["it"].start.update(needed=1.0, needed_row=2.0)
    assert resolve(system).problems == []


def test_an_input_with_a_broken_connection_is_not_told_twice(resolve, mine, pair):
    system = pair()
    system.stepping.step = 0.2
    system.add("it", mine("Needy"))
    system.connect("a.qqq", "it.needed")
    system.connect("a.row", "it.needed_row")
    found = [str(problem) for problem in resolve(system).problems]
    assert len(found) == 2
    assert "has no variable 'qqq'" in found[0]
    assert "3 elements, the input 2" in found[1]


def test_fed_twice(pair, resolve):
    system = pair()
    system.connect("a.metres", "b.row[2]")
    system.connect("a.row", "b.row")
    system.connections[1].origin = "x.toml:9"
    assert [str(problem) for problem in resolve(system).problems] == [
        "x.toml:9: b.row[2] is fed twice: by 'a.metres' and by 'a.row'"
    ]


def test_an_open_input_of_another_maker_s_fmu_keeps_its_start_value(resolve, foreign, xml):
    system = System()
    system.add("a", foreign([xml["variable"]("u", "input", start=3.5), xml["variable"]("y", "output")]))
    wiring = resolve(system)
    assert wiring.problems == []
    assert "a.u is not connected; it keeps 3.5" in wiring.notes


# -------------------------------------------------------------------- feed-through


def test_feed_through_is_read_off_the_interface(pair, resolve, workspace):
    system = pair()
    system.connect("a.metres", "b.metres")
    system.connect("b.y", "b.plain")
    assert [link.direct for link in resolve(system).links] == [False, True]


@pytest.mark.parametrize(("listed", "direct"), [(["u"], True), (["p"], False), ([], False), (None, False)])
def test_feed_through_of_another_maker_s_fmu(workspace, foreign, xml, listed, direct):
    """Without a list none is assumed (ordinary plants have none and list nothing), and `check` says so."""
    v = xml["variable"]
    system = System()
    path = foreign([v("u", "input", start=0.0), v("p", "parameter", start=1.0, variability="fixed", initial="exact"),
                    v("y", "output", dependencies=listed)])  # fmt: skip
    system.add("a", path)
    interface = load_models(system, workspace)["a"].interface
    assert is_direct(interface, interface.variables["y"]) is direct


@pytest.mark.parametrize("optional", [True, False])
def test_an_optional_connection_stands_for_nothing_where_an_end_is_missing(resolve, foreign, xml, optional):
    path = foreign([xml["variable"]("x[0]", "input", start=0.0), xml["variable"]("y[1]", "output")])
    system = System(stop_time=1.0)
    system.add("a", path)
    system.add("b", path)
    system.connections.append(Connection("a.y[0]", "b.x[0]", optional=optional))
    wiring = resolve(system)
    assert [str(problem) for problem in wiring.problems] == (
        [] if optional else ["'b.x[0]' = 'a.y[0]': Foreign (a) has no variable 'y[0]'; there is 'y[1]'"]
    )
    nothing = "'b.x[0]' = 'a.y[0]' stands for nothing: there are no such elements"
    assert (nothing in wiring.notes) == optional


def test_of_a_pattern_that_makes_one_connection_at_least_nothing_is_said(resolve, foreign, xml):
    path = foreign([xml["variable"]("x[0]", "input", start=0.0), xml["variable"]("y[1]", "output")])
    system = System(stop_time=1.0)
    system.add("a", path)
    system.add("b", path)
    for k in (0, 1):
        system.connections.append(Connection(f"a.y[{k}]", "b.x[0]", optional=not k, origin="s.toml:7"))
    wiring = resolve(system)
    assert len(wiring.links) == 1
    assert not any("stands for nothing" in note for note in wiring.notes)
