"""The XML documents of an SSP: read without entities, and told where they are not as their schema says."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, final

import fmpy
from lxml import etree

from ..errors import ScenarioError
from ..fmi import Unit
from ..problems import Problem
from .package import Package

_SCHEMAS = {
    "SystemStructureDescription": "SystemStructureDescription",
    "ParameterSet": "SystemStructureParameterValues",
    "ParameterMapping": "SystemStructureParameterMapping",
    "SignalDictionary": "SystemStructureSignalDictionary",
}
_BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_MOST_TOLD = 3
OWN = "railcosim"
"""The type of our annotations."""


@final
class Document:
    """One document of a package, or a part of one that is a document of its own.

    Attributes:
        package, path: where it stands. root: its root element. notes: what is wrong with it though it can be read.
    """

    def __init__(self, package: Package, path: str, root: Any, notes: list[str]) -> None:
        self.package, self.path, self.root, self.notes = package, path, root, notes
        self.units = {unit.name: unit for unit in _units(root)}

    @classmethod
    def read(cls, package: Package, path: str, kind: str, notes: list[str]) -> Document:
        """Parse and check one.

        Args:
            package: that it stands in.
            path: in there.
            kind: the name of its root element.
            notes: where to say what is wrong with it.

        Raises:
            ScenarioError: it is no XML, declares entities, or is something else.
        """
        place = f"{package.label}/{path}" if package.is_archive else f"{package.label}"
        parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, encoding="utf-8")
        try:
            root = etree.fromstring(package.read(path), parser)
        except (etree.XMLSyntaxError, ValueError) as error:
            raise ScenarioError(Problem(place, f"it is not XML in UTF-8: {error}")) from error
        if root.getroottree().docinfo.internalDTD is not None:
            raise ScenarioError(Problem(place, "it is refused: it has a DOCTYPE, which may declare XML entities"))
        made = cls(package, path, root, notes)
        made._check(kind)
        return made

    def part(self, element: Any, kind: str) -> Document:
        """A document that stands in this one.

        Raises:
            ScenarioError: it is something else.
        """
        made = Document(self.package, self.path, element, self.notes)
        made._check(kind)
        return made

    def _check(self, kind: str) -> None:
        if local(self.root) != kind:
            raise ScenarioError(Problem(self.place(self.root), f"it is a {local(self.root)}, not a {kind}"))
        version = self.root.get("version", "")
        schema = _schema(schema_folder(version), _SCHEMAS[kind])
        if schema is None:
            get = ": pip install 'railcosim[ssp]'" if version.startswith("2.") else ""
            self.note(self.root, f"no schema for version {version!r} is at hand; it is read without one{get}")
            return
        if schema.validate(self.root):
            return
        found = list(schema.error_log)
        for error in found[:_MOST_TOLD]:
            self.notes.append(f"{self.name}:{error.line}: against the schema: {error.message}")
        if len(found) > _MOST_TOLD:
            self.note(self.root, f"{len(found) - _MOST_TOLD} more places are against the schema")

    @property
    def name(self) -> str:
        """How messages call it."""
        label = self.package.label
        return f"{label}/{self.path}" if self.package.is_archive else f"{Path(label).parent / self.path}"

    def place(self, element: Any) -> str:
        """Where an element stands."""
        return f"{self.name}:{element.sourceline}"

    def note(self, element: Any, text: str) -> None:
        """Say what a user should know of an element."""
        self.notes.append(f"{self.place(element)}: {text}")

    def number(self, element: Any, attribute: str, default: float | None = None) -> float:
        """A number in an attribute.

        Raises:
            ScenarioError: it is none.
        """
        text = element.get(attribute)
        if text is None and default is not None:
            return default
        try:
            return float(text)
        except (TypeError, ValueError):
            what = f"{attribute} of {local(element)} is {text!r}, not a number"
            raise ScenarioError(Problem(self.place(element), what)) from None

    def whole(self, element: Any, attribute: str) -> int:
        """A whole number in an attribute; 0 where it is not given.

        Raises:
            ScenarioError: it is none.
        """
        text = element.get(attribute, "0")
        try:
            return int(text)
        except ValueError:
            what = f"{attribute} of {local(element)} is {text!r}, not a whole number"
            raise ScenarioError(Problem(self.place(element), what)) from None

    def unit(self, element: Any) -> Unit | None:
        """The unit that an element names; one that is not defined has no exponents."""
        name = element.get("unit")
        return None if name is None else self.units.get(name, Unit(name, None))


def local(element: Any) -> str:
    """The name of an element without its namespace; empty for a comment."""
    return str(etree.QName(element).localname) if isinstance(element.tag, str) else ""


def children(element: Any, *path: str) -> Iterator[Any]:
    """The elements at a path below one, whatever their namespaces: drafts and tools differ in them."""
    yield from element.iterfind("/".join(f"{{*}}{name}" for name in path))


def first(element: Any, *path: str) -> Any | None:
    """The first of those."""
    return next(children(element, *path), None)


def annotated(element: Any, kind: str, name: str) -> Iterator[Any]:
    """The elements of a name in the annotations of a kind that an element has, however deep."""
    for annotation in children(element, "Annotations", "Annotation"):
        if annotation.get("type") == kind:
            yield from annotation.iter(f"{{*}}{name}")


def only_child(element: Any) -> Any | None:
    """What stands in an element beside comments."""
    return next((one for one in element if local(one)), None)


def _units(root: Any) -> Iterator[Unit]:
    for element in children(root, "Units", "Unit"):
        base: Any = first(element, "BaseUnit")
        try:
            exponents = tuple(int(base.get(name, "0")) for name in _BASE)
            factor, offset = float(base.get("factor", "1")), float(base.get("offset", "0"))
            yield Unit(element.get("name", ""), exponents, factor, offset)
        except (AttributeError, ValueError):  # the schema says so; values then pass as they are
            yield Unit(element.get("name", ""), None)


def schema_folder(version: str) -> Path | None:
    """Where the schemas of a version are, if they are installed: FMPy has those of 1, pyssp-standard those of 2."""
    major = version.partition(".")[0]
    if major == "1":
        return Path(fmpy.__file__).parent / "ssp" / "schema"
    found = find_spec("pyssp_standard") if major == "2" else None
    return None if found is None or found.origin is None else Path(found.origin).parent / "resources" / "ssp2"


@cache
def _schema(folder: Path | None, name: str) -> Any | None:
    path = None if folder is None else folder / f"{name}.xsd"
    return etree.XMLSchema(file=str(path)) if path is not None and path.is_file() else None
