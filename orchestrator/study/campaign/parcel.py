"""What a worker needs to run a study, wherever it is: the scenario, the files it names, and FMUs of its components."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from railcosim import models

from ....fmus.references import file_and_class, imports_of, names_data
from ... import world
from ...digests import digest_of
from ...errors import ScenarioError, naming
from ...fmi import is_fmu_name, packaged
from ...scenario import parse_value
from ...ssp import is_ssp_name
from ...system import System

MODELS = os.path.dirname(os.path.abspath(models.__file__ or ""))
"""Where the scenarios and data are that every installation has."""


def this_machine() -> str:
    """Whom compiled FMUs of this process are for."""
    return f"{platform.system()} {platform.machine()}"


def this_version() -> str:
    """Of this package."""
    return importlib.metadata.version("railcosim")


class Component(NamedTuple):
    """A component as the FMU that was made of it here, so that a worker needs neither its file nor a compiler.

    Attributes:
        reference, arguments, kind: what was asked for.
        digest: of the FMU. name: of its file. made: what it is. note: why it is not of another kind.
    """

    reference: str
    arguments: Mapping[str, Any]
    kind: Any
    digest: str
    name: str
    made: Any
    note: str


@dataclass(frozen=True)
class Parcel:
    """What is sent: this with every chunk, and what files hold once, by digest.

    Attributes:
        how: the arguments of the `Runner`.
        folder: where relative paths in them start.
        files: SHA-256 of the files that stand here, by path. components: the FMUs that were made here.
        models: where the shipped scenarios are here. machine, version: whom compiled FMUs and all else are for.
    """

    how: Mapping[str, Any]
    folder: str
    files: Mapping[str, str]
    components: tuple[Component, ...]
    models: str = MODELS
    machine: str = field(default_factory=this_machine)
    version: str = field(default_factory=this_version)
    places: Mapping[str, Path] = field(default_factory=dict, repr=False)

    @property
    def digest(self) -> str:
        """What tells studies apart that run something else."""
        told = [self.how, self.folder, self.files, [one[:4] for one in self.components], self.version]
        return hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode()).hexdigest()

    def contents(self) -> Iterator[tuple[str, bytes]]:
        """Digest and content of each file, once.

        Raises:
            ScenarioError: one has changed since.
        """
        for digest, path in self.places.items():
            with naming(path):
                content = world.read_bytes(path)
            if hashlib.sha256(content).hexdigest() != digest:
                raise ScenarioError(f"{path} has changed while the study was about to begin; begin again")
            yield digest, content

    def sent(self) -> Parcel:
        """Itself without what only the sender needs."""
        return Parcel(self.how, self.folder, self.files, self.components, self.models, self.machine, self.version)


def packed(how: Mapping[str, Any], systems: Iterable[System], kind: Any) -> Parcel:
    """What workers need to run systems.

    Args:
        how: the arguments of the `Runner`.
        systems: those that it will make, as far as they are known to differ in models.
        kind: as which kind of models they run.

    Raises:
        ScenarioError: a file is gone.
    """
    files: dict[str, str] = {}
    places: dict[str, Path] = {}
    components: dict[str, Component] = {}
    for system in systems:
        for file in files_of(system):
            if file not in files:
                files[file] = digest_of(Path(file))
                if not Path(file).is_relative_to(MODELS):  # every worker has those
                    places[files[file]] = Path(file)
        for instance in system.instances.values():
            key = json.dumps([instance.model, instance.build], sort_keys=True, default=str)
            if kind == "plain" or is_fmu_name(instance.model) or key in components:
                continue
            fmu = packaged(instance.model, instance.build, kind)
            digest = digest_of(fmu.path)
            places[digest] = fmu.path
            components[key] = Component(instance.model, instance.build, kind, digest, fmu.path.name, fmu.kind, fmu.note)
    return Parcel(how, os.getcwd(), files, tuple(components.values()), places=places)


Where = Callable[[str], str | None]
"""Where a file is now, by its absolute path; None for what is no file that moved."""


def moved(value: Any, folder: str, where: Where) -> Any:
    """A value with the file that it names where that is now: ``"other.fmu"``, ``"mine.py:Mine"``, ``"line.json"``.

    Args:
        value: of a change, or a build argument.
        folder: where relative paths start.
        where: a file is now.
    """
    if not isinstance(value, str):
        return value
    file, name = file_and_class(value)
    there = where(os.path.abspath(os.path.join(folder, os.path.expanduser(file or value))))
    return value if there is None else f"{there}:{name}" if file else there


def moved_options(how: Mapping[str, Any], folder: str, where: Where) -> dict[str, Any]:
    """The arguments of a `Runner` with the files that they name where those are now."""
    found = dict(how)
    scenario = str(how["scenario"])
    file, sign, variant = scenario.partition("#") if is_ssp_name(scenario) else (scenario, "", "")
    found["scenario"] = f"{moved(file, folder, where)}{sign}{variant}"
    for option in ("settings", "builds", "swaps"):
        found[option] = [_moved_assignment(text, folder, where) for text in how.get(option) or ()]
    return found


def _moved_assignment(text: str, folder: str, where: Where) -> str:
    key, equals, value = text.partition("=")
    parsed = parse_value(value.strip())
    there = moved(parsed, folder, where)
    return text if there == parsed else f"{key}{equals}{json.dumps(there) if value.strip() != parsed else there}"


def files_of(system: System) -> Iterator[str]:
    """The scenario of a system, FMUs, data, Python files of components, and what these import beside them.

    Those count too that the scenario names for what is not in the system, such as presets: it is not loaded without.
    """
    came = system.provenance
    path = os.path.abspath(came.path)
    yield path
    yield from named_in(tomllib.loads(came.text), os.path.dirname(path))
    for instance in system.instances.values():
        yield from named_in([instance.model, instance.build], os.getcwd())


def named_in(value: Any, folder: str) -> Iterator[str]:
    """The files that texts name, in whatever lists and tables."""
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from named_in(inner, folder)
    elif isinstance(value, str):
        code, _ = file_and_class(value)
        file = os.path.abspath(os.path.join(folder, code or value))
        if (code or is_fmu_name(value) or names_data(value)) and os.path.isfile(file):
            yield file
            yield from map(str, imports_of(Path(file)).files if code else ())
