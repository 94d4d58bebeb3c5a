"""Values that are changed in a system as `--set` changes them in a scenario: starts, the seed, events."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..errors import ScenarioError
from ..names import SignalName
from ..problems import Problem
from ..system import Event, System
from .changes import EVENT, change
from .events import expand_events, read_events
from .groups import OPTION_KEYS, Draft, Entry, EventDraft, Group, Member, expand_group
from .patterns import NAME
from .simulation import read_seed
from .toml_source import parse_value
from .writer import event_table, toml_value

SEED = "simulation.seed"
_STRUCTURE = ("component", "fmu", "count", *OPTION_KEYS)
_GROUP = re.compile(rf"{NAME}(?:\[[^\[\]]*\])?")


def is_structural(key: str) -> bool:
    """Whether a change alters what a system is made of or how it is stepped, rather than a value in it.

    Args:
        key: as `--set` has it, or ``"preset"``, or an instance alone whose model is swapped.
    """
    event = EVENT.fullmatch(key)
    if key == SEED or event:
        return bool(event and event[2] == "from")
    name, _, rest = key.partition(".")
    return name == "simulation" or not rest or rest in _STRUCTURE or rest.startswith("build.")


def assignment(key: str, value: Any) -> str:
    """A change as `--set` takes it: ``cruise.alpha=0.03``.

    Raises:
        TypeError: a value that TOML cannot hold.
    """
    text = toml_value(value)
    if isinstance(value, str) and value == value.strip() and value and parse_value(value) == value:
        text = value  # an expression, say: a text that is nothing else needs no quotes
    return f"{key}={text}"


def changed(system: System, changes: Mapping[str, Any]) -> System:
    """A copy of a system with other values in it, as if they had been given to `load` by `--set`.

    Args:
        system: from `load`, or built by hand.
        changes: by key: ``{"cruise.alpha": 0.03, "train[2].mass": 4e5, "simulation.seed": 7, "events[1].at": 120.0}``;
            what comes later wins.

    Raises:
        ScenarioError: with every problem of the changes; some of them are of the structure, which is `load`'s.
    """
    if not changes:
        return system
    problems: list[Problem] = []
    draft = _drafted(system, {key.partition(".")[0].partition("[")[0].strip() for key in changes})
    for key, value in changes.items():
        entry = Entry(_plain(value), f"--set {assignment(key, value)}")
        if is_structural(key):
            remedy = "load the scenario with it, or let a Runner do so"
            problems.append(entry.problem("changes what a system is made of, not a value in it", remedy))
        elif key == SEED:
            draft.simulation["seed"] = entry
        else:
            change(draft, key, entry, os.getcwd(), problems)
    made = _finished(system, draft, problems)
    if problems:
        raise ScenarioError(list(dict.fromkeys(problems)))
    return made


def _plain(value: Any) -> Any:
    """A value without NumPy's types, as TOML would have given it."""
    return parse_value(toml_value(value))


def _drafted(system: System, concerned: set[str]) -> Draft:
    """The system before expansion: instances that are numbered as one group, with what they say if it is concerned."""
    draft = Draft(events=_entries(system.events))
    for instance in system.instances.values():
        name = SignalName(instance.name)
        number = name.number
        group = draft.groups.setdefault(
            name.group, Group(name.group, instance.origin, instance.model, None if number is None else 0)
        )
        if number is not None:
            group.count = max(group.count or 0, number)
        if name.group in concerned:
            start = {key: Entry(value, instance.origin) for key, value in instance.start.items()}
            if number is None:
                group.start = start
            else:
                group.members[number] = Member(instance.origin, instance.model, start=start)
    return draft


def _entries(events: list[Event]) -> list[EventDraft]:
    """The entries that events belong to, each with its signals one by one."""
    entries: dict[int, EventDraft] = {}
    for k, event in enumerate(events, 1):
        number = event.number or k
        table = event_table(event)
        each: dict[str, list[Any]] = {key: [] for key in ("signal", "from") if table[key] is not None}
        given: dict[str, Any] = table | each
        written = {key: Entry(x, event.origin, f"events[{number}].{key}") for key, x in given.items() if x is not None}
        entries.setdefault(number, EventDraft(Entry(None, event.origin, f"events[{number}]"), written))
        for key in each:
            entries[number].entries[key].value.append(table[key])
    return [entries[number] for number in sorted(entries)]


def _finished(system: System, draft: Draft, problems: list[Problem]) -> System:
    """The system with the values of a draft."""
    seed = system.seed
    if "seed" in draft.simulation:
        seed = read_seed(draft.simulation["seed"], problems)
    instances, origins = dict(system.instances), dict(system.provenance.origins)
    for group in draft.groups.values():
        for made, told in expand_group(group, problems) if group.start or group.members else ():
            if made.name in instances:
                instances[made.name] = replace(instances[made.name], start=made.start)
                origins |= {key: where for key, where in told.items() if where.startswith("--set ")}
    events = expand_events(read_events(draft.events, problems), draft.counts, problems)
    is_same = instances == system.instances and events == system.events and seed == system.seed
    modified = system.provenance.modified or not is_same
    return system.changed(instances=instances, events=events, seed=seed, origins=origins, modified=modified)
