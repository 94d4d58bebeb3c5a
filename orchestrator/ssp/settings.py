"""Parameters and start values by their precedence: later wins at one level, a higher level wins over a lower one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import final

from ..fmi import Interface
from .network import Node, Path
from .structure import Element
from .values import Setting


@final
class Settings:
    """What is given to which connector or variable.

    Args:
        root: the system.
        interfaces: of the components that have a source, by path.

    Attributes:
        values: by connector or variable, those in force.
        notes: what is given to nothing.
    """

    def __init__(self, root: Element, interfaces: Mapping[Path, Interface]) -> None:
        self.values: dict[Node, Setting] = {}
        self.notes: list[str] = []
        self._interfaces = interfaces
        self._collect(root, ())

    def _collect(self, element: Element, path: Path) -> None:
        for name, inner in element.inner.items():
            self._collect(inner, (*path, name))
        for setting in element.settings:
            nodes = list(self._named(element, path, setting.name))
            if not nodes:
                self.notes.append(f"{setting.place}: {element.name} has no {setting.name!r}; the value is left out")
            self.values |= dict.fromkeys(nodes, setting)

    def _named(self, element: Element, path: Path, name: str) -> Iterator[Node]:
        """All that a name means, which may be several things: names may hold dots."""
        interface = self._interfaces.get(path)
        if interface is not None:
            if interface.scalars(interface.start_name(name)) is not None:
                yield Node(path, name)
            return
        if name in element.connectors:
            yield Node(path, name)
        for inner, child in element.inner.items():
            if name.startswith(f"{inner}."):
                yield from self._named(child, (*path, inner), name[len(inner) + 1 :])
