"""The commands of ``orchestrate`` that are about models: describe, build, pack, validate, new. `cli` registers them."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from ..errors import ScenarioError
from . import completing
from .documents import Answer, written
from .options import (
    FAILED,
    OK,
    PROBE_SECONDS,
    Algorithm,
    FmiName,
    PackagingName,
    Preset,
    ProfileName,
    Quiet,
    Scenario,
    Set,
    Step,
    Stop,
    Swap,
    Trust,
    Variant,
    With,
    build_arguments,
    is_scenario,
    load_system,
)


def describe(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A component, my_file.py:Class, the path of any FMU, or a scenario as 'run' takes it.",
            autocompletion=completing.things,
        ),
    ],
    builds: Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: carriages=8.")] = None,
    variant: Variant = None,
    quiet: Quiet = False,
) -> Answer:
    """Show what a component, any FMU or a scenario is.

    Of a model its variables by causality, with units, start values and direct dependencies; its build arguments, where
    it comes from, and the kind that a run takes. Of a scenario its source, presets, instances, connections, and what is
    judged and drawn; nothing that it names is imported. A component's file is.
    """
    from ...components import CATALOGUE
    from ...fmus.annotation import Annotation
    from ...fmus.build import package
    from ..fmi import Workspace, is_fmu_name, load_fmu
    from ..problems import Problem, suggestion
    from ..scenario import shipped
    from ..times import digits
    from .documents import describe_document, scenario_document
    from .printing import open_console, show_compilations, show_model, show_system

    arguments = build_arguments(builds)
    known_scenario = is_scenario(name)
    # Any other file is told for what it is: a folder with an unpacked FMU, a program.
    is_file = not (known_scenario or name in CATALOGUE or ".py" in name) and Path(name).exists()
    is_fmu = is_fmu_name(name) or is_file
    if known_scenario or variant is not None:
        system = load_system(name, None, None, builds, None, variant=variant)
        return Answer(lambda: scenario_document(system), lambda: show_system(open_console(), system))
    if not (is_fmu or name in CATALOGUE or ".py:" in name):
        known = (*CATALOGUE, *dict(shipped()))
        remedy = suggestion(name, known) or "'orchestrate list' has them; a file is named with its ending"
        raise ScenarioError(Problem("", f"there is no component or shipped scenario {name!r}", remedy))
    with show_compilations(quiet, doing=f"reading {name}"), Workspace() as workspace:
        path, _, lacks = (Path(name), "", "") if is_fmu else package(name, arguments)
        interface = load_fmu(path, workspace, structure=arguments if is_fmu else {}).interface
    annotation = interface.annotation or Annotation()
    facts = {
        "": interface.description,
        "note": annotation.note,
        "source": annotation.source,
        "build arguments": ", ".join(f"{k} = {v!r}" for k, v in annotation.arguments.items()),
        "digest": annotation.digest,
        "kind": f"{annotation.kind}: {annotation.kind_note}" if annotation.kind else "",
        "not native": lacks,
        "FMI": interface.version,
        "made with": interface.generator,
        "guid": interface.guid,
        "default step": "" if interface.default_step is None else f"{digits(interface.default_step)} s",
        "saves its state": "yes" if interface.can_save_state else "no",
    }
    return Answer(lambda: describe_document(interface, facts), lambda: show_model(open_console(), interface, facts))


def build(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Component names or my_file.py:Class.", autocompletion=completing.components),
    ] = None,
    *,
    every: Annotated[bool, typer.Option("--all", help="Build the whole catalogue, with SHA256SUMS.")] = False,
    builds: Annotated[list[str] | None, typer.Option("--with", help="Give a build argument: carriages=8.")] = None,
    kind: Annotated[
        PackagingName, typer.Option(help="native: compiled C; python: Python FMUs; auto: native if possible.")
    ] = PackagingName.auto,
    platforms: Annotated[
        str | None,
        typer.Option(
            help="Of native FMUs: some of linux64,win64,darwin64,aarch64-linux, all of these, wasm for web pages; this "
            "machine's by default.",
            autocompletion=completing.platforms,
        ),
    ] = None,
    profile: Annotated[
        ProfileName,
        typer.Option(help="real-time: native FMUs without files, and without memory taken after instantiation."),
    ] = ProfileName.standard,
    fmi: Annotated[FmiName, typer.Option(help="Version of FMI: 2 (2.0), or 3 (3.0, native FMUs).")] = FmiName.two,
    model_exchange: Annotated[
        bool,
        typer.Option("--model-exchange", help="Model exchange beside co-simulation in one archive, of native FMUs."),
    ] = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Directory for the FMUs.")] = None,
    quiet: Quiet = False,
) -> Answer:
    """Build FMUs to keep, for other tools or for --swap; prints the files it wrote."""
    from ...components import CATALOGUE
    from ...fmus.release import default_directory, release
    from .lines import tell
    from .printing import show_compilations

    wanted = [*(names or []), *(CATALOGUE if every else [])]
    if not wanted:
        raise ScenarioError(f"name the components to build, or --all; there is {', '.join(CATALOGUE)}")
    if model_exchange and profile is not ProfileName.standard:
        raise ScenarioError(f"--model-exchange and --profile {profile.value} exclude each other; build two FMUs")
    with show_compilations(quiet):
        paths = release(
            tuple(dict.fromkeys(wanted)),
            build_arguments(builds),
            output or default_directory(),
            kind=kind.value,
            platforms=[name.strip() for name in (platforms or "").split(",") if name.strip()],
            profile="model-exchange" if model_exchange else profile.value,
            fmi=fmi.value,
            checksums=every,
            tell=(lambda line: None) if quiet else tell,
        )
    return written(paths, quiet)


def pack(
    scenario: Scenario,
    output: Annotated[Path, typer.Option("--output", "-o", help="The FMU to write, such as platoon.fmu.")],
    *,
    expose: Annotated[
        list[str] | None,
        typer.Option(
            help="What to show: train[:].speed,gust.size; all outputs of the trains by default.",
            autocompletion=completing.signals,
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
    platforms: Annotated[
        str | None,
        typer.Option(
            help="all, or some of linux64,win64,darwin64; this machine's by default.",
            autocompletion=completing.platforms,
        ),
    ] = None,
    trust: Trust = False,
    quiet: Quiet = False,
) -> Answer:
    """Write one FMU that holds a whole scenario, for another tool to run as a block."""
    from ..packing import pack as pack_system
    from .documents import pack_document
    from .printing import open_console, say, show_compilations, show_notes

    system = load_system(
        scenario, preset, settings, builds, swaps, variant=variant, stop=stop, step=step, algorithm=algorithm
    )
    with show_compilations(quiet):
        packed = pack_system(system, output, expose=expose or (), platforms=(platforms or "").split(","), trusted=trust)

    def show() -> None:
        out = open_console()
        show_notes(out, packed.notes)
        shown = f"{len(packed.exposed)} variables, for {', '.join(packed.platforms)}"
        if not quiet:
            say(out, f"{packed.path}: {len(system.instances)} FMUs as one, {shown}", whole=True)

    return Answer(lambda: pack_document(packed, len(system.instances)), show)


def validate(
    fmu: Annotated[Path, typer.Argument(help="Any FMI co-simulation FMU, ours or not.")],
    timeout: Annotated[float, typer.Option(min=0.1, help="Longest time for one probe, in s.")] = PROBE_SECONDS,
    quiet: Quiet = False,
) -> Answer:
    """Check any FMU: archive, description, and probes that cannot take this program down.

    Probes execute the code of the FMU, with your rights.

    Exit codes: 0 nothing failed; 1 something did; 2 the file is no FMU that could be used.
    """
    from ..isolation import note_validation
    from ..validation import validate as validate_fmu
    from .documents import validate_document
    from .printing import open_console, show_compilations, show_report

    with show_compilations(quiet, doing=f"reading and trying {fmu}"):
        report = validate_fmu(fmu, timeout=timeout)
    note_validation(Path(fmu), passed=report.passed)
    return Answer(
        lambda: validate_document(report),
        lambda: show_report(open_console(), report, quiet),
        OK if report.passed else FAILED,
    )


def new(
    path: Annotated[Path, typer.Argument(help="The file to write, such as my_controller.py.")],
    quiet: Quiet = False,
) -> Answer:
    """Write a commented controller to start from; it runs."""
    from .documents import new_document
    from .lines import printable
    from .skeleton import write_skeleton

    name = write_skeleton(path)
    swap = shlex.quote(f"cruise={path}:{name}")
    hint = printable(f"{path} written. Try it:\n  orchestrate run comfort_cruise --swap {swap}")
    return Answer(lambda: new_document(path, name), lambda: None if quiet else print(hint))
