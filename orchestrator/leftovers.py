"""Temporary folders with an owner: what an owner could not remove, because it was killed, others do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from . import world
from .errors import naming

if TYPE_CHECKING:
    from filelock import FileLock

PREFIX = "railcosim_"
_OWNED = ".in-use"
"""The lock in such a folder, which its owner holds for as long as it lives, however it ends."""
_NEW = 60.0
"""Age in s below which a folder may be one whose owner is about to take the lock."""


def own(folder: Path) -> FileLock:
    """The lock that makes this process the owner of a folder until it is released, or the process ends."""
    lock = world.lock(folder / _OWNED)
    with naming(folder):
        lock.acquire(timeout=0)
    return lock


def sweep(own: Path) -> None:
    """Remove what runs left behind that were killed: folders beside our own whose lock is there and held by nobody.

    One that was killed before it took its lock has left an empty folder.
    """
    for folder in world.glob(own.parent, f"{PREFIX}*"):
        try:
            lock = folder / _OWNED
            has_lock = lock.is_file()
            if folder == own or world.now() - world.stat(lock if has_lock else folder).st_mtime < _NEW:
                continue
            if has_lock:
                _remove(folder)
            else:
                world.rmdir(folder)
        except OSError:  # somebody else's, or not empty
            continue


def remove_where_abandoned(inside: Path) -> None:
    """Remove the folder with an owner that something stands in, if the owner is gone."""
    for folder in inside.parents:
        if (folder / _OWNED).is_file():
            _remove(folder)
            return


def _remove(folder: Path) -> None:
    try:
        with world.lock(folder / _OWNED).acquire(timeout=0):
            world.rmtree(folder, ignore_errors=True)
    except OSError:  # in use, or somebody else's
        pass
