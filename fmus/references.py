"""What a user names: a component of the catalogue or of a file, and the data it is built with."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import importlib
import importlib.machinery
import importlib.util
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from .. import models
from ..components import CATALOGUE, Component, ComponentError
from ..components.errors import BuildArgumentError, did_you_mean
from .foreign import DATA_SUFFIXES, ForeignError, read_data

_PRESENT = sys.stdlib_module_names | {"numpy", __package__.partition(".")[0]}
"""What every component file may import."""

_SHIPPED = Path(models.__file__ or "").resolve().parent
_DATA_FOLDERS = ("lines", "profiles", "rolling_stock")
"""Of the shipped data, relative to the scenarios."""

_MOST = 1 << 24
"""Bytes of a data file: as much as of a scenario."""


def resolve(reference: str, folder: Path | None = None) -> type[Component]:
    """The component behind a catalogue name or ``"file.py:Class"``.

    Args:
        reference: what a scenario or the command line says.
        folder: where a relative file path starts; the current folder by default.

    Raises:
        ComponentError: no such name, file or class; the message suggests the nearest one.
    """
    path, name = file_and_class(reference)
    if not path:
        if reference in CATALOGUE:
            return CATALOGUE[reference]
        raise ComponentError(f"there is no component {_nearest(reference, CATALOGUE)}")
    module = _load_file((folder or Path()) / path)
    found = {k: v for k, v in vars(module).items() if isinstance(v, type) and issubclass(v, Component)}
    own = {k: v for k, v in found.items() if v.__module__ == module.__name__}
    if name not in own:
        raise ComponentError(f"{path} has no component {_nearest(name, own)}")
    return own[name]


def summary(cls: type[Component]) -> str:
    """First line of the class's docstring."""
    return ((cls.__doc__ or "").strip() or cls.__name__).splitlines()[0]


def file_and_class(reference: str) -> tuple[str, str]:
    """``"file.py:Class"`` in two; the file is empty where the reference names none."""
    path, _, name = reference.rpartition(":")
    return (path, name) if path.endswith(".py") else ("", reference)


@dataclass(frozen=True)
class Imports:
    """What is executed where a component file is imported, as far as its text tells.

    Attributes:
        files: it and the modules beside it that it imports, and so on; links are followed.
        others: what else is imported, a package or a folder, and the file that does it; neither the standard library
            nor NumPy nor this project.
    """

    files: list[Path] = field(default_factory=list)
    others: dict[str, Path] = field(default_factory=dict)


def imports_of(path: Path) -> Imports:
    """What importing a component file would execute; nothing of it is. A file that is not Python imports nothing."""
    found, waiting = Imports(), [path.resolve()]
    importlib.invalidate_caches()
    while waiting:
        file = waiting.pop()
        if file in found.files:
            continue
        found.files.append(file)
        for module in _imported_modules(file):
            spec = importlib.machinery.PathFinder.find_spec(module, [str(file.parent)])
            if spec is None or spec.origin is None:  # not there, or a folder, which is looked at last
                if module not in _PRESENT:
                    found.others.setdefault(module, file)
            elif spec.origin.endswith(".py") and not spec.submodule_search_locations:
                waiting.append(Path(spec.origin).resolve())
            else:
                found.others.setdefault(str(file.parent / module), file)
    return found


def _imported_modules(file: Path) -> Iterator[str]:
    """The first parts of what a file imports, wherever in it."""
    try:
        nodes = list(ast.walk(ast.parse(file.read_bytes())))
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):  # it cannot be imported either
        return
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


def names_data(value: Any) -> bool:
    """Whether a value names a data file: one ending in ``.json``, ``.csv``, ``.railml``, ``.xml`` or ``.onnx``."""
    return isinstance(value, str) and value.endswith(DATA_SUFFIXES)


def data_file(name: str, folder: Path | None = None) -> Path:
    """The data file of a name: in a folder, the current one by default, or else one that is shipped."""
    own, shipped = (folder or Path()) / name, _SHIPPED / name
    return shipped if not own.exists() and Path(name).parts[0] in _DATA_FOLDERS and shipped.is_file() else own


def read_arguments(arguments: Mapping[str, Any] | None) -> dict[str, Any]:
    """Build arguments with the data files read that they name.

    Raises:
        ComponentError: the file is missing, too large or not JSON, or a value of a foreign format is unusable.
    """
    given = dict(arguments or {})
    for name, value in given.items():
        if names_data(value):
            try:
                file = data_file(value)
                size = file.stat().st_size
                if size > _MOST:
                    raise ComponentError(f"{name}: {value} has {size >> 20} MiB; no more than {_MOST >> 20} are read")
                given[name] = read_data(value, file.read_bytes())
            except OSError as error:
                raise ComponentError(f"{name}: {value} cannot be read: {error.strerror or error}") from error
            except ForeignError as error:
                raise ComponentError(f"{name}: {value}: {error}") from error
            except ValueError as error:
                raise ComponentError(f"{name}: {value} is not JSON: {error}") from error
            except RecursionError:
                raise ComponentError(f"{name}: {value} is nested too deep") from None
    return given


def build_with(cls: type[Component], arguments: Mapping[str, Any] | None) -> Component:
    """A component with its build arguments; what is wrong in one that a file holds is told with the file.

    Raises:
        ComponentError: an argument is unusable, or its file cannot be read.
    """
    given = dict(arguments or {})
    try:
        return cls(**read_arguments(given))
    except BuildArgumentError as error:
        file = given.get(error.argument)
        if not names_data(file):
            raise
        raise ComponentError(f"{file}: {error}") from error


def _load_file(path: Path) -> ModuleType:
    """Run a user's component file as a module of its own, anew each time, because it may have been edited."""
    path = path.resolve()
    if not path.is_file():
        raise ComponentError(f"there is no file {path}")
    name = f"railcosim_user_{hashlib.sha256(str(path).encode()).hexdigest()[:16]}"
    loader = _Loader(name, str(path))
    module = importlib.util.module_from_spec(importlib.machinery.ModuleSpec(name, loader, origin=str(path)))
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        with _neighbours(path.parent):
            loader.exec_module(module)
    except Exception as error:
        line = _line_in(error, path)
        raise ComponentError(f"{path}{f':{line}' if line else ''}: {type(error).__name__}: {error}") from error
    return module


class _Loader(importlib.machinery.SourceFileLoader):
    """Compiles what the file holds now, and the same text once; a compiled file beside it could be older."""

    def get_code(self, fullname: str) -> CodeType:
        return _compiled(self.get_data(self.path), self.path)


@functools.lru_cache(maxsize=32)
def _compiled(source: bytes, path: str) -> CodeType:
    return compile(source, path, "exec", dont_inherit=True)


@contextlib.contextmanager
def _neighbours(folder: Path) -> Iterator[None]:
    """Modules beside a user's file import as they would from its folder, and are forgotten afterwards.

    Otherwise the first ``helper.py`` of a process would serve every component that has a module of that name, and a
    compiled file left behind could outlive an edit within the same second.
    """
    names = {file.stem for file in folder.glob("*.py")} - _PRESENT
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
