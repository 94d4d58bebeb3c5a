"""Scenarios: TOML -> `System`. The format is described in `docs/scenarios.md`.

`toml_source` reads the text, `reader` makes a draft of it (`simulation` and `events` know their
sections), `changes` applies presets and options, and here the draft becomes a `System`. Everything that is wrong with a
scenario is told at once, as one `ScenarioError`.
"""

from __future__ import annotations

import copy
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import world
from ..errors import ScenarioError
from ..fmi import is_fmu_name
from ..problems import Problem, suggestion
from ..ssp import is_ssp_name, read_system
from ..system import Instance, System
from .changes import apply_preset, apply_settings, apply_step, apply_swaps, preset_descriptions
from .connections import read_connections
from .events import draft_events, expand_events, read_events
from .groups import Draft, Entry, expand_group
from .patterns import connect
from .reader import Reader
from .shipped import is_shipped, shipped, shipped_file
from .simulation import TOLERANCES, read_simulation, spread_tolerances
from .toml_source import Source, parse_value
from .varied import read_study
from .writer import STANDARD, TIMES, dump, tables_of, text_of

__all__ = ["dump", "find", "load", "loads", "preset_names"]


def find(name_or_path: str | os.PathLike[str]) -> Path:
    """The file of a scenario: a path that ends in `.toml`, or the name of a shipped scenario.

    Raises:
        ScenarioError: there is none; the message suggests the nearest name.
    """
    text = os.fspath(name_or_path)
    ours = shipped_file(text) if os.path.basename(text) == text else None
    if ours is not None:
        return ours
    if os.path.isfile(text) and text.endswith(".toml"):
        return Path(text)
    if is_fmu_name(text):
        remedy = (
            f"see 'orchestrate describe', and name it in a scenario: [instances.it] fmu = {os.path.basename(text)!r}"
        )
        raise ScenarioError(Problem("", f"'{text}' is an FMU, not a scenario", remedy))
    names = [name for name, _ in shipped()]
    folder, file = os.path.split(text)
    if not text.endswith(".toml") and not folder:
        here = f"did you mean './{text}.toml'?" if os.path.isfile(f"{text}.toml") else suggestion(text, names)
        remedy = here or f"there are {', '.join(names)}"
        raise ScenarioError(Problem("", f"there is no shipped scenario '{text}'", remedy))
    if os.path.isdir(text):
        raise ScenarioError(Problem("", f"'{text}' is a folder", "name the scenario file in it"))
    if not os.path.isfile(text):
        around = world.listdir(folder or ".") if os.path.isdir(folder or ".") else []
        near = suggestion(file, [other for other in around if other.endswith(".toml")])
        remedy = near or f"shipped scenarios are {', '.join(names)}"
        raise ScenarioError(Problem("", f"there is no file '{text}'", remedy))
    return Path(text)


def preset_names(scenario: str | os.PathLike[str]) -> tuple[str, ...]:
    """Every preset a scenario can be run with, the default one first."""
    return load(scenario).provenance.presets


def load(
    scenario: str | os.PathLike[str],
    *,
    preset: str | None = None,
    settings: Sequence[str] = (),
    builds: Sequence[str] = (),
    swaps: Sequence[str] = (),
    stop_time: float | None = None,
    step: float | None = None,
    algorithm: str | None = None,
) -> System:
    """Read a scenario, with a preset and changes applied in this order: preset, swaps, builds, step, settings.

    Args:
        scenario: a path, or the name of a shipped scenario.
        preset: a preset of the file; None for the values as they stand.
        settings: values by name, such as ``"train[4].speed=10"`` or ``"simulation.record=0.1"``.
        builds: build arguments, such as ``"train.carriages=8"``.
        swaps: other models, such as ``"cruise=my_controller.py:MyController"``.
        stop_time: another end in s.
        step: another communication step in s; sample times that equal the old one follow.
        algorithm: another master algorithm.

    Raises:
        ScenarioError: with every problem of the file and of the changes, each with its place.
    """
    changes = _Changes(preset, settings, builds, swaps, stop_time, step, algorithm)
    if is_ssp_name(os.fspath(scenario)):
        system = _system_of_ssp(os.fspath(scenario), changes)
    else:
        path = find(scenario)
        source = Source.read(path, path.name if is_shipped(path) else str(path))
        system = _system(source, path, changes)
    system.provenance.command = (os.fspath(scenario), *changes.words())
    return system


def _system_of_ssp(name: str, changes: _Changes) -> System:
    """The system of an SSP: by way of the scenario that it makes, so that options change it as they change any."""
    read = read_system(name)
    places: dict[tuple[str | int, ...], str] = {}
    for instance in read.instances.values():
        places["instances", instance.name] = instance.origin
        for variable in instance.start:
            origin = read.provenance.origins.get(f"{instance.name}.{variable}", instance.origin)
            places["instances", instance.name, "start", variable] = origin
    places |= {("connections", connection.target): connection.origin for connection in read.connections}
    tables = _tables_of_ssp(read)
    annotation = read.provenance.origins["scenario"]
    places |= {(key,): annotation for key in tables if key not in STANDARD}
    if isinstance(tables["events"], list):  # those of other tools stand behind our own
        own = len(tables["events"]) - len(read.events)
        places |= {("events", own + k): event.origin for k, event in enumerate(read.events)}
    system = _system(Source(text_of(tables), read.provenance.path, places), Path(read.provenance.path), changes)
    system.provenance.name, system.provenance.notes = read.provenance.name, read.provenance.notes
    return system


def _tables_of_ssp(read: System) -> dict[str, Any]:
    """A scenario's tables: instances, connections and times as the standard has them, the rest by our annotation.

    Raises:
        ScenarioError: the annotation is no TOML, or holds what a scenario cannot.
    """
    tables = tables_of(read)
    if not read.provenance.text:
        return tables
    place = read.provenance.origins["scenario"]
    own = Source(read.provenance.text, place, {}).data
    times = {key: tables["simulation"][key] for key in TIMES}
    if isinstance(own.get("simulation", {}), dict):
        own["simulation"] = tables["simulation"] | own.get("simulation", {}) | times
    merged = own | {key: tables[key] for key in STANDARD}
    if isinstance(events := merged.setdefault("events", []), list):
        merged["events"] = events + tables["events"]
    try:
        text_of(merged)
    except TypeError as error:
        raise ScenarioError(Problem(place, str(error))) from None
    return merged


def import_ssp(name: str, fmus: Path, folder: Path) -> str:
    """The scenario that an SSP makes, with notes on how it was read as comments.

    Args:
        name: of the archive; a variant follows after a ``#``.
        fmus: where its FMUs are put.
        folder: where the scenario will stand.

    Raises:
        ScenarioError: with everything that is wrong with the archive.
    """
    system = read_system(name, fmus)
    for instance in system.instances.values():
        instance.model = Path(os.path.relpath(instance.model, folder)).as_posix()
    lines = [f"imported from {name}", *system.provenance.notes]
    comments = "".join(f"# {part}\n" for line in lines for part in line.splitlines())
    return f"{comments}\n{text_of(_tables_of_ssp(system))}"


def loads(text: str, path: str | os.PathLike[str] = "scenario.toml", **changes: Any) -> System:
    """Like `load`, from a text; `path` is what messages call it and what relative paths in it are relative to."""
    return _system(Source(text, os.fspath(path)), Path(path), _Changes(**changes))


@dataclass(frozen=True)
class _Changes:
    """The arguments of `load` beside the scenario."""

    preset: str | None = None
    settings: Sequence[str] = ()
    builds: Sequence[str] = ()
    swaps: Sequence[str] = ()
    stop_time: float | None = None
    step: float | None = None
    algorithm: str | None = None

    def words(self) -> Iterator[str]:
        """The options of the command line that say the same."""
        for option, values in (
            ("--preset", [self.preset]),
            ("--swap", self.swaps),
            ("--with", self.builds),
            ("--set", self.settings),
            ("--step", [self.step]),
            ("--stop", [self.stop_time]),
            ("--algorithm", [self.algorithm]),
        ):
            for value in values:
                if value is not None:
                    yield from (option, str(value))

    def apply(self, draft: Draft, problems: list[Problem]) -> float | None:
        """Change the draft; returns the old step where a new one was given."""
        apply_swaps(draft, self.swaps, problems)
        apply_settings(draft, self.builds, problems, "--with")
        settings = list(self.settings)
        steps = [] if self.step is None else [Entry(self.step, f"--step {self.step}")]
        for text in self.settings:
            key, _, value = text.partition("=")
            if key.strip() == "simulation.step":  # sample times follow it, as they follow --step
                settings.remove(text)
                steps.append(Entry(parse_value(value.strip()), f"--set {text}"))
        old_step = apply_step(draft, steps[-1]) if steps else None
        apply_settings(draft, settings, problems)
        if self.stop_time is not None:
            draft.simulation["stop_time"] = Entry(self.stop_time, f"--stop {self.stop_time}")
        if self.algorithm is not None:
            draft.simulation["algorithm"] = Entry(self.algorithm, f"--algorithm {self.algorithm}")
        return old_step


def _system(source: Source, path: Path, changes: _Changes) -> System:
    try:
        scenario = _Scenario(source, path)
        base = scenario.base(changes.preset)
        draft = copy.deepcopy(base)
        old_step = changes.apply(draft, scenario.problems)
        system = scenario.finish(draft)
        if changes != _Changes(changes.preset):
            return system.changed(modified=system != scenario.finish(base), rescaled_from=old_step)
        return system
    except RecursionError:
        raise ScenarioError(Problem(source.label, "nested too deeply", "no scenario needs that")) from None


class _Scenario:
    """One scenario file on its way to a system."""

    def __init__(self, source: Source, path: Path) -> None:
        self.source = source
        self.path = path
        self.folder = os.path.dirname(os.path.abspath(path))
        self.reader = Reader(source, self.folder)
        self.draft = self.reader.read()
        self.draft.rules = read_connections(self.reader)
        self.problems = self.reader.problems
        presets = self.reader.table(source.data, "presets")
        self.default = default if isinstance(default := source.data.get("default_preset"), str) else None
        if self.default in presets:
            both = f"names the values as they stand, but there is [presets.{self.default}] as well"
            self.reader.problem(both, "default_preset", remedy="rename one of the two")
        self.names = tuple(dict.fromkeys([*([self.default] if self.default else []), *presets]))
        self.preset: str | None = self.default
        self.descriptions = preset_descriptions(source, self.problems)
        self.draft.events = draft_events(self.reader)
        self.metrics = self.reader.texts("metrics")
        self.requirements = self.reader.texts("require")
        self.published = self.reader.values("published", self.metrics, self.names)
        self.references = self.reader.values("references", self.metrics, self.names)
        self.figures = self.reader.figures()
        self.study, self.study_origins = read_study(self.reader)

    def base(self, preset: str | None) -> Draft:
        """The draft under a preset. All presets are applied once, so that a mistake in any of them is told."""
        chosen = self.draft
        for name in self.names:
            if name != self.default:
                draft = copy.deepcopy(self.draft)
                apply_preset(draft, self.source, name, self.folder, self.problems)
                self._check(draft)
                chosen = draft if name == preset else chosen
        if preset is not None and preset not in self.names:
            known = suggestion(preset, self.names) or (
                f"there are {', '.join(self.names)}" if self.names else "the scenario has none"
            )
            self.problems.append(Problem(self.source.label, f"there is no preset '{preset}'", known))
        self.preset = self.default if preset is None else preset
        return chosen

    def _check(self, draft: Draft) -> None:
        read_simulation(draft.simulation, self.source.label, self.problems)
        read_events(draft.events, self.problems)
        for group in draft.groups.values():
            expand_group(group, self.problems)

    def finish(self, draft: Draft) -> System:
        """The system.

        Raises:
            ScenarioError: with everything that was found wrong so far and now.
        """
        problems = list(self.problems)
        simulation = read_simulation(draft.simulation, self.source.label, problems)
        origins = {f"simulation.{key}": entry.origin for key, entry in draft.simulation.items()}
        instances: dict[str, Instance] = {}
        for group in draft.groups.values():
            for instance, starts in expand_group(group, problems):
                instances[instance.name] = instance
                origins |= {instance.name: instance.origin, **starts}
        connections = connect(draft.rules, draft.counts, problems)
        events = expand_events(read_events(draft.events, problems), draft.counts, problems)
        if "tolerances" in simulation:
            keys = spread_tolerances(draft.simulation, draft.counts, problems)
            written = simulation["tolerances"]
            simulation["tolerances"] = {name: list(written[key.removeprefix(TOLERANCES)]) for name, key in keys.items()}
            origins |= {f"simulation.tolerances.{name}": draft.simulation[key].origin for name, key in keys.items()}
        if "order" in draft.simulation:
            simulation["order"] = _order(draft.simulation["order"], draft, list(instances), problems)
        if problems:
            raise ScenarioError(list(dict.fromkeys(problems)))
        data = self.source.data
        return System(
            title=data.get("title", ""),
            source=data.get("source", ""),
            description=data.get("description", "")
            if self.preset == self.default
            else self.descriptions.get(self.preset or "", ""),
            **simulation,
            events=events,
            instances=instances,
            connections=connections,
            requirements=dict(self.requirements),
            metrics=dict(self.metrics),
            published=copy.deepcopy(self.published),
            references=copy.deepcopy(self.references),
            figures=copy.deepcopy(self.figures),
            study=copy.deepcopy(self.study),
            preset=self.preset,
            presets=self.names,
            preset_descriptions=self.descriptions,
            default_preset=self.default,
            name=self.path.stem.encode(errors="replace").decode(),  # the bytes of a file name need not be letters
            path=str(self.path),
            text=self.source.text,
            named=tuple(filter(None, draft.named)),
            origins=origins | self._origins(),
        )

    def _origins(self) -> dict[str, str]:
        origins = dict(self.study_origins)
        for section, texts in (("require", self.requirements), ("metrics", self.metrics)):
            origins |= {f"{section}.{name}": self.source.origin(section, name) for name in texts}
        known = (("published", self.published), ("references", self.references))
        for section, entries in (("events", self.draft.events), *known, ("figures", self.figures)):
            origins |= {f"{section}[{k + 1}]": self.source.origin(section, k) for k in range(len(entries))}
        return origins


def _order(entry: Entry, draft: Draft, names: Sequence[str], problems: list[Problem]) -> list[str]:
    """The instances in the order they step; `train` stands for all trains."""
    if not isinstance(entry.value, list) or not all(isinstance(name, str) for name in entry.value):
        problems.append(entry.problem('is a list of instance names, as in ["cruise", "train", "gust"]'))
        return []
    order: list[str] = []
    for name in entry.value:
        count = draft.counts.get(name)
        if name not in names and count is None:
            near = suggestion(name, [*names, *draft.counts]) or f"instances are {', '.join(draft.counts)}"
            problems.append(entry.problem(f"there is no instance '{name}'", near))
        order += [f"{name}[{k + 1}]" for k in range(count)] if count is not None else [name]
    stands = Counter(order)
    twice = next((name for name, times in stands.items() if times > 1), None)
    if twice:
        problems.append(entry.problem(f"'{twice}' stands there twice", "each instance steps once"))
    missing = [name for name in names if name not in stands]
    if order and missing:
        problems.append(entry.problem(f"lacks {', '.join(missing)}", "name every instance, or leave order out"))
    return order
