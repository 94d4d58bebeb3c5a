"""Scenario actions of Ecos as events: which become what, which are left out and why, and a run of known numbers."""

import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator import ScenarioError, load, run

from .conftest import UNITS, component, connection, connectors, packed, structure, system

ECOS = "http://github.com/Ecos-platform/libecos/resources/schema/ScenarioConfig"


def action(at, *variables, more=""):
    """At a time, variables by id, type and value."""
    rows = "".join(
        f'<e:variable id="{name}"><e:{kind} value="{value}"/></e:variable>' for name, kind, value in variables
    )
    return f'<e:action t="{at}"{more}>{rows}</e:action>'


def experiment(*scenarios, type_="com.github.ecos-platform.scenario", more=""):
    """Default experiments with scenarios of Ecos."""
    begin = f'<ssc:Annotation type="{type_}"><e:Scenario xmlns:e="{ECOS}" name="s"{more}>'
    each = (f"{begin}{inside}</e:Scenario></ssc:Annotation>" for inside in scenarios)
    return (
        f'{UNITS}<ssd:DefaultExperiment startTime="0" stopTime="1"><ssd:Annotations>{"".join(each)}</ssd:Annotations>'
        "</ssd:DefaultExperiment>"
    )


PARTS = system(component("a") + component("b b"), connection("a.y", "b b.u"))


def events(found):
    return [(one.signal, one.action, one.at, one.value) for one in found.events]


def test_an_action_sets_an_input_or_a_tunable_parameter(read):
    first = action(0.5, ("a::u", "real", "2.5"), ("b b::n", "integer", "-3"), ("b b::on", "boolean", "1"))
    found = read(PARTS, after=experiment(first + action(0.75, ("a::k", "real", 4))))
    assert events(found) == [
        ("a.u", "set", 0.5, 2.5),
        ("b_b.n", "set", 0.5, -3),
        ("b_b.on", "set", 0.5, True),
        ("a.k", "set", 0.75, 4.0),
    ]
    assert {type(one.value) for one in found.events} == {float, int, bool}
    assert all("SystemStructure.ssd:" in one.origin for one in found.events)
    assert not any("the action" in note for note in found.provenance.notes)


@pytest.mark.parametrize(
    ("variable", "why"),
    [
        (("b b::u", "real", 1), "it is connected, and what it receives next takes the place of what is set"),
        (("a::y", "real", 1), "only inputs and tunable parameters can be set in a run; it is a continuous output"),
        (("a::top.v", "real", 1), "only inputs and tunable parameters can be set in a run; it is a fixed parameter"),
        (("a::n", "real", 1), "it is of type Integer, not real"),
        (("a::u", "complex", 1), "it is of type Real, not complex"),
        (("a::w", "real", 1), "a has no variable 'w'"),
        (("c::u", "real", 1), "there is no FMU 'c' at the top"),
        (("u", "real", 1), "there is no FMU 'u' at the top"),
    ],
)
def test_what_has_no_counterpart_is_told_and_left_out(read, variable, why):
    found = read(PARTS, after=experiment(action(0.5, variable, ("a::k", "real", 4))))
    assert events(found) == [("a.k", "set", 0.5, 4.0)]
    (note,) = (note for note in found.provenance.notes if "the action on" in note)
    assert note.endswith(f"is left out: {why}")
    assert "SystemStructure.ssd:" in note


def test_an_action_without_a_value_is_left_out(read):
    found = read(PARTS, after=experiment('<e:action t="1"><e:variable id="a::u"/></e:action>'))
    assert events(found) == []
    assert any("it is of type Real, not given" in note for note in found.provenance.notes)


def test_several_scenarios_and_eps(read):
    """Ecos 0.7.2 runs the last scenario alone; here all are taken, and that is told."""
    inside = action(0.5, ("a::u", "real", 1)), action(0.25, ("a::u", "real", 2), more=' eps="0.1"')
    found = read(PARTS, after=experiment(*inside))
    assert events(found) == [("a.u", "set", 0.5, 1.0), ("a.u", "set", 0.25, 2.0)]
    told = " ".join(found.provenance.notes)
    assert "the actions of all 2 scenarios of Ecos are taken" in told
    assert told.count("eps is left out") == 1
    assert read(PARTS, after=experiment(*inside, type_="org.other")).events == []


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        (action("soon", ("a::u", "real", 1)), "t of action is 'soon', not a number"),
        (action(1, ("a::u", "real", "fast")), "value of real is 'fast', not a number"),
        (action(1, ("a::n", "integer", "1.5")), "the value of an action is '1.5', not of type integer"),
        (action(1, ("a::on", "boolean", "yes")), "the value of an action is 'yes', not of type boolean"),
        (
            '<e:action t="1"><e:variable id="a::on"><e:boolean/></e:variable></e:action>',
            "the value of an action is None, not of type boolean",
        ),
    ],
)
def test_what_is_no_action_is_refused_where_it_stands(read, inside, said):
    with pytest.raises(ScenarioError, match=rf"SystemStructure\.ssd:\d+: {said}"):
        read(PARTS, after=experiment(inside))


def own(text):
    return f'<ssc:Annotation type="railcosim"><Scenario>{text}</Scenario></ssc:Annotation>'


def test_they_stand_behind_events_of_ours(archive):
    """What is wrong with one is told where it stands."""
    after = experiment(action(0.5, ("a::u", "real", 1)))
    ours = '[[events]]\nsignal = "a.k"\naction = "set"\nat = 0.25\nvalue = 2.0'
    both = after + f"<ssd:Annotations>{own(ours)}</ssd:Annotations>"
    assert events(load(archive(structure(PARTS, both)))) == [("a.k", "set", 0.25, 2.0), ("a.u", "set", 0.5, 1.0)]
    found = load(archive(structure(PARTS, both)), settings=["events[2].value=3.0"])
    assert (found.events[1].value, "SystemStructure.ssd" in found.provenance.origins["events[2]"]) == (3.0, True)
    odd = after + f"<ssd:Annotations>{own('events = 3')}</ssd:Annotations>"
    with pytest.raises(ScenarioError, match="events"):
        load(archive(structure(PARTS, odd)))


def test_a_run_of_known_numbers(mine, tmp_path):
    """y = 1 u + 0: u = 2 from the first point at or after 0.45 s on, with points every 0.2 s."""
    shown = connectors(u="input", y="output")
    parts = system(component("first", source="resources/pass.fmu", shown=shown))
    top = structure(parts, experiment(action(0.45, ("first::u", "real", 2))))
    path = tmp_path / "system.ssp"
    fmu = build(mine("Pass"), kind="native").read_bytes()
    path.write_bytes(packed({"SystemStructure.ssd": top, "resources/pass.fmu": fmu}))
    result = run(load(str(path), step=0.2))
    held = dict(zip(result.time.round(9), result["first.y"], strict=True))
    assert (held[0.4], held[0.8], held[1.0]) == (0.0, 2.0, 2.0)
    assert [round(event["time"], 9) for event in result.coupling["events"]] == [0.6]
