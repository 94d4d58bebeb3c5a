"""What a search needs before its first run: the scenario with what is varied in place, in the search's directory."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ... import world
from ...digests import digest_of
from ...errors import ScenarioError
from ...evaluation import split_metric, value_name
from ...fmi import Kind, Workspace
from ...problems import Problem, suggestion
from ...run import Interruption, RunDirectory, check, execute
from ...scenario import is_structural
from ...system import System
from ..campaign import Dataset, Parcel, Point, Pool, named_in, need_packages, packed, pool_for, rewrite
from ..design import Dimension
from ..rows import Row
from ..structure import Runner
from .counterexample import NOMINAL, changed_scenario, scenario_text
from .evaluations import Evaluations
from .keeping import copy, kept
from .slopes import Slopes, traced
from .space import Space, make_space, read_space

SEARCH_FILE = "search.json"


class InterruptedSearch(KeyboardInterrupt):
    """A signal has ended a search, which can be gone on with where it has a directory.

    Attributes:
        signal: its number. directory: that holds its runs; None before there is one.
    """

    def __init__(self, signal: int, directory: Path | None = None) -> None:
        super().__init__()
        self.signal, self.directory = signal, directory


@dataclass(frozen=True)
class Prepared:
    """A search about to begin.

    Attributes:
        directory: for all that it writes. told: what makes it the one it is. space: what is varied. evaluations: the
            runs. slopes: of their margins.
    """

    directory: Path
    told: Mapping[str, Any]
    space: Space
    evaluations: Evaluations
    slopes: Slopes

    @property
    def nominal(self) -> Path:
        """The scenario with signals in place."""
        return self.directory / NOMINAL


@contextmanager
def prepared(
    system: System,
    vary: Sequence[str],
    output: str | Path,
    told: Mapping[str, Any],
    *,
    requirements: Sequence[str] = (),
    metrics: Mapping[str, str] | None = None,
    objectives: Mapping[str, str] | None = None,
    kind: Kind = "auto",
    resume: bool = False,
    scheduler: str | None = None,
    workers: int | None = None,
    begun: Callable[[Pool], None] = lambda _: None,
    sloping: bool = False,
) -> Iterator[Prepared]:
    """Make a search ready; its runs can be asked for while this is entered.

    Args:
        system: the scenario as options change it.
        vary: what is varied, as `--vary` takes it.
        output: the directory.
        told: what makes the search the one it is, so that it can be gone on with.
        requirements: those that the search is about.
        metrics: expressions to be evaluated beside those of the scenario.
        objectives: metrics by flat name that the search is about, with what they are called.
        kind: how components become models.
        resume: whether runs that are there already count.
        scheduler: as `run_study` has it.
        workers: likewise.
        begun: likewise.
        sloping: whether the search needs slopes.

    Raises:
        ScenarioError: something is wrong with the scenario, a requirement or what is varied.
        RunError: the scenario as it stands cannot be run, or the scheduler is gone.
        InterruptedSearch: a signal has ended it.
    """
    need_packages("pyarrow", *(["distributed"] if workers != 0 else []))
    dimensions, signals = read_space(vary)
    _check(system, requirements, [one.name for one in dimensions])
    system = system.changed(metrics={**system.judged.metrics, **(metrics or {})}, modified=True)
    nominal = execute(
        system.changed(record=None, record_only=[]) if signals else system, kind=kind
    )  # as they are varied
    if nominal.signal:
        raise InterruptedSearch(nominal.signal)
    if nominal.error is not None:
        raise nominal.error
    _check_objectives(objectives or {}, [value_name(one.name, k) for one in nominal.metrics for k in one.values])
    system, space = make_space(system, nominal.checked, nominal.results, dimensions, signals)
    varied = [file for one in dimensions for file in named_in([*one.values], os.getcwd())]
    told = {**told, "models": sorted({digest_of(Path(file)) for file in varied})}
    with RunDirectory(Path(output), record=SEARCH_FILE) as place:
        _begin(place, system, told, resume)
        # Keys that mean nothing, and values that nothing takes, are told here and not by every run.
        try:
            with Workspace() as workspace:
                first = changed_scenario(place.path / NOMINAL, space, space.changes(space.origin()))
                checked = check(first, workspace, kind)
            if sloping:
                traced(checked)
        except ScenarioError:  # there was no search
            world.unlink(place.path / NOMINAL)
            raise
        order = [*system.judged.metrics, *system.judged.requirements]
        dataset = Dataset(place.path, space.keys, order, system.seed)
        parcel = _packed(place.path / NOMINAL, dimensions, kind)
        interruption = Interruption(lambda _: dataset.flush())
        is_whole = False
        try:
            with interruption.listening(), suppress(KeyboardInterrupt), ExitStack() as stack:
                pool = stack.enter_context(pool_for(parcel, scheduler, workers))
                runner = stack.enter_context(Runner(place.path / NOMINAL, kind=kind))  # loads nothing but for slopes
                begun(pool)
                evaluations = Evaluations(partial(_rows, pool, interruption), dataset, resumed=resume)
                try:
                    yield Prepared(place.path, told, space, evaluations, Slopes(runner.checked, space))
                    is_whole = True
                finally:
                    dataset.flush()
        except Exception:
            if not interruption.is_asked_for:  # a signal may have ended workers as well
                raise
    interruption.pass_on()
    if not is_whole:
        raise InterruptedSearch(interruption.number or signal.SIGINT, Path(output))


def _rows(pool: Pool, interruption: Interruption, points: Sequence[Point]) -> Iterator[tuple[Point, Row]]:
    return pool.rows(iter(points), len(points), lambda: interruption.is_asked_for)


def _packed(nominal: Path, dimensions: Sequence[Dimension], kind: Kind) -> Parcel:
    """What workers need: of the scenario, and of each model that may take the place of one of its own."""
    how: dict[str, Any] = {"scenario": str(nominal), "kind": kind}
    with Runner(**how) as runner:
        systems = [runner.load({})]
        for one in dimensions:
            for value in one.values if is_structural(one.name) else ():
                with suppress(ScenarioError):  # a run that has no system is refused
                    systems.append(runner.load({one.name: value}))
    return packed(how, systems, kind)


def _check(system: System, requirements: Sequence[str], names: Sequence[str]) -> None:
    problems = []
    known = list(system.judged.requirements)
    for name in requirements:
        if name not in known:
            near = suggestion(name, known) or (f"there are {', '.join(known)}" if known else "the scenario has none")
            problems.append(Problem("", f"there is no requirement '{name}'", near))
    if "preset" in names:
        remedy = "run one search for each, with --preset"
        problems.append(Problem("--vary preset", "a preset is where a search begins", remedy))
    if problems:
        raise ScenarioError(problems)


def _check_objectives(objectives: Mapping[str, str], known: Sequence[str]) -> None:
    problems = []
    for name, text in objectives.items():
        if name not in known:
            alike = [other for other in known if split_metric(other)[0] == split_metric(name)[0]]
            remedy = f"name one of {', '.join(alike)}, or write an expression of all"
            problems.append(Problem(f"--minimize {text}", "it is not a single number", remedy))
    if problems:
        raise ScenarioError(problems)


def _begin(place: RunDirectory, system: System, told: Mapping[str, Any], resume: bool) -> None:
    """Write down what is searched; of a search that is gone on with it must be the same."""
    nominal, record = place.path / NOMINAL, place.path / SEARCH_FILE
    system, copies = kept(system, place.path)  # a model that has changed has another copy, and so the text differs
    text = scenario_text(system, ["What is searched, with what is varied as it stands."])
    if not nominal.exists():
        if resume:
            raise ScenarioError(f"{place.given} holds no search to go on with; leave --resume out to begin one")
        copy(copies, place.path)
        rewrite(record, json.dumps(told).encode())
        rewrite(nominal, text.encode())  # with which there is a search
        return
    if not resume:
        raise ScenarioError(
            f"{place.given} holds a search already: go on with it by --resume, or name another directory by -o"
        )
    try:
        before = json.loads(world.read_text(record, encoding="utf-8"))
        same = all(before[key] == value for key, value in told.items())
    except (OSError, ValueError, LookupError, TypeError):
        same = False
    if not same or world.read_text(nominal, encoding="utf-8") != text:
        raise ScenarioError(
            f"{place.given} holds another search: give the scenario and options it was begun with, or name another "
            "directory by -o; a budget may be larger"
        )
