"""The copy of the equations that a Python FMU carries: which files, and how their imports are kept inside the copy.

All Python FMUs of a process share one ``sys.modules``. The copy therefore stands under a package name that contains a
hash of its content, and imports itself by relative imports only: two versions of a component never meet.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Iterable
from pathlib import Path

from .. import components
from ..components.component import Component, ComponentError

_PROJECT = components.__name__.rpartition(".")[0]
_COMPONENTS = Path(inspect.getfile(components)).parent
_FMUS = Path(__file__).parent
_RUNTIME = ("fmus/slave.py", "fmus/variables.py")


def embedded_files(cls: type[Component]) -> tuple[dict[str, str], str]:
    """The files of the copy by path inside it, and the dotted module of ``cls`` in it.

    Raises:
        ComponentError: a component outside the project imports a package that it does not name in ``requires``.
    """
    files: dict[str, str] = {}
    if cls.__module__.startswith(components.__name__ + "."):
        module = cls.__module__.removeprefix(_PROJECT + ".")
        _add(module.replace(".", "/") + ".py", files)
    else:
        path = Path(inspect.getfile(cls))
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
    if path in files:
        return
    folder, _, rest = path.partition("/")
    text = ((_COMPONENTS if folder == "components" else _FMUS) / rest).read_text(encoding="utf-8")
    files[path] = text
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.level:
            for needed in _targets(path, node):
                _add(needed, files)


def _targets(path: str, node: ast.ImportFrom) -> Iterable[str]:
    base = Path(path).parents[node.level - 1]
    if node.module:
        yield (base / node.module.replace(".", "/")).as_posix() + ".py"
    else:
        yield from ((base / alias.name).as_posix() + ".py" for alias in node.names)


# ---------------------------------------------------------------- files from outside the project


def _add_user_file(path: Path, cls: type[Component], files: dict[str, str]) -> None:
    name = f"user/{path.name}"
    if name in files:
        return
    text = path.read_text(encoding="utf-8")
    files[name] = ""  # known from here on: two local modules may import one another
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text, str(path))):
        if isinstance(node, ast.Import | ast.ImportFrom):
            replacement = _localised(node, path, cls, files)
            if replacement is not None:
                _replace(lines, node, replacement)
    files[name] = "\n".join(lines) + "\n"


def _localised(node: ast.Import | ast.ImportFrom, path: Path, cls: type[Component], files: dict[str, str]) -> str | None:
    """The import statement as it must stand inside the copy; None where it may stay."""
    if isinstance(node, ast.ImportFrom):
        if node.level:
            raise ComponentError(f"{path}:{node.lineno}: a component file is a plain file; it cannot import relatively")
        module = node.module or ""
        if module.split(".")[0] == _PROJECT:
            return _project_import(node, path, files)
        if _is_local(module, path):
            _add_user_file(path.parent / f"{module.replace('.', '/')}.py", cls, files)
            return f"from .{module} import {_names(node.names)}"
        _check_named(module, path, node.lineno, cls)
        return None
    kept: list[str] = []
    changed = False
    for alias in node.names:
        if alias.name.split(".")[0] == _PROJECT:
            raise ComponentError(
                f"{path}:{node.lineno}: write 'from {_PROJECT}.components import ...' so that the FMU can carry its own copy"
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
        raise ComponentError(f"{path}:{node.lineno}: a component may import from {components.__name__} only, not {module}")
    statements = []
    for alias in node.names:
        place = module if module != components.__name__ else _defining_module(alias.name, path, node.lineno)
        inside = place.removeprefix(_PROJECT + ".")
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
    return bool(module) and (path.parent / f"{module.replace('.', '/')}.py").is_file()


def _check_named(module: str, path: Path, line: int, cls: type[Component]) -> None:
    package = module.split(".")[0]
    if package in sys.stdlib_module_names or package == "numpy" or package in cls.requires:
        return
    raise ComponentError(
        f"{path}:{line}: {cls.__name__} imports {package!r}; name it in the class: requires = ({package!r},)"
    )


def _names(aliases: Iterable[ast.alias]) -> str:
    return ", ".join(a.name if a.asname is None else f"{a.name} as {a.asname}" for a in aliases)


def _replace(lines: list[str], node: ast.stmt, statement: str) -> None:
    """Put a statement in place of another; the lines keep their numbers, so that messages point at the author's file."""
    first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    lines[first] = lines[first][: node.col_offset] + statement
    for k in range(first + 1, last + 1):
        lines[k] = ""
