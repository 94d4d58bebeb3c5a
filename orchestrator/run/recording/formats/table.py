"""`Table`: what a result file holds, whoever has written it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ....errors import RailcosimError, ScenarioError

TIME = "time"


@dataclass(frozen=True)
class Table:
    """Columns by name, ``time`` among them, all over the same points; units by name, where the file has them."""

    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)


Reader = Callable[[Path], Table]


def time_among(names: Iterable[str]) -> str | None:
    """The name that is meant by time: tools write ``time``, ``Time``, ``time [s]`` and ``t``."""
    plain = {name: name.split("[")[0].split("(")[0].strip().lower() for name in names}
    return next((name for wanted in (TIME, "t") for name, text in plain.items() if text == wanted), None)


@contextmanager
def needing(path: Path, library: str) -> Iterator[None]:
    """Say of a library that is not there which file wants it, and how it is got."""
    try:
        yield
    except ImportError as error:
        remedy = f"{library}, which is not installed: pip install 'railcosim[files]'"
        raise RailcosimError(f"{path}: such a file is for {remedy}") from error


def refused(path: Path, why: object) -> ScenarioError:
    """The error of a file that is not what its ending says."""
    return ScenarioError(f"{path} cannot be read as results: {why}")
