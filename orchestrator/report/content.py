"""What a page shows of runs, out of their directories: signals, verdicts, trains."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RailcosimError
from ..evaluation import Judge, filled
from ..run import Results, read_metrics, read_record
from .happenings import bands_of
from .payload import Packed, is_even, pack
from .trains import gradients_of, trains_of

_LOOKED_AT = 8
"""Signals of a requirement that a panel shows, at most."""


@dataclass
class Columns:
    """The columns of a page, each packed once; the script of the page unpacks them by number.

    ``live``: whether curves are told with what they are made of.
    """

    live: bool = False
    packed: list[Packed] = field(default_factory=list)
    told: list[dict[str, Any]] = field(default_factory=list)
    _known: dict[bytes, int] = field(default_factory=dict)

    def add(self, values: NDArray[Any]) -> int:
        """Pack a column, if it is not there yet; its number."""
        words: dict[str, int] = {}
        if values.dtype.kind not in "fiub":  # texts: numbered in the order in which they come
            values = np.array([words.setdefault(str(word), len(words)) for word in values], dtype=np.float64)
        numbers = np.ascontiguousarray(values, dtype=np.float64)
        digest = hashlib.sha256(numbers.data.cast("B") if len(numbers) else b"")
        digest.update("\0".join(words).encode(errors="surrogatepass"))
        known = self._known.setdefault(digest.digest(), len(self.packed))
        if known < len(self.packed):
            return known
        column = pack(numbers)
        self.packed.append(column)
        self.told.append({"points": len(values), "offset": column.offset} | ({"words": list(words)} if words else {}))
        return known

    @property
    def loss(self) -> float:
        """By how much a number of the page differs from that of the run, at most, in ranges of its signal."""
        return max((column.loss for column in self.packed), default=0.0)


@dataclass(frozen=True)
class Content:
    """One run.

    Attributes:
        directory: of the run. record, metrics: run.json and metrics.json. results: its signals.
        places: the number of each among the page's columns.
    """

    directory: Path
    record: Mapping[str, Any]
    metrics: Mapping[str, Any]
    results: Results
    places: Mapping[str, int]

    @property
    def title(self) -> str:
        """What the run is called."""
        return str(self.record.get("title") or self.record.get("scenario") or self.directory.name)

    @property
    def stepwise(self) -> frozenset[str]:
        """The signals that hold between the points at which they change."""
        return frozenset(self.record.get("stepwise", self.record["texts"]))


def read_content(directory: Path, columns: Columns) -> Content:
    """Read a run, complete or cut short, and pack its signals.

    Raises:
        ScenarioError: there is no run that can be read.
    """
    record, results = read_record(directory), Results.load(directory)
    content = Content(directory, record, read_metrics(directory), results, {})
    held = content.stepwise
    places = {name: columns.add(filled(results.time, results[name], held=name in held)) for name in results}
    return replace(content, places=places)


def told_of(content: Content, name: str, columns: Columns) -> dict[str, Any]:
    """What the script of the page is given of a run.

    Args:
        content: the run.
        name: what it is called where there are several.
        columns: to which its points of time are added, if they are not evenly spaced.
    """
    time, results = content.results.time, content.results
    even = len(time) > 0 and is_even(time)
    return {
        "name": name,
        "time": {"first": float(time[0]), "last": float(time[-1])} if even else columns.add(time),
        "points": len(time),
        "bands": list(bands_of(content.record)),
        "broke": float(time[-1]) if content.record.get("status") == "failed" and len(time) else None,
        "requirements": list(requirements_of(content)),
        "trains": trains_of(results),
        "gradients": gradients_of(content.record),
    }


def signals_of(contents: Sequence[Content]) -> list[dict[str, Any]]:
    """Every signal once, with its column in each run."""
    found = []
    stepwise = [content.stepwise for content in contents]
    for name in dict.fromkeys(name for content in contents for name in content.results):
        own = next(k for k, content in enumerate(contents) if name in content.places)
        told = {
            "name": name,
            "unit": contents[own].results.units.get(name, ""),
            "columns": [content.places.get(name) for content in contents],
        }
        found.append(told | ({"steps": True} if name in stepwise[own] else {}))
    return found


def requirements_of(content: Content) -> Iterator[dict[str, Any]]:
    """Of each requirement the signals it looks at, those that decided it first, and when it was decided."""
    names = [*content.results.names(), *content.results.parameters]
    for verdict in content.metrics.get("requirements", ()):
        looked = [name for name in verdict.get("blame", ()) if name in content.places] or [
            name for name in content.results if name in _needed(verdict, names)
        ]
        told = {key: verdict[key] for key in ("name", "verdict", "margin", "time")}
        yield told | {"signals": looked[:_LOOKED_AT]}


def _needed(verdict: Mapping[str, Any], names: Sequence[str]) -> frozenset[str]:
    try:
        return Judge({}, {verdict["name"]: verdict["text"]}, names).needed_signals
    except RailcosimError:  # of another version
        return frozenset()
