"""`System` -> TOML that loads to an equal system."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..fmi import is_fmu_name
from ..system import Connection, Instance, Stepping, System
from .events import EVENT_KEYS
from .groups import OPTION_KEYS
from .simulation import SIMULATION_KEYS


def dump(system: System) -> str:
    """A scenario that loads to an equal system: counts, patterns and the preset in force are written out.

    Known values of other presets are left out, as are all of them where the system was modified: a scenario of its
    own does not owe them.

    Raises:
        TypeError: a value that TOML cannot hold.
    """
    return "\n".join(_lines(system)).lstrip("\n") + "\n"


def _lines(system: System) -> Iterator[str]:
    came, stepping = system.provenance, system.stepping
    yield from _assignments({key: getattr(came, key) or None for key in ("title", "source", "description")})
    yield from _assignments({"default_preset": system.provenance.preset})
    yield from ("", "[simulation]")
    keys = ("start_time", "stop_time", "step", "algorithm", "record")
    yield from _assignments({key: getattr(stepping, key) for key in keys} | {"seed": system.seed})
    yield from _assignments({key: getattr(stepping, key) or None for key in ("order", "record_only")})
    others = [key for key in SIMULATION_KEYS if key not in (*keys, "seed", "order", "record_only", "tolerances")]
    yield from _assignments(
        {key: value for key in others if (value := getattr(stepping, key)) != getattr(Stepping, key)}
    )
    if system.stepping.tolerances:
        yield from ("", "[simulation.tolerances]", *_assignments(system.stepping.tolerances))
    yield from () if system.instances else ("", "[instances]")
    for instance in system.instances.values():
        yield from _instance(instance)
    connections = {connection.target: _options(connection) for connection in system.connections}
    for section, table in (
        ("connections", connections),
        ("require", system.judged.requirements),
        ("metrics", system.judged.metrics),
    ):
        if table:
            yield from ("", f"[{section}]", *_assignments(table))
    study = {**system.study}
    varied = study.pop("vary", {})
    for section, table in (("study", study), ("study.vary", varied)):
        if table:
            yield from ("", f"[{section}]", *_assignments(table))
    for event in system.events:
        yield from ("", "[[events]]", *_assignments({key: getattr(event, key) for key in EVENT_KEYS}))
    owed, own = (
        [entry for entry in entries if _applies(entry, system)]
        for entries in (system.judged.published, system.judged.references)
    )
    for section, tables in (("published", owed), ("references", own), ("figures", system.judged.figures)):
        for entry in tables:
            yield from ("", f"[[{section}]]", *_assignments(entry))


def _assignments(table: Mapping[str, Any]) -> Iterator[str]:
    return (f"{_key(key)} = {toml_value(value)}" for key, value in table.items() if value is not None)


def _applies(entry: Mapping[str, Any], system: System) -> bool:
    came = system.provenance
    return not came.modified and bool(entry.get("preset", came.default_preset) == came.preset)


def _instance(instance: Instance) -> Iterator[str]:
    yield from ("", f"[instances.{_key(instance.name)}]")
    yield f"{'fmu' if is_fmu_name(instance.model) else 'component'} = {toml_value(instance.model)}"
    keys = (*OPTION_KEYS, "swapped")
    yield from _assignments({key: value for key in keys if (value := getattr(instance, key)) != getattr(Instance, key)})
    yield from _assignments({"build": instance.build or None})
    yield from (f"start.{line}" for line in _assignments(instance.start))


def _options(connection: Connection) -> str | dict[str, Any]:
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
