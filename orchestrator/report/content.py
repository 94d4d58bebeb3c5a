"""What a page shows of one run, out of its directory: signals, panels, marks, verdicts, provenance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RailcosimError
from ..evaluation import needed_signals
from ..figures import COLOURS, curves_of, panels_of
from ..run import Results, read_metrics, read_record
from .payload import Packed, is_even, pack

MOST_SHOWN = 8
"""Lines of a panel that nobody chose."""


@dataclass
class Columns:
    """The columns of a page, each packed once; the script of the page unpacks them by number."""

    packed: list[Packed] = field(default_factory=list)
    told: list[dict[str, Any]] = field(default_factory=list)

    def add(self, values: NDArray[Any]) -> int:
        """Pack a column; its number."""
        words: list[str] = []
        if values.dtype.kind not in "fiub":  # texts: numbered in the order in which they come
            places: dict[str, int] = {}
            values = np.array([places.setdefault(str(word), len(places)) for word in values])
            words = list(places)
        column = pack(values)
        self.packed.append(column)
        self.told.append({"points": len(values), "offset": column.offset} | ({"words": words} if words else {}))
        return len(self.packed) - 1


@dataclass(frozen=True)
class Content:
    """One run.

    Attributes:
        directory: of the run. record, metrics: run.json and metrics.json. results: the signals.
        shown: what the page's script is given, but for the columns.
    """

    directory: Path
    record: Mapping[str, Any]
    metrics: Mapping[str, Any]
    results: Results
    shown: Mapping[str, Any]


def gather(directory: Path, columns: Columns) -> Content:
    """Read a run and pack its signals.

    Args:
        directory: of the run, complete or cut short.
        columns: to which its columns are added.

    Raises:
        ScenarioError: there is no run that can be read.
    """
    record, results = read_record(directory), Results.load(directory)
    metrics = read_metrics(directory)
    time = results.time
    places = {name: columns.add(results[name]) for name in results}
    even = is_even(time)
    shown = {
        "name": str(record.get("scenario") or directory.name),
        "title": str(record.get("title") or record.get("scenario") or directory.name),
        "time": {"first": float(time[0]), "last": float(time[-1])} if even and len(time) else columns.add(time),
        "points": len(time),
        "signals": [_signal(name, place, results) for name, place in places.items()],
        "panels": [*_panels(results, columns, places)],
        "bands": _bands(record),
        "requirements": _requirements(metrics, results),
        "trains": _trains(results),
    }
    return Content(directory, record, metrics, results, shown)


def _signal(name: str, place: int, results: Results) -> dict[str, Any]:
    values = results[name]
    told = {"name": name, "unit": results.units.get(name, ""), "column": place}
    return told | ({} if values.dtype.kind == "f" else {"steps": True})


def _panels(results: Results, columns: Columns, places: Mapping[str, int]) -> list[dict[str, Any]]:
    """The panels that the scenario's figures ask for, as far as they are over time."""
    found = []
    for figure in results.figures:
        for panel in panels_of(figure):
            if panel.get("x") is not None:
                continue
            try:
                curves = curves_of(panel, results)
            except RailcosimError:  # what a run that was cut short does not have
                continue
            lines = []
            for k, curve in enumerate(curves):
                scale = float(panel.get("scale", 1.0))
                same = next((n for n in _plain(panel) if _is_same(results, n, curve.y)), None)
                line: dict[str, Any] = {"label": curve.label.replace("\\$", "$"), "colour": COLOURS[k % len(COLOURS)]}
                if same is not None and scale == 1.0:
                    line["column"] = places[same]
                elif len(curve.y) == len(results.time):
                    line["column"] = columns.add(curve.y * scale)
                else:
                    line |= {"column": columns.add(curve.y * scale), "x": columns.add(curve.x)}
                lines.append(line)
            title = str(panel.get("title") or figure["title"])
            label = str(panel.get("y_label", "")) or _unit_label({curve.unit for curve in curves})
            found.append({"title": title, "label": label, "lines": lines})
    return found


def _plain(panel: Mapping[str, Any]) -> list[str]:
    """The entries of a panel, of which those that are a signal's name may be shown as that signal."""
    texts = panel["y"]
    return [texts] if isinstance(texts, str) else list(texts)


def _is_same(results: Results, name: str, values: NDArray[np.float64]) -> bool:
    return name in results and len(results[name]) == len(values) and bool(np.array_equal(results[name], values, True))


def _unit_label(units: set[str]) -> str:
    unit = next(iter(units)) if len(units) == 1 else ""
    return f"[{unit}]" if unit else ""


def _bands(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What happened on the way: events that lasted, and findings."""
    stop = float(record["stop_time"])
    found = []
    for event in record.get("events", ()):
        begin = float(event["at"])
        end = stop if event.get("duration") is None and event["action"] != "set" else begin + float(event["duration"] or 0)
        every = event.get("every")
        repeats = int((stop - begin) / every) + 1 if every else 1
        for k in range(min(repeats, 1000)):
            shift = k * every if every else 0.0
            label = f"{event['action']} of {event['signal']}"
            found.append({"from": begin + shift, "until": min(stop, end + shift), "label": label})
    return found


def _requirements(metrics: Mapping[str, Any], results: Results) -> list[dict[str, Any]]:
    """Of each requirement the signals it looks at, and where it was decided."""
    names = [*results.names(), *results.parameters]
    found = []
    for verdict in metrics.get("requirements", ()):
        try:
            needed = needed_signals({}, {verdict["name"]: verdict["text"]}, names)
        except RailcosimError:
            needed = set()
        looked = [name for name in results if name in needed]
        of_index = [name for name in looked if f"[{verdict['index']}]" in name] if verdict["index"] is not None else looked
        told = {key: verdict[key] for key in ("name", "verdict", "time", "index")}
        found.append(told | {"signals": (of_index or looked)[:MOST_SHOWN]})
    return found


def _trains(results: Results) -> list[dict[str, Any]]:
    """Whatever has a position, a speed and an acceleration: where it is, how fast, how long."""
    found = []
    instances = dict.fromkeys(name.partition(".")[0] for name in results)
    for instance in instances:
        head = [f"{instance}.{what}" for what in ("position", "speed", "acceleration")]
        if not all(name in results or f"{name}[1]" in results for name in head):
            continue
        vehicles = [name for name in results if name.startswith(f"{instance}.position[")]
        position, speed = (name if name in results else f"{name}[1]" for name in head[:2])
        length = results.parameters.get(f"{instance}.length", 0.0)
        if not length and f"{instance}.vehicle_length" in results.parameters:
            forces = [name for name in results if name.startswith(f"{instance}.vehicle_force[")]
            length = max(1, len(forces)) * float(results.parameters[f"{instance}.vehicle_length"])
        limits = [name for name in _limits(results, instance)]
        found.append(
            {
                "name": instance,
                "position": position,
                "speed": speed,
                "tail": vehicles[-1] if vehicles else None,
                "length": float(length),
                "limits": limits,
            }
        )
    return found


def _limits(results: Results, instance: str) -> list[str]:
    """Signals that are a ceiling of this train's speed: those of instances with its number, or without any."""
    number = instance.partition("[")[2]
    found = []
    for name in results:
        owner, _, what = name.partition(".")
        if what in ("speed_limit", "ceiling") and owner.partition("[")[2] in ("", number):
            found.append(name)
    return found


def series(results: Results, names: Sequence[str]) -> list[NDArray[Any]]:
    """Several signals at once."""
    return [results[name] for name in names]
