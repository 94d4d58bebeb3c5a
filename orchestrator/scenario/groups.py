"""A scenario between TOML and `System`: groups of instances, before counts, lists and patterns are expanded.

Presets and options on the command line change the draft, so that `cruise.alpha` means all controllers whatever their
number, and what they say is checked as if it stood in the file.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...fmus.references import data_file, names_data
from .. import world
from ..errors import ScenarioError
from ..fmi import is_fmu_name
from ..problems import Problem, suggestion
from ..system import TOGETHER, Instance
from .patterns import NAME, Rule, member

MAX_COUNT = 10_000
RESERVED = frozenset(
    {"simulation", "instances", "connections", "events", "presets"}
    | {"require", "metrics", "published", "references", "figures"}
)
OPTION_KEYS = ("step", "isolate", "step_timeout", "memory_limit")
_PYTHON_CLASS = re.compile(rf"(.*\.py):({NAME})", re.DOTALL)


@dataclass(frozen=True)
class Entry:
    """A value, where it stands (`file.toml:12`, `--set x.y=1`) and what it is called there."""

    value: Any
    origin: str
    place: str = ""

    @property
    def where(self) -> str:
        """Where it stands and what it is called there."""
        return f"{self.origin}: {self.place}" if self.place else self.origin

    def problem(self, message: str, remedy: str = "") -> Problem:
        """Something wrong with it."""
        return Problem(self.where, message, remedy)


@dataclass
class Member:
    """What is said of one instance of a group alone."""

    origin: str = ""
    model: str | None = None
    swapped: bool | None = None  # None: as the group
    options: dict[str, Entry] = field(default_factory=dict)
    build: dict[str, Any] = field(default_factory=dict)
    start: dict[str, Entry] = field(default_factory=dict)
    built_by: dict[str, str] = field(default_factory=dict)  # where build arguments were changed


@dataclass
class Group:
    """Instances that are written together: `train`, of which there are `count`; one without a number where None."""

    name: str
    origin: str
    model: str = ""
    count: int | None = None
    swapped: bool = False
    options: dict[str, Entry] = field(default_factory=dict)
    build: dict[str, Any] = field(default_factory=dict)
    start: dict[str, Entry] = field(default_factory=dict)
    built_by: dict[str, str] = field(default_factory=dict)
    members: dict[int, Member] = field(default_factory=dict)

    def swap(self, model: str, index: int | None = None) -> None:
        """Put another model in the place of all, or of one; connections, start values and build arguments stay."""
        ones = list(self.members.values()) if index is None else [self.members.setdefault(index, Member())]
        for one in ones:
            was_swapped = self.swapped if one.swapped is None else one.swapped
            one.swapped = was_swapped or model != (one.model or self.model)
            one.model = None if index is None else model
        if index is None:
            self.swapped |= model != self.model
            self.model = model

    def set_option(self, name: str, entry: Entry, index: int | None = None) -> None:
        """Give one of `OPTION_KEYS` to all, or to one."""
        if index is not None:
            self.members.setdefault(index, Member()).options[name] = entry
            return
        self.options[name] = entry
        for one in self.members.values():
            one.options.pop(name, None)

    def set_build(self, name: str, value: Any, origin: str, index: int | None = None) -> None:
        """Give a build argument to all, or to one."""
        one = self if index is None else self.members.setdefault(index, Member())
        one.build[name], one.built_by[name] = value, origin
        for other in self.members.values() if index is None else ():
            other.build.pop(name, None)
            other.built_by.pop(name, None)

    def set_start(self, name: str, entry: Entry, index: int | None = None) -> None:
        """Give a start value to all, or to one; what comes later wins, a whole array over its elements too."""
        if index is None:
            for one in self.members.values():
                _drop(one.start, name)
        table = self.start if index is None else self.members.setdefault(index, Member()).start
        _drop(table, name)
        table[name] = entry


@dataclass
class EventDraft:
    """One entry of `[[events]]` as written: where it stands, or what changed it last, and its keys."""

    whole: Entry
    entries: dict[str, Entry]


@dataclass
class Draft:
    """A scenario before expansion; `named` are the models that options put in."""

    simulation: dict[str, Entry] = field(default_factory=dict)
    groups: dict[str, Group] = field(default_factory=dict)
    events: list[EventDraft] = field(default_factory=list)
    rules: list[Rule] = field(default_factory=list)
    named: list[str] = field(default_factory=list)

    @property
    def counts(self) -> dict[str, int | None]:
        """Group names with their count."""
        return {group.name: group.count for group in self.groups.values()}


def _drop(table: dict[str, Entry], name: str) -> None:
    for key in [key for key in table if key == name or key.startswith(f"{name}[")]:
        del table[key]


def resolve_model(text: Any, folder: str, kind: str = "component") -> str:
    """A model as `Instance.model` has it: files absolute, names of the catalogue as they are.

    Args:
        text: a name, `file.py:Class`, or a path that ends in `.fmu`.
        folder: what relative paths are relative to.
        kind: the key it stands under, `component` or `fmu`; empty where either will do.

    Raises:
        ScenarioError: it is none of these, or there is no such file.
    """
    if not isinstance(text, str) or not text.strip():
        raise ScenarioError("takes a text: a component's name, 'file.py:Class', or the path of an .fmu")
    is_fmu = is_fmu_name(text)
    if kind == "component" and is_fmu:
        raise ScenarioError(Problem("", f"'{text}' is an FMU file", "write fmu = ... instead of component = ..."))
    if is_fmu or kind == "fmu":
        if not is_fmu:
            remedy = "for a component of the catalogue write component = ..."
            if text.lower().endswith(".ssp"):
                remedy = "it is a system of FMUs: run it as it is, or unpack it and name one of those in its resources/"
            raise ScenarioError(Problem("", f"'{text}' does not end in .fmu", remedy))
        return _existing(text, folder)
    match = _PYTHON_CLASS.fullmatch(text)
    if match:
        return f"{_existing(match[1], folder)}:{match[2]}"
    if text.endswith(".py") or ".py:" in text:
        raise ScenarioError(Problem("", f"'{text}' does not name a class", "write 'file.py:Class'"))
    if not re.fullmatch(NAME, text):
        raise ScenarioError(f"'{text}' is neither a component's name, nor 'file.py:Class', nor the path of an .fmu")
    return text


def _existing(text: str, folder: str) -> str:
    path = os.path.abspath(os.path.join(folder, text))
    if os.path.isfile(path):
        return path
    if os.path.isdir(path):
        raise ScenarioError(Problem("", f"'{path}' is a folder", "name a file; an unpacked FMU is to be zipped"))
    near = ""
    if os.path.isdir(os.path.dirname(path)):
        near = suggestion(os.path.basename(path), world.listdir(os.path.dirname(path)))
    raise ScenarioError(Problem("", f"there is no file '{path}'", near))


def build_argument(value: Any, folder: str) -> Any:
    """A build argument as it is: a text that names a data file becomes an absolute path.

    Raises:
        ScenarioError: there is no such file, or the value is a date or a time.
    """
    if names_data(value):
        return _existing(str(data_file(value, Path(folder))), folder)
    if not is_plain(value, tables=True):
        raise ScenarioError(
            Problem("", "takes numbers, texts, true or false, lists and tables of these", "quote a date")
        )
    return value


def is_plain(value: Any, tables: bool = False) -> bool:
    """Whether a value consists of numbers, texts and truth values, lists of these, and perhaps tables."""
    if isinstance(value, list):
        return all(is_plain(item, tables) for item in value)
    if isinstance(value, dict):
        return tables and all(is_plain(item, tables) for item in value.values())
    return isinstance(value, bool | int | float | str)


def expand_group(group: Group, problems: list[Problem]) -> list[tuple[Instance, dict[str, str]]]:
    """The instances of a group, each with the origins of its options and start values."""
    members: list[tuple[Instance, dict[str, str]]] = []
    total = 1 if group.count is None else group.count
    for entry_name, entry in group.start.items():
        if group.count is not None and isinstance(entry.value, list) and len(entry.value) != total:
            values = f"{len(entry.value)} value{'s' * (len(entry.value) != 1)}"
            message = f"{entry_name} has {values} for the {total} instances of '{group.name}'"
            problems.append(entry.problem(message, "give one for each, or a single value for all"))
    for k in range(total):
        index = None if group.count is None else k + 1
        one = group.members.get(k + 1, Member()) if index else Member()
        start = {name: _share(entry, k, index) for name, entry in group.start.items()}
        for name, entry in one.start.items():
            _drop(start, name)
            start[name] = entry
        options = {**group.options, **one.options}
        model, swapped = one.model or group.model, group.swapped if one.swapped is None else one.swapped
        build, built_by = {**group.build, **one.build}, {**group.built_by, **one.built_by}
        if swapped and is_fmu_name(model):  # what a swap left behind is nobody's mistake
            build = {name: value for name, value in build.items() if built_by.get(name, "").startswith("--")}
        instance = Instance(
            member(group.name, index),
            model,
            build,
            {name: entry.value for name, entry in start.items()},
            index,
            total,
            **_options(options, problems),
            swapped=swapped,
            origin=one.origin or group.origin,
        )
        origins = {f"instances.{instance.name}.{key}": entry.origin for key, entry in options.items()}
        origins |= {f"{instance.name}.{name}": entry.origin for name, entry in start.items()}
        origins |= {f"instances.{instance.name}.build.{name}": origin for name, origin in built_by.items()}
        members.append((instance, origins))
    return members


def _options(entries: dict[str, Entry], problems: list[Problem]) -> dict[str, Any]:
    """The values of `OPTION_KEYS`, checked."""
    values: dict[str, Any] = {}
    for key, entry in entries.items():
        if key == "isolate":
            values[key] = TOGETHER if entry.value == TOGETHER else truth(entry, problems, f", or {TOGETHER!r},")
        else:
            values[key] = positive(entry, problems, "MiB" if key == "memory_limit" else "s")
    return values


def _share(entry: Entry, k: int, index: int | None) -> Entry:
    """One instance's part of a value: the outer axis of a list is the instance, wherever there is a count."""
    if index is None or not isinstance(entry.value, list):
        return entry
    return Entry(entry.value[k] if k < len(entry.value) else 0.0, entry.origin, entry.place)


def number(
    entry: Entry,
    problems: list[Problem],
    default: float = 0.0,
    what: str = "a finite number",
    fits: Callable[[float], bool] = math.isfinite,
) -> float:
    """A finite number that fits; `what` it has to be is said otherwise."""
    value = entry.value
    try:
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and fits(value):
            return float(value)
    except OverflowError:
        pass
    problems.append(entry.problem(f"takes {what}, not {shown(value)}"))
    return default


def positive(entry: Entry, problems: list[Problem], unit: str = "s") -> float:
    """A finite number greater than 0."""
    return number(entry, problems, 1.0, f"a number greater than 0, in {unit}", lambda value: value > 0)


def whole(entry: Entry, problems: list[Problem], fits: Callable[[int], bool], what: str, default: int = 1) -> int:
    """A whole number that fits; `what` it has to be is said otherwise."""
    value = entry.value
    if isinstance(value, int) and not isinstance(value, bool) and fits(value):
        return value
    problems.append(entry.problem(f"takes {what}, not {shown(value)}"))
    return default


def truth(entry: Entry, problems: list[Problem], more: str = ",") -> bool:
    """True or false; what else is taken instead is said by the message."""
    if not isinstance(entry.value, bool):
        problems.append(entry.problem(f"takes true or false{more} not {shown(entry.value)}"))
    return entry.value is True


def choice(entry: Entry, problems: list[Problem], valid: Collection[str], what: str) -> str:
    """One of a few words; `what` they are called in the message."""
    if isinstance(entry.value, str) and entry.value in valid:
        return str(entry.value)
    near = suggestion(str(entry.value), valid) or f"there are {', '.join(valid)}"
    problems.append(entry.problem(f"there is no {what} {shown(entry.value)}", near))
    return next(iter(valid))


def shown(value: Any) -> str:
    """A value as a message shows it: as TOML writes it, cut where it is long."""
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else _short(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _short(value: Any) -> str:
    if isinstance(value, int) and abs(value) >= 10**50:
        return "a number of more than 50 digits"
    return repr(value)


def whole_multiple(value: float, step: float) -> bool:
    """Whether `value` is a whole number (at least 1) of steps, up to rounding."""
    steps = value / step
    return math.isfinite(steps) and round(steps) >= 1 and abs(steps - round(steps)) <= 1e-9 * steps + 1e-12
