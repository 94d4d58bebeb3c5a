"""The scenarios that come with the package, as a list has them: read, not checked."""

from __future__ import annotations

import os
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railcosim import models

from .. import world

MODELS = Path(os.path.abspath(models.__file__ or "")).parent
"""Where the shipped scenarios are, wherever the package is installed."""


@dataclass(frozen=True)
class Listed:
    """A shipped scenario: its name and title, and what its presets say of themselves, the default one first."""

    name: str
    title: str
    presets: dict[str, str]


def listed() -> list[Listed]:
    """Every scenario that comes with the package, by name."""
    read = {path.stem: _read(path) for path in sorted(world.glob(MODELS, "*.toml"))}
    found = [(name, data) for name, data in read.items() if data is not None]
    return [Listed(name, str(data.get("title", "")), presets_of(data)) for name, data in found]


def shipped() -> list[tuple[str, str]]:
    """Name and title of every scenario that comes with the package, by name."""
    return [(each.name, each.title) for each in listed()]


def shipped_file(name: str) -> Path | None:
    """The file of a shipped scenario; None where there is no such scenario."""
    path = MODELS / f"{name}.toml"
    return None if _read(path) is None else path


def raw(name: str) -> tuple[Path, dict[str, Any]] | None:
    """The file of a scenario as it is named on a command line, and what it holds; None where it cannot be read."""
    path = Path(name) if name.endswith(".toml") else MODELS / f"{name}.toml"
    data = _read(path)
    return None if data is None else (path, data)


def is_shipped(path: Path) -> bool:
    """Whether a file is one of those."""
    return path.parent == MODELS


def _read(path: Path) -> dict[str, Any] | None:
    try:
        data = tomllib.loads(world.read_text(path, encoding="utf-8"))
    except (OSError, ValueError):  # listing the others is more useful than failing on one
        return None
    return data if "instances" in data else None


def presets_of(data: dict[str, Any]) -> dict[str, str]:
    """The presets of a scenario as it is written, with what they say of themselves, the default one first."""
    default = {str(name): "as it stands"} if (name := data.get("default_preset")) else {}
    return default | {name: str(table.get("description", "")) for name, table in data.get("presets", {}).items()}
