"""The commands of ``orchestrate`` that are about scenarios and do not run them: list, check, import, export."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .. import world
from . import completing
from .documents import Answer
from .options import (
    Algorithm,
    Preset,
    Quiet,
    Scenario,
    Set,
    Step,
    Stop,
    Swap,
    Trust,
    Variant,
    With,
    load_system,
    variant_of,
)

if TYPE_CHECKING:
    from ..run import Checked
    from ..system import System


def list_all() -> Answer:
    """List the shipped scenarios, cases of driving, components and master algorithms."""
    from ...components import CATALOGUE
    from ...fmus.references import summary
    from ..driving import listed_cases
    from ..master import ALGORITHMS
    from ..scenario import listed
    from .documents import list_document
    from .printing import show_list

    scenarios = listed()
    components = {name: summary(component) for name, component in CATALOGUE.items()}
    algorithms = {name: algorithm.summary() for name, algorithm in ALGORITHMS.items()}
    found = (scenarios, listed_cases(), components, algorithms)
    return Answer(lambda: list_document(*found), lambda: show_list(*found))


def check(
    scenario: Scenario,
    *,
    variant: Variant = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    trust: Trust = False,
    quiet: Quiet = False,
) -> Answer:
    """Find what is wrong before a run, and show how the run would step.

    Of an FMU nothing is executed. The file of a Python component is, because it is imported.
    """
    from ..fmi import Workspace
    from ..run import check as check_system
    from ..run import describe_stepping
    from .documents import check_document
    from .printing import show_check, show_compilations

    system = load_system(
        scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step, algorithm=algorithm
    )
    study = _study(system)
    with Workspace() as workspace, show_compilations(quiet, doing="reading what it is made of"):
        checked = check_system(system, workspace, trusted=trust)
    stepping = [*describe_stepping(checked), *_delays(system), *_topology(checked)]
    return Answer(
        lambda: check_document(system, checked, stepping, study),
        lambda: show_check(system, checked, [*stepping, *study], quiet),
    )


def import_ssp(
    archive: Annotated[str, typer.Argument(metavar="SSP", help="An .ssp archive, or a bare .ssd file.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The scenario to write, such as platoon.toml.")],
    *,
    variant: Variant = None,
    quiet: Quiet = False,
) -> Answer:
    """Make a scenario of an SSP, to read and to change; its FMUs go to a folder beside it.

    What a user should know of how it was read stands in the scenario's first lines.
    """
    from ..scenario import import_ssp as make
    from .documents import written

    folder = output.with_name(f"{output.stem}_fmus")
    world.mkdir(output.parent, parents=True, exist_ok=True)
    text = make(archive if variant is None else variant_of(archive, variant), folder, output.parent)
    world.write_text(output, text, encoding="utf-8")
    return written([output], quiet)


def export(
    scenario: Scenario,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="The file to write: platoon.ssp, or OspSystemStructure.xml for libcosim."),
    ],
    *,
    variant: Variant = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    platforms: Annotated[
        str | None,
        typer.Option(
            help="Of native FMUs: some of linux64,win64,darwin64,aarch64-linux, all of these; this machine's by "
            "default.",
            autocompletion=completing.platforms,
        ),
    ] = None,
    trust: Trust = False,
    quiet: Quiet = False,
) -> Answer:
    """Write a scenario for other tools: an SSP archive, which 'run' reads too, or libcosim's OspSystemStructure.xml.

    What other tools do otherwise with it, or not at all, is told.
    """
    from ..packing import export as write
    from .documents import export_document
    from .lines import printable
    from .printing import open_console, show_compilations, show_notes

    system = load_system(
        scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step, algorithm=algorithm
    )
    wanted = [name.strip() for name in (platforms or "").split(",") if name.strip()]
    with show_compilations(quiet):
        exported = write(system, output, platforms=wanted, trusted=trust)

    def show() -> None:
        show_notes(open_console(), exported.notes)
        for path in () if quiet else exported.files:
            print(printable(str(path)))

    return Answer(lambda: export_document(exported), show)


def _delays(system: System) -> list[str]:
    from .lines import counted

    late = [(each, counted(each.delay, "communication point")) for each in system.connections if each.delay]
    return [f"delay: {each.target} receives {each.source} {points} later" for each, points in late]


def _topology(checked: Checked) -> list[str]:
    from ..wiring import describe_topology

    interfaces = {name: model.interface for name, model in checked.models.items()}
    lines: list[str] = []
    before: list[str] = []
    for when, wiring in checked.wiring.routings:
        now = list(describe_topology(interfaces, wiring))
        lines += [f"{when}{now[0]}", *now[1:]] if now and now != before else []
        before = now
    return lines


def _study(system: System) -> list[str]:
    """What `[study]` would run, in words; nothing where there is none."""
    if not system.study:
        return []
    from ..study.design import make_plan, plan_notes
    from .lines import counted

    plan = make_plan(system)
    over = ", ".join(plan.names) or "noise alone"
    return [f"study: {counted(plan.count, 'run')} ({plan.design}) over {over}", *plan_notes(plan)]
