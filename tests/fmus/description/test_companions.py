"""Terminals, icons and the description of the build: against the schemas, the ports, and one another."""

from pathlib import Path

import fmpy
import pytest
from lxml import etree
from railcosim.components import CATALOGUE
from railcosim.fmus.description import companions, write

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
    for name in CATALOGUE:
        check.assertValid(etree.fromstring(companions(CATALOGUE[name](), b"")[path]))


def test_the_sources_are_one_translation_unit():
    root = etree.fromstring(companions(CATALOGUE["Gust"](), b"")["sources/buildDescription.xml"])
    assert root.find("BuildConfiguration").get("modelIdentifier") == "Gust"
    assert [file.get("name") for file in root.iter("SourceFile")] == ["all.c"]


def test_the_icon_is_there():
    assert companions(CATALOGUE["Gust"](), b"picture")["terminalsAndIcons/icon.png"] == b"picture"


@pytest.mark.parametrize("name", [name for name in CATALOGUE if terminals(name)])
def test_members_are_variables_of_the_description_as_the_standard_has_them(name):
    """FMI 3.0, 2.4.9: names are told apart, a plug names its members, and a signal is an input or an output."""
    component = CATALOGUE[name]()
    described = etree.fromstring(write(component, "native", "0123456789abcdef" * 4, fmi="3"))
    causalities = {v.get("name"): v.get("causality") for v in described.find("ModelVariables")}
    root = etree.fromstring(companions(component, b"")[TERMINALS])
    found = root.findall("Terminals/Terminal")
    assert root.get("fmiVersion") == "3.0"
    assert len({terminal.get("name") for terminal in found}) == len(found)
    for terminal in found:
        assert terminal.get("matchingRule") == "plug"
        assert len({member.get("memberName") for member in terminal}) == len(terminal) > 0
        assert {member.get("variableKind") for member in terminal} == {"signal"}
        assert {causalities[member.get("variableName")] for member in terminal} <= {"input", "output"}


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


def form(name, variable):
    """Type, unit and shape of a variable."""
    slot = CATALOGUE[name]().slots[variable]
    return slot.type, slot.unit, slot.shape


@pytest.mark.parametrize(("one", "plug", "other", "socket"), CONNECTIONS)
def test_ports_fit(one, plug, other, socket):
    """Of the same kind, with the same members, of which one is an output for each that is an input."""
    kind, members = terminals(one)[plug]
    other_kind, other_members = terminals(other)[socket]
    assert (kind, members.keys()) == (other_kind, other_members.keys())
    assert [form(one, members[member]) for member in members] == [
        form(other, other_members[member]) for member in members
    ]
    shown = [{slot.name for slot in CATALOGUE[name]().output_slots} for name in (one, other)]
    for member, variable in members.items():
        assert (variable in shown[0]) != (other_members[member] in shown[1])


def test_what_has_no_port_has_no_terminal():
    assert terminals("Gust") == {}
