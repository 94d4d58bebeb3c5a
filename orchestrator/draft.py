"""A scenario between TOML and `System`: groups of instances, before counts, lists and patterns are expanded.

Presets and options on the command line change the draft, so that `cruise.alpha` means all controllers whatever their
number, and what they say is checked as if it stood in the file.
"""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, field
from typing import Any

from .errors import ScenarioError, did_you_mean
from .patterns import NAME, Rule, member
from .system import ALGORITHMS, Instance

MAX_COUNT = 10_000
RESERVED = frozenset(
    {"simulation", "instances", "connections", "presets", "require", "metrics", "published", "figures"}
)
SIMULATION_KEYS = ("stop_time", "step", "start_time", "algorithm", "record", "seed", "order")
_PYTHON_CLASS = re.compile(rf"(.*\.py):({NAME})", re.DOTALL)


@dataclass(frozen=True)
class Entry:
    """A value, where it stands (`file.toml:12`, `--set x.y=1`) and what it is called there."""

    value: Any
    origin: str
    place: str = ""

    def problem(self, message: str) -> str:
        """A message that says where."""
        return f"{self.origin}: {self.place}: {message}" if self.place else f"{self.origin}: {message}"


@dataclass
class Member:
    """What is said of one instance of a group alone."""

    origin: str = ""
    model: str | None = None
    swapped: bool = False
    build: dict[str, Any] = field(default_factory=dict)
    start: dict[str, Entry] = field(default_factory=dict)


@dataclass
class Group:
    """Instances that are written together: `train`, of which there are `count`; one without a number where None."""

    name: str
    origin: str
    model: str = ""
    count: int | None = None
    swapped: bool = False
    build: dict[str, Any] = field(default_factory=dict)
    start: dict[str, Entry] = field(default_factory=dict)
    members: dict[int, Member] = field(default_factory=dict)

    def swap(self, model: str, index: int | None = None) -> None:
        """Put another model in the place of all, or of one; connections, start values and build arguments stay."""
        if index is not None:
            one = self.members.setdefault(index, Member())
            one.swapped |= model != (one.model or self.model)
            one.model = model
            return
        self.swapped |= model != self.model
        self.model = model
        for one in self.members.values():
            one.swapped |= one.model not in (None, model)
            one.model = None

    def set_build(self, name: str, value: Any, index: int | None = None) -> None:
        """Give a build argument to all, or to one."""
        if index is not None:
            self.members.setdefault(index, Member()).build[name] = value
            return
        self.build[name] = value
        for one in self.members.values():
            one.build.pop(name, None)

    def set_start(self, name: str, entry: Entry, index: int | None = None) -> None:
        """Give a start value to all, or to one; what comes later wins, a whole array over its elements too."""
        if index is None:
            for one in self.members.values():
                _drop(one.start, name)
        table = self.start if index is None else self.members.setdefault(index, Member()).start
        _drop(table, name)
        table[name] = entry


@dataclass
class Draft:
    """A scenario before expansion."""

    simulation: dict[str, Entry] = field(default_factory=dict)
    groups: dict[str, Group] = field(default_factory=dict)
    rules: list[Rule] = field(default_factory=list)

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
    is_fmu = text.lower().endswith(".fmu")
    if kind == "component" and is_fmu:
        raise ScenarioError(f"'{text}' is an FMU file; write fmu = ... instead of component = ...")
    if is_fmu or kind == "fmu":
        if not is_fmu:
            raise ScenarioError(
                f"'{text}' does not end in .fmu; for a component of the catalogue write component = ..."
            )
        return _existing(text, folder)
    match = _PYTHON_CLASS.fullmatch(text)
    if match:
        return f"{_existing(match[1], folder)}:{match[2]}"
    if text.endswith(".py") or ".py:" in text:
        raise ScenarioError(f"'{text}' does not name a class; write 'file.py:Class'")
    if not re.fullmatch(NAME, text):
        raise ScenarioError(f"'{text}' is neither a component's name, nor 'file.py:Class', nor the path of an .fmu")
    return text


def _existing(text: str, folder: str) -> str:
    path = os.path.abspath(os.path.join(folder, text))
    if os.path.isfile(path):
        return path
    near = ""
    if os.path.isdir(os.path.dirname(path)):
        near = did_you_mean(os.path.basename(path), os.listdir(os.path.dirname(path)))
    raise ScenarioError(f"there is no file '{path}'{near}")


def build_argument(value: Any, folder: str) -> Any:
    """A build argument as it is: a text that ends in `.json` names a file and becomes an absolute path.

    Raises:
        ScenarioError: there is no such file, or the value is a date or a time.
    """
    if isinstance(value, str) and value.endswith(".json"):
        return _existing(value, folder)
    if not is_plain(value, tables=True):
        raise ScenarioError("takes numbers, texts, true or false, lists and tables of these; quote a date")
    return value


def is_plain(value: Any, tables: bool = False) -> bool:
    """Whether a value consists of numbers, texts and truth values, lists of these, and perhaps tables."""
    if isinstance(value, list):
        return all(is_plain(item, tables) for item in value)
    if isinstance(value, dict):
        return tables and all(is_plain(item, tables) for item in value.values())
    return isinstance(value, bool | int | float | str)


def expand_group(group: Group, problems: list[str]) -> list[tuple[Instance, dict[str, str]]]:
    """The instances of a group, each with the origin of its start values."""
    members: list[tuple[Instance, dict[str, str]]] = []
    total = 1 if group.count is None else group.count
    for entry_name, entry in group.start.items():
        if group.count is not None and isinstance(entry.value, list) and len(entry.value) != total:
            values = f"{len(entry.value)} value{'s' * (len(entry.value) != 1)}"
            problems.append(
                entry.problem(
                    f"{entry_name} has {values} for the {total} instances of '{group.name}'; "
                    "give one for each, or a single value for all"
                )
            )
    for k in range(total):
        index = None if group.count is None else k + 1
        one = group.members.get(k + 1, Member()) if index else Member()
        start = {name: _share(entry, k, index) for name, entry in group.start.items()}
        for name, entry in one.start.items():
            _drop(start, name)
            start[name] = entry
        model, swapped = one.model or group.model, one.swapped or group.swapped
        build = {**group.build, **one.build}
        if build and model.lower().endswith(".fmu"):  # what a swap left behind is nobody's mistake
            if not swapped:
                problems.append(
                    f"{one.origin or group.origin}: '{model}' is a finished FMU and takes no build arguments"
                )
            build = {}
        instance = Instance(
            member(group.name, index),
            model,
            build,
            {name: entry.value for name, entry in start.items()},
            index,
            total,
            swapped,
            one.origin or group.origin,
        )
        members.append((instance, {f"{instance.name}.{name}": entry.origin for name, entry in start.items()}))
    return members


def _share(entry: Entry, k: int, index: int | None) -> Entry:
    """One instance's part of a value: the outer axis of a list is the instance, wherever there is a count."""
    if index is None or not isinstance(entry.value, list):
        return entry
    return Entry(entry.value[k] if k < len(entry.value) else 0.0, entry.origin, entry.place)


def number(entry: Entry, problems: list[str], default: float = 0.0) -> float:
    """A finite number."""
    value = entry.value
    try:
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
    except OverflowError:
        pass
    problems.append(entry.problem(f"takes a finite number, not {shown(value)}"))
    return default


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


def read_simulation(entries: dict[str, Entry], origin: str, problems: list[str]) -> dict[str, Any]:
    """The values of `[simulation]`, checked; `order` is left as written."""
    before = len(problems)
    if "stop_time" not in entries:
        problems.append(f"{origin}: simulation.stop_time is missing; say how long to run, in s: stop_time = 350.0")
    values: dict[str, Any] = {
        key: number(entries[key], problems, 1.0)
        for key in ("stop_time", "step", "start_time", "record")
        if key in entries
    }
    if "algorithm" in entries:
        values["algorithm"] = algorithm = entries["algorithm"].value
        if algorithm not in ALGORITHMS:
            near = did_you_mean(str(algorithm), ALGORITHMS) or f"; there are {', '.join(ALGORITHMS)}"
            problems.append(entries["algorithm"].problem(f"there is no algorithm {shown(algorithm)}{near}"))
    if "seed" in entries:
        values["seed"] = seed = entries["seed"].value
        if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**63:
            problems.append(entries["seed"].problem(f"takes a whole number from 0 to 2**63 - 1, not {shown(seed)}"))
    if len(problems) == before:
        problems += _grid(entries, values)
    return values


def _grid(entries: dict[str, Entry], values: dict[str, Any]) -> list[str]:
    """What is wrong with the points in time."""
    step, start, stop = values.get("step", 0.1), values.get("start_time", 0.0), values["stop_time"]
    steps_of = f"steps of {step:.10g} s" + (f" ({entries['step'].origin})" if "step" in entries else "")
    if step <= 0:
        return [entries["step"].problem(f"the step must be greater than 0 s, not {step:g} s")]
    if stop <= start:
        return [entries["stop_time"].problem(f"the stop time, {stop:g} s, must be later than the start, {start:g} s")]
    problems = []
    if not whole_multiple(stop - start, step):
        steps = max(1, math.floor((stop - start) / step)) if math.isfinite((stop - start) / step) else 1
        near = " or ".join(f"{start + k * step:.10g} s" for k in (steps, steps + 1))
        problems.append(
            entries["stop_time"].problem(
                f"{stop - start:.10g} s is not a whole number of {steps_of}; change the step, or stop at {near}"
            )
        )
    record = values.get("record")
    if record is not None and not whole_multiple(record, step):
        fitting = max(1, round(record / step)) * step if 0 < record / step < 1e15 else step
        problems.append(
            entries["record"].problem(
                f"{record:.10g} s is not a whole number of {steps_of}; take {fitting:.10g} s (simulation.record)"
            )
        )
    return problems
