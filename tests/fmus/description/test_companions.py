"""Terminals, icons and the description of the build: against the schemas, the ports, and one another."""

from pathlib import Path

import fmpy
import pytest
from lxml import etree
from railcosim.components import CATALOGUE
from railcosim.fmus.description import companions

SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


def terminals(name):
    """Of a component: kind and members by name."""
    root = etree.fromstring(companions(CATALOGUE[name](), b"")[TERMINALS])
    return {
        terminal.get("name"): (
            terminal.get("terminalKind"),
            {m.get("memberName"): m.get("variableName") for m in terminal},
        )
        for terminal in root.iterfind("Terminals/Terminal")
    }


@pytest.mark.parametrize(
    ("path", "schema"),
    [(TERMINALS, "fmi3TerminalsAndIcons.xsd"), ("sources/buildDescription.xml", "fmi3BuildDescription.xsd")],
)
def test_the_schemas_are_obeyed(path, schema):
    check = etree.XMLSchema(etree.parse(str(SCHEMAS / schema)))
    for name in ("PointMassTrain", "ComfortCruise", "Gust"):
        check.assertValid(etree.fromstring(companions(CATALOGUE[name](), b"")[path]))


def test_the_sources_are_one_translation_unit():
    root = etree.fromstring(companions(CATALOGUE["Gust"](), b"")["sources/buildDescription.xml"])
    assert root.find("BuildConfiguration").get("modelIdentifier") == "Gust"
    assert [file.get("name") for file in root.iter("SourceFile")] == ["all.c"]


def test_the_icon_is_there():
    assert companions(CATALOGUE["Gust"](), b"picture")["terminalsAndIcons/icon.png"] == b"picture"


@pytest.mark.parametrize("name", CATALOGUE)
def test_members_are_variables_of_the_component(name):
    known = {slot.name for slot in CATALOGUE[name]().slots.values()}
    for _, members in terminals(name).values():
        assert set(members.values()) <= known


CONNECTIONS = [
    ("PointMassTrain", "train", "ComfortCruise", "train"),
    ("PointMassTrain", "motion", "ComfortCruise", "ahead"),
    ("PointMassTrain", "motion", "TimeHeadwayCruise", "behind"),
    ("SubwayTrain", "motion", "FixedDistanceCruise", "leader"),
    ("SubwayTrain", "train", "Cailc", "train"),
    ("Timetable", "reference", "PidAto", "reference"),
    ("Consist", "train", "FaultTolerantCruise", "train"),
    ("Consist", "motion", "FaultTolerantCruise", "ahead"),
]


@pytest.mark.parametrize(("one", "plug", "other", "socket"), CONNECTIONS)
def test_ports_fit(one, plug, other, socket):
    """Of the same kind, with the same members, of which one is an output for each that is an input."""
    kind, members = terminals(one)[plug]
    other_kind, other_members = terminals(other)[socket]
    assert (kind, members.keys()) == (other_kind, other_members.keys())
    shown = [{slot.name for slot in CATALOGUE[name]().output_slots} for name in (one, other)]
    for member, variable in members.items():
        assert (variable in shown[0]) != (other_members[member] in shown[1])


def test_what_has_no_port_has_no_terminal():
    assert terminals("Gust") == {}
