"""What is changed in a scenario without editing it: presets, `--set`, `--with` and `--swap`."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import ScenarioError
from ..problems import Problem, suggestion
from .events import EVENT_KEYS
from .groups import OPTION_KEYS, Draft, Entry, Group, Member, build_argument, is_plain, resolve_model, shown
from .patterns import check_instance, read_reference
from .reader import check_count, flatten, place_of
from .simulation import SIMULATION_KEYS, set_tolerance
from .toml_source import Source, parse_value

_NAME = re.compile(r"(?:'(?:[^'\\]|\\.)*'|[^=])*+", re.DOTALL)
"""What stands before the sign of an assignment; a quoted name may hold one itself."""
EVENT = re.compile(r"events\s*+(?:\[\s*+(\d{1,9})\s*+\]\s*+)?(?:\.(.*))?", re.DOTALL)
_BUILD = re.compile(r"[A-Za-z_]\w*(?:\[[^\[\]]*\])?\.build\.[^.]+")


@dataclass(frozen=True)
class Target:
    """What a key such as `train[4].speed` means: a group, one of its members or all, and what to change there."""

    group: Group
    index: int | None
    rest: str


def read_target(text: str, draft: Draft) -> Target:
    """Read `NAME`, `NAME.what` or `NAME[2].what`.

    Raises:
        ScenarioError: there is no such instance.
    """
    counts = draft.counts
    name, index, rest = read_reference(text, counts, "train[4].speed or train.speed", whole=True)
    if name not in counts or index is not None:
        read = check_instance(name, index, counts)
        if read and read.free:
            remedy = f"write {name} for all or {name}[1] for one"
            raise ScenarioError(Problem(f"'{text}'", "i has no meaning here", remedy))
        return Target(draft.groups[name], read.offset if read else None, rest)
    return Target(draft.groups[name], None, rest)


def change(draft: Draft, key: str, entry: Entry, folder: str, problems: list[Problem]) -> str:
    """Apply one line of a preset or one `--set`; what is wrong with it is added to `problems`.

    Args:
        draft: what is changed.
        key: `simulation.step`, `cruise.alpha`, `train[4].speed`, `cruise.component`, `train.build.carriages`,
            `cruise.isolate`, `events[1].at`, ...
        entry: the new value.
        folder: what relative paths are relative to.
        problems: where problems go.

    Returns:
        the model that it puts in; empty where it changes something else.
    """
    try:
        if event := EVENT.fullmatch(key):
            _change_event(draft, event[1], (event[2] or "").strip(), entry)
        elif key.startswith("simulation."):
            _change_simulation(draft, key.removeprefix("simulation."), entry)
        else:
            return _change_instance(read_target(key, draft), entry, folder, problems)
    except ScenarioError as error:
        problems += error.at(entry.where)
    return ""


def _change_simulation(draft: Draft, key: str, entry: Entry) -> None:
    word, _, signal = key.partition(".")
    if word == "tolerances":
        _change_tolerances(draft, signal, entry)
        return
    if key not in SIMULATION_KEYS:
        near = suggestion(key, SIMULATION_KEYS) or f"valid here: {', '.join(SIMULATION_KEYS)}"
        raise ScenarioError(Problem("", f"unknown key 'simulation.{key}'", near))
    draft.simulation[key] = entry


def _change_tolerances(draft: Draft, signal: str, entry: Entry) -> None:
    if signal:
        set_tolerance(draft.simulation, signal, entry, draft.counts)
    elif isinstance(entry.value, dict):
        for keys, value in flatten(entry.value):
            set_tolerance(draft.simulation, ".".join(keys), Entry(value, entry.origin, entry.place), draft.counts)
    else:
        remedy = "write simulation.tolerances.INSTANCE.VARIABLE = [relative, absolute]"
        raise ScenarioError(Problem("", f"is a table, not {shown(entry.value)}", remedy))


def _change_event(draft: Draft, index: str | None, key: str, entry: Entry) -> None:
    """Give one event, by its place among `[[events]]`, another value; what it then is, is checked as a whole."""
    count = len(draft.events)
    if not count:
        raise ScenarioError(Problem("", "the scenario has no events", "write one as [[events]]"))
    if index is None:
        raise ScenarioError(Problem("", "does not say which event", f"write events[1].{key or 'at'} for the first"))
    if not 1 <= int(index) <= count:
        there = "there is events[1]" if count == 1 else f"there are events[1] to events[{count}]"
        raise ScenarioError(Problem("", f"there is no events[{index}]", there))
    if key not in EVENT_KEYS:
        near = suggestion(key, EVENT_KEYS) or f"valid here: {', '.join(EVENT_KEYS)}"
        raise ScenarioError(
            Problem("", f"an event has no '{key}'" if key else "names an event but not what to change", near)
        )
    event = draft.events[int(index) - 1]
    event.entries[key] = entry
    event.whole = entry


def _change_instance(target: Target, entry: Entry, folder: str, problems: list[Problem]) -> str:
    group, (word, _, rest) = target.group, target.rest.partition(".")
    if not word:
        remedy = f"write {group.name}.VARIABLE or {group.name}.component"
        raise ScenarioError(Problem("", "names an instance but not what to change", remedy))
    if word in ("component", "fmu") and not rest:
        model = resolve_model(entry.value, folder, word)
        group.swap(model, target.index)
        return model
    if word == "count" and not rest:
        if target.index is not None:
            raise ScenarioError(Problem("", "a count belongs to all", f"write {group.name}.count"))
        if group.count is None:
            remedy = f"give it one in [instances.{group.name}]"
            raise ScenarioError(Problem("", f"'{group.name}' has no count to change", remedy))
        group.count = check_count(entry, problems)
        group.members = {k: one for k, one in group.members.items() if k <= group.count}
        if not group.model and len(group.members) < group.count:
            listed = f"the instances of '{group.name}' are listed singly"
            raise ScenarioError(Problem("", listed, f"there are only {len(group.members)}"))
    elif word in OPTION_KEYS and not rest:
        group.set_option(word, entry, target.index)
    elif word == "build" and rest:
        group.set_build(rest, build_argument(entry.value, folder), entry.origin, target.index)
    else:
        if not is_plain(entry.value):
            raise ScenarioError(f"takes numbers, texts, true or false, or lists of these, not {shown(entry.value)}")
        name = rest if word == "start" and rest else target.rest
        group.set_start(name, entry, target.index)
    return ""


def preset_descriptions(source: Source, problems: list[Problem]) -> dict[str, str]:
    """What each preset says of itself; nothing where it does not, for the scenario's own would be untrue of it."""
    presets = source.data.get("presets", {})
    found = {}
    for name, table in presets.items() if isinstance(presets, dict) else ():
        text = table.get("description", "") if isinstance(table, dict) else ""
        if not isinstance(text, str):
            path = ("presets", name, "description")
            entry = Entry(text, source.origin(*path), place_of(path))
            problems.append(entry.problem(f"takes a text, not {shown(text)}"))
        found[name] = str(text)
    return found


def apply_preset(draft: Draft, source: Source, name: str, folder: str, problems: list[Problem]) -> None:
    """Apply a preset of the file: models first, so that what else it says is meant for them."""
    table = source.data["presets"][name]
    if not isinstance(table, dict):
        entry = Entry(table, source.origin("presets", name), place_of(("presets", name)))
        problems.append(entry.problem(f"is a table, not {shown(table)}"))
        return
    lines = [line for line in _preset_lines(table) if line[0] != ("description",)]
    lines.sort(key=lambda line: ".".join(line[0]).rpartition(".")[2] not in ("component", "fmu", "count"))
    for keys, value in lines:
        path = ("presets", name, *keys)
        change(draft, ".".join(keys), Entry(value, source.origin(*path), place_of(path)), folder, problems)


def _preset_lines(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """The lines of a preset; tables are opened, except a build argument's own value."""
    for key, value in table.items():
        keys = (*path, key)
        if isinstance(value, dict) and not _BUILD.fullmatch(".".join(keys)):
            yield from _preset_lines(value, keys)
        else:
            yield keys, value


def apply_settings(draft: Draft, settings: Sequence[str], problems: list[Problem], option: str = "--set") -> None:
    """Apply `--set train[4].speed=10` (or `--with train.carriages=8`); values are TOML, or the text as it is."""
    for text in settings:
        key, equals, value = split_assignment(text)
        entry = Entry(parse_value(value.strip()), f"{option} {text}")
        if not equals or not key.strip() or not value.strip():
            example = "train[4].speed=10" if option == "--set" else "train.carriages=8"
            problems.append(entry.problem(f"is not of the form name=value, as in {option} {example}"))
            continue
        if not is_plain(entry.value, tables=option == "--with" or key.strip() == "simulation.tolerances"):
            entry = Entry(value.strip(), entry.origin)
        name = key.strip() if option == "--set" else _build_key(key.strip())
        draft.named.append(change(draft, name, entry, os.getcwd(), problems))


def split_assignment(text: str) -> tuple[str, str, str]:
    """Key, sign and value of ``a.'x = y' = 3``, taken apart at the right sign; without one, all is key."""
    match = _NAME.match(text)
    if match is None or match.end() == len(text):  # all of it, where a quote is just a letter
        return text.partition("=")
    return match[0], "=", text[match.end() + 1 :]


def _build_key(key: str) -> str:
    name, _, argument = key.partition(".")
    return f"{name}.build.{argument.removeprefix('build.')}" if argument else key


def apply_swaps(draft: Draft, swaps: Sequence[str], problems: list[Problem]) -> None:
    """Apply `--swap cruise=PATH.fmu|Component|file.py:Class`; paths are relative to the current directory."""
    for text in swaps:
        key, equals, model = text.partition("=")
        where = f"--swap {text}"
        if not equals or not model.strip():
            example = "--swap cruise=my_controller.py:MyController"
            problems.append(Problem(where, f"is not of the form instance=model, as in {example}"))
            continue
        try:
            target = read_target(key.strip(), draft)
            if target.rest:
                remedy = f"write --swap {target.group.name}=..."
                raise ScenarioError(Problem("", "a swap replaces a whole instance", remedy))
            named = resolve_model(os.path.expanduser(model.strip()), os.getcwd(), "")
            target.group.swap(named, target.index)
            draft.named.append(named)
        except ScenarioError as error:
            problems += error.at(where)


def apply_step(draft: Draft, entry: Entry) -> float | None:
    """Set the communication step, and every sample time and step of an instance's own that equals the old one.

    Returns:
        the old step, where it differs; the sample times that components have by default follow later.
    """
    from_step = draft.simulation.get("step", Entry(0.1, ""))
    draft.simulation["step"] = entry
    old, new = from_step.value, entry.value
    if old == new or not isinstance(old, int | float) or not isinstance(new, int | float) or isinstance(new, bool):
        return None
    for group in draft.groups.values():
        parts: list[Group | Member] = [group, *group.members.values()]
        for key, entries in [("sample_time", p.start) for p in parts] + [("step", p.options) for p in parts]:
            if key in entries:
                known = entries[key]
                entries[key] = Entry(_follow(known.value, old, new), known.origin, known.place)
    return float(old)


def _follow(value: Any, old: float, new: float) -> Any:
    if isinstance(value, list):
        return [_follow(item, old, new) for item in value]
    return new if not isinstance(value, bool | str) and value == old else value
