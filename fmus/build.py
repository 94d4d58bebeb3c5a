"""Building FMUs: what the command line and the orchestrator call. Built once, then taken from a cache by content."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.util
import json
import os
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import platformdirs

from ..components import CATALOGUE, Component, ComponentError, Simulation
from ..components.spelling import did_you_mean
from . import native_fmu, python_fmu, toolchain
from .description import Kind, write
from .identity import source_digest

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time a zip can hold: archives of equal content are equal files."""


@dataclass(frozen=True)
class Plain:
    """A component in this process, without packaging: its description, and a `Simulation` for each instance."""

    component: type[Component]
    arguments: Mapping[str, Any]
    description: bytes

    def instantiate(self) -> Simulation:
        """A new instance."""
        return Simulation(self.component(**self.arguments))


def resolve(reference: str, folder: Path | None = None) -> type[Component]:
    """The component behind a catalogue name or ``"file.py:Class"``.

    Args:
        reference: what a scenario or the command line says.
        folder: where a relative file path starts; the current folder by default.

    Raises:
        ComponentError: no such name, file or class; the message suggests the nearest one.
    """
    path, colon, name = reference.rpartition(":")
    if not colon or not path.endswith(".py"):
        if reference in CATALOGUE:
            return CATALOGUE[reference]
        raise ComponentError(f"there is no component {_nearest(reference, CATALOGUE)}")
    module = _load_file((folder or Path()) / path)
    found = {k: v for k, v in vars(module).items() if isinstance(v, type) and issubclass(v, Component)}
    own = {k: v for k, v in found.items() if v.__module__ == module.__name__}
    if name not in own:
        raise ComponentError(f"{path} has no component {_nearest(name, own)}")
    return own[name]


def build(
    reference: str,
    arguments: Mapping[str, Any] | None = None,
    *,
    kind: Kind = "python",
    platforms: Sequence[str] = (),
    folder: Path | None = None,
) -> Path:
    """The FMU of a component, built if the cache does not have it.

    Args:
        reference: catalogue name or ``"file.py:Class"``.
        arguments: build arguments (`Size`, `Data`) by name.
        kind: ``"native"`` (compiled C) or ``"python"``.
        platforms: of a native FMU, keys of `toolchain.PLATFORMS`; this machine's by default.
        folder: where a relative file path starts.

    Returns:
        Path of the FMU in the user's cache; copy it to keep it.

    Raises:
        ComponentError: the component or its arguments are unusable, cannot be traced, or do not compile.
    """
    component = resolve(reference, folder)(**read_arguments(arguments))
    return build_component(component, kind, platforms)


def read_arguments(arguments: Mapping[str, Any] | None) -> dict[str, Any]:
    """Build arguments with data files read: a text that ends in ``.json`` names one.

    Raises:
        ComponentError: the file is missing or is not JSON.
    """
    given = dict(arguments or {})
    for name, value in given.items():
        if isinstance(value, str) and value.endswith(".json"):
            try:
                given[name] = json.loads(Path(value).read_text(encoding="utf-8"))
            except OSError as error:
                raise ComponentError(f"{name}: {value} cannot be read: {error.strerror or error}") from error
            except ValueError as error:
                raise ComponentError(f"{name}: {value} is not JSON: {error}") from error
    return given


def build_component(component: Component, kind: Kind = "python", platforms: Sequence[str] = ()) -> Path:
    """The same for a component at hand; its values become the FMU's start values."""
    name, digest = type(component).__name__, source_digest(component, kind)
    if kind == "python":
        return _keep(digest, name, lambda: python_fmu.contents(component, digest))
    chosen = toolchain.chosen(platforms)
    identity = hashlib.sha256(f"{digest} {toolchain.identity(chosen)}".encode()).hexdigest()
    zig = cache_folder().with_name("zig")
    return _keep(identity, name, lambda: native_fmu.contents(component, digest, chosen, zig))


def _keep(identity: str, name: str, make: Callable[[], Mapping[str, bytes]]) -> Path:
    """The FMU of this identity in the cache, made only if it is not there."""
    target = cache_folder() / identity[:32] / f"{name}.fmu"
    if not target.exists():
        archive = make()
        try:
            write_archive(archive, target)
        except PermissionError:  # on Windows: another process has just written the same file and is reading it
            if not target.exists():
                raise
    return target


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
    given = read_arguments(arguments)
    component = cls(**given)
    return Plain(cls, given, write(component, "python", source_digest(component, "python")))


def cache_folder() -> Path:
    """Where built FMUs are kept: ``RAILCOSIM_CACHE``, or the user's cache directory."""
    chosen = os.environ.get("RAILCOSIM_CACHE")
    return (Path(chosen) if chosen else Path(platformdirs.user_cache_dir("railcosim", appauthor=False))) / "fmus"


def write_archive(archive: Mapping[str, bytes], target: Path) -> None:
    """Write an FMU, whole or not at all; the same content gives the same bytes."""
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=".part", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as fmu:
            for path in sorted(archive):
                entry = zipfile.ZipInfo(path, _EPOCH)
                entry.create_system = 3  # what Unix writes, everywhere
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                fmu.writestr(entry, archive[path])
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _load_file(path: Path) -> ModuleType:
    """Run a user's component file as a module of its own, anew each time, because it may have been edited."""
    path = path.resolve()
    if not path.is_file():
        raise ComponentError(f"there is no file {path}")
    name = f"railcosim_user_{hashlib.sha256(str(path).encode()).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ComponentError(f"{path} cannot be read as Python")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with _neighbours(path.parent):
            spec.loader.exec_module(module)
    except Exception as error:
        line = _line_in(error, path)
        raise ComponentError(f"{path}{f':{line}' if line else ''}: {type(error).__name__}: {error}") from error
    return module


@contextlib.contextmanager
def _neighbours(folder: Path) -> Iterator[None]:
    """Modules beside a user's file import as they would from its folder, and are forgotten afterwards.

    Otherwise the first ``helper.py`` of a process would serve every component that has a module of that name, and a
    compiled file left behind could outlive an edit within the same second.
    """
    names = (
        {file.stem for file in folder.glob("*.py")} - sys.stdlib_module_names - {"numpy", __package__.partition(".")[0]}
    )
    before = {name: sys.modules.pop(name) for name in names if name in sys.modules}
    writes_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        sys.dont_write_bytecode = writes_bytecode
        for name in names:
            sys.modules.pop(name, None)
        sys.modules.update(before)


def _line_in(error: BaseException, path: Path) -> int | None:
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return error.lineno
    line, trace = None, error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(path):
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def _nearest(name: str, known: Mapping[str, Any]) -> str:
    there = f"; there is {', '.join(sorted(known)) or 'none'}; one of your own is written file.py:Class"
    return f"{name!r}{did_you_mean(name, known) or there}"
