"""A study, from a plan to a table of runs."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import RailcosimError, ScenarioError
from ...fmi import Workspace
from ...run import Interruption, RunDirectory, check
from ...scenario import is_structural
from ...ssp import is_ssp_name
from ...system import System
from ..design import Plan
from ..structure import Runner
from .columns import Entry
from .dataset import Dataset, rewrite
from .flight import Point
from .parcel import Parcel, packed
from .pool import Pool, pool_for
from .study import STUDY_FILE, Study

OnProgress = Callable[[int, int, int], None]
"""Is told how many runs are done, of how many, and how many failed."""
_BLOCK = 4096
"""Runs that are read of the plan at a time."""
_MOST_BUILT = 64
"""Structures whose components are built before the study begins; the FMUs of more are built by workers."""
_PACKAGES = ("railcosim", "numpy", "scipy", "pyarrow")
_SAME = {"plan": "what is varied", "how": "the options", "contents": "a file or model", "versions": "a package"}
"""What makes a study the one it is, and what to call it."""


def run_study(
    plan: Plan,
    how: Mapping[str, Any],
    output: str | Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    resume: bool = False,
    progress: OnProgress = lambda *_: None,
    begun: Callable[[Pool], None] = lambda _: None,
) -> Study:
    """Run a study.

    Args:
        plan: which runs.
        how: the arguments of the `Runner`, the scenario among them.
        output: the directory for its results.
        scheduler: the address of a Dask scheduler; without one workers are started on this machine.
        workers: how many of them; by default as many as there are processors. With 0 all runs in this process.
        resume: whether to go on with the study in the directory.
        progress: called after each run.
        begun: called with the pool once there is one.

    Raises:
        ScenarioError: the study cannot be run, or the directory holds another one; nothing is written.
        RecordError: there is no room for results. What was computed is on disk, and the study can be resumed.
        RunError: the scheduler is gone. As above.
    """
    need_packages("pyarrow", "pandas", *(["distributed"] if workers != 0 else []))
    how = {**how, "scenario": _absolute(how["scenario"])}
    with Runner(**how) as runner:
        systems = _systems(runner, plan)
        _check(runner, plan, how)
    parcel = packed(how, systems, how.get("kind", "auto"))
    told = _told(plan, parcel, systems[0])
    with RunDirectory(Path(output), record=STUDY_FILE) as place:
        told |= {"process": place.marks["process"]}
        dataset = Dataset(place.path, plan.names, told["evaluated"], systems[0].seed)
        there = _opened(place, dataset, told, resume)
        _note(place.path, told | {"status": "running", "error": None})
        interruption = Interruption(lambda _: dataset.flush())
        status, error = "failed", None
        try:
            with interruption.listening(), suppress(KeyboardInterrupt):
                if not there.all():
                    with pool_for(parcel, scheduler, workers) as pool:
                        begun(pool)
                        _run(pool, plan, there, dataset, is_over=lambda: interruption.is_asked_for, tell=progress)
            status = "completed" if there.all() else "interrupted"
            if status == "completed" and not dataset.is_complete:
                dataset.complete(told | {"status": status, "error": None})
        except Exception as problem:
            if not interruption.is_asked_for:  # a signal may have ended workers as well
                status, error = "failed", str(problem)
                raise
            status = "interrupted"
        finally:
            with suppress(OSError, RailcosimError):  # for this there may be no room either
                _note(place.path, told | {"status": status, "error": error})
    study = Study.load(output)
    study.signal = interruption.number
    interruption.pass_on()
    return study


def need_packages(*names: str) -> None:
    """Say which extra a study needs.

    Raises:
        RailcosimError: a package is missing.
    """
    missing = [name for name in names if importlib.util.find_spec(name) is None]
    if missing:
        raise RailcosimError(f"studies need {', '.join(missing)}: pip install 'railcosim[study]'")


def _absolute(scenario: str) -> str:
    """A scenario's path, which leads there from everywhere; the name of a shipped one as it is."""
    is_file = scenario.endswith(".toml") or is_ssp_name(scenario)
    return os.path.abspath(scenario) if os.path.dirname(scenario) or is_file else scenario


def _variant(scenario: str) -> str:
    """Which of the system structures of an SSP a scenario is."""
    return scenario.partition("#")[2] if is_ssp_name(scenario) else ""


def _systems(runner: Runner, plan: Plan) -> list[System]:
    """The systems of a plan that differ in their structure, as far as there are such: a run that has none is refused.

    Raises:
        ScenarioError: there is none at all.
    """
    found: list[System] = []
    refused: list[ScenarioError] = []
    seen: set[str] = set()
    keys = [name for name in plan.names if is_structural(name)]
    for _, changes in _points(plan):
        structure = json.dumps([changes[key] for key in keys], default=str)
        if structure not in seen:
            seen.add(structure)
            try:
                found.append(runner.load(changes))
            except ScenarioError as error:
                refused.append(error)
        if len(seen) == _MOST_BUILT or not keys:
            break
    if not found:
        raise refused[0]
    return found


def _check(runner: Runner, plan: Plan, how: Mapping[str, Any]) -> None:
    """Refuse a study none of whose runs could run, before anything is written: three of them tell.

    Raises:
        ScenarioError: with what is wrong with the first.
    """
    refused: list[ScenarioError] = []
    for number in sorted({0, plan.count // 2, plan.count - 1}):
        try:
            with Workspace() as workspace:
                check(runner.load(plan.changes(number)), workspace, how.get("kind", "auto"))
        except ScenarioError as error:
            refused.append(error)
        else:
            return
    raise refused[0]


def _told(plan: Plan, parcel: Parcel, system: System) -> dict[str, Any]:
    """What is said of a study, so that everybody knows what it is, and it can be gone on with."""
    came = system.provenance
    versions = {name: importlib.metadata.version(name) for name in _PACKAGES}
    return {
        "scenario": came.name,
        "path": came.path,
        "title": came.title,
        "preset": came.preset,
        "runs": plan.count,
        "seed": plan.seed,
        "dimensions": plan.names,
        "evaluated": [*system.judged.metrics, *system.judged.requirements],
        "plan": plan.to_json(),
        "how": dict(parcel.how),
        "folder": parcel.folder,
        "files": dict(parcel.files),
        "components": {f"{one.reference} {json.dumps(one.arguments)}": one.digest for one in parcel.components},
        "contents": sorted({*parcel.files.values(), *(one.digest for one in parcel.components)}),
        "versions": versions,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "scenario_text": came.text,
    }


def _opened(place: RunDirectory, dataset: Dataset, told: dict[str, Any], resume: bool) -> NDArray[np.bool_]:
    """Which runs are there; of a new study none.

    Raises:
        ScenarioError: there is a study and none is to be resumed, or none and one is; or it is another.
    """
    path = place.path / STUDY_FILE
    if not path.exists():
        if resume:
            raise ScenarioError(f"{place.given} holds no study to go on with; leave --resume out to begin one")
        dataset.clear()
        return np.zeros(told["runs"], np.bool_)
    before = Study.load(place.path)
    if not resume and not dataset.parts():  # it ended before its first run
        dataset.clear()
        return np.zeros(told["runs"], np.bool_)
    if not resume:
        raise ScenarioError(
            f"{place.given} holds a study already ({before.told['status']}): go on with it by --resume, or name "
            "another directory by -o"
        )
    now = json.loads(json.dumps(told, default=str))
    began = before.told["how"]["scenario"]
    if _variant(began) == _variant(now["how"]["scenario"]):
        now["how"]["scenario"] = began  # it may stand elsewhere: its content counts
    other = [what for key, what in _SAME.items() if before.told.get(key) != now[key]]
    if other:
        raise ScenarioError(
            f"{place.given} holds another study: {', '.join(other)} differs; give what it was begun with, or name "
            "another directory by -o"
        )
    return dataset.recover(told["runs"])


def _note(directory: Path, told: Mapping[str, Any]) -> None:
    text = json.dumps(told, indent=2, default=str)
    rewrite(directory / STUDY_FILE, text.encode(errors="backslashreplace"))


def _run(
    pool: Pool, plan: Plan, there: NDArray[np.bool_], dataset: Dataset, *, is_over: Callable[[], bool], tell: OnProgress
) -> None:
    """Run what is missing, and keep it as it comes."""
    failed, done = 0, int(there.sum())
    missing = (point for point in _points(plan) if not there[point[0]])
    try:
        for (number, changes), row in pool.rows(missing, plan.count - done, is_over):
            dataset.add(Entry(number, changes, row))
            there[number] = True
            done += 1
            failed += row.status in ("failed", "refused")
            tell(done, plan.count, failed)
    finally:
        dataset.flush()


def _points(plan: Plan) -> Iterator[Point]:
    for first in range(0, plan.count, _BLOCK):
        yield from enumerate(plan.block(first, min(first + _BLOCK, plan.count)), first)
