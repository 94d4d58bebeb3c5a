"""``orchestrate``: the command line. Each command is a thin layer over what Python can call as well."""

from __future__ import annotations

import shutil
import sys
import tomllib
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from ..components import CATALOGUE
from ..components.component import ComponentError
from ..fmus.build import build as build_fmu
from ..fmus.description import summary
from . import console
from .archive import Workspace
from .check import check as check_system
from .errors import FmuError, RailcosimError, ScenarioError
from .loading import KINDS, load_models
from .metrics import Comparison, compare
from .plots import draw
from .reproduce import cases
from .results import Results
from .run import Run, execute
from .scenario import load, shipped
from .skeleton import write_skeleton
from .system import ALGORITHMS, System

OK, FAILED, WRONG_INPUT, FMU_FAILED, INTERRUPTED = 0, 1, 2, 3, 130

app = typer.Typer(
    help="Co-simulate trains, cruise controllers and ATO controllers as FMUs.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

KindName = StrEnum("KindName", {kind: kind for kind in KINDS})
AlgorithmName = StrEnum("AlgorithmName", {name: name for name in ALGORITHMS})

Scenario = Annotated[str, typer.Argument(help="A shipped scenario's name (see 'orchestrate list'), or a .toml file.")]
Preset = Annotated[str | None, typer.Option(help="Apply a preset of the scenario.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Set a parameter or start value: train[4].speed=10, cruise.alpha=0.01.")
]
With = Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: train.carriages=8.")]
Swap = Annotated[
    list[str] | None,
    typer.Option("--swap", help="Put another model in place: cruise=other.fmu | OtherComponent | my_controller.py:Class."),
]
Stop = Annotated[float | None, typer.Option(help="Stop time in s.")]
Step = Annotated[float | None, typer.Option(help="Communication step in s; sample times equal to it follow.")]
Algorithm = Annotated[AlgorithmName | None, typer.Option(help="How the instances exchange values.")]
Kind = Annotated[
    KindName,
    typer.Option(help="python: components as FMUs; plain: as Python objects in this process, for a debugger."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def main() -> None:
    """Entry point: every expected error becomes one message and an exit code."""
    try:
        app()
    except FmuError as error:
        _fail(f"an FMU failed: {error}", FMU_FAILED)
    except ScenarioError as error:
        _fail("\n".join(f"error: {problem}" for problem in error.problems), WRONG_INPUT, prefix="")
    except (RailcosimError, ComponentError) as error:
        _fail(str(error), WRONG_INPUT)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(OK)


def _fail(message: str, code: int, prefix: str = "error: ") -> None:
    print(f"{prefix}{message}", file=sys.stderr)
    sys.exit(code)


@app.command()
def run(
    scenario: Scenario,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    kind: Kind = KindName("python"),
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

    Exit codes: 0 fine; 1 a requirement failed or a published value was missed; 2 the input is wrong; 3 an FMU failed;
    130 interrupted by Ctrl-C (what was computed is on disk).
    """
    system = _load(scenario, preset, settings, builds, swaps, stop, step, algorithm)
    directory = output or Path("results") / "-".join(filter(None, (system.name, preset)))
    with console.progress(system.name, quiet) as progress:
        outcome = execute(system, kind=kind.value, output=directory, figures=not no_figures, progress=progress)
    comparisons = _verify_step(system, outcome, kind.value, quiet) if verify_step else []
    if not quiet:
        _report(outcome, comparisons)
    if outcome.error is not None:
        raise outcome.error
    raise typer.Exit(_exit_code(outcome))


def _load(
    scenario: str,
    preset: str | None,
    settings: list[str] | None,
    builds: list[str] | None,
    swaps: list[str] | None,
    stop: float | None = None,
    step: float | None = None,
    algorithm: Any = None,
) -> System:
    return load(
        scenario,
        preset=preset,
        settings=settings or (),
        builds=builds or (),
        swaps=swaps or (),
        stop_time=stop,
        step=step,
        algorithm=None if algorithm is None else str(algorithm.value),
    )


def _verify_step(system: System, outcome: Run, kind: Any, quiet: bool) -> list[Comparison]:
    if outcome.status != "completed":
        return []
    rescaled = system.rescaled_from if system.rescaled_from is not None else system.step
    half = replace(system, step=system.step / 2.0, record=system.record or system.step, rescaled_from=rescaled)
    with console.progress(f"{system.name} at half the step", quiet) as progress:
        second = execute(half, kind=kind, progress=progress)
    if second.error is not None:
        raise second.error
    return compare(outcome.metrics, second.metrics)


def _report(outcome: Run, comparisons: list[Comparison]) -> None:
    out = console.console()
    system = outcome.system
    out.print(Text(system.title or system.name, style="bold"))
    how = system.preset or "as it stands"
    seconds, count = outcome.seconds, len(system.instances)
    pace = f"{seconds['steps']:g} steps in {seconds['stepping']:.2f} s, set-up {seconds['setup']:.2f} s" if seconds else ""
    changed = ", modified" if system.modified else ""
    out.print(f"{how}{changed}; {count} instances, {system.algorithm}, step {system.step:g} s; {pace}", style="dim")
    for note in outcome.checked.notes:
        out.print(Text(f"note: {note}", style="yellow"))
    console.show_run(out, outcome, comparisons)
    if outcome.status != "completed":
        reached = float(outcome.time[-1]) if len(outcome.time) else system.start_time
        out.print(Text(f"{outcome.status} at t = {reached:g} s of {system.stop_time:g} s", style="red"))
    if outcome.directory is not None:
        figures = f", {len(outcome.figures)} figures" if outcome.figures else ""
        out.print(Text(f"Files in {outcome.directory}: results.csv, units.json, metrics.json, run.json{figures}"))


def _exit_code(outcome: Run) -> int:
    if outcome.status == "interrupted":
        return INTERRUPTED
    return FAILED if outcome.failed else OK


@app.command("list")
def list_all() -> None:
    """List the shipped scenarios and components."""
    out = console.console()
    out.print("Scenarios (orchestrate run NAME)", style="bold")
    for name, title in shipped():
        presets = ", ".join(load(name).presets)
        out.print(Text(f"  {name}: {title}" + (f"  [presets: {presets}]" if presets else "")))
    out.print("Components (orchestrate describe NAME)", style="bold")
    for name, component in CATALOGUE.items():
        out.print(Text(f"  {name}: {summary(component)}"))


@app.command()
def describe(
    model: Annotated[str, typer.Argument(help="A component's name, my_file.py:Class, or the path of any FMU.")],
    builds: Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: carriages=8.")] = None,
) -> None:
    """Show a model's interface: variables, units, causality, dependencies, arguments."""
    system = System()
    system.add("model", model, build=_arguments(builds))
    out = console.console()
    with Workspace() as workspace:
        loaded = load_models(system, workspace)["model"]
    interface = loaded.interface
    vendor = interface.vendor
    out.print(Text(interface.model, style="bold"))
    facts = {
        "": interface.description,
        "note": vendor.get("note", ""),
        "source": vendor.get("source", ""),
        "build arguments": ", ".join(f"{k} = {v!r}" for k, v in vendor.get("arguments", {}).items()),
        "digest": vendor.get("digest", ""),
        "kind": f"{vendor['kind']}: {vendor['kind_note']}" if vendor else "",
        "made with": interface.generator,
        "guid": interface.guid,
        "default step": "" if interface.default_step is None else f"{interface.default_step:g} s",
        "saves its state": "yes" if interface.can_save_state else "no",
    }
    for label, fact in facts.items():
        if fact:
            out.print(Text(f"{label}: {fact}" if label else fact))
    for warning in interface.warnings:
        out.print(Text(f"warning: {warning}", style="yellow"))
    out.print(console.interface_table(interface))


def _arguments(builds: list[str] | None) -> dict[str, Any]:
    """``carriages=8`` as on every command line: the value is TOML, or text."""
    arguments: dict[str, Any] = {}
    for text in builds or []:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise ScenarioError(f"--with {text}: write NAME=VALUE, as in --with carriages=8")
        try:
            arguments[name.strip()] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            arguments[name.strip()] = value
    return arguments


@app.command()
def check(scenario: Scenario, preset: Preset = None, settings: Set = None, builds: With = None, swaps: Swap = None) -> None:
    """Find everything that can be known to be wrong before a run, and show how the run would step."""
    system = _load(scenario, preset, settings, builds, swaps)
    out = console.console()
    with Workspace() as workspace:
        checked = check_system(system, workspace)
    out.print(Text(system.title or system.name, style="bold"))
    connections = len(checked.wiring.links)
    out.print(f"{len(system.instances)} instances, {connections} scalar connections, step {system.step:g} s", style="dim")
    if system.algorithm == "gauss-seidel":
        out.print(Text(f"gauss-seidel steps in the order: {', '.join(checked.order.sequence)}"))
    else:
        out.print("jacobi: all instances step in parallel; a feed-through output acts one step late")
    for connection in system.connections:
        if connection.delay:
            out.print(Text(f"delay: {connection.target} receives {connection.source} {connection.delay} point(s) later"))
    for note in checked.notes:
        out.print(Text(f"note: {note}", style="yellow"))
    out.print("no errors", style="green")


@app.command()
def build(
    names: Annotated[list[str] | None, typer.Argument(help="Component names or my_file.py:Class.")] = None,
    every: Annotated[bool, typer.Option("--all", help="Build the whole catalogue.")] = False,
    builds: Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: carriages=8.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Directory for the FMUs.")] = None,
) -> None:
    """Build FMUs to keep, for other tools or for --swap."""
    wanted = [*(names or []), *(CATALOGUE if every else [])]
    if not wanted:
        raise ScenarioError(f"name the components to build, or --all; there is {', '.join(CATALOGUE)}")
    directory = output or _dist()
    directory.mkdir(parents=True, exist_ok=True)
    arguments = _arguments(builds)
    for name in dict.fromkeys(wanted):
        source = build_fmu(name, arguments)
        target = directory / source.name
        shutil.copyfile(source, target)
        print(target)


def _dist() -> Path:
    """``fmus/dist`` in a checkout, the current folder elsewhere."""
    checkout = Path("fmus/build.py").is_file() and Path("pyproject.toml").is_file()
    return Path("fmus/dist") if checkout else Path()


@app.command()
def plot(
    results: Annotated[Path, typer.Argument(help="A results directory.")],
    signals: Annotated[
        list[str] | None, typer.Argument(help="Expressions to draw, such as 'train[:].speed'; the run's own figures if none.")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Where to draw; the results directory by default.")] = None,
) -> None:
    """Draw the figures of a finished or cut-short run again, or chosen signals of it."""
    loaded = Results.load(results)
    figures = [{"title": ", ".join(signals), "y": signals}] if signals else loaded.figures
    directory = output or results
    directory.mkdir(parents=True, exist_ok=True)
    for path in draw(figures, loaded, directory):
        print(path)


@app.command()
def new(path: Annotated[Path, typer.Argument(help="The file to write, such as my_controller.py.")]) -> None:
    """Write a commented controller that runs, to start from."""
    name = write_skeleton(path)
    print(f"{path} written. Try it:\n  orchestrate run comfort_cruise --swap cruise={path}:{name}")


@app.command()
def reproduce(
    paper: Annotated[
        str | None, typer.Argument(help="A scenario's name or a word of its source, such as Wang; all by default.")
    ] = None,
    kind: Kind = KindName("python"),
    quiet: Quiet = False,
) -> None:
    """Run every published case and print one table: claim, published, measured, tolerance, verdict, command."""
    rows, commands = [], []
    for case in cases(paper):
        with console.progress(case.command.removeprefix("orchestrate run "), quiet) as progress:
            outcome = execute(case.system, kind=kind.value, progress=progress)
        if outcome.error is not None:
            raise outcome.error
        if outcome.status == "interrupted":
            raise KeyboardInterrupt
        rows += outcome.published
        commands += [case.command] * len(outcome.published)
    console.console().print(console.published_table(rows, commands))
    missed = sum(row.verdict == "missed" for row in rows)
    judged = sum(row.verdict == "reproduced" for row in rows)
    print(f"{judged} reproduced, {missed} missed, {len(rows) - judged - missed} not judged")
    raise typer.Exit(FAILED if missed else OK)


if __name__ == "__main__":
    main()
