"""The document of commands whose result is files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..lines import printable
from .answer import Answer


@dataclass(frozen=True)
class FilesDocument:
    """The files that were written, as paths, in order."""

    files: list[str]


def written(paths: Iterable[Path], quiet: bool) -> Answer:
    """The answer of a command that writes files: their paths, a line each."""
    files = list(map(str, paths))

    def show() -> None:
        for path in () if quiet else files:
            print(printable(path))

    return Answer(lambda: FilesDocument(files), show)
