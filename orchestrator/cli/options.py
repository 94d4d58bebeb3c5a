"""What the commands of ``orchestrate`` share: exit codes, and the options that several of them take."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import ScenarioError
from . import completing

if TYPE_CHECKING:
    from ..run import Run, StepCheck
    from ..system import System

OK, FAILED, WRONG_INPUT, FMU_FAILED = 0, 1, 2, 3


def interrupted(number: int) -> int:
    """The exit code of a command that was ended by a signal, by the convention of shells: 130 for Ctrl-C."""
    return 128 + number


class KindName(StrEnum):
    """`kinds.KINDS`, as the command line needs them."""

    auto = "auto"
    native = "native"
    python = "python"
    plain = "plain"


class PackagingName(StrEnum):
    """The kinds of FMU that can be built, as the command line needs them."""

    auto = "auto"
    native = "native"
    python = "python"


class ProfileName(StrEnum):
    """What the C of native FMUs may do, as the command line needs it."""

    standard = "standard"
    real_time = "real-time"


class FmiName(StrEnum):
    """The version of FMI that FMUs are written in, as the command line needs it."""

    two = "2"
    three = "3"


Scenario = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="A shipped scenario (see 'orchestrate list'), or a .toml, .ssp or .ssd file (a.ssp#Name is a variant).",
        autocompletion=completing.scenarios,
    ),
]
Variant = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Of an .ssp that holds several system structures: which one, by its file or name.",
        autocompletion=completing.variants,
    ),
]
Preset = Annotated[str | None, typer.Option(help="Apply a preset of the scenario.", autocompletion=completing.presets)]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", help="Set a parameter or start value: train[4].speed=10.", autocompletion=completing.assignments
    ),
]
With = Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: train.carriages=8.")]
Swap = Annotated[
    list[str] | None,
    typer.Option(
        "--swap",
        help="Put in another model: cruise=other.fmu, or OtherComponent, or my_file.py:Class.",
        autocompletion=completing.swaps,
    ),
]
Stop = Annotated[float | None, typer.Option(help="Stop time in s.")]
Step = Annotated[float | None, typer.Option(help="Communication step in s; sample times equal to it follow.")]
Algorithm = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="How the instances exchange values (see 'orchestrate list').",
        autocompletion=completing.algorithms,
    ),
]
Kind = Annotated[
    KindName,
    typer.Option(
        help="native: compiled FMUs; python: Python FMUs; plain: Python objects, to debug; auto: native if possible."
    ),
]
Isolate = Annotated[
    list[str] | None,
    typer.Option(
        "--isolate",
        metavar="NAME",
        autocompletion=completing.instances,
        help="Run an instance, a group such as 'train', or 'all' in processes of their own: a crash there ends no more "
        "than the run. By 'together' instances of one FMU share a process; by 'auto' so do those of FMUs that this "
        "machine does not know.",
    ),
]


class LateName(StrEnum):
    """`run.pacing.LATE`, as the command line needs them."""

    warn = "warn"
    catch_up = "catch-up"
    fail = "fail"


_REAL_TIME = "--real-time"
RealTimeFactor = Annotated[
    float | None,
    typer.Option(
        _REAL_TIME,
        metavar="[FACTOR]",
        help="Keep pace with the clock, or run FACTOR times as fast; how well that went is told and recorded.",
    ),
]
WhenLate = Annotated[
    LateName | None,
    typer.Option(
        "--late",
        help="With --real-time, a step that is done too late: warn at once (the default), catch-up and tell at the "
        "end, or fail.",
    ),
]


def with_factor(words: Sequence[str]) -> list[str]:
    """A command line on which the factor of real time stands: an option of typer's has a value, or never one."""
    found = list(words)
    if _REAL_TIME in found:
        place = found.index(_REAL_TIME) + 1
        try:
            float(found[place])
        except (IndexError, ValueError):
            found.insert(place, "1")
    return found


Workers = Annotated[
    int | None,
    typer.Option(min=0, help="Processes that run; as many as processors by default, 0 for this one alone."),
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler to use instead: tcp://host:8786.")
]


class FormatName(StrEnum):
    """`figures.FORMATS`, as the command line needs them."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


FigureFormat = Annotated[
    FormatName | None, typer.Option(help="How figures are written; as the scenario says, or png, by default.")
]
Dpi = Annotated[
    float | None,
    typer.Option(min=20, max=1200, help="Dots per inch of figures; as the scenario says, or 100, by default."),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Import Python code wherever a file names it; else only what is in the scenario's folder or named here.",
    ),
]
Report = Annotated[
    bool,
    typer.Option("--report", help="Make report.html as well, a page to zoom and play in (extra 'report')."),
]
PROBE_SECONDS = 60.0
"""`validation.TIMEOUT`, as the command line needs it."""
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only errors, what was found, and what failed.")]


def build_arguments(builds: list[str] | None) -> dict[str, Any]:
    """``carriages=8`` as on every command line: the value is TOML, or text."""
    from ..scenario import parse_value

    arguments: dict[str, Any] = {}
    for text in builds or []:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise ScenarioError(f"--with {text}: write NAME=VALUE, as in --with carriages=8")
        arguments[name.strip()] = parse_value(value)
    return arguments


def check_workers(workers: int | None, scheduler: str | None) -> None:
    """Refuse a number of workers for a scheduler, which has its own."""
    if scheduler is not None and workers is not None:
        raise typer.BadParameter("the scheduler has the workers that it has.", param_hint="'--workers'")


def is_scenario(name: str) -> bool:
    """Whether a name on the command line is that of a scenario, and of nothing else."""
    from ..scenario import shipped
    from ..ssp import is_ssp_name

    return name.endswith(".toml") or is_ssp_name(name) or name in dict(shipped())


def variant_of(scenario: str, variant: str) -> str:
    """The name of one of the system structures of an SSP."""
    from ..ssp import is_ssp_name

    if not is_ssp_name(scenario):
        raise ScenarioError(f"--variant {variant}: {scenario} is no .ssp, and has no variants")
    if "#" in scenario:
        raise ScenarioError(f"--variant {variant}: {scenario} names a variant already; give one of the two")
    return f"{scenario}#{variant}"


def load_system(
    scenario: str,
    preset: str | None,
    settings: list[str] | None,
    builds: list[str] | None,
    swaps: list[str] | None,
    *,
    variant: str | None = None,
    stop: float | None = None,
    step: float | None = None,
    algorithm: str | None = None,
) -> System:
    """The scenario as the options of a command change it."""
    from ..scenario import load

    return load(
        scenario if variant is None else variant_of(scenario, variant),
        preset=preset,
        settings=settings or (),
        builds=builds or (),
        swaps=swaps or (),
        stop_time=stop,
        step=step,
        algorithm=algorithm,
    )


def draw_as(system: System, format: FormatName | None, dpi: float | None) -> None:
    """Let the figures of a system be written as the options say."""
    from ..figures import written_as

    system.judged.figures = written_as(system.judged.figures, format and format.value, dpi)


def exit_code(outcome: Run, second: Run | None = None, verdict: StepCheck | None = None) -> int:
    """The exit code of a run; of one that was repeated at half the step, with what that has shown."""
    for ended in (outcome, second):
        if ended is not None and ended.status == "interrupted":
            return interrupted(ended.signal)
    coarse = verdict is not None and verdict.verdict == "too coarse"
    return FAILED if outcome.failed or coarse else OK
