"""``orchestrate``: the command line. Each command is a thin layer over what Python can call as well."""

from __future__ import annotations

import importlib.metadata
import io
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from ...components import CATALOGUE
from ...components.component import ComponentError
from ...fmus.description import summary
from ..comparison import published_cases
from ..errors import FmuError, RailcosimError, RunError, ScenarioError
from ..evaluation import PublishedRow
from ..figures import check_figures, draw
from ..fmi import Workspace
from ..isolation import isolate
from ..master import ALGORITHMS
from ..run import (
    ROWS_FILE,
    Results,
    Run,
    at_half_the_step,
    describe_stepping,
    execute,
    go_on,
    read_checkpoint,
    recover_rows,
)
from ..run import check as check_system
from ..scenario import load, shipped
from ..wiring import describe_topology
from . import analysis, console, models
from .options import (
    FAILED,
    FMU_FAILED,
    INTERRUPTED,
    OK,
    WRONG_INPUT,
    Algorithm,
    Isolate,
    Kind,
    KindName,
    Preset,
    Quiet,
    Scenario,
    Set,
    Step,
    Stop,
    Swap,
    With,
    load_system,
)

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Entry point: every expected error becomes one message and an exit code."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # a terminal or pipe may lack letters that a title or a file name has
        sys.stdout.reconfigure(errors="backslashreplace")
    code = call()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # whoever read it may be gone
            stream.flush()
    # pythonfmu 0.7 frees its interpreter state twice when C++ is torn down, and some exits crash: leave before that.
    os._exit(code)


def call(arguments: Sequence[str] | None = None) -> int:
    """Run a command, with the arguments of the process by default, and return its exit code."""
    try:
        app(arguments)
    except RunError as error:
        what = "an FMU" if isinstance(error, FmuError) else "the run"
        return _fail([f"{what} failed: {error}"], FMU_FAILED)
    except ScenarioError as error:
        return _fail(console.folded(error.problems), WRONG_INPUT)
    except (RailcosimError, ComponentError) as error:
        return _fail([str(error)], WRONG_INPUT)
    except OSError as error:
        return _fail([f"{error.filename or 'a file'}: {error.strerror or error}"], WRONG_INPUT)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else OK
    return OK


def _fail(messages: Sequence[str], code: int) -> int:
    for message in messages:
        print(f"error: {message}", file=sys.stderr)
    return code


def _version(wanted: bool) -> None:
    if wanted:
        print(f"railcosim {importlib.metadata.version('railcosim')}")
        raise typer.Exit()


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Co-simulate trains, cruise controllers and ATO controllers as FMUs."""


@app.command()
def run(
    scenario: Annotated[
        str | None,
        typer.Argument(metavar="SCENARIO", help="A shipped scenario (see 'orchestrate list'), or a .toml file."),
    ] = None,
    *,
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
            help="Threads that step in parallel: jacobi, FMI 2.0 FMUs; for many or heavy ones on idle cores.",
        ),
    ] = 1,
    checkpoint_every: Annotated[
        float | None,
        typer.Option(metavar="T", help="Write a checkpoint about every T s of the run, to go on from by --resume."),
    ] = None,
    resume_from: Annotated[
        Path | None,
        typer.Option("--resume", metavar="DIR", help="Go on with the run in DIR from its last checkpoint."),
    ] = None,
    verify_step: Annotated[
        bool, typer.Option("--verify-step", help="Run again at half the step and print each metric's difference.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory for the results; results/<scenario> by default.")
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    quiet: Quiet = False,
) -> None:
    """Run a scenario: results, metrics, verdicts, figures.

    Exit codes: 0 fine; 1 a requirement failed or a published value was missed; 2 the input is wrong; 3 an FMU failed,
    or what the FMUs exchange does not settle (what was computed is on disk);
    130 interrupted by Ctrl-C (what was computed is on disk).
    """
    how: Any = {"figures": not no_figures, "threads": threads, "checkpoint_every": checkpoint_every}
    if resume_from is not None:
        given = (scenario, preset, settings or None, builds or None, swaps or None, step, algorithm, isolated or None)
        if any(x is not None for x in (*given, output)) or kind is not KindName.auto or verify_step:
            raise ScenarioError(
                "--resume takes the run as its directory has it: give no scenario and no change but --stop; --threads, "
                "--checkpoint-every, --no-figures and --quiet may stand with it"
            )
        point = read_checkpoint(resume_from)
        with console.progress(point.system.name, quiet, point.system.start_time, point.time) as progress:
            outcome = go_on(resume_from, stop_time=stop, progress=progress, **how)
    else:
        if scenario is None:
            raise ScenarioError("name a scenario (see 'orchestrate list'), or a run to go on with by --resume DIR")
        system = load_system(scenario, preset, settings, builds, swaps, stop=stop, step=step, algorithm=algorithm)
        system = isolate(system, isolated or ())
        directory = output or Path("results") / "-".join(filter(None, (system.name, preset)))
        with console.progress(system.name, quiet, system.start_time) as progress:
            outcome = execute(system, kind=kind.value, output=directory, progress=progress, **how)
    second = _at_half_the_step(outcome, kind, quiet) if verify_step else None
    console.show_run(outcome, second, quiet)
    for ended in (outcome, second):
        if ended is not None and ended.status == "failed" and ended.error is not None:
            raise ended.error
    raise typer.Exit(_exit_code(outcome, second))


def _at_half_the_step(outcome: Run, kind: KindName, quiet: bool) -> Run | None:
    """The same run at half the step, in memory; None where there is nothing to compare it with."""
    if outcome.status != "completed":
        return None
    system = outcome.system
    with console.progress(f"{system.name} at half the step", quiet, system.start_time) as progress:
        return execute(at_half_the_step(system), kind=kind.value, progress=progress)


def _exit_code(outcome: Run, second: Run | None) -> int:
    if "interrupted" in (outcome.status, second and second.status):
        return INTERRUPTED
    return FAILED if outcome.failed else OK


@app.command("list")
def list_all() -> None:
    """List the shipped scenarios, components and master algorithms."""
    out = console.console()
    console.say(out, "Scenarios (orchestrate run NAME)", "bold")
    for name, title in shipped():
        console.say(out, f"  {name}: {title}")
        presets = load(name).presets
        if presets:
            console.say(out, f"      presets: {', '.join(presets)}", "dim")
    console.say(out, "Components (orchestrate describe NAME)", "bold")
    for name, component in CATALOGUE.items():
        console.say(out, f"  {name}: {summary(component)}")
    console.say(out, "Master algorithms (orchestrate run SCENARIO --algorithm NAME)", "bold")
    for name, algorithm in ALGORITHMS.items():
        console.say(out, f"  {name}: {algorithm.summary()}")


@app.command()
def check(
    scenario: Scenario,
    *,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    algorithm: Algorithm = None,
) -> None:
    """Find what is wrong before a run, and show how the run would step."""
    system = load_system(scenario, preset, settings, builds, swaps, algorithm=algorithm)
    out = console.console()
    with Workspace() as workspace:
        checked = check_system(system, workspace)
    console.say(out, system.title or system.name, "bold")
    connections = len(checked.wiring.links)
    facts = f"{len(system.instances)} instances, {connections} scalar connections, step {system.step:g} s"
    console.say(out, facts, "dim")
    for line in describe_stepping(checked):
        console.say(out, line)
    for connection in system.connections:
        if connection.delay:
            points = f"{connection.delay} communication point{'s' * (connection.delay > 1)}"
            console.say(out, f"delay: {connection.target} receives {connection.source} {points} later")
    for line in describe_topology({name: model.interface for name, model in checked.models.items()}, checked.wiring):
        console.say(out, line)
    for note in console.folded(checked.notes):
        console.say(out, f"note: {note}", "yellow")
    console.say(out, "no errors", "green")


@app.command()
def plot(
    results: Annotated[Path, typer.Argument(help="The directory of a run.")],
    signals: Annotated[
        list[str] | None,
        typer.Argument(help="Expressions such as 'train[:].speed'; without, the run's figures."),
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Where to draw; RESULTS by default.")] = None,
) -> None:
    """Draw a run's figures again, or chosen signals.

    Of a run that was killed, or still goes on, it writes results.csv as well.
    """
    results = results.parent if results.is_file() else results
    loaded = Results.load(results)
    problems = [] if signals else check_figures(loaded.figures, [*loaded.names(), *loaded.parameters])
    if problems:
        raise ScenarioError(problems)
    if (results / ROWS_FILE).is_file():
        print(recover_rows(results))
    figures = [{"title": ", ".join(signals), "y": signals}] if signals else loaded.figures
    directory = output or results
    directory.mkdir(parents=True, exist_ok=True)
    for path in draw(figures, loaded, directory):
        print(path)


@app.command()
def reproduce(
    paper: Annotated[
        str | None, typer.Argument(help="A scenario's name or a word of its source, such as Wang; all by default.")
    ] = None,
    kind: Kind = KindName.auto,
    quiet: Quiet = False,
) -> None:
    """Run every published case and print one table.

    Claim, published and measured value, tolerance and verdict, under the command that shows them. Exit code 1 if a
    published value was missed.
    """
    groups: dict[str, list[PublishedRow]] = {}
    for case in published_cases(paper):
        title = case.command.removeprefix("orchestrate run ")
        with console.progress(title, quiet, case.system.start_time) as progress:
            outcome = execute(case.system, kind=kind.value, progress=progress)
        if outcome.error is not None:
            raise outcome.error
        if outcome.status == "interrupted":
            raise KeyboardInterrupt
        groups[case.command] = outcome.published
    out = console.console()
    console.show_published(out, groups)
    missed = False
    for line, bad in console.summary([], [row for rows in groups.values() for row in rows]):
        missed |= bad
        console.say(out, line, "bold red" if bad else "green")
    raise typer.Exit(FAILED if missed else OK)


for command in (
    models.describe,
    models.build,
    models.pack,
    models.validate,
    models.new,
    analysis.compare,
    analysis.linearize,
):
    app.command()(command)


if __name__ == "__main__":
    main()
