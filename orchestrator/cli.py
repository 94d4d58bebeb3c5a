"""``orchestrate``: the command line. Each command is a thin layer over what Python can call as well."""

from __future__ import annotations

import importlib.metadata
import os
import shlex
import sys
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ..components import CATALOGUE
from ..components.component import ComponentError
from ..fmus.build import build as build_fmu
from ..fmus.description import summary
from . import console
from .archive import Workspace
from .check import check as check_system
from .errors import FmuError, RailcosimError, ScenarioError
from .loading import load_fmu
from .pack import pack as pack_system
from .plots import draw
from .published import PublishedRow
from .release import default_directory, release
from .reproduce import cases
from .results import Results
from .run import Run, execute
from .scenario import load, shipped
from .skeleton import write_skeleton
from .validate import TIMEOUT, show_report
from .validate import validate as validate_fmu

OK, FAILED, WRONG_INPUT, FMU_FAILED, INTERRUPTED = 0, 1, 2, 3, 130

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


class KindName(StrEnum):
    """`loading.KINDS`, as the command line needs them."""

    auto = "auto"
    native = "native"
    python = "python"
    plain = "plain"


class PackagingName(StrEnum):
    """The kinds of FMU that can be built, as the command line needs them."""

    auto = "auto"
    native = "native"
    python = "python"


class AlgorithmName(StrEnum):
    """`system.ALGORITHMS`, as the command line needs them."""

    gauss_seidel = "gauss-seidel"
    jacobi = "jacobi"


Scenario = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A shipped scenario (see 'orchestrate list'), or a .toml file.")
]
Preset = Annotated[str | None, typer.Option(help="Apply a preset of the scenario.")]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", help="Set a parameter or start value: train[4].speed=10."),
]
With = Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: train.carriages=8.")]
Swap = Annotated[
    list[str] | None,
    typer.Option("--swap", help="Put in another model: cruise=other.fmu, or OtherComponent, or my_file.py:Class."),
]
Stop = Annotated[float | None, typer.Option(help="Stop time in s.")]
Step = Annotated[float | None, typer.Option(help="Communication step in s; sample times equal to it follow.")]
Algorithm = Annotated[AlgorithmName | None, typer.Option(help="How the instances exchange values.")]
Kind = Annotated[
    KindName,
    typer.Option(
        help="native: compiled FMUs; python: Python FMUs; plain: Python objects, to debug; auto: native if possible."
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def main() -> None:
    """Entry point: every expected error becomes one message and an exit code."""
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
    except FmuError as error:
        return _fail([f"an FMU failed: {error}"], FMU_FAILED)
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
    scenario: Scenario,
    *,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    kind: Kind = KindName.auto,
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
    system = load(
        scenario,
        preset=preset,
        settings=settings or (),
        builds=builds or (),
        swaps=swaps or (),
        stop_time=stop,
        step=step,
        algorithm=algorithm.value if algorithm else None,
    )
    directory = output or Path("results") / "-".join(filter(None, (system.name, preset)))
    with console.progress(system.name, quiet, system.start_time) as progress:
        outcome = execute(system, kind=kind.value, output=directory, figures=not no_figures, progress=progress)
    second = _at_half_the_step(outcome, kind, quiet) if verify_step else None
    console.show_run(outcome, second, quiet)
    error = outcome.error or (second and second.error)
    if error:
        raise error
    raise typer.Exit(_exit_code(outcome, second))


def _at_half_the_step(outcome: Run, kind: KindName, quiet: bool) -> Run | None:
    """The same run at half the step, in memory; None where there is nothing to compare it with."""
    if outcome.status != "completed":
        return None
    system = outcome.system
    rescaled = system.rescaled_from if system.rescaled_from is not None else system.step
    half = replace(system, step=system.step / 2.0, record=system.record or system.step, rescaled_from=rescaled)
    with console.progress(f"{system.name} at half the step", quiet, system.start_time) as progress:
        return execute(half, kind=kind.value, progress=progress)


def _exit_code(outcome: Run, second: Run | None) -> int:
    if "interrupted" in (outcome.status, second and second.status):
        return INTERRUPTED
    return FAILED if outcome.failed else OK


@app.command("list")
def list_all() -> None:
    """List the shipped scenarios and components."""
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


@app.command()
def describe(
    model: Annotated[str, typer.Argument(help="A component's name, my_file.py:Class, or the path of any FMU.")],
    builds: Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: carriages=8.")] = None,
) -> None:
    """Show the interface of a component or of any FMU.

    Variables by causality, with units, start values and direct dependencies; build arguments; where it comes from.
    """
    arguments = _arguments(builds)
    if model.endswith(".fmu") and arguments:
        raise ScenarioError(f"{model} is built already; it takes no --with {', '.join(arguments)}")
    path = Path(model) if model.endswith(".fmu") else build_fmu(model, arguments)
    with Workspace() as workspace:
        interface = load_fmu(path, workspace).interface
    out = console.console()
    vendor = interface.vendor
    console.say(out, interface.model, "bold")
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
            console.say(out, f"{label}: {fact}" if label else fact)
    for warning in interface.warnings:
        console.say(out, f"warning: {warning}", "yellow")
    console.show_interface(out, interface)


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
def check(
    scenario: Scenario, preset: Preset = None, settings: Set = None, builds: With = None, swaps: Swap = None
) -> None:
    """Find what is wrong before a run, and show how the run would step."""
    system = load(scenario, preset=preset, settings=settings or (), builds=builds or (), swaps=swaps or ())
    out = console.console()
    with Workspace() as workspace:
        checked = check_system(system, workspace)
    console.say(out, system.title or system.name, "bold")
    connections = len(checked.wiring.links)
    facts = f"{len(system.instances)} instances, {connections} scalar connections, step {system.step:g} s"
    console.say(out, facts, "dim")
    if system.algorithm == "gauss-seidel":
        console.say(out, f"gauss-seidel steps in the order: {', '.join(checked.order.sequence)}")
    else:
        console.say(out, "jacobi: all instances step in parallel; a feed-through output acts one step late")
    for connection in system.connections:
        if connection.delay:
            points = f"{connection.delay} communication point{'s' * (connection.delay > 1)}"
            console.say(out, f"delay: {connection.target} receives {connection.source} {points} later")
    for note in console.folded(checked.notes):
        console.say(out, f"note: {note}", "yellow")
    console.say(out, "no errors", "green")


@app.command()
def build(
    names: Annotated[list[str] | None, typer.Argument(help="Component names or my_file.py:Class.")] = None,
    *,
    every: Annotated[bool, typer.Option("--all", help="Build the whole catalogue, with SHA256SUMS.")] = False,
    builds: Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: carriages=8.")] = None,
    kind: Annotated[
        PackagingName, typer.Option(help="native: compiled C; python: Python FMUs; auto: native if possible.")
    ] = PackagingName.auto,
    platforms: Annotated[
        str | None,
        typer.Option(
            help="Of native FMUs: all, or some of linux64,win64,darwin64,aarch64-linux; this machine's by default."
        ),
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Directory for the FMUs.")] = None,
    quiet: Quiet = False,
) -> None:
    """Build FMUs to keep, for other tools or for --swap; prints the files it wrote."""
    wanted = [*(names or []), *(CATALOGUE if every else [])]
    if not wanted:
        raise ScenarioError(f"name the components to build, or --all; there is {', '.join(CATALOGUE)}")
    written = release(
        tuple(dict.fromkeys(wanted)),
        _arguments(builds),
        output or default_directory(),
        kind=kind.value,
        platforms=[name.strip() for name in (platforms or "").split(",") if name.strip()],
        checksums=every,
        tell=(lambda line: None) if quiet else (lambda line: print(line, file=sys.stderr, flush=True)),
    )
    for path in written:
        print(path)


@app.command()
def pack(
    scenario: Scenario,
    output: Annotated[Path, typer.Option("--output", "-o", help="The FMU to write, such as platoon.fmu.")],
    *,
    expose: Annotated[
        list[str] | None,
        typer.Option(help="What to show: train[:].speed,gust.size; all outputs of the trains by default."),
    ] = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    platforms: Annotated[
        str | None, typer.Option(help="all, or some of linux64,win64,darwin64; this machine's by default.")
    ] = None,
) -> None:
    """Write one FMU that holds a whole scenario, for another tool to run as a block."""
    system = load(
        scenario,
        preset=preset,
        settings=settings or (),
        builds=builds or (),
        swaps=swaps or (),
        stop_time=stop,
        step=step,
        algorithm=algorithm.value if algorithm else None,
    )
    packed = pack_system(system, output, expose=expose or (), platforms=(platforms or "").split(","))
    out = console.console()
    for note in console.folded(packed.notes):
        console.say(out, f"note: {note}", "yellow")
    shown = f"{len(packed.exposed)} variables, for {', '.join(packed.platforms)}"
    console.say(out, f"{packed.path}: {len(system.instances)} FMUs as one, {shown}", whole=True)


@app.command()
def validate(
    fmu: Annotated[Path, typer.Argument(help="Any FMI 2.0 co-simulation FMU, ours or not.")],
    timeout: Annotated[float, typer.Option(min=0.1, help="Longest time for one probe, in s.")] = TIMEOUT,
) -> None:
    """Check any FMU: archive, description, and probes that cannot take this program down.

    Exit codes: 0 nothing failed; 1 something did; 2 the file is no FMU that could be used.
    """
    report = validate_fmu(fmu, timeout=timeout)
    show_report(console.console(), report)
    raise typer.Exit(OK if report.passed else FAILED)


@app.command()
def plot(
    results: Annotated[Path, typer.Argument(help="The directory of a run.")],
    signals: Annotated[
        list[str] | None,
        typer.Argument(help="Expressions such as 'train[:].speed'; without, the run's figures."),
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Where to draw; RESULTS by default.")] = None,
) -> None:
    """Draw a run's figures again, or chosen signals."""
    results = results.parent if results.is_file() else results
    loaded = Results.load(results)
    figures = [{"title": ", ".join(signals), "y": signals}] if signals else loaded.figures
    directory = output or results
    directory.mkdir(parents=True, exist_ok=True)
    for path in draw(figures, loaded, directory):
        print(path)


@app.command()
def new(path: Annotated[Path, typer.Argument(help="The file to write, such as my_controller.py.")]) -> None:
    """Write a commented controller to start from; it runs."""
    name = write_skeleton(path)
    print(f"{path} written. Try it:\n  orchestrate run comfort_cruise --swap cruise={shlex.quote(f'{path}:{name}')}")


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
    for case in cases(paper):
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


if __name__ == "__main__":
    main()
