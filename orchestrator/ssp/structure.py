"""The tree of elements that a system structure describes, with what other archives it names put in place."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

from ..errors import ScenarioError
from ..fmi import Unit
from ..problems import Problem
from .documents import OWN, Document, annotated, children, first, local
from .package import DEFAULT, Package
from .values import Setting, Transformation, is_suppressed, read_bindings, read_transformation

MAX_DEPTH = 50
"""How deep elements may stand in each other, over all archives."""
MAX_ELEMENTS = 10_000
_FMU, _SSD, _SSP = "application/x-fmu-sharedlibrary", "application/x-ssp-definition", "application/x-ssp-package"


@dataclass(frozen=True)
class Connector:
    """What an element shows: its kind is that of the standard, such as ``"input"``."""

    name: str
    kind: str
    unit: Unit | None = None


@dataclass(frozen=True)
class Connection:
    """Two connectors, each as element (None: the system itself) and name; which is the source follows from kinds.

    Attributes:
        suppressed: whether units are not converted. transformation: of the value.
        delay, threshold: as `system.Connection` has them, by our own annotation.
    """

    start: tuple[str | None, str]
    end: tuple[str | None, str]
    suppressed: bool
    transformation: Transformation | None
    place: str
    delay: int = 0
    threshold: float | None = None


@dataclass
class Element:
    """A system or a component.

    Attributes:
        connectors: by name. settings: in the order in which they apply.
        fmu: the file of a component; None for a system, and for a component that has no source.
        dictionary: the signal dictionary that it refers to, by name.
        inner, connections, dictionaries: of a system.
        document, node: where it was read.
    """

    name: str
    place: str
    document: Document = field(repr=False)
    node: Any = field(repr=False)
    connectors: dict[str, Connector] = field(default_factory=dict)
    settings: list[Setting] = field(default_factory=list)
    fmu: Path | None = None
    dictionary: str | None = None
    inner: dict[str, Element] = field(default_factory=dict)
    connections: list[Connection] = field(default_factory=list)
    dictionaries: set[str] = field(default_factory=set)


@final
class StructureReader:
    """Reads system structures, and collects what is wrong with them.

    Attributes:
        notes: what a user should know. problems: what makes the whole useless.
    """

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.problems: list[Problem] = []
        self._under_way: list[tuple[Path, str]] = []
        self._depth = 0
        self._count = 0

    def top(self, package: Package, path: str) -> tuple[Document, Element]:
        """One document, and the system in it.

        Raises:
            ScenarioError: it cannot be read at all.
        """
        document = Document.read(package, path, "SystemStructureDescription", self.notes)
        system = first(document.root, "System")
        if system is None:
            raise ScenarioError(Problem(document.place(document.root), "it has no System"))
        return document, self._guarded(document, path, system)

    def _guarded(self, document: Document, fragment: str, node: Any) -> Element:
        """A system of a document, unless it is being read already."""
        key = document.package.path, f"{document.path}#{fragment}"
        if key in self._under_way:
            raise ScenarioError(Problem(document.place(node), "it is refused: it includes itself"))
        self._under_way.append(key)
        try:
            return self._system(document, node)
        finally:
            self._under_way.pop()

    def _system(self, document: Document, node: Any) -> Element:
        system = self._element(document, node)
        if self._depth >= MAX_DEPTH:
            raise ScenarioError(Problem(system.place, f"it is refused: elements stand {MAX_DEPTH} deep in each other"))
        self._depth += 1
        for child in filter(local, next(children(node, "Elements"), ())):
            try:
                element = self._child(document, child)
            except ScenarioError as error:
                self.problems += error.problems
                continue
            if element.name in system.inner:
                what = f"there are two elements {element.name!r}; the other is at {system.inner[element.name].place}"
                self.problems.append(Problem(element.place, what))
            system.inner[element.name] = element
        self._depth -= 1
        for child in children(node, "Connections", "Connection"):
            try:
                system.connections.append(self._connection(document, child))
            except ScenarioError as error:
                self.problems += error.problems
        system.dictionaries = {
            child.get("name", "") for child in children(node, "SignalDictionaries", "SignalDictionary")
        }
        self._settings(system, None)
        return system

    def _child(self, document: Document, node: Any) -> Element:
        self._count += 1
        if self._count > MAX_ELEMENTS:
            raise ScenarioError(Problem(document.place(node), f"it is refused: it has over {MAX_ELEMENTS} elements"))
        if local(node) == "System":
            return self._system(document, node)
        if local(node) == "SignalDictionaryReference":
            element = self._element(document, node)
            element.dictionary = node.get("dictionary", "")
            return element
        return self._component(document, node)

    def _component(self, document: Document, node: Any) -> Element:
        uri = node.get("source")
        if uri is None:
            document.note(node, f"component {node.get('name')!r} has no source: nothing comes from it")
            return self._element(document, node)
        place = document.place(node)
        how = node.get("implementation", "any")
        if how not in ("any", "CoSimulation"):
            what = f"component {node.get('name')!r} is to be run by {how}, and only co-simulation is"
            raise ScenarioError(Problem(place, what, "take an FMU for co-simulation"))
        if uri.startswith("#"):
            return self._reference(document, node, uri[1:])
        path, fragment = document.package.resolve(uri, document.path, place)
        kind = node.get("type") or {".ssd": _SSD, ".ssp": _SSP}.get(Path(path).suffix.lower(), _FMU)
        if kind in (_SSD, _SSP):
            package = document.package if kind == _SSD else document.package.inner(path)
            _, top = self.top(package, path if kind == _SSD else fragment or DEFAULT)
            return self._placed(document, node, top, path)
        if kind != _FMU:
            what = f"component {node.get('name')!r} is of type {kind!r}, which is not supported"
            raise ScenarioError(Problem(place, what))
        element = self._element(document, node)
        element.fmu = document.package.extract(path)
        self._settings(element, path)
        return element

    def _reference(self, document: Document, node: Any, name: str) -> Element:
        """A system of the same document once more (SSP 2.0)."""
        found = next((one for one in document.root.iter("{*}System") if one.get("id") == name), None)
        if found is None:
            raise ScenarioError(Problem(document.place(node), f"there is no system with the id {name!r}"))
        return self._placed(document, node, self._guarded(document, name, found), None)

    def _placed(self, document: Document, node: Any, top: Element, source: str | None) -> Element:
        """A system in place of the component that names it: its own parameters come last, and so win."""
        outside = self._element(document, node)
        self._settings(outside, source)
        top.name, top.place = outside.name, outside.place
        top.settings = [*top.settings, *outside.settings]
        return top

    def _element(self, document: Document, node: Any) -> Element:
        element = Element(node.get("name", ""), document.place(node), document, node)
        for child in children(node, "Connectors", "Connector"):
            name, kind = child.get("name", ""), child.get("kind", "unspecified")
            unit = next((document.unit(one) for one in child if local(one) in ("Real", "Float64", "Float32")), None)
            if name in element.connectors:
                document.note(child, f"{element.name} has two connectors {name!r}; the last counts")
            element.connectors[name] = Connector(name, kind, unit)
        return element

    def _settings(self, element: Element, source: str | None) -> None:
        try:
            element.settings = read_bindings(element.document, element.node, source)
        except ScenarioError as error:
            self.problems += error.problems

    def _connection(self, document: Document, node: Any) -> Connection:
        if node.get("startIndices") or node.get("endIndices"):
            raise ScenarioError(Problem(document.place(node), "it connects parts of arrays, which is not supported"))
        # OMSimulator writes an empty name where the standard leaves the attribute out: the system itself.
        start = node.get("startElement") or None, node.get("startConnector", "")
        end = node.get("endElement") or None, node.get("endConnector", "")
        transformation = read_transformation(document, node)
        delay, threshold = 0, None
        for own in annotated(node, OWN, "Connection"):
            delay = document.whole(own, "delay")
            threshold = None if own.get("threshold") is None else document.number(own, "threshold")
        suppressed, place = is_suppressed(node), document.place(node)
        return Connection(start, end, suppressed, transformation, place, delay, threshold)
