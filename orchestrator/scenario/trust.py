"""Python code that a scenario names: importing it executes it, so that is told, and what is elsewhere refused."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...fmus.references import Imports, file_and_class, imports_of
from ..names import SignalName
from ..problems import Problem
from ..system import Instance, System


@dataclass(frozen=True)
class NamedCode:
    """A component file that a scenario names, not an option.

    Attributes:
        model: as instances have it. group: the first of those that are made of it. origin: where that stands.
        imports: what is executed with it.
    """

    model: str
    group: str
    origin: str
    imports: Imports

    @property
    def path(self) -> str:
        """The file, as it is named."""
        return file_and_class(self.model)[0]

    def outside(self, folder: Path) -> list[str]:
        """What of it is not in a folder, a part of a sentence each."""
        here = folder.resolve()
        files = [str(file) for file in self.imports.files if not file.is_relative_to(here)]
        return [*files, *(f"{name} (imported by {file})" for name, file in self.imports.others.items())]


def named_code(system: System) -> list[NamedCode]:
    """The component files that the scenario of a system names by itself, once each; of a system of Python none."""
    if not system.provenance.path:
        return []
    first: dict[str, Instance] = {}
    for instance in system.instances.values():
        if file_and_class(instance.model)[0] and instance.model not in system.provenance.named:
            first.setdefault(instance.model, instance)
    return [
        NamedCode(model, SignalName(one.name).group, one.origin, imports_of(Path(file_and_class(model)[0])))
        for model, one in first.items()
    ]


def untrusted_code(system: System) -> list[Problem]:
    """What looking at a scenario would execute, although it stands neither in its folder nor on the command line."""
    folder = _folder(system)
    outside = [(code, code.outside(folder)) for code in named_code(system)]
    remedy = "read it; --trust imports it"
    return [
        Problem(
            code.origin,
            f"instance '{code.group}' names Python code, and importing it would execute what is outside of the "
            f"scenario's folder {folder}: {', '.join(what)}",
            remedy,
        )
        for code, what in outside
        if what
    ]


def import_notes(system: System) -> Iterator[str]:
    """What of the scenario's own naming is imported, a note each."""
    folder = _folder(system)
    for code in named_code(system):
        what = code.outside(folder)
        more = f", which executes what is outside of the scenario's folder: {', '.join(what)}" if what else ""
        yield f"the scenario names Python code for {code.group}, which check and run import: {code.path}{more}"


def _folder(system: System) -> Path:
    return Path(os.path.abspath(system.provenance.path)).parent
