"""The shared library of an FMU: where it stands, and its functions, loaded once for all its instances."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import fmpy

from ... import world
from ...errors import FmuFileError
from ..guard import guarded, loading, unload
from ..interface import Interface

Signatures = Mapping[str, tuple[Any, ...]]
"""By a function's name: the types of its result and of its arguments."""


class Library:
    """A loaded library with its functions bound, those that it has.

    FMPy binds an FMU's functions anew for every instance, demands all of them even where the standard does not (an FMI
    3.0 FMU for co-simulation needs none of model exchange), looks for FMI 3.0 libraries under one name only, and takes
    statuses of FMI 1.0 for texts: a failed fmiInitializeSlave would end the process.
    """

    def __init__(self, path: Path, signatures: Signatures, prefix: str) -> None:
        self._before = threads()
        here = os.getcwd()
        os.chdir(path.parent)  # where some libraries look for others
        try:
            with loading(path):
                self._dll = world.load_library(str(path))
        except OSError as error:
            raise OSError(f"Failed to load shared library {path}. {error}") from error
        finally:
            os.chdir(here)
        self.path = path
        self.users = 0
        bound = {name: self._bind(prefix + name, types) for name, types in signatures.items()}
        there = {name: function for name, function in bound.items() if function is not None}
        self.addresses = {name: address(function) for name, function in there.items()}
        self.functions = {name: guarded(function, self.addresses[name], name) for name, function in there.items()}

    def _bind(self, name: str, types: tuple[Any, ...]) -> Any:
        try:
            function = self._dll[name]
        except AttributeError:
            return None
        function.restype, *function.argtypes = types
        return world.bound(function)

    def own(self, started: set[int]) -> None:
        """Threads that it has started, and no other library."""
        _OWNERS.update(dict.fromkeys(started, self.path))

    def _left(self) -> set[int]:
        """Threads that are there since it was loaded, and that no other library has started as far as is known."""
        return {each for each in threads() - self._before if _OWNERS.get(each, self.path) == self.path}

    def unload(self) -> bool:
        """Take it out of memory: no function may be called any more. False where it has to stay.

        Threads that it has started (of OpenMP, say) would go on in what is no longer there.
        """
        patience = _PATIENCE
        while self._left():
            if patience <= 0.0:
                return False
            world.sleep(_LOOK)
            patience -= _LOOK
        unload(self._dll._handle, self.addresses.values())
        return True


_OWNERS: dict[int, Path] = {}
"""By thread, the library that has started it; where that is known."""
_PATIENCE, _LOOK = 0.05, 0.005
"""How long threads that are about to end are waited for, and how often they are looked for, in s."""


def threads() -> set[int]:
    """The threads of this process that Python has not started; none where the system does not list them."""
    with suppress(OSError):
        ours = {thread.native_id for thread in threading.enumerate()}
        return {int(each) for each in world.listdir("/proc/self/task")} - ours
    return set()


_LIBRARIES: dict[Path, Library] = {}
"""The libraries in use, by path."""


def open_library(path: Path, signatures: Signatures, prefix: str = "") -> Library:
    """A library, loaded if it is not in use yet.

    Args:
        path: the file.
        signatures: the functions that are wanted; what the library lacks is missing from its ``functions``.
        prefix: what stands before the names of the functions in the library.

    Raises:
        OSError: it cannot be loaded.
    """
    if path not in _LIBRARIES:
        _LIBRARIES[path] = Library(path, signatures, prefix)
    _LIBRARIES[path].users += 1
    return _LIBRARIES[path]


def close_library(it: Library) -> bool:
    """Give a library back; the last to do so unloads it. False where it has to stay loaded for the threads it left."""
    it.users -= 1
    if it.users:
        return True
    del _LIBRARIES[it.path]
    return it.unload()


def address(function: Any) -> int:
    """Where a function of a loaded library stands in memory."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0


def names_of_platform(version: str) -> tuple[str, str]:
    """This platform's folder of binaries by the names of FMI 2.0 and 3.0, the right one for the version first."""
    names = (fmpy.platform, fmpy.platform_tuple)
    return names if version < "3" else names[::-1]


def library(folder: Path, interface: Interface, name: str) -> Path:
    """The shared library of an unpacked FMU for this platform, even if it is not named after the model.

    Where it is not, it is the only one there, or the only one among several that can step: others are what it needs.

    Args:
        folder: where the FMU was unpacked.
        interface: its interface.
        name: the file as the user knows it, for messages.

    Raises:
        FmuFileError: there is none, or no telling which; the message says for which platforms there are some.
    """
    binaries = folder / "binaries"
    named = f"{Path(interface.identifier).name}{fmpy.sharedLibraryExtension}"  # never one outside the archive
    for platform in names_of_platform(interface.version):
        place = binaries / platform
        if (place / named).is_file():
            return place / named
        files = world.iterdir(place) if place.is_dir() else ()
        others = sorted(path for path in files if path.suffix.lower() == fmpy.sharedLibraryExtension)
        usable = [path for path in others if len(others) == 1 or b"DoStep" in world.read_bytes(path)]
        if len(usable) == 1:
            return usable[0]
        if others:
            names = ", ".join(path.name for path in usable or others)
            raise FmuFileError(f"{name} has several libraries for {platform} ({names}) and none called {named}")
    platforms = world.iterdir(binaries) if binaries.is_dir() else ()
    found = sorted(p.name for p in platforms if p.is_dir() and any(world.iterdir(p)))
    wanted = names_of_platform(interface.version)[0]
    raise FmuFileError(f"{name} has no binary for {wanted}; it brings {', '.join(found) or 'none at all'}")


def forget_paths(folder: Path) -> None:
    """Take an unpack folder's entries off ``sys.path``, where Python FMUs put them at every instantiation."""
    sys.path[:] = [entry for entry in sys.path if not entry.startswith(str(folder))]
