"""What a page shows of runs, out of their directories: signals, panels, marks, verdicts, trains, provenance."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RailcosimError
from ..evaluation import Judge
from ..figures import bracketed, curves_of, filled_title, panels_of
from ..run import Results, read_metrics, read_record
from .payload import Packed, is_even, pack
from .trains import gradients_of, trains_of

_LOOKED_AT = 8
"""Signals of a requirement that a panel shows, at most."""
_REPEATS = 1000
"""Of an event that comes again and again, so many are marked."""


@dataclass
class Columns:
    """The columns of a page, each packed once; the script of the page unpacks them by number."""

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
        """By how much a number of the page differs from that of the run, at most."""
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


def read_content(directory: Path, columns: Columns) -> Content:
    """Read a run, complete or cut short, and pack its signals.

    Raises:
        ScenarioError: there is no run that can be read.
    """
    record, results = read_record(directory), Results.load(directory)
    places = {name: columns.add(results[name]) for name in results}
    return Content(directory, record, read_metrics(directory), results, places)


def shown(contents: Sequence[Content], names: Sequence[str], columns: Columns) -> dict[str, Any]:
    """What the script of the page is given.

    Args:
        contents: the runs.
        names: what each is called where there are several.
        columns: to which computed curves are added.
    """
    return {
        "runs": [_run(content, name, columns) for content, name in zip(contents, names, strict=True)],
        "signals": _signals(contents),
        "panels": _panels(contents, names, columns),
        "columns": columns.told,
    }


def _run(content: Content, name: str, columns: Columns) -> dict[str, Any]:
    time, results = content.results.time, content.results
    even = len(time) > 0 and is_even(time)
    return {
        "name": name,
        "time": {"first": float(time[0]), "last": float(time[-1])} if even else columns.add(time),
        "points": len(time),
        "bands": list(_bands(content.record)),
        "requirements": list(_requirements(content)),
        "trains": trains_of(results),
        "gradients": gradients_of(content.record),
    }


def _signals(contents: Sequence[Content]) -> list[dict[str, Any]]:
    """Every signal once, with its column in each run."""
    found = []
    for name in dict.fromkeys(name for content in contents for name in content.results):
        own = next(content for content in contents if name in content.places)
        told = {
            "name": name,
            "unit": own.results.units.get(name, ""),
            "columns": [content.places.get(name) for content in contents],
        }
        found.append(told | ({"steps": True} if name in own.record["texts"] else {}))
    return found


def _panels(contents: Sequence[Content], names: Sequence[str], columns: Columns) -> list[dict[str, Any]]:
    """The panels over time that the first run's figures ask for, with the curves of all."""
    found = []
    for figure in contents[0].results.figures:
        for panel in panels_of(figure):
            if panel.get("x") is not None:
                continue
            lines: list[dict[str, Any]] = []
            for run, content in enumerate(contents):
                lines += _lines(content, run, panel, columns, names[run] if len(contents) > 1 else "")
            if lines:
                units = {line.pop("curve_unit") for line in lines}
                label = str(panel.get("y_label", "")) or (bracketed(units.pop()) if len(units) == 1 else "")
                title = _title(panel, contents[0].results) or str(figure["title"])
                found.append({"title": title, "label": label, "lines": lines})
    return found


def _title(panel: Mapping[str, Any], results: Results) -> str:
    try:
        return filled_title(panel, results)
    except RailcosimError:  # of a run that was cut short
        return str(panel.get("title", ""))


def _lines(
    content: Content, run: int, panel: Mapping[str, Any], columns: Columns, prefix: str
) -> Iterator[dict[str, Any]]:
    """The curves of a panel in one run."""
    try:
        curves = curves_of(panel, content.results)
    except RailcosimError:  # what a run that was cut short does not have
        return
    scale = float(panel.get("scale", 1.0))
    for k, curve in enumerate(curves):
        label = curve.label.replace("\\$", "$")
        yield {
            "label": f"{prefix}: {label}" if prefix else label,
            "run": run,
            "look": [run, k] if prefix else [k, 0],
            "unit": curve.unit if scale == 1.0 else "",
            "curve_unit": curve.unit if scale == 1.0 else "",
            "column": columns.add(curve.y * scale),
            **({} if len(curve.y) == content.results.points else {"x": columns.add(curve.x)}),
        }


def _bands(record: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """What happened on the way: events, and faults and outages that a model was built with."""
    stop = float(record["stop_time"])
    for event in record.get("events", ()):
        begin, every = float(event["at"]), event.get("every")
        lasts = event.get("duration")
        for k in range(min(_REPEATS, int((stop - begin) / every) + 1) if every else 1):
            start = begin + k * every if every else begin
            end = start if event["action"] == "set" else stop if lasts is None else start + float(lasts)
            yield {"from": start, "until": min(stop, end), "label": f"{event['action']} {event['signal']}"}
    for name, told in record.get("instances", {}).items():
        for what, value in told.get("build", {}).items():
            for begin, end in _stretches(value):
                if begin < stop:
                    yield {"from": begin, "until": min(stop, end), "label": f"{name}: {what}"}


def _stretches(value: Any) -> Iterator[tuple[float, float]]:
    """Times from and until which something holds, in the data a model was built with."""
    for entry in value if isinstance(value, list) else ():
        match entry:
            case {"from": int() | float() as begin, "until": int() | float() as end}:
                yield float(begin), float(end)
            case [int() | float() as begin, int() | float() as end]:
                yield float(begin), float(end)


def _requirements(content: Content) -> Iterator[dict[str, Any]]:
    """Of each requirement the signals it looks at, and where it was decided."""
    names = [*content.results.names(), *content.results.parameters]
    for verdict in content.metrics.get("requirements", ()):
        try:
            needed = Judge({}, {verdict["name"]: verdict["text"]}, names).needed_signals
        except RailcosimError:  # of another version
            needed = frozenset()
        looked = [name for name in content.results if name in needed]
        own = [name for name in looked if verdict["index"] is not None and f"[{verdict['index']}]" in name]
        told = {key: verdict[key] for key in ("name", "verdict", "time")}
        yield told | {"signals": (own or looked)[:_LOOKED_AT]}
