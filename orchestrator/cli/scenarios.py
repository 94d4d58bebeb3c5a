"""The commands of ``orchestrate`` that look at scenarios without running them: list, check."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .options import Algorithm, Preset, Scenario, Set, Step, Stop, Swap, Trust, With, load_system

if TYPE_CHECKING:
    from ..system import System


def list_all() -> None:
    """List the shipped scenarios, components and master algorithms."""
    from ...components import CATALOGUE
    from ...fmus.references import summary
    from ..master import ALGORITHMS
    from ..scenario import listed
    from .printing import open_console, say

    out = open_console()
    say(out, "Scenarios (orchestrate run NAME)", "bold")
    for scenario in listed():
        say(out, f"  {scenario.name}: {scenario.title}")
        for preset, what in scenario.presets.items():
            say(out, f"      --preset {preset}" + (f": {what}" if what else ""), "dim")
    say(out, "Components (orchestrate describe NAME)", "bold")
    for name, component in CATALOGUE.items():
        say(out, f"  {name}: {summary(component)}")
    say(out, "Master algorithms (orchestrate run SCENARIO --algorithm NAME)", "bold")
    for name, algorithm in ALGORITHMS.items():
        say(out, f"  {name}: {algorithm.summary()}")


def check(
    scenario: Scenario,
    *,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    stop: Stop = None,
    step: Step = None,
    algorithm: Algorithm = None,
    trust: Trust = False,
) -> None:
    """Find what is wrong before a run, and show how the run would step.

    Of an FMU nothing is executed. The file of a Python component is, because it is imported.
    """
    from ..fmi import Workspace
    from ..run import check as check_system
    from ..run import describe_stepping
    from ..times import digits
    from ..wiring import describe_topology
    from .lines import counted
    from .printing import open_console, say, show_compilations, show_notes

    system = load_system(scenario, preset, settings, builds, swaps, stop=stop, step=step, algorithm=algorithm)
    study = _study(system)
    out = open_console()
    with Workspace() as workspace, show_compilations(quiet=False, doing="reading what it is made of"):
        checked = check_system(system, workspace, trusted=trust)
    say(out, system.provenance.title or system.provenance.name, "bold")
    connections = len(checked.wiring.links)
    facts = (
        f"{len(system.instances)} instances, {connections} scalar connections, step {digits(system.stepping.step)} s"
    )
    say(out, facts, "dim")
    for line in describe_stepping(checked):
        say(out, line)
    for connection in system.connections:
        if connection.delay:
            points = counted(connection.delay, "communication point")
            say(out, f"delay: {connection.target} receives {connection.source} {points} later")
    for line in describe_topology({name: model.interface for name, model in checked.models.items()}, checked.wiring):
        say(out, line)
    for line in study:
        say(out, line)
    show_notes(out, checked.notes)
    say(out, "no errors", "green")


def _study(system: System) -> list[str]:
    """What `[study]` would run, in words; nothing where there is none."""
    if not system.study:
        return []
    from ..study.design import make_plan, plan_notes
    from .lines import counted

    plan = make_plan(system)
    over = ", ".join(plan.names) or "noise alone"
    return [f"study: {counted(plan.count, 'run')} ({plan.design}) over {over}", *plan_notes(plan)]
