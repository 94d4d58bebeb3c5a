"""`[connections]`: which input follows which output, and what happens to the value on the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import ScenarioError
from ..problems import Problem
from ..system import Connection
from .groups import Entry, number, shown, truth
from .groups import whole as counted
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
    entries: dict[str, Entry] = {}
    if not isinstance(value, str):
        reader.check_keys(value, CONNECTION_KEYS, *path)
        entries = {key: reader.entry(value[key], *path, key) for key in CONNECTION_KEYS if key in value}
    made = read_source(reader.entry(value, *path), entries, reader.problems)
    made.target = path[-1]
    return made


def read_source(whole: Entry, entries: Mapping[str, Entry], problems: list[Problem]) -> Connection:
    """What an input is to follow, and how; the connection has no target yet.

    Args:
        whole: a text, or a table.
        entries: the keys of the table.
        problems: where problems go.
    """
    made = Connection("", "", origin=whole.origin)
    if isinstance(whole.value, str):
        made.source = whole.value
        return made
    source, delay = entries.get("from"), entries.get("delay")
    if source is None or not isinstance(source.value, str):
        problems.append(whole.problem("names no source", 'write { from = "instance.output", ... }'))
    else:
        made.source = source.value
    if delay is not None:
        made.delay = counted(
            delay, problems, lambda x: 0 <= x <= 10**6, "a whole number of communication steps, at least 0", 0
        )
    if "scale" in entries:
        made.scale = number(entries["scale"], problems, 1.0)
    if "threshold" in entries:
        made.threshold = number(entries["threshold"], problems, 0.5)
    if "optional" in entries:
        made.optional = truth(entries["optional"], problems)
    if "convert" in entries:
        made.convert = truth(entries["convert"], problems)
    if "offset" in entries:
        made.offset = number(entries["offset"], problems)
    if "map" in entries:
        made.map = _map(entries["map"], problems)
    return made


def _map(entry: Entry, problems: list[Problem]) -> dict[str, bool | int | str] | None:
    """What becomes of single values: by the value, as text."""
    table = entry.value
    if isinstance(table, dict) and table and all(isinstance(value, bool | int | str) for value in table.values()):
        return dict(table)
    what = f"takes a table of what becomes of which value, not {shown(table)}"
    remedy = 'as in { "1" = 10, "2" = 20 }, { true = false } or { park = "hold" }'
    problems.append(entry.problem(what, remedy))
    return None
