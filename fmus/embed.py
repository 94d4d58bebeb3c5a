"""The copy of the equations that a Python FMU carries: which files, and how their imports are kept inside the copy.

All Python FMUs of a process share one ``sys.modules``. The copy therefore stands under a package name that contains a
hash of its content, and imports itself by relative imports only: two versions of a component never meet.
"""

from __future__ import annotations

import ast
import functools
import inspect
import keyword
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from .. import components
from ..components.component import Component
from ..components.errors import ComponentError

_PROJECT = components.__name__.rpartition(".")[0]
_COMPONENTS = Path(inspect.getfile(components)).parent
_FMUS = Path(__file__).parent
_RELATIVE = re.compile(r"^ *from (\.+)([\w.]*) import (.+)$", re.MULTILINE)
"""How a file of the project imports another: parsing it takes a hundred times as long, and each run asks for it."""
_RUNTIME = ("fmus/pythonfmu_slave.py", "fmus/variables.py")


def embedded_files(cls: type[Component]) -> tuple[dict[str, str], str]:
    """The files of the copy by path inside it, and the dotted module of ``cls`` in it.

    Raises:
        ComponentError: a component outside the project imports a package that it does not name in ``requires``, or
            does not stand in a file of its own.
    """
    files: dict[str, str] = {}
    if cls.__module__.startswith(components.__name__ + "."):
        module = cls.__module__.removeprefix(_PROJECT + ".")
        _add(module.replace(".", "/") + ".py", files)
    else:
        path = _source_file(cls)
        module = f"user.{path.stem}"
        _add_user_file(path, cls, files)
    for runtime in _RUNTIME:
        _add(runtime, files)
    for folder in {Path(name).parent for name in files}:
        files[(folder / "__init__.py").as_posix()] = ""
    files["__init__.py"] = ""
    return dict(sorted(files.items())), module


def _add(path: str, files: dict[str, str]) -> None:
    """Add a file of the project and, through its relative imports, every file it needs."""
    if path not in files:
        files[path], needed = _own_file(path)
        for other in needed:
            _add(other, files)


@functools.cache
def _own_file(path: str) -> tuple[str, tuple[str, ...]]:
    """A file of the project, and those it imports; read once, as Python itself does."""
    folder, _, rest = path.partition("/")
    text = ((_COMPONENTS if folder == "components" else _FMUS) / rest).read_text(encoding="utf-8")
    return text, tuple(dict.fromkeys(needed for found in _RELATIVE.finditer(text) for needed in _targets(path, found)))


def _targets(path: str, statement: re.Match[str]) -> Iterable[str]:
    dots, module, names = statement.groups()
    base = Path(path).parents[len(dots) - 1]
    for name in [module] if module else re.findall(r"\w+", names):
        yield (base / name.replace(".", "/")).as_posix() + ".py"


# ---------------------------------------------------------------- files from outside the project


def _source_file(cls: type[Component]) -> Path:
    try:
        path = Path(inspect.getfile(cls))
    except (TypeError, OSError):
        path = Path()
    if not path.is_file() or cls.__qualname__ != cls.__name__:
        raise ComponentError(
            f"{cls.__name__} must stand at the top level of a file, so that its FMU can carry the file"
        )
    if not (path.stem.isidentifier() and path.stem.isascii()) or keyword.iskeyword(path.stem):
        raise ComponentError(f"{path}: rename the file to ASCII letters, digits and _ only, such as my_controller.py")
    return path


def _add_user_file(path: Path, cls: type[Component], files: dict[str, str]) -> None:
    name = f"user/{path.name}"
    if name in files:
        return
    text = path.read_text(encoding="utf-8-sig")
    files[name] = ""  # known from here on: two local modules may import one another
    replacements = []
    for node in _imports(text, path):
        replacement = _localised(node, path, cls, files)
        if replacement is not None:
            replacements.append((node, replacement))
    files[name] = _replaced(text, replacements)


@functools.lru_cache(maxsize=32)
def _imports(text: str, path: Path) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """The import statements of a file; a scenario asks for those of one file once for each instance."""
    return tuple(node for node in ast.walk(ast.parse(text, str(path))) if isinstance(node, ast.Import | ast.ImportFrom))


def _localised(
    node: ast.Import | ast.ImportFrom, path: Path, cls: type[Component], files: dict[str, str]
) -> str | None:
    """The import statement as it must stand inside the copy; None where it may stay."""
    if isinstance(node, ast.ImportFrom):
        if node.level:
            raise ComponentError(f"{path}:{node.lineno}: a component file is a plain file; it cannot import relatively")
        module = node.module or ""
        if module.split(".")[0] == _PROJECT:
            return _project_import(node, path, files)
        if _is_local(module, path):
            _add_user_file(path.parent / f"{module}.py", cls, files)
            return f"from .{module} import {_names(node.names)}"
        _check_named(module, path, node.lineno, cls)
        return None
    kept: list[str] = []
    changed = False
    for alias in node.names:
        if alias.name.split(".")[0] == _PROJECT:
            raise ComponentError(
                f"{path}:{node.lineno}: write 'from {_PROJECT}.components import ...', so that the FMU can carry "
                "its own copy"
            )
        if _is_local(alias.name, path):
            _add_user_file(path.parent / f"{alias.name}.py", cls, files)
            kept.append(f"from . import {_names([alias])}")
            changed = True
        else:
            _check_named(alias.name, path, node.lineno, cls)
            kept.append(f"import {_names([alias])}")
    return "; ".join(kept) if changed else None


def _project_import(node: ast.ImportFrom, path: Path, files: dict[str, str]) -> str:
    """``from railcosim.components import X`` as an import of the module in the copy that defines X."""
    module = node.module or ""
    if module != components.__name__ and not module.startswith(components.__name__ + "."):
        raise ComponentError(
            f"{path}:{node.lineno}: a component may import from {components.__name__} only, not {module}"
        )
    statements = []
    for alias in node.names:
        place = module if module != components.__name__ else _defining_module(alias.name, path, node.lineno)
        inside = place.removeprefix(_PROJECT + ".")
        if not _COMPONENTS.parent.joinpath(*inside.split(".")).with_suffix(".py").is_file():
            raise ComponentError(
                f"{path}:{node.lineno}: {place} is a folder; import {alias.name!r} from {components.__name__} or from "
                "the module that defines it"
            )
        _add(inside.replace(".", "/") + ".py", files)
        if inside == f"components.{alias.name}":
            statements.append(f"from ..components import {_names([alias])}")
        else:
            statements.append(f"from ..{inside} import {_names([alias])}")
    return "; ".join(statements)


def _defining_module(name: str, path: Path, line: int) -> str:
    if (_COMPONENTS / f"{name}.py").is_file():
        return f"{components.__name__}.{name}"
    found = getattr(components, name, None)
    module = getattr(found, "__module__", None)
    if module is None:
        raise ComponentError(f"{path}:{line}: {components.__name__} has no {name!r}")
    return str(module)


def _is_local(module: str, path: Path) -> bool:
    return "." not in module and (path.parent / f"{module}.py").is_file()


def _check_named(module: str, path: Path, line: int, cls: type[Component]) -> None:
    package = module.partition(".")[0]
    if package in sys.stdlib_module_names or package == "numpy" or package in cls.requires:
        return
    if (path.parent / package).is_dir():
        raise ComponentError(
            f"{path}:{line}: {package!r} is a folder; a component's local modules are single files beside it"
        )
    raise ComponentError(
        f"{path}:{line}: {cls.__name__} imports {package!r}; name it in the class: requires = ({package!r},)"
    )


def _names(aliases: Iterable[ast.alias]) -> str:
    return ", ".join(a.name if a.asname is None else f"{a.name} as {a.asname}" for a in aliases)


def _replaced(text: str, replacements: Iterable[tuple[ast.stmt, str]]) -> str:
    """The text with statements exchanged; lines keep their numbers, so that messages point at the author's file."""
    lines = text.encode().split(b"\n")  # the parser counts columns in bytes
    for node, statement in sorted(replacements, key=lambda r: (r[0].lineno, r[0].col_offset), reverse=True):
        first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
        rest = lines[last][node.end_col_offset :]
        lines[first] = lines[first][: node.col_offset] + statement.encode() + rest
        for k in range(first + 1, last + 1):
            lines[k] = b""
    return b"\n".join(lines).decode()
