"""`falsify` and `optimize`: a search from a scenario to the files that tell what it has found."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from ...evaluation import Verdict
from ...fmi import Kind
from ...markup import MOST_ROWS, escaped, number, table
from ...system import System
from ..campaign import Pool, rewrite
from .counterexample import as_json, changed_scenario, describe, write_counterexample, write_scenario
from .falsification import Falsification, search
from .figures import draw_optimization
from .methods import METHODS, SLOPING
from .optimization import Optimization, minimize, read_objectives
from .preparation import SEARCH_FILE, Prepared, prepared

OnRun = Callable[[int, int, str], None]
"""Told after each run how many there were, of how many, and what is best so far."""


@dataclass(frozen=True)
class Falsified:
    """A search for a counterexample, and its files.

    Attributes:
        found: what came out. directory: with the files.
        verdict: of the counterexample, run by itself; None where there is none. scenario: its file.
        changes: what it changes, a line each. figures: that were drawn.
    """

    found: Falsification
    directory: Path
    verdict: Verdict | None = None
    scenario: Path | None = None
    changes: tuple[str, ...] = ()
    figures: tuple[Path, ...] = ()

    def _repr_html_(self) -> str:
        """What a notebook shows: whether the requirement is broken, where, and by the smallest of changes."""
        found, verdict = self.found, self.verdict
        end = f"not broken in {found.runs} runs" if verdict is None else f"broken after {found.runs} runs"
        rows = [[f"<code>{escaped(line)}</code>"] for line in self.changes]
        facts = [] if verdict is None else [["margin", number(verdict.margin)], ["at t [s]", number(verdict.time)]]
        told = table(["", "value"], facts, "Counterexample") if facts else ""
        return f"<p><b>{escaped(found.requirement)}</b>: {end}</p>{told}" + (
            table(["change"], rows, "") if rows else ""
        )


@dataclass(frozen=True)
class Optimized:
    """An optimisation, and its files.

    Attributes:
        found: what came out. directory: with the files.
        scenarios: of the best runs, in their order. changes: what each changes, a line each. figures: that were drawn.
    """

    found: Optimization
    directory: Path
    scenarios: tuple[Path, ...] = ()
    changes: tuple[tuple[str, ...], ...] = ()
    figures: tuple[Path, ...] = field(default=())

    def _repr_html_(self) -> str:
        """What a notebook shows: the best of all runs, each with its values and what it changes."""
        names = list(self.found.objectives.values())
        rows = [
            [escaped(path.name), *map(number, self.found.values(best)), "<br>".join(map(escaped, changes))]
            for best, path, changes in zip(self.found.best, self.scenarios, self.changes, strict=True)
        ]
        return table(["scenario", *names, "changes"], rows, f"Best of {self.found.runs} runs", most=MOST_ROWS)


def falsify(
    system: System,
    vary: Sequence[str],
    requirement: str,
    output: str | Path,
    *,
    budget: int = 500,
    method: str = next(iter(METHODS)),
    seed: int = 0,
    kind: Kind = "auto",
    scheduler: str | None = None,
    workers: int | None = None,
    resume: bool = False,
    figures: bool = True,
    progress: OnRun = lambda *_: None,
    begun: Callable[[Pool], None] = lambda _: None,
) -> Falsified:
    """Search for the run that breaks a requirement.

    Args:
        system: the scenario, from `load`.
        vary: what is varied, each as `--vary` takes it: ``"gust.size=0:2"``, ``"target.value=signal(60, 85, 10)"``.
        requirement: by name.
        output: the directory for counterexample, figure and all runs.
        budget: how many runs may be spent; as many again to make small what is found.
        method: one of `METHODS`.
        seed: of the method's luck.
        kind: how components become models.
        scheduler: the address of a Dask scheduler; without one workers are started on this machine.
        workers: how many of them; by default as many as there are processors. With 0 all runs in this process. What
            is found does not depend on it.
        resume: whether to go on with the search in the directory.
        figures: whether to draw.
        progress: told after each run.
        begun: called with the pool once there is one.

    Raises:
        ScenarioError: something is wrong with the scenario, the requirement or what is varied.
        RunError: the scenario as it stands cannot be run, or the scheduler is gone.
        InterruptedSearch: a signal has ended it: what was run is on disk, and `resume` goes on.
    """
    told = {"vary": list(vary), "requirement": requirement, "method": method, "seed": seed}
    where: Any = {"kind": kind, "resume": resume, "scheduler": scheduler, "workers": workers, "begun": begun}
    sloping = method in SLOPING
    with prepared(system, vary, output, told, requirements=[requirement], sloping=sloping, **where) as ready:
        found = search(
            ready.space,
            ready.evaluations,
            requirement,
            budget=budget,
            method=method,
            seed=seed,
            slope=partial(ready.slopes.at, requirement),
            told=lambda done, of, least: progress(done, of, f"least margin {least:.4g}"),
        )
        ready.evaluations.flush()
        result = Falsified(found, Path(output))
        if found.found:
            scenario, verdict, drawn = write_counterexample(
                ready.directory, ready.space, found.changes, requirement, kind=kind, figure=figures
            )
            changes = tuple(describe(ready.space, found.changes))
            result = Falsified(found, Path(output), verdict, scenario, changes, tuple(drawn))
        _note(ready, {**ready.told, "budget": budget} | _of_falsification(result))
    return result


def optimize(
    system: System,
    vary: Sequence[str],
    objectives: Sequence[str],
    output: str | Path,
    *,
    requirements: Sequence[str] = (),
    budget: int = 500,
    seed: int = 0,
    kind: Kind = "auto",
    scheduler: str | None = None,
    workers: int | None = None,
    resume: bool = False,
    figures: bool = True,
    progress: OnRun = lambda *_: None,
    begun: Callable[[Pool], None] = lambda _: None,
) -> Optimized:
    """Search for the changes that make metrics least while requirements hold.

    Args:
        system: the scenario, from `load`.
        vary: what is varied, as for `falsify`.
        objectives: metrics of the scenario (``"settling"``, ``"gap_min[2]"``), or expressions.
        output: the directory for scenarios, figure and all runs.
        requirements: by name.
        budget: how many runs may be spent.
        seed: of the search.
        kind: how components become models.
        scheduler: the address of a Dask scheduler; without one workers are started on this machine.
        workers: how many of them; by default as many as there are processors. With 0 all runs in this process. What
            is found does not depend on it.
        resume: whether to go on with the search in the directory.
        figures: whether to draw.
        progress: told after each run.
        begun: called with the pool once there is one.

    Raises:
        ScenarioError: something is wrong with the scenario, an objective, a requirement or what is varied.
        RunError: the scenario as it stands cannot be run, or the scheduler is gone.
        InterruptedSearch: a signal has ended it: what was run is on disk, and `resume` goes on.
    """
    wanted, more = read_objectives(system, objectives)
    told = {"vary": list(vary), "minimize": list(objectives), "subject_to": list(requirements), "seed": seed}
    about: Any = {"requirements": requirements, "metrics": more, "objectives": wanted}
    where: Any = {"kind": kind, "resume": resume, "scheduler": scheduler, "workers": workers, "begun": begun}
    with prepared(system, vary, output, told, **about, **where) as ready:
        found = minimize(
            ready.space,
            ready.evaluations,
            wanted,
            requirements,
            budget=budget,
            seed=seed,
            told=lambda done, of: progress(done, of, ""),
        )
        ready.evaluations.flush()
        paths = _write_best(ready, found)
        drawn = (draw_optimization(found, ready.directory, system.provenance.name),) if figures else ()
        changes = tuple(tuple(describe(ready.space, best.changes)) for best in found.best)
        result = Optimized(found, Path(output), paths, changes, drawn)
        _note(ready, {**ready.told, "budget": budget} | _of_optimization(result))
    return result


def _write_best(ready: Prepared, found: Optimization) -> tuple[Path, ...]:
    """The scenarios of the best runs: `best.toml`, or of a Pareto front one each."""
    paths = []
    several = len(found.objectives) > 1
    for k, best in enumerate(found.best, 1):
        path = ready.directory / (f"pareto-{k}.toml" if several else "best.toml")
        values = zip(found.objectives.values(), found.values(best), strict=True)
        lines = [
            "Of all runs of a search, no other is better in every one of:" if several else "The best run of a search:"
        ]
        lines += [f"    {text} = {value:.6g}" for text, value in values]
        lines += ["", "What it changes:", *(f"    {line}" for line in describe(ready.space, best.changes))]
        lines += ["", f"Run it: orchestrate run {path.name}"]
        write_scenario(path, changed_scenario(ready.nominal, ready.space, best.changes), lines)
        paths.append(path)
    return tuple(paths)


def _of_falsification(result: Falsified) -> dict[str, Any]:
    found, nearest = result.found, result.found.nearest
    return {
        "broken": found.found,
        "runs": found.runs,
        "shrinking": found.shrinking,
        "failed": found.failed,
        "errors": list(found.errors),
        "nearest": nearest and {"run": nearest.run, "margin": nearest.margins.get(found.requirement)},
        "changes": as_json(found.changes),
        "margin": result.verdict and result.verdict.margin,
        "time": result.verdict and result.verdict.time,
        "figures": [path.name for path in result.figures],
    }


def _of_optimization(result: Optimized) -> dict[str, Any]:
    found = result.found
    return {
        "runs": found.runs,
        "failed": found.failed,
        "errors": list(found.errors),
        "best": [
            {"run": best.run, "scenario": path.name, "values": found.values(best), "changes": as_json(best.changes)}
            for best, path in zip(found.best, result.scenarios, strict=True)
        ],
        "figures": [path.name for path in result.figures],
    }


def _note(ready: Prepared, told: Mapping[str, Any]) -> None:
    text = json.dumps(told, indent=1, ensure_ascii=False) + "\n"
    rewrite(ready.directory / SEARCH_FILE, text.encode(errors="backslashreplace"))
