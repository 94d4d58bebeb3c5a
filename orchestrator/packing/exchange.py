"""A system as other tools run it: an SSP archive, or an `OspSystemStructure.xml` with its FMUs beside it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...fmus.build import package, write_archive, write_whole
from .. import world
from ..errors import ScenarioError
from ..fmi import Model, Workspace, is_fmu_name
from ..problems import Problem
from ..run import Checked, check
from ..system import Instance, System
from .losses import losses, unsayable
from .osp import osp_structure
from .parts import Part
from .ssd import parameter_set, system_structure

_SSP, _OSP = ".ssp", ".xml"


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        files: the archive; or the structure, and the FMUs beside it. parts: how many instances are in it.
        notes: what a user should know, and what other tools do otherwise or not at all.
    """

    files: tuple[Path, ...]
    parts: int
    notes: tuple[str, ...]


def export(system: System, path: Path, *, platforms: Sequence[str] = (), trusted: bool = True) -> Exported:
    """Write a system for other tools.

    Args:
        system: what to write.
        path: ``.ssp`` for an archive of SSP 1.0 that can be read again, with the same results to the bit; ``.xml``
            for the structure that libcosim calls ``OspSystemStructure.xml``, with the FMUs beside it.
        platforms: for which to build the components; this machine's by default.
        trusted: whether Python code that the scenario names is imported wherever it stands.

    Raises:
        ScenarioError: the system cannot run, or has what the format has no words for; all of it is listed.
    """
    kind = path.suffix.lower()
    if kind not in (_SSP, _OSP):
        remedy = "name it system.ssp, or OspSystemStructure.xml for libcosim"
        raise ScenarioError(Problem(str(path), "a system is exported to a file that ends in .ssp or .xml", remedy))
    with Workspace() as workspace:
        checked = check(system, workspace, trusted=trusted)
        problems = list(unsayable(checked, osp=kind == _OSP))
        if problems:
            raise ScenarioError(problems)
        fmus = {name: _fmu(checked.system.instances[name], model, platforms) for name, model in checked.models.items()}
        sources = _file_names(fmus)
        parts = _parts(checked, {name: sources[fmu] for name, fmu in fmus.items()})
        contents = {source: world.read_bytes(fmu) for fmu, source in sources.items()}
        notes = dict.fromkeys([*checked.notes, *losses(checked, osp=kind == _OSP), *_missing(checked, platforms)])
    if kind == _OSP:
        files = {path.parent / source: content for source, content in contents.items()}
        for target, content in (files | {path: osp_structure(checked, parts)}).items():
            write_whole(content, target)
        return Exported((path, *files), len(parts), tuple(notes))
    archive = {f"resources/{source}": content for source, content in contents.items()}
    archive |= {f"resources/{part.name}.ssv": parameter_set(part) for part in parts.values() if part.starts}
    archive["SystemStructure.ssd"] = system_structure(checked, parts)
    write_archive(archive, path)
    return Exported((path,), len(parts), tuple(notes))


def _fmu(instance: Instance, model: Model, platforms: Sequence[str]) -> Path:
    """The file of an instance's FMU: of a component, with a binary for every platform asked for."""
    if is_fmu_name(instance.model):
        return Path(instance.model)
    if platforms:
        if model.kind == "python":
            return package(instance.model, instance.build, "python")[0]
        return package(instance.model, instance.build, "native", platforms)[0]
    assert model.path is not None  # only plain components have none
    return model.path


def _missing(checked: Checked, platforms: Sequence[str]) -> Iterator[str]:
    """What given FMUs do not run on."""
    for model in {id(model): model for model in checked.models.values() if model.kind == "fmu"}.values():
        for platform in platforms:
            if model.interface.version == "2.0" and not (model.folder / "binaries" / platform).is_dir():
                yield f"{model.interface.model}, which was given as an FMU, has no binary for {platform}"


def _file_names(fmus: Mapping[str, Path]) -> dict[Path, str]:
    """A name in the new place for every FMU: its own, with a number where several have it."""
    names: dict[Path, str] = {}
    for fmu in fmus.values():
        if fmu in names:
            continue
        stem = re.sub(r"\W", "_", fmu.stem, flags=re.ASCII)
        name, number = f"{stem}.fmu", 2
        while name in names.values():
            name, number = f"{stem}_{number}.fmu", number + 1
        names[fmu] = name
    return names


def _parts(checked: Checked, sources: Mapping[str, str]) -> dict[str, Part]:
    """The instances under names that every tool takes: letters, digits and `_`."""
    parts: dict[str, Part] = {}
    for name, instance in checked.system.instances.items():
        text = re.sub(r"\W", "_", name.replace("]", ""), flags=re.ASCII)
        plain, number = text, 2
        while plain in {part.name for part in parts.values()}:
            plain, number = f"{text}_{number}", number + 1
        starts = checked.wiring.starts[name]
        left = {
            signal.partition(".")[2]: value
            for signal, value in checked.wiring.left.items()
            if signal.partition(".")[0] == name
        }
        parts[name] = Part(plain, instance, checked.models[name].interface, sources[name], starts, left)
    return parts
