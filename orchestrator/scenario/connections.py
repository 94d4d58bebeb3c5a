"""`[connections]`: which input follows which output, and what happens to the value on the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import ScenarioError
from ..system import Connection
from .groups import number, shown, truth
from .patterns import Rule, read_endpoint
from .reader import Reader

CONNECTION_KEYS = ("from", "delay", "scale", "offset", "threshold", "optional", "convert", "map")


def read_connections(reader: Reader) -> list[Rule]:
    """The lines of the section as rules; what is wrong with them goes to the reader's problems."""
    rules = []
    for keys, value in _lines(reader, reader.table(reader.source.data, "connections"), ()):
        path = ("connections", *keys)
        options = _options(reader, value, *path)
        ends = []
        for end in (".".join(keys), options.source):
            try:
                ends.append(read_endpoint(end, reader.draft.counts))
            except ScenarioError as error:
                reader.failed(error, *path)
        if len(ends) == 2:
            rules.append(Rule(ends[0], ends[1], options))
    return rules


def _lines(
    reader: Reader, table: Mapping[str, Any], path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], str | dict[str, Any]]]:
    """The lines of the section; `gust.size = "x.y"` without quotes is a table in TOML, and a line here."""
    for key, value in table.items():
        keys = (*path, key)
        is_options = "." in key or (path and isinstance(value, dict) and any(k in CONNECTION_KEYS for k in value))
        if isinstance(value, dict) and not is_options:
            yield from _lines(reader, value, keys)
        elif isinstance(value, str | dict):
            yield keys, value
        else:
            reader.problem(
                f'takes "instance.output" or {{ from = "instance.output", ... }}, not {shown(value)}',
                "connections",
                *keys,
            )


def _options(reader: Reader, value: str | Mapping[str, Any], *path: str) -> Connection:
    made = Connection("", path[-1], origin=reader.source.origin(*path))
    if isinstance(value, str):
        made.source = value
        return made
    reader.check_keys(value, CONNECTION_KEYS, *path)
    if not isinstance(value.get("from"), str):
        reader.problem("names no source", *path, remedy='write { from = "instance.output", ... }')
    else:
        made.source = value["from"]
    delay = value.get("delay", 0)
    if isinstance(delay, bool) or not isinstance(delay, int) or not 0 <= delay <= 10**6:
        reader.problem(f"takes a whole number of communication steps, at least 0, not {shown(delay)}", *path, "delay")
    else:
        made.delay = delay
    entries = {key: reader.entry(value[key], *path, key) for key in CONNECTION_KEYS if key in value}
    if "scale" in entries:
        made.scale = number(entries["scale"], reader.problems, 1.0)
    if "threshold" in entries:
        made.threshold = number(entries["threshold"], reader.problems, 0.5)
    if "optional" in entries:
        made.optional = truth(entries["optional"], reader.problems)
    if "convert" in entries:
        made.convert = truth(entries["convert"], reader.problems)
    if "offset" in entries:
        made.offset = number(entries["offset"], reader.problems)
    if "map" in entries:
        made.map = _map(reader, entries["map"].value, *path)
    return made


def _map(reader: Reader, table: Any, *path: str) -> dict[str, bool | int | str] | None:
    """What becomes of single values: by the value, as text."""
    if isinstance(table, dict) and table and all(isinstance(value, bool | int | str) for value in table.values()):
        return dict(table)
    reader.problem(
        f"takes a table of what becomes of which value, not {shown(table)}",
        *path,
        "map",
        remedy='as in { "1" = 10, "2" = 20 }, { true = false } or { park = "hold" }',
    )
    return None
