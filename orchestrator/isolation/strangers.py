"""FMUs that this machine does not know: files of other makers that no run here has come through with, or that are bad.

What is known of a file is kept in the cache, by the digest of its content: whoever changes it makes it a stranger.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path

from ...fmus.build import cache_folder
from .. import world
from ..digests import digest_of
from ..fmi import Model
from ..system import System

_HAS_RUN, _FAILED = b"has run\n", b"failed validation\n"


def strangers(system: System) -> list[str]:
    """The instances of a system that are made of strangers.

    Components are packaged here, and FMU files with the content of one that was packaged here are none of others.
    """
    paths = {instance.model: Path(instance.model) for instance in system.instances.values() if _is_file(instance.model)}
    strange = {model for model, path in paths.items() if _is_strange(path)}
    return [name for name, instance in system.instances.items() if instance.model in strange]


def become_known(models: Iterable[Model]) -> None:
    """Note that a run has come to its end with these; one that failed validation stays a stranger all the same."""
    for digest in {model.digest for model in models if model.kind == "fmu"}:
        if not _note(digest).is_file():
            _keep(_note(digest), _HAS_RUN)


def note_validation(path: Path, *, passed: bool) -> None:
    """Note what came out when an FMU file was validated: one that fails is a stranger until it passes."""
    with contextlib.suppress(OSError):
        note = _note(digest_of(path, OSError))
        if not passed:
            _keep(note, _FAILED)
        elif note.is_file() and world.read_bytes(note) == _FAILED:
            world.unlink(note)


def _is_file(model: str) -> bool:
    return model.lower().endswith(".fmu") and Path(model).is_file()


def _is_strange(path: Path) -> bool:
    digest = digest_of(path, OSError)
    note = _note(digest)
    if note.is_file():
        return world.read_bytes(note) != _HAS_RUN
    kept = world.glob(cache_folder(), "*/*.fmu.sha256")
    return not any(world.read_bytes(known).startswith(digest.encode()) for known in kept)


def _note(digest: str) -> Path:
    return cache_folder().with_name("known") / digest


def _keep(note: Path, what: bytes) -> None:
    with contextlib.suppress(OSError):  # then it stays a stranger
        world.mkdir(note.parent, parents=True, exist_ok=True)
        world.write_bytes(note, what)
