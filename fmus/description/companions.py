"""What FMI 3.0 has beside the model description: terminals and the icon, and how the sources are compiled.

A terminal gathers the variables that one connection carries. Those of our ports fit each other by their kinds: the
terminal ``train`` of a train into that of its controller, its ``motion`` into ``ahead``, ``behind`` or ``leader``
of the controller of another, ``reference`` of a timetable into that of an ATO controller.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from lxml import etree

from ...components.ato.port import AtoController
from ...components.component import Component
from ...components.cruise.consist_port import ConsistCruise
from ...components.cruise.port import CruiseController
from ...components.supervision.timetable import TripTimetable
from ...components.trains.consist import Consist
from ...components.trains.port import Train
from ..annotation import TOOL
from .fmi2 import SOURCE

_VERSION = "3.0"


class _Terminal(NamedTuple):
    """Its name, what fits it, and the variables of its members."""

    name: str
    kind: str
    members: dict[str, str]


def _train(kind: str) -> _Terminal:
    return _Terminal("train", kind, {name: name for name in ("position", "speed", "force")})


def _neighbour(name: str, prefix: str, *members: str) -> _Terminal:
    return _Terminal(name, "motion", {member: f"{prefix}{member}" for member in members})


_PLACE = ("position", "speed")
_REFERENCE = _Terminal(
    "reference",
    "reference",
    {
        name: name
        for name in ("trip", "trip_time", *(f"reference_{what}" for what in (*_PLACE, "acceleration")), "speed_limit")
    },
)
_PORTS: dict[type[Component], tuple[_Terminal, ...]] = {
    Train: (_train("train"), _neighbour("motion", "", *_PLACE)),
    CruiseController: (
        _train("train"),
        *(_neighbour(who, f"{who}_", *_PLACE) for who in ("ahead", "behind", "leader")),
    ),
    AtoController: (_train("train"), _REFERENCE),
    TripTimetable: (_REFERENCE,),
    Consist: (_train("consist"), _neighbour("motion", "tail_", *_PLACE)),
    ConsistCruise: (_train("consist"), _neighbour("ahead", "ahead_", *_PLACE)),
}


def companions(component: Component, icon: bytes) -> dict[str, bytes]:
    """The files by their path in the FMU.

    Args:
        component: whose ports become terminals.
        icon: a PNG.
    """
    return {
        "terminalsAndIcons/terminalsAndIcons.xml": _terminals_and_icons(component),
        "terminalsAndIcons/icon.png": icon,
        "sources/buildDescription.xml": _build_description(component),
    }


def _terminals_and_icons(component: Component) -> bytes:
    root = etree.Element("fmiTerminalsAndIcons", fmiVersion=_VERSION)
    corners = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    picture = etree.SubElement(root, "GraphicalRepresentation")
    etree.SubElement(picture, "CoordinateSystem", **corners, suggestedScalingFactorTo_mm="0.1")
    etree.SubElement(picture, "Icon", **corners)
    found = [terminal for port, own in _PORTS.items() if isinstance(component, port) for terminal in own]
    block = etree.SubElement(root, "Terminals") if found else None
    for terminal in found:
        kind = f"{TOOL}.{terminal.kind}"
        entry = etree.SubElement(block, "Terminal", name=terminal.name, matchingRule="plug", terminalKind=kind)
        for member, variable in terminal.members.items():
            told = {"variableName": variable, "memberName": member, "variableKind": "signal"}
            etree.SubElement(entry, "TerminalMemberVariable", **told)
    return _written(root)


def _build_description(component: Component) -> bytes:
    root = etree.Element("fmiBuildDescription", fmiVersion=_VERSION)
    one = etree.SubElement(root, "BuildConfiguration", modelIdentifier=type(component).__name__)
    files = etree.SubElement(one, "SourceFileSet", language="C11")
    etree.SubElement(files, "SourceFile", name=SOURCE)
    return _written(root)


def _written(root: Any) -> bytes:
    text: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return text
