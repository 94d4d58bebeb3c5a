"""`Table`: what a result file holds, whoever has written it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ....errors import RailcosimError, ScenarioError
from ....evaluation import Signals

TIME, ROWS = "time", 1 << 16
"""The name of the time; and how many points are read and written together, so that memory does not grow with a run."""


@dataclass(frozen=True)
class Table:
    """Columns by name, ``time`` among them, all over the same points; units by name, where the file has them."""

    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)


Reader = Callable[[Path], Table]
Writer = Callable[[Path, Signals], None]


def time_among(names: Iterable[str]) -> str | None:
    """The name that is meant by time: tools write ``time``, ``Time``, ``time [s]`` and ``t``."""
    plain = {name: name.split("[")[0].split("(")[0].strip().lower() for name in names}
    return next((name for wanted in (TIME, "t") for name, text in plain.items() if text == wanted), None)


def blocks_of(signals: Signals, names: Sequence[str]) -> Iterator[list[NDArray[Any]]]:
    """Columns of some signals, the time among them, at some points after the other."""
    for first in range(0, signals.points, ROWS):
        part = signals.part(first, min(first + ROWS, signals.points))
        yield [part[name] for name in names]


def texts_among(signals: Signals) -> list[str]:
    """Signals that hold texts."""
    first = signals.part(0, 1)
    return [name for name in signals.names() if first[name].dtype.kind not in "fiub"]


def numbers_among(signals: Signals) -> list[str]:
    """The time and the signals that hold numbers."""
    texts = set(texts_among(signals))
    return [TIME, *(name for name in signals.names() if name not in texts)]


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
