"""`System` -> TOML that loads to an equal system."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..fmi import is_fmu_name
from ..system import Connection, Event, Instance, Stepping, System
from .events import EVENT_KEYS
from .groups import OPTION_KEYS
from .simulation import SIMULATION_KEYS

STANDARD, TIMES = ("instances", "connections"), ("start_time", "stop_time", "step")
"""What other formats have words for: sections, and keys of the simulation."""
_USUAL = Stepping()
_ALWAYS = ("simulation", "instances")
"""Sections that a scenario has even where they hold nothing."""


def dump(system: System) -> str:
    """A scenario that loads to an equal system: counts, patterns and the preset in force are written out.

    Known values of other presets are left out, as are all of them where the system was modified: a scenario of its
    own does not owe them.

    Raises:
        TypeError: a value that TOML cannot hold.
    """
    return text_of(tables_of(system))


def dump_beside(system: System) -> str:
    """What a scenario says of a system beside instances, connections and times: these have words elsewhere, too.

    Raises:
        TypeError: a value that TOML cannot hold.
    """
    tables = tables_of(system)
    for section in STANDARD:
        del tables[section]
    for key in TIMES:
        del tables["simulation"][key]
    return text_of(tables)


def tables_of(system: System) -> dict[str, Any]:
    """What a scenario says of a system, by section, without what goes without saying."""
    came, stepping = system.provenance, system.stepping
    keys = ("start_time", "stop_time", "step", "algorithm", "record")
    simulation = {key: getattr(stepping, key) for key in keys} | {"seed": system.seed}
    simulation |= {key: getattr(stepping, key) or None for key in ("order", "record_only")}
    for key in SIMULATION_KEYS:
        if key not in simulation and (value := getattr(stepping, key)) != getattr(_USUAL, key):
            simulation[key] = value
    owed, own = (
        [entry for entry in entries if _applies(entry, system)]
        for entries in (system.judged.published, system.judged.references)
    )
    return {
        **{key: getattr(came, key) or None for key in ("title", "source", "description")},
        "default_preset": came.preset,
        "simulation": simulation,
        "instances": {one.name: _instance(one) for one in system.instances.values()},
        "connections": {one.target: _source(one) for one in system.connections},
        "require": system.judged.requirements,
        "metrics": system.judged.metrics,
        "study": system.study,
        "events": [event_table(event) for event in system.events],
        "published": owed,
        "references": own,
        "figures": system.judged.figures,
    }


def text_of(tables: Mapping[str, Any]) -> str:
    """The text of a scenario.

    Args:
        tables: by section, what they hold by key; None stands for nothing.

    Raises:
        TypeError: a value that TOML cannot hold.
    """
    return "\n".join(_lines(tables)).lstrip("\n") + "\n"


def _lines(tables: Mapping[str, Any]) -> Iterator[str]:
    sections = {key: value for key, value in tables.items() if isinstance(value, dict) or _is_repeated(value)}
    yield from _assignments({key: value for key, value in tables.items() if key not in sections})
    for section, content in sections.items():
        if isinstance(content, dict):
            yield from _section(section, content)
            continue
        for entry in content:
            yield from ("", f"[[{section}]]", *_assignments(entry))


def _is_repeated(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, dict) for entry in value)


def _section(section: str, content: Mapping[str, Any]) -> Iterator[str]:
    """A section, the tables in it as sections of their own; those of connections stand in a line."""
    inner = {} if section == "connections" else {key: one for key, one in content.items() if isinstance(one, dict)}
    if len(inner) < len(content) or (section in _ALWAYS and not content):
        yield from ("", f"[{section}]", *_assignments({key: content[key] for key in content if key not in inner}))
    for key, table in inner.items():
        yield from ("", f"[{section}.{_key(key)}]")
        yield from _assignments({name: value for name, value in table.items() if name != "start"})
        yield from (f"start.{line}" for line in _assignments(table.get("start", {})))


def _assignments(table: Mapping[str, Any]) -> Iterator[str]:
    return (f"{_key(key)} = {toml_value(value)}" for key, value in table.items() if value is not None)


def _applies(entry: Mapping[str, Any], system: System) -> bool:
    came = system.provenance
    return not came.modified and bool(entry.get("preset", came.default_preset) == came.preset)


def _instance(instance: Instance) -> dict[str, Any]:
    keys = (*OPTION_KEYS, "swapped")
    return {
        "fmu" if is_fmu_name(instance.model) else "component": instance.model,
        **{key: value for key in keys if (value := getattr(instance, key)) != getattr(Instance, key)},
        "build": instance.build or None,
        "start": instance.start,
    }


def event_table(event: Event) -> dict[str, Any]:
    """The keys of an event as `[[events]]` has them; None where there is nothing to say."""
    source = None if event.source is None else _source(event.source)
    return {key: source if key == "from" else getattr(event, key) for key in EVENT_KEYS}


def _source(connection: Connection) -> str | dict[str, Any]:
    keys = ("delay", "scale", "offset", "threshold", "optional", "convert", "map")
    given = {key: value for key in keys if (value := getattr(connection, key)) != getattr(Connection, key)}
    return {"from": connection.source, **given} if given else connection.source


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _text(text: str) -> str:
    # JSON's escapes are a subset of TOML's, which forbids one more control character
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_value(value: Any) -> str:
    """A value as TOML writes it.

    Raises:
        TypeError: a value that TOML cannot hold.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case str():
            return _text(value)
        case list() | tuple():
            return f"[{', '.join(toml_value(item) for item in value)}]"
        case dict():
            return (
                f"{{ {', '.join(f'{_key(key)} = {toml_value(item)}' for key, item in value.items())} }}"
                if value
                else "{}"
            )
    raise TypeError(f"a scenario cannot hold {value!r}")
