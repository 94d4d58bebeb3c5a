"""Doors: a package offers its names, and loads each when somebody first asks for it.

What it offers stands in its `__init__.pyi`, as plain imports and an ``__all__``: for type checkers, editors and people,
and for the door, which reads the same file (as SPEC 1 of Scientific Python has it, https://scientific-python.org/specs).
"""

from __future__ import annotations

import ast
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any


class Door(ModuleType):
    """A package that loads what it offers when it is asked for it; `homes` has the module and its name there."""

    homes: dict[str, tuple[str, str]]

    def __getattr__(self, name: str) -> Any:
        if name not in self.homes:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        home, inside = self.homes[name]
        value = getattr(import_module(home, self.__name__), inside)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        # Python names a module here once it is loaded. Where the function in it has the same name, that is meant.
        if not (isinstance(value, ModuleType) and name in self.homes):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.homes})


def hang_door(package: str) -> None:
    """Let a package that is being imported offer what the stub beside it imports.

    Args:
        package: its ``__name__``.
    """
    module = sys.modules[package]
    stub = Path(str(module.__file__)).with_suffix(".pyi")
    nodes = [node for node in ast.parse(stub.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)]
    homes = {
        alias.asname or alias.name: ("." * node.level + (node.module or ""), alias.name)
        for node in nodes
        for alias in node.names
    }
    module.__dict__.update(homes=homes, __all__=list(homes))
    module.__class__ = Door
