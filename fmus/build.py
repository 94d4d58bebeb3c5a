"""Building FMUs: what the command line and the orchestrator call. Built once, then taken from a cache by content."""

from __future__ import annotations

import atexit
import functools
import hashlib
import importlib.util
import io
import logging
import os
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import platformdirs
from filelock import FileLock

from ..components import Component, ComponentError, Simulation
from ..components.tracing import TracingError
from . import native_fmu, python_fmu, toolchain
from .description import write
from .identity import source_digest
from .kinds import FmiVersion, FmuKind, PackagingKind, Profile
from .references import build_with, resolve
from .toolchain import CompilerError

_LOG = logging.getLogger(__name__)
_PROGRAMS = (b"\x7fELF", b"#!")
"""How programs begin: in the resources of an FMU they may be run."""
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time a zip can hold: archives of equal content are equal files."""


@dataclass(frozen=True)
class Plain:
    """A component in this process, without packaging: its description, and a `Simulation` for each instance."""

    component: type[Component]
    arguments: Mapping[str, Any]
    digest: str
    description: bytes

    def instantiate(self) -> Simulation:
        """A new instance."""
        return Simulation(self.component(**self.arguments))


def build(
    reference: str,
    arguments: Mapping[str, Any] | None = None,
    *,
    kind: FmuKind = "python",
    platforms: Sequence[str] = (),
    folder: Path | None = None,
    profile: Profile = "standard",
    fmi: FmiVersion = "2",
) -> Path:
    """The FMU of a component, built if the cache does not have it.

    Args:
        reference: catalogue name or ``"file.py:Class"``.
        arguments: build arguments (`Size`, `Data`) by name.
        kind: ``"native"`` (compiled C) or ``"python"``.
        platforms: of a native FMU, keys of `toolchain.PLATFORMS`; this machine's by default.
        folder: where a relative file path starts.
        profile: of a native FMU, what its C may do.
        fmi: of a native FMU, the version of FMI.

    Returns:
        Path of the FMU in the user's cache; copy it to keep it.

    Raises:
        ComponentError: the component or its arguments are unusable, cannot be traced, or do not compile.
    """
    component = build_with(resolve(reference, folder), arguments)
    return build_component(component, kind, platforms, profile, fmi)


def build_component(
    component: Component,
    kind: FmuKind = "python",
    platforms: Sequence[str] = (),
    profile: Profile = "standard",
    fmi: FmiVersion = "2",
) -> Path:
    """The same for a component at hand; its values become the FMU's start values."""
    if kind == "python" and profile != "standard":
        raise ComponentError(f"the profile {profile} is for native FMUs; Python FMUs have none")
    name, digest = type(component).__name__, source_digest(component, kind, profile, fmi)
    if kind == "python":
        return _keep(digest, name, lambda: python_fmu.contents(component, digest))
    chosen = toolchain.chosen(platforms)
    identity = hashlib.sha256(f"{digest} {toolchain.identity(chosen)}".encode()).hexdigest()
    return _keep(
        identity, name, lambda: native_fmu.contents(component, digest, chosen, _zig_cache(), profile=profile, fmi=fmi)
    )


def _zig_cache() -> Path:
    """Where ziglang keeps the C libraries it makes, which are the same for every folder of FMUs.

    In the user's cache directory, wherever ``RAILCOSIM_CACHE`` is, so that they are made once; where that cannot be
    written, beside the FMUs, or for this process alone.
    """
    places = (_user_cache() / "zig", cache_folder().with_name("zig"))
    return next((place for place in places if _can_be_written(place)), None) or _instead() / "zig"


def _can_be_written(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):  # flags are not all: disks are full, and mounted to be read
            return True
    except OSError:
        return False


def _user_cache() -> Path:
    return Path(platformdirs.user_cache_dir("railcosim", appauthor=False))


def _keep(identity: str, name: str, make: Callable[[], Mapping[str, bytes]]) -> Path:
    """The FMU of this identity in the cache, made if it is not there, or is not what was put there."""
    place = Path(identity[:32]) / f"{name}.fmu"
    target = cache_folder() / place
    if _is_sound(target):
        return target
    content = _archive(make())
    try:
        _put(content, target)
    except OSError as error:
        if target.is_file() and target.read_bytes() == content:  # Windows: another process has just put it there
            return target
        _warn_once(f"{cache_folder()} cannot be written ({error.strerror or error}): what is built is not kept")
        target = _instead() / place
        _put(content, target)
    return target


def _put(content: bytes, target: Path) -> None:
    write_whole(content, target)
    write_whole(_digest(content, target), _digest_file(target))


def _is_sound(target: Path) -> bool:
    """Whether the cache has this file as it was put there: disks, other programs and power cuts change files."""
    try:
        return _digest_file(target).read_bytes() == _digest(target.read_bytes(), target)
    except OSError:
        return False


def _digest_file(target: Path) -> Path:
    return target.with_name(f"{target.name}.sha256")


def _digest(content: bytes, target: Path) -> bytes:
    """As ``sha256sum -c`` reads it."""
    return f"{hashlib.sha256(content).hexdigest()}  {target.name}\n".encode()


@functools.cache
def _instead() -> Path:
    """A folder of this process's, where the cache cannot be written."""
    folder = Path(tempfile.mkdtemp(prefix="railcosim_"))
    # As the orchestrator owns the folders of its runs, which removes those of processes that were killed.
    lock = FileLock(folder / ".in-use")
    lock.acquire()
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    atexit.register(lock.release)
    return folder


@functools.cache
def _warn_once(message: str) -> None:
    _LOG.warning("%s; name another folder in RAILCOSIM_CACHE", message)


def package(
    reference: str,
    arguments: Mapping[str, Any],
    kind: PackagingKind = "auto",
    platforms: Sequence[str] = (),
    *,
    profile: Profile = "standard",
    fmi: FmiVersion = "2",
) -> tuple[Path, FmuKind, str]:
    """The FMU of a component in the cache, its kind, and why it is not native if that was left open."""
    if kind != "auto":
        return build(reference, arguments, kind=kind, platforms=platforms, profile=profile, fmi=fmi), kind, ""
    component = resolve(reference)
    problem = native_problem(component)
    if platforms and not component.requires:
        problem = ""  # asked for by name: what is missing is an error then, not a reason for another kind
    if not problem:
        try:
            return build(reference, arguments, kind="native", platforms=platforms), "native", ""
        except TracingError as error:
            problem = str(error).splitlines()[0]
        except CompilerError as error:
            if platforms:
                raise
            problem = str(error).splitlines()[0]
    return build(reference, arguments, kind="python"), "python", problem


def native_problem(component: type[Component]) -> str:
    """Why a component cannot become a native FMU here, in one line; empty if it can."""
    if component.requires:
        return f"{component.__name__} imports {', '.join(component.requires)}"
    if importlib.util.find_spec("casadi") is None:
        return "casadi is not installed (pip install 'railcosim[native]')"
    if not toolchain.can_compile():
        return "there is no C compiler (install cc, gcc or clang, or pip install 'railcosim[cross]')"
    return ""


def plain(reference: str, arguments: Mapping[str, Any] | None = None, *, folder: Path | None = None) -> Plain:
    """A component to run in this process as Python objects, for a debugger."""
    cls = resolve(reference, folder)
    component = build_with(cls, arguments)
    digest = source_digest(component, "python")
    return Plain(cls, component.build_arguments, digest, write(component, "python", digest))


def cache_folder() -> Path:
    """Where built FMUs are kept: ``RAILCOSIM_CACHE``, or the user's cache directory."""
    chosen = os.environ.get("RAILCOSIM_CACHE")
    return (Path(chosen) if chosen else _user_cache()) / "fmus"


def write_archive(archive: Mapping[str, bytes], target: Path) -> None:
    """Write an FMU, whole or not at all; the same content gives the same bytes."""
    write_whole(_archive(archive), target)


def _archive(contents: Mapping[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as fmu:
        for path in sorted(contents):
            entry = zipfile.ZipInfo(path, _EPOCH)
            entry.create_system = 3  # what Unix writes, everywhere
            entry.compress_type = zipfile.ZIP_DEFLATED
            is_program = path.startswith("resources/") and contents[path].startswith(_PROGRAMS)
            entry.external_attr = (0o755 if is_program else 0o644) << 16
            fmu.writestr(entry, contents[path])
    return stream.getvalue()


def write_whole(content: bytes, target: Path) -> None:
    """Write a file so that there is never a part of it under its name, not after a power cut either.

    Raises:
        OSError: it cannot be written; what stood there stands there still.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(handle)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
