"""SSP -> `System`."""

from __future__ import annotations

import keyword
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import final

from ...fmus.build import cache_folder
from ..digests import digest_of
from ..errors import FmuFileError, ScenarioError
from ..fmi import Interface, Workspace, load_fmu
from ..names import SignalName
from ..problems import Problem
from ..system import Connection, Instance, System
from ..wiring import convert
from .actions import Actions
from .annotations import own_names, read_stepping, scenario_of, set_options, step_of
from .documents import Document
from .network import Hop, Network, Node, Path, own_unit
from .package import DEFAULT, Package
from .settings import Settings
from .structure import Element, StructureReader
from .transport import Way

_CLOSE = 1e-12


def is_ssp_name(text: str) -> bool:
    """Whether a name is that of an SSP or of a bare SSD, perhaps with a variant after a ``#``."""
    return text.partition("#")[0].lower().endswith((".ssp", ".ssd"))


def read_system(name: str, folder: FilePath | None = None) -> System:
    """The system that an SSP describes: nested systems made flat, FMUs unpacked.

    Args:
        name: of the file; a variant follows after a ``#``, by its file or by its name.
        folder: where FMUs are unpacked; in the user's cache directory by default.

    Raises:
        ScenarioError: with everything that is wrong with it.
    """
    file, _, variant = name.partition("#")
    path = FilePath(file)
    if not path.is_file():
        raise ScenarioError(Problem("", f"there is no file '{file}'"))
    package = Package(path, file, folder or cache_folder().with_name("ssp") / digest_of(path)[:32])
    reader = StructureReader()
    chosen = _variant(package, variant)
    document, root = reader.top(package, chosen)
    with Workspace() as workspace:
        interfaces = dict(_interfaces(root, (), workspace, reader.problems, {}))
    network, settings = Network(root, interfaces), Settings(root, interfaces)
    problems = reader.problems + network.problems
    system = System(title=document.root.get("name", ""), description=root.node.get("description", ""))
    try:
        system.stepping = read_stepping(document, root, interfaces)
    except ScenarioError as error:
        problems += error.problems
    flat = _Flat(root, interfaces, network, settings, system)
    actions = Actions(document, interfaces, flat.names, {one.target for one in system.connections})
    system.events = actions.events
    problems += flat.problems + actions.problems
    if not system.instances:
        problems.append(Problem(root.place, "it has no component with a source: there is nothing to run"))
    if problems:
        raise ScenarioError(list(dict.fromkeys(problems)))
    came = system.provenance
    name = path.stem if chosen in (DEFAULT, path.name) else f"{path.stem}-{_stem(chosen)}"
    came.name, came.path = name.encode(errors="replace").decode(), file
    came.text, came.origins["scenario"] = scenario_of(document)
    came.notes = tuple(dict.fromkeys([*reader.notes, *network.notes, *settings.notes, *flat.notes, *actions.notes]))
    return system


def _variant(package: Package, wanted: str) -> str:
    """The file of a variant, which is called by its file or by the name in it."""
    roots = package.roots
    if not wanted:
        if not package.is_archive or DEFAULT in roots:
            return roots[0]
        what = f"it is no SSP: there is no {DEFAULT} at its top" + " but others" * bool(roots)
        choose = f"choose a variant by --variant: {_listed(_titles(package))}" if roots else ""
        raise ScenarioError(Problem(package.label, what, choose))
    for root in roots:
        if wanted in (root, FilePath(root).stem):
            return root
    titles = _titles(package)
    for root, title in titles.items():
        if wanted == title:
            return root
    what = f"there is no variant {wanted!r}"
    raise ScenarioError(Problem(package.label, what, f"there are {_listed(titles)}"))


def _titles(package: Package) -> dict[str, str]:
    """The name that stands in each system structure at the top; empty where it cannot be read."""
    return {root: _title(package, root) for root in package.roots}


def _title(package: Package, root: str) -> str:
    try:
        document = Document.read(package, root, "SystemStructureDescription", [])
    except ScenarioError:  # of another variant than the one that is wanted
        return ""
    return str(document.root.get("name", ""))


def _listed(titles: Mapping[str, str]) -> str:
    """Variants as ``--variant`` takes them, with their names where these say more."""
    return ", ".join(_stem(root) + f" ({title})" * (title not in ("", _stem(root))) for root, title in titles.items())


def _stem(root: str) -> str:
    return FilePath(root).stem


def _interfaces(
    element: Element,
    path: Path,
    workspace: Workspace,
    problems: list[Problem],
    read: dict[FilePath, Interface],
) -> Iterator[tuple[Path, Interface]]:
    """What the FMUs show, by the path of their component."""
    if element.fmu is not None:
        try:
            if element.fmu not in read:
                read[element.fmu] = load_fmu(element.fmu, workspace).interface
            yield path, read[element.fmu]
        except FmuFileError as error:
            problems.append(Problem(element.place, str(error)))
    for name, inner in element.inner.items():
        yield from _interfaces(inner, (*path, name), workspace, problems, read)


def _elements(element: Element, path: Path) -> Iterator[tuple[Path, Element]]:
    yield path, element
    for name, inner in element.inner.items():
        yield from _elements(inner, (*path, name))


@final
class _Flat:
    """Instances, start values and connections of a system without nesting, put into a `System`.

    Attributes:
        names: of instances, by the path of their component.
        problems: what makes it useless. notes: what a user should know.
    """

    def __init__(
        self,
        root: Element,
        interfaces: Mapping[Path, Interface],
        network: Network,
        settings: Settings,
        system: System,
    ) -> None:
        self.problems: list[Problem] = []
        self.notes: list[str] = []
        self._interfaces, self._network, self._settings, self._system = interfaces, network, settings, system
        own = own_names({path: one for path, one in _elements(root, ()) if path in interfaces})
        self.names = _instance_names(interfaces, own)
        changed = [
            f"{'.'.join(path)} is {name}" for path, name in self.names.items() if path != (name,) and path not in own
        ]
        if changed:
            more = f", and {len(changed) - 8} more" if len(changed) > 8 else ""
            self.notes.append(f"names of instances: {', '.join(changed[:8])}{more}")
        self._add(root, ())
        used = set[Node]()
        for node in settings.values:
            self._try(self._start, node)
        for node in network.targets():
            self._try(self._target, node, used)
        for node, setting in settings.values.items():
            if node.path not in interfaces and node not in used:
                self.notes.append(f"{setting.place}: {node} gives its value to nothing, or gets it from elsewhere")

    def _try(self, act: object, *arguments: object) -> None:
        try:
            act(*arguments)  # type: ignore[operator]
        except ScenarioError as error:
            self.problems += error.problems

    def _add(self, element: Element, path: Path) -> None:
        if path in self._interfaces:
            name = self.names[path]
            instance = Instance(name, os.fspath(element.fmu or ""), origin=element.place)
            self._system.instances[name] = instance
            self._try(self._rate, instance, element)
            self._try(set_options, instance, element)
        for name, inner in element.inner.items():
            self._add(inner, (*path, name))

    def _rate(self, instance: Instance, element: Element) -> None:
        """A step of an instance's own, where a multiple of the system's."""
        hint, step = step_of(element), self._system.stepping.step
        if hint is None or abs(hint - step) <= 1e-9 * step:
            return
        if hint > step and abs(hint / step - round(hint / step)) <= 1e-9:
            instance.step = hint
        else:
            self.notes.append(f"{element.place}: its step {hint:g} s is no multiple of {step:g} s, and is left out")

    def _start(self, node: Node) -> None:
        """A value that is given to a variable of an FMU by its name."""
        interface, setting = self._interfaces.get(node.path), self._settings.values[node]
        if interface is None:
            return
        scalars = interface.scalars(interface.start_name(node.name)) or ()
        if not all(interface.variables[one].settable for one in scalars):
            self.notes.append(f"{setting.place}: {node} cannot be set before a run; the value is left out")
            return
        self._set(node, Way(setting.unit), node, (), setting.place)

    def _target(self, target: Node, used: set[Node]) -> None:
        source, hops = self._network.trace(target)
        if source.path in self._interfaces:
            self._connect(source, target, hops)
        elif source in self._settings.values:
            used.add(source)
            self._set(source, Way(self._settings.values[source].unit), target, hops, hops[-1].place)

    def _set(self, given: Node, way: Way, target: Node, hops: list[Hop] | tuple[()], place: str) -> None:
        """Let a start value be what a setting becomes on the way to a variable."""
        setting, network = self._settings.values[given], self._network
        way = way.to(network.unit(given), setting.suppressed, setting.transformation, setting.place)
        for hop in hops:
            way = way.to(network.unit(hop.target), hop.suppressed, hop.transformation, hop.place)
        name = self.names[target.path]
        self._system.instances[name].start[target.name] = way.apply(setting.value, setting.place)
        self._system.provenance.origins[f"{name}.{target.name}"] = setting.place if not hops else place

    def _connect(self, source: Node, target: Node, hops: list[Hop]) -> None:
        place = hops[-1].place
        taker = self._interfaces[target.path]
        scalars = taker.scalars(target.name)
        if scalars and taker.variables[scalars[0]].causality != "input":
            what = f"{target} is a {taker.variables[scalars[0]].causality}, and would follow {source}"
            raise ScenarioError(Problem(place, what, "what is calculated is only handed on to inputs"))
        way, plain = Way(self._network.unit(source)), Way()
        for hop in hops:
            way = way.to(self._network.unit(hop.target), hop.suppressed, hop.transformation, hop.place)
            plain = plain.to(None, False, hop.transformation, hop.place)
        ends = [f"{self.names[node.path]}.{node.name}" for node in (source, target)]
        made = Connection(ends[0], ends[1], sum(hop.delay for hop in hops), origin=place)
        made.threshold = next((hop.threshold for hop in hops if hop.threshold is not None), None)
        if way.entries is not None:
            made.map = dict(way.entries)
        elif self._is_own(source, target, way, plain):
            made.scale, made.offset = None if plain.scale == 1.0 else plain.scale, plain.offset
        else:
            made.convert, made.offset = False, way.offset
            made.scale = None if way.scale == 1.0 else way.scale
        self._system.connections.append(made)

    def _is_own(self, source: Node, target: Node, way: Way, plain: Way) -> bool:
        """Whether the units that the FMUs declare themselves lead to the same."""
        a, b = (own_unit(self._interfaces[node.path], node.name) for node in (source, target))
        scale, offset = 1.0, 0.0
        if a is not None and b is not None and a.name != b.name:
            if a.exponents is None or b.exponents is None or a.exponents != b.exponents:
                return not way.suppressed
            scale, offset = convert(a, b)
        close = (
            abs(plain.scale * scale - way.scale) <= _CLOSE * abs(way.scale),
            abs(plain.scale * offset + plain.offset - way.offset) <= _CLOSE * max(1.0, abs(way.offset)),
        )
        return all(close)


def _instance_names(paths: Mapping[Path, object], own: Mapping[Path, str]) -> dict[Path, str]:
    """A name for each component that a scenario can write, the same for the same archive; those of ours stay."""
    names = dict(own)
    groups = {SignalName(name).group for name in own.values()}
    for path in paths:
        if path in own:
            continue
        text = re.sub(r"\W", "_", "_".join(path), flags=re.ASCII)
        text = text if re.match(r"[A-Za-z_]", text) and not keyword.iskeyword(text) else f"_{text}"
        taken, number = groups.union(names.values()), 2
        name = text
        while name in taken:
            name, number = f"{text}_{number}", number + 1
        names[path] = name
    return names
