"""Commands of ``orchestrate`` that search: for a run that breaks a requirement, for the best parameters or driving."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import ScenarioError
from ..problems import Problem
from ..system import System
from . import completing
from .documents import Answer
from .options import (
    FAILED,
    FMU_FAILED,
    OK,
    Kind,
    KindName,
    Preset,
    Quiet,
    Scenario,
    Scheduler,
    Set,
    Step,
    Stop,
    Swap,
    Variant,
    With,
    Workers,
    check_workers,
    interrupted,
    load_system,
)


class MethodName(StrEnum):
    """`search.METHODS`, as the command line needs them."""

    cma_es = "cma-es"
    tpe = "tpe"
    random = "random"
    gradient = "gradient"


class ObjectiveName(StrEnum):
    """`driving.OBJECTIVES`, as the command line needs them."""

    energy = "energy"
    time = "time"


Vary = Annotated[
    list[str] | None,
    typer.Option(
        help="What is varied: gust.size=0:2, a distribution, a list, or a signal over time such as "
        "target.value=signal(60, 85, 10, linear, rate=0.5); repeatable.",
        autocompletion=completing.varied,
    ),
]
Budget = Annotated[int, typer.Option(min=1, help="How many runs may be spent.")]
Seed = Annotated[int, typer.Option(min=0, max=2**32 - 1, help="Of the search.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with the search in the directory: no run is run twice.")]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")]


def falsify(
    scenario: Scenario,
    *,
    vary: Vary = None,
    requirement: Annotated[
        str | None,
        typer.Option(
            help="The requirement to be broken; the scenario's own where it has one alone.",
            autocompletion=completing.requirements,
        ),
    ] = None,
    budget: Budget = 500,
    method: Annotated[
        MethodName,
        typer.Option(help="How to search: CMA-ES, the tree-structured Parzen estimator, at random, or by gradients."),
    ] = MethodName.cma_es,
    seed: Seed = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    resume: Resume = False,
    variant: Variant = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    kind: Kind = KindName.auto,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Directory; results/falsify-<scenario>-<requirement> by default."),
    ] = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
) -> Answer:
    """Search for the run that breaks a requirement, and make what is found as small as it can be.

    What is found is a scenario, counterexample.toml; as many runs as the budget may be spent on making it small.

    Exit codes: 0 not broken within the budget; 1 broken; 2 the input is wrong; 3 not broken, but runs failed; 130
    interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP: --resume goes on.
    """
    from ..study.search import falsify as search
    from .documents import falsify_document
    from .printing import show_falsified, show_search

    check_workers(workers, scheduler)
    system = load_system(scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step)
    name = requirement or _only_requirement(system)
    directory = output or _directory("falsify", system, preset, name)
    with show_search(f"{system.provenance.name}: {name}", quiet) as shown, _resumable():
        result = search(
            system,
            vary or (),
            name,
            directory,
            budget=budget,
            method=method.value,
            seed=seed,
            kind=kind.value,
            resume=resume,
            figures=not no_figures,
            scheduler=scheduler,
            workers=workers,
            progress=shown.progress,
            begun=shown.begun,
        )
    code = FAILED if result.found.found else FMU_FAILED if result.found.failed else OK
    return Answer(lambda: falsify_document(result), lambda: show_falsified(result, quiet), code)


def optimize(
    scenario: Scenario,
    *,
    vary: Vary = None,
    objectives: Annotated[
        list[str] | None,
        typer.Option(
            "--minimize",
            help="What is to be least: a metric, or an expression; several give a Pareto front.",
            autocompletion=completing.metrics,
        ),
    ] = None,
    requirements: Annotated[
        list[str] | None,
        typer.Option(
            "--subject-to", help="A requirement that has to hold; repeatable.", autocompletion=completing.requirements
        ),
    ] = None,
    budget: Budget = 500,
    seed: Seed = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    resume: Resume = False,
    variant: Variant = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    kind: Kind = KindName.auto,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory; results/optimize-<scenario> by default.")
    ] = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
) -> Answer:
    """Search for the values that make metrics least while requirements hold.

    One objective is searched for by the tree-structured Parzen estimator and gives best.toml, several by NSGA-II and
    give a Pareto front of scenarios, pareto-1.toml and so on.

    Exit codes: 0 found; 1 no run keeps the requirements; 2 the input is wrong; 3 none keeps them, and runs failed; 130
    interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP: --resume goes on.
    """
    from ..study.search import optimize as search
    from .documents import optimize_document
    from .printing import show_optimized, show_search

    check_workers(workers, scheduler)
    if not objectives:
        raise ScenarioError(Problem("", "nothing is to be least", "name a metric, as in --minimize settling"))
    system = load_system(scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step)
    directory = output or _directory("optimize", system, preset)
    how: Any = {"requirements": requirements or (), "budget": budget, "seed": seed, "kind": kind.value}
    with show_search(system.provenance.name, quiet) as shown, _resumable():
        result = search(
            system,
            vary or (),
            objectives,
            directory,
            **how,
            resume=resume,
            figures=not no_figures,
            scheduler=scheduler,
            workers=workers,
            progress=shown.progress,
            begun=shown.begun,
        )
    code = OK if result.found.best else FMU_FAILED if result.found.failed else FAILED
    return Answer(lambda: optimize_document(result), lambda: show_optimized(result, quiet), code)


@contextmanager
def _resumable() -> Iterator[None]:
    """Tell how a search that a signal ended is gone on with, and end as signals do."""
    from ..study.search import InterruptedSearch
    from .lines import tell

    try:
        yield
    except InterruptedSearch as end:
        if end.directory is not None:
            tell(f"interrupted; to go on: the same command with --resume -o {end.directory}")
        raise typer.Exit(interrupted(end.signal)) from None


def _only_requirement(system: System) -> str:
    """The one requirement of a scenario.

    Raises:
        ScenarioError: it has none, or several.
    """
    names = list(system.judged.requirements)
    if len(names) != 1:
        remedy = f"name one by --requirement: {', '.join(names)}" if names else "write one into its [require]"
        raise ScenarioError(Problem("", f"the scenario has {len(names) or 'no'} requirements", remedy))
    return names[0]


def _directory(command: str, system: System, preset: str | None, *more: str) -> Path:
    return Path("results") / "-".join(filter(None, (command, system.provenance.name, preset, *more)))


def drive(
    case: Annotated[
        str,
        typer.Argument(
            metavar="CASE",
            help="A shipped case (see 'orchestrate list'), or a .toml file with a table [drive].",
            autocompletion=completing.cases,
        ),
    ],
    *,
    time: Annotated[float | None, typer.Option(help="Running time in s; as the case says by default.")] = None,
    minimize: Annotated[ObjectiveName | None, typer.Option(help="What is to be least.")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Set a key of the case: jerk=0.5, train.mass=4e5; repeatable.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory; results/<case>-drive by default.")
    ] = None,
    quiet: Quiet = False,
) -> Answer:
    """Find the driving over a line that takes the least energy in a given time, or the least time (extra 'native').

    What is found is profile.csv: place, time, speed, and the forces of traction and brakes. Exit codes: 0 found; 2 the
    input is wrong, or no driving keeps to it.
    """
    try:
        from ..driving import MESHES, load_case, optimise, write_profile
    except ImportError:
        raise ScenarioError(Problem("", "driving needs casadi", "pip install 'railcosim[native]'")) from None
    from .documents import drive_document
    from .printing import show_drive, show_meshes

    changes = {"time": time, "minimize": minimize and minimize.value}
    found = load_case(case, settings or (), changes)
    with show_meshes(found.title, quiet, MESHES) as solved:
        optimum = optimise(found, solved)
    path = write_profile(output or Path("results") / f"{optimum.case.name}-drive", optimum.solution)
    return Answer(lambda: drive_document(optimum, path), lambda: show_drive(optimum, path, quiet))
