"""From the instances of a system to models that can be instantiated: FMU files read, components built."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from ...fmus.build import Plain, package, plain
from ...fmus.kinds import FmuKind, Kind, ModelKind, PackagingKind
from ..errors import ScenarioError
from ..names import SignalName
from ..problems import Problem
from ..system import Instance, System
from .archive import Workspace
from .binding.libraries import library
from .binding.versions import SLAVES
from .interface import Interface
from .plain import PlainSlave
from .reader import read_interface
from .recognition import is_fmu_name
from .slave import Slave

_NO_STRUCTURE: Mapping[str, Any] = {}


class Packaged(NamedTuple):
    """The FMU of a component: where it is, its kind, and why it is not native if that was left open."""

    path: Path
    kind: FmuKind
    note: str


@dataclass(frozen=True)
class Model:
    """What an instance is made of.

    Attributes:
        interface: what it shows.
        kind: ``"fmu"`` for a file of the user's, ``"native"`` or ``"python"`` for a component packaged here,
            ``"plain"`` for one in this process.
        path: the FMU file; None for a plain component.
        digest: SHA-256 of the file, or the component's own digest.
        note: why it is not of the kind a user would expect; empty mostly.
    """

    interface: Interface
    kind: ModelKind
    folder: Path
    path: Path | None
    digest: str
    plain: Plain | None = None
    note: str = ""

    def instantiate(self, name: str) -> Slave:
        """One instance.

        Raises:
            FmuError: it cannot be loaded or instantiated.
        """
        if self.plain is not None:
            return PlainSlave(name, self.interface, self.plain.instantiate())
        return SLAVES[self.interface.version](name, self.interface, self.folder)


def load_models(system: System, workspace: Workspace, kind: Kind = "auto") -> dict[str, Model]:
    """The model of every instance; instances of the same file or component share one.

    Raises:
        ScenarioError: all instances whose model is missing or unusable, together.
    """
    shared: dict[str, Model] = {}
    models: dict[str, Model] = {}
    problems: dict[Problem, None] = {}
    for instance in system.instances.values():
        key = f"{instance.model} {sorted(instance.build.items())}"
        try:
            if key not in shared:
                shared[key] = _load(instance, workspace, kind)
            models[instance.name] = shared[key]
        except (ValueError, OSError) as error:  # ComponentError and FmuFileError among them
            place = f"instance {SignalName(instance.name).group!r}"
            problems[Problem(place, str(error)).at(_origin(system, instance, str(error)))] = None
    if problems:
        raise ScenarioError(problems)
    return models


def _origin(system: System, instance: Instance, message: str) -> str:
    """Where what a message complains of was written: the build argument that it names, or the instance."""
    known = system.provenance.origins
    places = (known.get(f"instances.{instance.name}.build.{name}") for name in instance.build if repr(name) in message)
    return next(filter(None, places), instance.origin)


def _load(instance: Instance, workspace: Workspace, kind: Kind) -> Model:
    if is_fmu_name(instance.model):
        model = load_fmu(Path(instance.model), workspace, "fmu", instance.build)
        found = library(model.folder, model.interface, instance.model)  # said now, not when the run has begun
        if found.stem == model.interface.identifier:
            return model
        what = f"is not named after its model identifier {model.interface.identifier!r}"
        return replace(model, note=f"{instance.model}: its library {found.name} {what}")
    if kind == "plain":
        component = plain(instance.model, instance.build)
        folder = workspace.write_description(component.description)
        interface = read_interface(folder, instance.model)
        return Model(interface, kind, folder, None, component.digest, component)
    path, made, problem = packaged(instance.model, instance.build, kind)
    note = f"running Python FMUs, not native ones: {problem}" if problem else ""
    return replace(load_fmu(path, workspace, made), note=note)


_PROVIDED: dict[str, Packaged] = {}


def packaged(reference: str, arguments: Mapping[str, Any], kind: PackagingKind) -> Packaged:
    """The FMU of a component: what was provided, or what is built here."""
    provided = _PROVIDED.get(_asked(reference, arguments, kind))
    return provided or Packaged(*package(reference, arguments, kind))


def provide(reference: str, arguments: Mapping[str, Any], kind: PackagingKind, fmu: Packaged) -> None:
    """Take from now on what another process has made, which had the compiler and the component's files.

    Args:
        reference: of the component.
        arguments: its build arguments.
        kind: what is asked for.
        fmu: what is had for it.
    """
    _PROVIDED[_asked(reference, arguments, kind)] = fmu


def _asked(reference: str, arguments: Mapping[str, Any], kind: PackagingKind) -> str:
    return json.dumps([reference, dict(arguments), kind], sort_keys=True, default=str)


def load_fmu(
    path: Path, workspace: Workspace, kind: ModelKind = "fmu", structure: Mapping[str, Any] = _NO_STRUCTURE
) -> Model:
    """Unpack and read one FMU file; of one that is made here what a run needs.

    Args:
        path: the file.
        workspace: where it is unpacked.
        kind: what it is.
        structure: values of its structural parameters by name (FMI 3.0).

    Raises:
        FmuFileError: missing, hostile or unusable, or it has no such structural parameters.
    """
    folder, digest, notes = workspace.unpack(path, to_run=kind != "fmu")
    interface = read_interface(folder, str(path), structure)
    return Model(replace(interface, warnings=(*notes, *interface.warnings)), kind, folder, path, digest)
