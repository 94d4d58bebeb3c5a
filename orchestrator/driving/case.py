"""A case of optimal driving: the TOML file with a table `[drive]`, read and checked."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ...components.component import Component
from ...components.environment.track import Track
from ...components.errors import ComponentError
from ...components.tables import FASTEST, Column, Table
from ...components.trains.rolling_stock import RollingStock
from ...fmus.references import build_with, data_file, names_data, read_arguments, resolve
from .. import world
from ..errors import ScenarioError
from ..problems import Problem, suggestion
from ..scenario import MODELS, Source, parse_value, split_assignment

_FOLDER = MODELS / "driving"
OBJECTIVES = ("energy", "time")
_DATA = ("line", "train")


class Wish(NamedTuple):
    """What is asked of a driving, beside line and train; SI units, and None where the data say it."""

    minimize: str
    time: float | None
    begin: float | None
    end: float | None
    start_speed: float
    end_speed: float
    acceleration: float | None
    deceleration: float | None
    jerk: float
    regeneration: bool
    reserve: float
    intervals: int
    tolerance: float


WISH = Table(
    "case",
    [
        Column("minimize", type=str, default="energy", choices=OBJECTIVES),
        Column("time", "s", default=None, within=(1.0, 1e6), note="running time"),
        Column("begin", "m", default=None, note="the first stop where it is left out"),
        Column("end", "m", default=None, note="the last stop"),
        Column("start_speed", "m/s", default=1.0, within=(0.1, FASTEST)),
        Column("end_speed", "m/s", default=1.0, within=(0.1, FASTEST)),
        Column("acceleration", "m/s2", default=None, within=(0.0, 5.0), note="for comfort; 0 is no limit"),
        Column("deceleration", "m/s2", default=None, within=(0.0, 5.0), note="for comfort; 0 is no limit"),
        Column("jerk", "m/s3", default=0.0, within=(0.0, 10.0), note="change of the force over the mass; 0: no limit"),
        Column("regeneration", type=bool, default=True),
        Column("reserve", default=0.0, within=(0.0, 0.5), note="share of forces and powers left to a controller"),
        Column("intervals", type=int, default=60, within=(10, 2000), note="of the first mesh"),
        Column("tolerance", default=1e-5, within=(1e-9, 0.1), note="relative change of the objective to stop at"),
    ],
    make=Wish,
    single=True,
)


@dataclass(frozen=True, eq=False)
class Case:
    """A driving that is asked for.

    Attributes:
        name: of the file. title: in words.
        component: the `LineTrain` whose equations are driven.
        wish: what is asked for. begin, end: places of the front, m.
    """

    name: str
    title: str
    component: Component
    wish: Wish
    begin: float
    end: float

    @property
    def train(self) -> RollingStock:
        """Its data."""
        train: RollingStock = self.component.present_values["train"]
        return train

    @property
    def line(self) -> Track:
        """Its data."""
        line: Track = self.component.present_values["line"]
        return line


@dataclass(frozen=True)
class ListedCase:
    """A shipped case: its name and title."""

    name: str
    title: str


def listed_cases() -> list[ListedCase]:
    """Every case that comes with the package, by name."""
    files = sorted(world.glob(_FOLDER, "*.toml"))
    return [ListedCase(path.stem, str(Source.read(path, path.name).data.get("title", ""))) for path in files]


def load_case(
    name_or_path: str | os.PathLike[str], settings: Sequence[str] = (), changes: Mapping[str, Any] | None = None
) -> Case:
    """A case as it stands in its file, changed.

    Args:
        name_or_path: a shipped case, or a file that ends in ``.toml``.
        settings: keys of ``[drive]`` with other values, ``jerk=0.5``, and of its data, ``train.mass=4e5``.
        changes: the same by key; None changes nothing.

    Raises:
        ScenarioError: the case cannot be used; the message names file and key.
    """
    path = _find(os.fspath(name_or_path))
    source = Source.read(path, path.name)
    table = _table(source)
    data = {what: _data(source, path.parent, table.pop(what, None), what) for what in _DATA}
    _merge(source.origin("drive", "overrides"), data, table.pop("overrides", {}))
    for text in settings:
        key, equals, value = split_assignment(text)
        head, _, rest = key.strip().partition(".")
        if not equals or not head:
            raise ScenarioError(Problem(f"--set {text}", "is not of the form key=value, as in train.mass=4e5"))
        if rest:
            _merge(f"--set {text}", data, {head: _nested(rest, parse_value(value))})
        else:
            table[head] = parse_value(value)
    table |= {key: value for key, value in (changes or {}).items() if value is not None}
    try:
        wish = WISH.record(table)
        component = build_with(resolve("LineTrain"), data)
    except (ComponentError, ValueError) as error:
        raise ScenarioError(Problem(source.origin("drive"), str(error))) from None
    return _placed(source, path.stem, component, wish)


def _find(text: str) -> Path:
    shipped = _FOLDER / f"{text}.toml"
    if os.path.basename(text) == text and os.path.isfile(shipped):
        return shipped
    if text.endswith(".toml") and os.path.isfile(text):
        return Path(text)
    names = [case.name for case in listed_cases()]
    what = f"there is no file '{text}'" if text.endswith(".toml") else f"there is no shipped case '{text}'"
    raise ScenarioError(Problem("", what, suggestion(text, names) or f"there is {', '.join(names)}"))


def _table(source: Source) -> dict[str, Any]:
    table = source.data.get("drive")
    if not isinstance(table, dict):
        remedy = "'orchestrate run' runs scenarios" if "instances" in source.data else "write what is asked for there"
        raise ScenarioError(Problem(source.label, "there is no table [drive]", remedy))
    for key in sorted(source.data.keys() - {"title", "drive"}):
        raise ScenarioError(
            Problem(source.origin(key), f"a case has no key {key!r}", suggestion(key, ("title", "drive")))
        )
    return copy.deepcopy(table)


def _data(source: Source, folder: Path, given: Any, what: str) -> dict[str, Any]:
    """A line or a train as a table, from its file where one is named."""
    place = source.origin("drive", what)
    if names_data(given):
        try:
            given = read_arguments({what: str(data_file(given, folder))})[what]
        except ComponentError as error:
            raise ScenarioError(Problem(place, str(error))) from None
    if not isinstance(given, dict):
        remedy = 'name a file, as in train = "rolling_stock/virm6.json", or write a table'
        raise ScenarioError(Problem(place, f"{what!r} is {'missing' if given is None else repr(given)}", remedy))
    return given


def _merge(place: str, data: dict[str, Any], overrides: Any) -> None:
    """Put values into tables of tables; the first keys are `line` and `train`."""
    if not isinstance(overrides, dict) or not overrides.keys() <= set(_DATA):
        remedy = "overrides begin with 'line.' or 'train.', as in train.mass"
        raise ScenarioError(Problem(place, f"cannot set {overrides!r}", remedy))

    def put(into: dict[str, Any], values: Mapping[str, Any]) -> None:
        for key, value in values.items():
            if isinstance(value, dict) and isinstance(into.get(key), dict):
                put(into[key], value)
            else:
                into[key] = value

    put(data, overrides)


def _nested(key: str, value: Any) -> dict[str, Any]:
    head, _, rest = key.partition(".")
    return {head: _nested(rest, value) if rest else value}


def _placed(source: Source, name: str, component: Component, wish: Wish) -> Case:
    """The case between its places; what cannot be driven at all is refused here."""
    place = source.origin("drive")
    stops = component.present_values["line"].stops
    begin = wish.begin if wish.begin is not None else stops[0].position if len(stops) > 1 else None
    end = wish.end if wish.end is not None else stops[-1].position if len(stops) > 1 else None
    if begin is None or end is None:
        raise ScenarioError(Problem(place, "the line has no two stops", "give 'begin' and 'end' in m"))
    if not begin < end:
        raise ScenarioError(Problem(place, f"'end', {end:g} m, is not beyond 'begin', {begin:g} m"))
    case = Case(name, str(source.data.get("title", name)), component, wish, begin, end)
    for key, speed, at in (("start_speed", wish.start_speed, begin), ("end_speed", wish.end_speed, end)):
        limit = min(case.train.max_speed, float(case.line.speed_limit(at, case.train.length)))
        if speed > limit:
            raise ScenarioError(Problem(place, f"{key!r}, {speed:g} m/s, is above the limit there, {limit:g} m/s"))
    if wish.minimize == "energy" and wish.time is None:
        raise ScenarioError(
            Problem(place, "the least energy needs a running time", "give 'time' in s, or minimize time")
        )
    return case
