"""The files that a scenario names, kept beside it: its directory is all that is needed to run it elsewhere."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from ....fmus.references import file_and_class, imports_of
from ... import world
from ...fmi import is_fmu_name
from ...system import System

MODELS = "models"
"""The folder of copies. Those of another folder are in ``models-2`` and so on: Python files see their neighbours."""

Copies = dict[Path, Path]
"""What is copied from where, by where it comes to stand."""


def kept(system: System, directory: Path) -> tuple[System, Copies]:
    """A system that names the files of its models and data by their paths from a directory, and the copies it needs.

    FMUs, data, and Python files with those that they import beside them are copied, once. Python code that has a
    package beside it, or asks where it stands itself, keeps its absolute path: what else belongs to it is not known.

    Args:
        system: with absolute paths.
        directory: that the scenario is about to stand in.
    """
    copies: Copies = {}
    instances = {
        name: replace(
            one,
            model=_from(directory, one.model, copies),
            build={key: _from(directory, value, copies) for key, value in one.build.items()},
        )
        for name, one in system.instances.items()
    }
    return system.changed(instances=instances), copies


def copy(copies: Copies, directory: Path) -> None:
    """Make the copies that a scenario in a directory needs, each whole or not at all."""
    for target, source in copies.items():
        if not target.exists():
            world.mkdir(target.parent, exist_ok=True)
            part = directory / ".copy.part"
            with world.open(source, "rb") as stream, world.open(part, "wb") as made:
                world.copyfileobj(stream, made)
            world.replace(part, target)


def _from(directory: Path, value: Any, copies: Copies) -> Any:
    """A model or a build argument; of one that names a file the path from a directory, where it can be there."""
    if not isinstance(value, str):
        return value
    code, name = file_and_class(value)
    if not (code or is_fmu_name(value) or value.endswith(".json")):
        return value
    path = Path(os.path.abspath(code or value))
    if not path.is_relative_to(directory):
        files = _together(path) if code else [path]
        if not files:
            return value
        folder = _free_folder(files, directory, copies)
        copies |= {folder / file.name: file for file in files}
        path = folder / files[0].name
    inside = path.relative_to(directory).as_posix()
    return f"{inside}:{name}" if code else inside


def _together(code: Path) -> list[Path]:
    """A Python file and those that it imports beside it, itself first; none where that is not all it may need."""
    imports = imports_of(code)
    here = imports.files[0].parent
    if any((here / name).exists() for name in imports.others) or any(file.parent != here for file in imports.files):
        return []
    return [] if any(b"__file__" in world.read_bytes(file) for file in imports.files) else imports.files


def _free_folder(files: list[Path], directory: Path, copies: Copies) -> Path:
    """The first folder of copies that has nothing but what stands, the same, beside these files."""
    source, folder, number = files[0].parent, directory / MODELS, 1
    while not _has_only(folder, source, copies):
        number += 1
        folder = directory / f"{MODELS}-{number}"
    return folder


def _has_only(folder: Path, source: Path, copies: Copies) -> bool:
    """Whether all that is in a folder, or is about to be, is the same in another."""
    there = {path: path for path in world.glob(folder, "*")}
    there |= {target: origin for target, origin in copies.items() if target.parent == folder}
    return all(_is_same(origin, source / target.name) for target, origin in there.items())


def _is_same(one: Path, other: Path) -> bool:
    return one == other or (other.is_file() and one.is_file() and world.read_bytes(one) == world.read_bytes(other))
