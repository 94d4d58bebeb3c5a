"""A model description as XML, read in parts: one of a million variables is never in memory as a whole.

What there may be very many of (variables, and what the model structure lists) is handed on in parts and taken out of
the tree. What stays is a small document with everything else, and with the last of each kind, so that the schema says
of it what it would say of the whole.
"""

from __future__ import annotations

import codecs
from collections.abc import Callable, Iterator
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import fmpy
from lxml import etree

from .. import world
from ..errors import FmuFileError

PART = 5_000
"""How many elements a section may have before they are handed on."""
_PIECE = 1 << 21
"""Bytes that are parsed at a time."""
_SECTIONS = ("Outputs", "Derivatives", "InitialUnknowns")
"""Of the model structure of FMI 2.0; that of 3.0 lists everything itself."""
_HEADS = {
    "1.0": '<fmiModelDescription fmiVersion="1.0" modelName="m" modelIdentifier="m" guid="g" '
    'numberOfContinuousStates="0" numberOfEventIndicators="0">',
    "2.0": '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/>',
    "3.0": '<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">'
    '<CoSimulation modelIdentifier="m"/>',
}
_ONE = {
    "2.0": '<ScalarVariable name="v" valueReference="0"><Real/></ScalarVariable>',
    "3.0": '<Float64 name="v" valueReference="0"/>',
}
"""The smallest documents by version that a schema has nothing against, for a part of another to be put into."""

Take = Callable[[Any, str, list[Any]], object]
"""Given the root as far as it has been read, the path of a section, and the first of its elements, which then go."""


def parse(path: Path, name: str, take: Take) -> tuple[Any, list[str]]:
    """The root element without what was handed on, and what had to be overlooked to read it.

    Args:
        path: the file.
        name: the FMU as the user knows it, for messages.
        take: given the elements of long sections.

    Raises:
        FmuFileError: it is no XML, or declares entities.
    """
    try:
        with world.open(path, "rb") as stream:
            return _parse(stream, name, take), []
    except (etree.XMLSyntaxError, OSError) as error:  # the latter where bytes do not fit the encoding
        readable, encoding, overlooked = _readable(world.read_bytes(path))
        if overlooked:
            try:
                return _parse(BytesIO(readable), name, take, encoding), overlooked
            except (etree.XMLSyntaxError, OSError, LookupError):
                pass
        what = getattr(error, "msg", None) or "it has bytes that do not fit its encoding"
        raise FmuFileError(f"{name}: its modelDescription.xml is not XML: {what}") from error


def _parse(stream: IO[bytes], name: str, take: Take, encoding: str | None = None) -> Any:
    parser = etree.XMLPullParser(
        ("start",), tag="fmiModelDescription", resolve_entities=False, no_network=True, encoding=encoding
    )
    root = None
    while piece := stream.read(_PIECE):
        parser.feed(piece)
        if root is None:
            root = next((element for _, element in parser.read_events()), None)
            _refuse_entities(root, name)
        if root is not None:
            for section, parent in sections(root):
                if len(parent) > PART:
                    elements = parent[:-1]  # the last may not have been read to its end
                    take(root, section, [element for element in elements if isinstance(element.tag, str)])
                    del parent[:-1]  # comments, and what was left out
    root = parser.close()
    _refuse_entities(root, name)
    return root


def _refuse_entities(root: Any, name: str) -> None:
    # Asked of the parser, not searched for in the bytes: they may be in any encoding.
    if root is not None and root.getroottree().docinfo.internalDTD is not None:
        raise FmuFileError(f"{name} is refused: its modelDescription.xml has a DOCTYPE, which may declare XML entities")


def sections(root: Any) -> Iterator[tuple[str, Any]]:
    """What there may be very many of, by path."""
    paths = ("ModelVariables", "ModelStructure", *(f"ModelStructure/{section}" for section in _SECTIONS))
    for path in paths:
        parent = root.find(path)
        if parent is not None:
            yield path, parent


def _readable(content: bytes) -> tuple[bytes, str | None, list[str]]:
    """What is XML but for blanks at its beginning or letters of Windows' in what calls itself UTF-8, and why."""
    overlooked = []
    begun = content.removeprefix(codecs.BOM_UTF8).lstrip()
    if begun != content.removeprefix(codecs.BOM_UTF8):
        overlooked.append("it begins with blanks, which XML does not allow")
    try:
        begun.decode()
        encoding = None
    except UnicodeDecodeError:
        encoding = "windows-1252"
        overlooked.append("its letters are not those of the encoding it names; they are read as Windows-1252")
    return begun, encoding, [] if b"\0" in content[:4] else overlooked


class Schema:
    """What the schema of a version of FMI has against a document that is read in parts.

    Args:
        version: of the standard.
    """

    def __init__(self, version: str) -> None:
        self._version = version
        self._schema = _schema(version)
        self._found: list[tuple[int, str]] = []

    def check(self, tree: Any) -> None:
        """Note what it has against a whole document."""
        if not self._schema.validate(tree):
            told = ((e.line, f"{e.level_name} (line {e.line}, column {e.column}): {e.message}") for e in _log(self))
            self._found += told

    def check_part(self, section: str, elements: list[Any]) -> None:
        """Note what it has against elements of a section, which are taken from where they are."""
        root = etree.fromstring(f"{_HEADS[self._version]}<ModelVariables/></fmiModelDescription>")
        variables = root.find("ModelVariables")
        parent = variables
        if section != "ModelVariables":
            variables.append(etree.fromstring(_ONE[self._version]))
        for tag in section.split("/") if section != "ModelVariables" else ():
            parent = etree.SubElement(root if parent is variables else parent, tag)
        if section == "ModelVariables" and self._version != "1.0":
            etree.SubElement(root, "ModelStructure")
        parent.extend(elements)
        self.check(root)

    @property
    def problems(self) -> list[str]:
        """A sentence each, in the order of the file."""
        return [text for _, text in sorted(self._found, key=lambda found: found[0])]


def _log(schema: Schema) -> Any:
    return schema._schema.error_log


@cache
def _schema(version: str) -> Any:
    place = Path(fmpy.__file__).parent / "schema"
    number = version[0]
    prefix = "fmi" if number == "1" else f"fmi{number}"
    return etree.XMLSchema(file=str(place / f"fmi{number}" / f"{prefix}ModelDescription.xsd"))
