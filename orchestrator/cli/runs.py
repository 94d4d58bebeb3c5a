"""The commands of ``orchestrate`` that run a scenario, or draw what a run has left: run, reproduce, plot, convert."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .. import world
from ..errors import ScenarioError
from . import completing
from .documents import Answer, written
from .lines import tell
from .options import (
    FAILED,
    OK,
    Algorithm,
    Dpi,
    FigureFormat,
    Isolate,
    Kind,
    KindName,
    LateName,
    Preset,
    Quiet,
    RealTimeFactor,
    Report,
    Set,
    Step,
    Stop,
    Swap,
    Variant,
    WhenLate,
    With,
    draw_as,
    exit_code,
    interrupted,
    load_system,
)

if TYPE_CHECKING:
    from ..run import Results, Run
    from .documents import CaseDocument


def run(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="A shipped scenario (see 'orchestrate list'), or a .toml, .ssp or .ssd file.",
            autocompletion=completing.scenarios,
        ),
    ] = None,
    *,
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
    threads: Annotated[
        int,
        typer.Option(
            min=1,
            help="Threads that step in parallel, under jacobi with FMI 2.0 FMUs: for many or heavy ones on idle cores.",
        ),
    ] = 1,
    real_time: RealTimeFactor = None,
    late: WhenLate = None,
    checkpoint_every: Annotated[
        float | None,
        typer.Option(metavar="T", help="Write a checkpoint about every T s of the run, to go on from by --resume."),
    ] = None,
    resume_from: Annotated[
        Path | None,
        typer.Option(
            "--resume",
            metavar="DIR",
            help="Go on with the run in DIR from its last checkpoint; with Python components of your own, name the "
            "SCENARIO and its --swap as well.",
        ),
    ] = None,
    trust: Annotated[
        bool, typer.Option("--trust", help="With --resume: import Python code that the checkpoint alone names.")
    ] = False,
    verify_step: Annotated[
        bool, typer.Option("--verify-step", help="Run again at half the step, and judge the step by what changes.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory for the results; results/<scenario> by default.")
    ] = None,
    save: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Write the results for other tools as well, by the ending: .parquet, .h5 (MTSF), .mat (Dymola), .csv; "
            "repeatable.",
        ),
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    report: Report = False,
    live: Annotated[
        bool, typer.Option("--live", help="With --report: put the models into the page, with sliders.")
    ] = False,
    figure_format: FigureFormat = None,
    dpi: Dpi = None,
    quiet: Quiet = False,
) -> Answer:
    """Run a scenario: results, metrics, verdicts, figures.

    A run executes the code of all FMUs and Python components that the scenario names, with your rights.

    Exit codes: 0 fine; 1 a requirement failed, a known value was missed, or --verify-step found the step too coarse;
    2 the input is wrong; 3 an FMU failed, or what the FMUs exchange does not settle (what was computed is on disk);
    130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP (what was computed is on disk). A second Ctrl-C ends it at
    once, also where an FMU does not return.
    """
    from ..isolation import isolate
    from ..run import add_step_check, check_ending, check_step, execute, go_on, read_checkpoint
    from ..scenario import load
    from .documents import run_document
    from .printing import show_page, show_progress, show_run

    if live and not report:
        raise ScenarioError("--live is about the page of --report: give both")
    if report:
        from ..report import check_drawable, check_live

        check_drawable()
    for file in save or ():
        check_ending(file)
    how = {
        "figures": not no_figures,
        "threads": threads,
        "checkpoint_every": checkpoint_every,
        **_pace(real_time, late),
    }
    if resume_from is not None:
        given = (variant, preset, settings or None, builds or None, step, algorithm, isolated or None, output)
        changed = any(x is not None for x in (*given, figure_format, dpi)) or kind is not KindName.auto or verify_step
        if changed or (swaps and scenario is None):
            raise ScenarioError(
                "--resume takes the run as its directory has it: give no change but --stop; --threads, "
                "--checkpoint-every, --no-figures, --quiet and --trust may stand with it, and the scenario of the run "
                "with the --swap it had"
            )
        point = read_checkpoint(resume_from)
        same = None if scenario is None else load(scenario, preset=point.system.provenance.preset, swaps=swaps or ())
        with show_progress(
            point.system.provenance.name, quiet, point.system.stepping.start_time, point.time
        ) as progress:
            how |= {"progress": progress, "writing": progress and progress.writing}
            outcome = go_on(resume_from, stop_time=stop, scenario=same, trust=trust, **how)
    else:
        if scenario is None:
            raise ScenarioError("name a scenario (see 'orchestrate list'), or a run to go on with by --resume DIR")
        system = load_system(
            scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step, algorithm=algorithm
        )
        system = isolate(system, isolated or ())
        draw_as(system, figure_format, dpi)
        if live:
            check_live(system, kind.value)
        directory = output or Path("results") / "-".join(filter(None, (system.provenance.name, preset)))
        with show_progress(system.provenance.name, quiet, system.stepping.start_time) as progress:
            writing = progress and progress.writing
            outcome = execute(system, kind=kind.value, output=directory, progress=progress, writing=writing, **how)
    _save(outcome.results, (save or ()) if outcome.results.points else ())
    second = _at_half_the_step(outcome, kind, quiet) if verify_step else None
    verdict = None
    if second is not None and second.status == "completed":
        verdict = check_step(outcome, second)
        if outcome.directory is not None:
            add_step_check(outcome.directory, verdict)
    page = None
    if report and outcome.directory is not None:
        from ..report import write_report

        goes = live and outcome.status == "completed"
        page = write_report([outcome.directory], live=goes, trust=True)

    def show() -> None:
        show_run(outcome, second, verdict, quiet)
        show_page(page, quiet)

    return Answer(
        lambda: run_document(outcome, second, verdict, page),
        show,
        exit_code(outcome, second, verdict),
        next((each.error for each in (outcome, second) if each and each.status == "failed" and each.error), None),
    )


def _at_half_the_step(outcome: Run, kind: KindName, quiet: bool) -> Run | None:
    """The same run at half the step, in memory; None where there is nothing to compare it with."""
    from ..run import at_half_the_step, execute
    from .printing import show_progress

    if outcome.status != "completed":
        return None
    system = outcome.system
    with show_progress(f"{system.provenance.name} at half the step", quiet, system.stepping.start_time) as progress:
        return execute(at_half_the_step(system), kind=kind.value, progress=progress)


def reproduce(
    paper: Annotated[
        str | None,
        typer.Argument(
            help="A scenario's name or a word of its source, such as Wang; all by default.",
            autocompletion=completing.scenarios,
        ),
    ] = None,
    kind: Kind = KindName.auto,
    quiet: Quiet = False,
) -> Answer:
    """Run every published case and print what a source says beside what is measured.

    Claim, known and measured value, tolerance and verdict, under the command that shows them; of our own references
    only those that are missed (`run` shows all). Counted apart: stated, fitted, reconstructed, misprint, reference.
    With --quiet only what failed, and one line. Exit code 1 if a value was missed, or one that is known to depart does
    so no more.
    """
    from ..comparison import published_cases
    from ..evaluation import BAD
    from ..run import execute
    from .documents import CaseDocument, reproduce_document
    from .printing import show_cases, show_reproduced

    done: list[CaseDocument] = []
    cases = published_cases(paper)
    with show_cases(len(cases), quiet) as tell:
        for case in cases:
            tell(case.command.removeprefix("orchestrate run "))
            outcome = execute(case.system, kind=kind.value)
            if outcome.error is not None:
                raise outcome.error
            if outcome.status == "interrupted":
                raise typer.Exit(interrupted(outcome.signal))
            done.append(
                CaseDocument(case.command, outcome.status, outcome.findings, outcome.published, outcome.references)
            )
    missed = any(row.verdict in BAD for case in done for row in (*case.published, *case.references))
    return Answer(lambda: reproduce_document(done), lambda: show_reproduced(done, quiet), FAILED if missed else OK)


def plot(
    results: Annotated[Path, typer.Argument(help="The directory of a run.")],
    signals: Annotated[
        list[str] | None,
        typer.Argument(
            help="Expressions such as 'train[:].speed'; without, the run's figures.",
            autocompletion=completing.run_signals,
        ),
    ] = None,
    *,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Where to draw; RESULTS by default.")] = None,
    figure_format: FigureFormat = None,
    dpi: Dpi = None,
    quiet: Quiet = False,
) -> Answer:
    """Draw a run's figures again, or chosen signals.

    Of a run that was killed, or still goes on, it writes results.csv as well.
    """
    from ..figures import check_figures, draw, written_as
    from ..run import ROWS_FILE, Results, recover_rows

    results = results.parent if results.is_file() else results
    loaded = Results.load(results)
    problems = [] if signals else check_figures(loaded.figures, [*loaded.names(), *loaded.parameters])
    if problems:
        raise ScenarioError(problems)
    recovered = [recover_rows(results)] if (results / ROWS_FILE).is_file() else []
    figures = [{"title": ", ".join(signals), "y": signals}] if signals else loaded.figures
    directory = output or results
    world.mkdir(directory, parents=True, exist_ok=True)
    drawn = draw(written_as(figures, figure_format and figure_format.value, dpi), loaded, directory)
    return written([*recovered, *drawn], quiet)


def convert(
    results: Annotated[
        Path, typer.Argument(help="The directory of a run, finished or not, or a result file of any tool.")
    ],
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...", help="What to write, by its ending: .csv, .parquet, .h5 (MTSF), .mat (Dymola)."
        ),
    ],
    quiet: Quiet = False,
) -> Answer:
    """Write results as files for other tools.

    Numbers keep every digit. MAT and HDF5 files have the parameters as well, and no place for signals of texts.
    """
    from ..run import Results

    _save(Results.load(results), files)
    return written(files, quiet)


def _pace(factor: float | None, late: LateName | None) -> dict[str, Any]:
    from ..run import RealTime

    if factor is None and late is not None:
        raise ScenarioError("--late is about a run in step with the clock: give --real-time as well")
    return {} if factor is None else {"real_time": RealTime(factor, late.value if late else "warn")}


def _save(results: Results, files: Sequence[Path]) -> None:
    for file in files:
        without = results.save(file)
        if without:
            tell(f"{file} has no place for the texts of {', '.join(without)}")
