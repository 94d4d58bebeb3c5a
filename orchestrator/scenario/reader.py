"""TOML -> draft: which sections and keys there are, and what may stand in them."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from ..errors import ExpressionError, ScenarioError
from ..evaluation import FUNCTIONS, check_entry, parse, parse_requirement
from ..figures import FIGURE_KEYS, PANEL_KEYS
from ..names import SignalName
from ..problems import Problem, suggestion
from .groups import (
    MAX_COUNT,
    OPTION_KEYS,
    RESERVED,
    Draft,
    Entry,
    Group,
    Member,
    build_argument,
    is_plain,
    resolve_model,
    shown,
    truth,
)
from .patterns import NAME
from .simulation import SIMULATION_KEYS, TOLERANCES
from .toml_source import Source

TEXT_KEYS = ("title", "source", "description", "default_preset")
TOP_KEYS = (
    *TEXT_KEYS,
    "simulation",
    "instances",
    "connections",
    "events",
    "presets",
    "require",
    "metrics",
    "published",
    "references",
    "figures",
    "study",
)
INSTANCE_KEYS = ("component", "fmu", "count", *OPTION_KEYS, "swapped", "build", "start")


class Reader:
    """Reads one source into a draft and collects everything that is wrong with it in `problems`."""

    def __init__(self, source: Source, folder: str) -> None:
        self.source = source
        self.folder = folder
        self.problems: list[Problem] = []
        self.draft = Draft()
        self.strange: set[str] = set()  # a preset misspelt at the top would otherwise be told for every value

    def read(self) -> Draft:
        """The draft; what is wrong with the file stands in `problems` afterwards."""
        data = self.source.data
        self.check_keys(data, TOP_KEYS)
        for key in TEXT_KEYS:
            if key in data and (not isinstance(data[key], str) or (key == "default_preset" and not data[key])):
                self.problem(f"takes a text, not {shown(data[key])}", key)
        self._simulation(self.table(data, "simulation"))
        self._instances(self.table(data, "instances"))
        return self.draft

    # ---------------------------------------------------------------- helpers

    def entry(self, value: Any, *path: str | int) -> Entry:
        """A value with its place."""
        return Entry(value, self.source.origin(*path), place_of(path))

    def problem(self, message: str, *path: str | int, remedy: str = "") -> None:
        """Note something wrong at a place."""
        self.problems.append(self.entry(None, *path).problem(message, remedy))

    def failed(self, error: ScenarioError, *path: str | int) -> None:
        """Note all that is wrong at a place."""
        self.problems += error.at(self.entry(None, *path).where)

    def table(self, parent: Mapping[str, Any], key: str, *path: str | int) -> dict[str, Any]:
        """The table under a key; empty, with a problem noted, where something else stands there."""
        value = parent.get(key, {})
        if isinstance(value, dict):
            return value
        self.problem(f"is a table, [{place_of((*path, key))}], not {shown(value)}", *path, key)
        return {}

    def texts(self, section: str) -> dict[str, str]:
        """The texts of `[require]` or `[metrics]`, each of them readable."""
        found = {}
        for name, text in self.table(self.source.data, section).items():
            if not isinstance(text, str):
                self.problem(f"takes a text, not {shown(text)}", section, name)
                continue
            found[name] = text
            if section == "metrics":
                self._expression(text, section, name)
                continue
            try:
                parse_requirement(name, text)
            except ExpressionError as error:
                self.failed(error, section, name)
        return found

    def tables(self, section: str) -> list[dict[str, Any]]:
        """The tables of `[[events]]`, `[[published]]`, `[[references]]` or `[[figures]]`."""
        found = self.source.data.get(section, [])
        if isinstance(found, list) and all(isinstance(entry, dict) for entry in found):
            return found
        self.problem("is a list of tables", section, remedy=f"each begins with [[{section}]]")
        return []

    def values(self, section: str, metrics: Collection[str], presets: Collection[str]) -> list[dict[str, Any]]:
        """`[[published]]` or `[[references]]`; whether a metric has such an index is known with the interfaces only."""
        found = self.tables(section)
        for k, entry in enumerate(found):
            told = dict(entry)
            preset = told.get("preset")
            if isinstance(preset, str) and preset not in presets:
                if preset in self.strange:
                    del told["preset"]
                self.strange.add(preset)
            for key, problem in check_entry(told, section, {name: _AnyIndex() for name in metrics}, presets):
                place = (section, k, key) if key in told else (section, k)
                self.problems.append(problem.at(self.entry(None, *place).where))
        return found

    def figures(self) -> list[dict[str, Any]]:
        """The figures; the signals they draw are looked up when the interfaces are known."""
        found = self.tables("figures")
        for k, figure in enumerate(found):
            place = ("figures", k)
            self._panel(figure, (*PANEL_KEYS, *FIGURE_KEYS, "panels"), *place)
            if not is_plain(figure, tables=True):
                self.problem(
                    "takes numbers, texts, true or false, lists and tables of these", *place, remedy="no dates"
                )
            panels = figure.get("panels", [])
            for j, panel in enumerate(panels if isinstance(panels, list) else []):
                if isinstance(panel, dict):
                    self._panel(panel, PANEL_KEYS, "figures", k, "panels", j)
        return found

    def _panel(self, panel: Mapping[str, Any], valid: Collection[str], *path: str | int) -> None:
        self.check_keys(panel, valid, *path)
        texts = panel.get("y", [])
        for text in texts if isinstance(texts, list) else [texts]:
            if isinstance(text, str):
                self._expression(text, *path, "y")
            else:
                self.problem(f"takes expressions, texts, not {shown(text)}", *path, "y")

    def _expression(self, text: str, *path: str | int) -> None:
        try:
            parse(text, FUNCTIONS)
        except ExpressionError as error:
            self.failed(error, *path)

    def check_keys(self, table: Mapping[str, Any], valid: Collection[str], *path: str | int) -> None:
        """Note every key that does not belong there."""
        for key in table:
            if key not in valid:
                near = suggestion(key, valid) or f"valid here: {', '.join(valid)}"
                self.problem(f"unknown key '{key}'", *path, key, remedy=near)

    # ---------------------------------------------------------------- times, instances

    def _simulation(self, table: Mapping[str, Any]) -> None:
        self.check_keys(table, SIMULATION_KEYS, "simulation")
        draft = self.draft.simulation
        for key, value in table.items():
            if key in SIMULATION_KEYS and key != "tolerances":
                draft[key] = self.entry(value, "simulation", key)
        for keys, value in flatten(self.table(table, "tolerances", "simulation")):
            draft[TOLERANCES + ".".join(keys)] = self.entry(value, "simulation", "tolerances", *keys)

    def _instances(self, tables: Mapping[str, Any]) -> None:
        if not tables and "instances" not in self.source.data:
            none = Problem(self.source.label, "there are no instances", "begin one with [instances.NAME]")
            self.problems.append(none)
        singles: dict[str, dict[int, dict[str, Any]]] = {}
        written: dict[str, None] = {}
        for name in tables:
            table = self.table(tables, name, "instances")
            one = SignalName(name)
            is_member = one.number is not None and re.fullmatch(NAME, one.group)
            written[one.group if is_member else name] = None
            if is_member and one.number is not None:
                singles.setdefault(one.group, {})[one.number] = table
            elif self._name(name, "instances", name):
                self.draft.groups[name] = self._group(name, table)
        for name, members in singles.items():
            self._members(name, members)
        self.draft.groups = {name: self.draft.groups[name] for name in written if name in self.draft.groups}

    def _name(self, name: str, *path: str | int) -> bool:
        if re.fullmatch(NAME, name) and name not in RESERVED and not keyword.iskeyword(name):
            return True
        why = (
            "is taken"
            if name in RESERVED or keyword.iskeyword(name)
            else "takes letters, digits and _, not first a digit"
        )
        self.problem(f"an instance's name {why}", *path, remedy=f"choose another for '{name}'")
        return False

    def _group(self, name: str, table: Mapping[str, Any]) -> Group:
        path = ("instances", name)
        self.check_keys(table, INSTANCE_KEYS, *path)
        group = Group(name, self.source.origin(*path))
        if "component" not in table and "fmu" not in table:
            self.problem("says neither component = ... nor fmu = ...", *path, remedy="name the model")
        group.model = self._model(table, *path) or ""
        if "count" in table:
            group.count = check_count(self.entry(table["count"], *path, "count"), self.problems)
        group.swapped = self._swapped(table, *path) or False
        group.options = self._options_of(table, *path)
        group.build = self._build(table, *path)
        group.start = self._start(table, *path)
        return group

    def _members(self, name: str, tables: Mapping[int, Mapping[str, Any]]) -> None:
        """Instances written singly: all of a family, or some of one that also has a section of its own."""
        first = f"{name}[{min(tables)}]"
        group = self.draft.groups.get(name)
        if group is None:
            if not self._name(name, "instances", first):
                return
            group = Group(name, self.source.origin("instances", first), count=max(tables))
            missing = next((k for k in range(1, len(tables) + 1) if k not in tables), None)
            if missing is not None:
                wanted = "number from 1 without gaps"
                self.problem(f"there is no {name}[{missing}]", "instances", first, remedy=wanted)
                group.count = max(1, min(max(tables), MAX_COUNT))
            self.draft.groups[name] = group
        for k, table in tables.items():
            path = ("instances", f"{name}[{k}]")
            self.check_keys(table, [key for key in INSTANCE_KEYS if key != "count"], *path)
            if group.count is None or not 1 <= k <= group.count:
                there = "no count" if group.count is None else f"a count of {group.count}"
                self.problem(f"'{name}' has {there}, so there is no {name}[{k}]", *path)
                continue
            model = self._model(table, *path)
            if not group.model and not ("component" in table or "fmu" in table):
                self.problem("says neither component = ... nor fmu = ...", *path, remedy="name the model")
            group.members[k] = Member(
                self.source.origin(*path),
                model,
                self._swapped(table, *path),
                self._options_of(table, *path),
                self._build(table, *path),
                self._start(table, *path),
            )

    def _model(self, table: Mapping[str, Any], *path: str) -> str | None:
        kinds = [kind for kind in ("component", "fmu") if kind in table]
        if len(kinds) > 1:
            self.problem("component and fmu exclude each other", *path, "fmu", remedy="keep one")
        if not kinds:
            return None
        try:
            return resolve_model(table[kinds[0]], self.folder, kinds[0])
        except ScenarioError as error:
            self.failed(error, *path, kinds[0])
            return None

    def _swapped(self, table: Mapping[str, Any], *path: str) -> bool | None:
        return truth(self.entry(table["swapped"], *path, "swapped"), self.problems) if "swapped" in table else None

    def _options_of(self, table: Mapping[str, Any], *path: str) -> dict[str, Entry]:
        return {key: self.entry(table[key], *path, key) for key in OPTION_KEYS if key in table}

    def _build(self, table: Mapping[str, Any], *path: str) -> dict[str, Any]:
        build = {}
        for name, value in self.table(table, "build", *path).items():
            try:
                build[name] = build_argument(value, self.folder)
            except ScenarioError as error:
                self.failed(error, *path, "build", name)
        return build

    def _start(self, table: Mapping[str, Any], *path: str) -> dict[str, Entry]:
        start: dict[str, Entry] = {}
        for keys, value in flatten(self.table(table, "start", *path)):
            entry = self.entry(value, *path, "start", *keys)
            if is_plain(value):
                start[".".join(keys)] = entry
            else:
                self.problems.append(
                    entry.problem(f"takes numbers, texts, true or false, or lists of these, not {shown(value)}")
                )
        return start


class _AnyIndex(Collection[int | None]):
    """The indices of a metric while they are not known: every one may be there."""

    def __contains__(self, index: object) -> bool:
        return True

    def __iter__(self) -> Iterator[int | None]:
        return iter(())

    def __len__(self) -> int:
        return 0


def check_count(entry: Entry, problems: list[Problem]) -> int:
    """How many instances; 1, with a problem noted, where the value is unusable."""
    count = entry.value
    if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= MAX_COUNT:
        return count
    problems.append(entry.problem(f"takes a whole number from 1 to {MAX_COUNT}, not {shown(count)}"))
    return 1


def flatten(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """The values of nested tables, each with its keys: `start.engine.torque = 1` means the variable engine.torque."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from flatten(value, (*path, key))
        else:
            yield (*path, key), value


def place_of(path: tuple[str | int, ...]) -> str:
    """A place as messages write it: `presets.as-stated."cruise.alpha"`, `published[1].value`."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part + 1}]"
        else:
            text += ("." if text else "") + (part if re.fullmatch(r"[\w-]+", part) else f'"{part}"')
    return text
