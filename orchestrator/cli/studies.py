"""The commands of ``orchestrate`` that run a scenario many times: study, and replay of one of its runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..names import SignalName
from . import completing
from .documents import Answer
from .options import (
    FAILED,
    FMU_FAILED,
    OK,
    Algorithm,
    Isolate,
    Kind,
    KindName,
    Preset,
    Quiet,
    Report,
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
    variant_of,
)

if TYPE_CHECKING:
    from ..run import Run
    from ..system import System


def study(
    scenario: Scenario,
    *,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="NAME=VALUES",
            autocompletion=completing.varied,
            help="What is varied, repeatable: cruise.alpha=0.005:0.05:10 (a grid), 0.005:0.05, 1,2,3, "
            "'normal(400e3,20e3)'; the scenario's [study] by default.",
        ),
    ] = None,
    runs: Annotated[int | None, typer.Option(help="How many runs; a grid has as many as it has points.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of what is drawn, and of each run's noise.")] = None,
    design: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="grid, random, latin-hypercube, sobol or saltelli.", autocompletion=completing.designs
        ),
    ] = None,
    variant: Variant = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    kind: Kind = KindName.auto,
    isolated: Isolate = None,
    record: Annotated[
        list[str] | None,
        typer.Option(
            "--record",
            metavar="SIGNAL",
            help="Keep a signal over time: 'train[1].speed'; repeatable.",
            autocompletion=completing.signals,
        ),
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the study in the directory.")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory; results/<scenario>-study by default.")
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    report: Report = False,
    quiet: Quiet = False,
) -> Answer:
    """Run a scenario many times, with other values each time: one table of all runs.

    A run executes the code of all FMUs and Python components that the scenario names, with your rights, on all workers.

    Exit codes: 0 fine; 1 a requirement failed in a run; 2 the input is wrong; 3 a run failed, or results cannot be
    written; 130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP: --resume goes on.
    """
    from ..study.campaign import run_study
    from ..study.design import make_plan, plan_notes
    from .documents import study_document
    from .lines import tell
    from .printing import show_page, show_runs, show_study

    check_workers(workers, scheduler)
    if report:
        from ..report import check_drawable

        check_drawable()
    system = load_system(
        scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step, algorithm=algorithm
    )
    plan = make_plan(system, vary or (), runs=runs, seed=seed, design=design)
    how: dict[str, Any] = {
        "scenario": scenario if variant is None else variant_of(scenario, variant),
        "preset": preset,
        "settings": [*(settings or ()), *_isolating(system, isolated or [])],
        "builds": builds or [],
        "swaps": swaps or [],
        "stop_time": stop,
        "step": step,
        "algorithm": algorithm,
        "kind": kind.value,
        "record": record or [],
    }
    directory = output or Path("results") / "-".join(filter(None, (system.provenance.name, preset, "study")))
    for note in () if quiet else plan_notes(plan):
        tell(f"note: {note}")
    with show_runs(system.provenance.name, quiet) as shown:
        done = run_study(
            plan,
            how,
            directory,
            scheduler=scheduler,
            workers=workers,
            resume=resume,
            progress=shown.progress,
            begun=shown.begun,
        )
    figures = [] if no_figures or done.signal else done.draw()
    page = None
    if report and not done.signal:
        from ..report import write_report

        page = write_report([directory])
    code = FMU_FAILED if done.broken else FAILED if done.failed else OK

    def show() -> None:
        show_study(done, quiet, len(figures))
        show_page(page, quiet)

    return Answer(
        lambda: study_document(done, figures, page),
        show,
        interrupted(done.signal) if done.signal else code,
    )


def _isolating(system: System, names: list[str]) -> list[str]:
    """The settings that isolate instances; groups of them by their name, however many they are in a run."""
    from ..isolation import ALL, AUTO, isolate, strangers
    from ..system import TOGETHER

    isolate(system, names)  # tells which are unknown
    groups = list(dict.fromkeys(SignalName(name).group for name in system.instances))
    shared = groups if TOGETHER in names else strangers(system) if AUTO in names else []
    alone = groups if ALL in names else [name for name in names if name not in (TOGETHER, AUTO)]
    return [*(f"{x}.isolate='{TOGETHER}'" for x in shared), *(f"{x}.isolate=true" for x in alone)]


def replay(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The directory of a study.")],
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="The scenario of the study, where it names Python code of your own.",
            autocompletion=completing.scenarios,
        ),
    ] = None,
    *,
    number: Annotated[int, typer.Option("--run", metavar="N", help="Which run, by the column 'run'.")],
    trust: Annotated[bool, typer.Option("--trust", help="Import Python code that the study alone names.")] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory for the results; DIR/run-N by default.")
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    quiet: Quiet = False,
) -> Answer:
    """Run one run of a study again, as a single run with all results and figures, to the same bits.

    Exit codes: those of run; and 1 where it is not what the study has, to the bit.
    """
    from ..study.campaign import replay as replay_run
    from .documents import replay_document
    from .lines import tell
    from .printing import show_progress, show_run

    with show_progress(f"run {number}", quiet) as progress:
        again = replay_run(
            directory,
            number,
            scenario=scenario,
            trust=trust,
            output=output,
            figures=not no_figures,
            progress=progress,
            writing=progress and progress.writing,
        )

    def show() -> None:
        show_run(again.run, None, None, quiet)
        for line in (*again.notes, *(f"not the same as in the study: {what}" for what in again.differences)):
            tell(f"warning: {line}")
        if not again.differences and not quiet:
            tell(f"run {number} of {directory}: the same to the bit")

    return Answer(lambda: replay_document(again), show, _exit_code(again.run, bool(again.differences)))


def _exit_code(run: Run, differs: bool) -> int:
    if run.signal:
        return interrupted(run.signal)
    if run.error is not None and run.status == "failed":
        return FMU_FAILED
    return FAILED if run.failed or differs else OK
