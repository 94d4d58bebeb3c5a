"""What happened on the way of a run: events, and the faults and outages that its models were built with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

_REPEATS = 1000
"""Of an event that comes again and again, so many are marked."""


def bands_of(record: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """From when until when something happened, s, and what; both ends are equal where it did in an instant."""
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
