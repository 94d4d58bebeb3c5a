"""Commands of ``orchestrate`` that compare and analyse; `cli` registers them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .. import world
from ..errors import ScenarioError
from . import completing
from .documents import Answer
from .options import (
    FAILED,
    FMU_FAILED,
    OK,
    Dpi,
    FigureFormat,
    Kind,
    KindName,
    Preset,
    Quiet,
    Report,
    Scenario,
    Set,
    Step,
    Stop,
    Swap,
    Variant,
    With,
    draw_as,
    interrupted,
    load_system,
)

Scenarios = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO...",
        help="Shipped scenarios (see 'orchestrate list'), or .toml, .ssp or .ssd files; or results: directories of "
        "runs, and files of any tool (.csv, .parquet, .h5, .mat), the first of which is the reference.",
        autocompletion=completing.comparable,
    ),
]


def compare(
    scenarios: Scenarios,
    *,
    presets: Annotated[
        list[str] | None,
        typer.Option(
            "--preset",
            help="Add a variant: the scenario under this preset; repeatable.",
            autocompletion=completing.presets,
        ),
    ] = None,
    swaps: Annotated[
        list[str] | None,
        typer.Option(
            "--swap",
            help="Add a variant with another model: cruise=OtherComponent; repeatable.",
            autocompletion=completing.swaps,
        ),
    ] = None,
    settings: Set = None,
    builds: With = None,
    stop: Stop = None,
    step: Step = None,
    directions: Annotated[
        list[str] | None,
        typer.Option(
            "--better",
            help="What is better, where the metric does not say: gap_at_end=larger; repeatable.",
            autocompletion=completing.metrics,
        ),
    ] = None,
    kind: Kind = KindName.auto,
    tolerance: Annotated[
        float | None,
        typer.Option(
            min=1e-15,
            help="Of results: half the tube around the reference, as part of a signal's range and of the duration; "
            "0.002 by default.",
        ),
    ] = None,
    time_tolerance: Annotated[
        float | None, typer.Option(min=0.0, metavar="S", help="Of results: half the tube in time in s instead.")
    ] = None,
    nominal: Annotated[
        float | None,
        typer.Option(
            min=1e-300, help="Of results: the range that a signal is taken to have at least; 0.001 by default."
        ),
    ] = None,
    signals: Annotated[
        list[str] | None,
        typer.Option("--signal", metavar="PATTERN", help="Of results: compare these, as 'train*.speed'; repeatable."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory; results/compare-<scenarios> by default.")
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    report: Report = False,
    figure_format: FigureFormat = None,
    dpi: Dpi = None,
    quiet: Quiet = False,
) -> Answer:
    """Run variants side by side: one table of metrics, a winner per row, overlaid figures. Or compare recorded results.

    Variants: each SCENARIO as it stands, then under each --preset, then with each --swap. Several changes to one
    variant are parted by commas: --swap cruise=A,train=B. Exit codes: 0 fine; 1 a requirement failed in a variant; 2
    the input is wrong; 3 a variant failed; 130 interrupted by Ctrl-C, 143 by SIGTERM, 129 by SIGHUP.

    Results: each signal that the others share with the first is to run in a tube around it. Exit codes: 0 all do; 1 one
    leaves its tube, or ends too early; 2 the input is wrong.
    """
    from ..comparison import compare as compare_systems
    from ..comparison import is_recorded, read_directions, variants
    from .documents import compare_document
    from .printing import show_comparison, show_page, show_progress

    of_results = {"tolerance": tolerance, "time_tolerance": time_tolerance, "nominal": nominal, "signals": signals}
    of_variants = (presets, swaps, settings, builds, directions, stop, step, report or None, figure_format, dpi)
    if any(map(is_recorded, scenarios)):
        if not all(map(is_recorded, scenarios)) or any(of_variants) or kind is not KindName.auto:
            raise ScenarioError(
                "results are compared with results alone, as they are: give no scenario beside them, and of the "
                "options --tolerance, --time-tolerance, --nominal, --signal, --output, --no-figures and --quiet"
            )
        given = {key: value for key, value in of_results.items() if value is not None}
        return _compare_recorded(scenarios, output, given, figures=not no_figures, quiet=quiet)
    if any(value is not None for value in of_results.values()):
        raise ScenarioError(
            "--tolerance, --time-tolerance, --nominal and --signal are about recorded results: name directories of "
            "runs, or files such as a.csv"
        )
    if report:
        from ..report import check_drawable

        check_drawable()
    systems = variants(
        scenarios,
        presets=presets or (),
        swaps=swaps or (),
        settings=settings or (),
        builds=builds or (),
        stop_time=stop,
        step=step,
    )
    for system in systems.values():
        draw_as(system, figure_format, dpi)
    names = dict.fromkeys(system.provenance.name for system in systems.values())
    metrics = {name: text for system in systems.values() for name, text in system.judged.metrics.items()}
    directory = output or Path("results") / "-".join(["compare", *names])
    comparison = compare_systems(
        systems,
        kind=kind.value,
        output=directory,
        figures=not no_figures,
        directions=read_directions(directions or (), metrics),
        progress=lambda name, start: show_progress(name, quiet, start),
    )
    ran = {variant.name: variant.run.directory for variant in comparison.variants if variant.run}
    runs = {name: path for name, path in ran.items() if path is not None}
    page = None
    if report and runs:
        from ..report import REPORT_FILE, write_report

        page = write_report([*runs.values()], directory / REPORT_FILE, [*runs])

    def show() -> None:
        show_comparison(comparison, quiet)
        show_page(page, quiet)

    code = FMU_FAILED if comparison.broken else FAILED if comparison.requirement_failed else OK
    code = interrupted(comparison.interrupted) if comparison.interrupted else code
    return Answer(lambda: compare_document(comparison, page), show, code)


def _compare_recorded(
    paths: list[str], output: Path | None, given: dict[str, Any], *, figures: bool, quiet: bool
) -> Answer:
    from ..comparison import compare_recorded
    from .documents import recorded_document
    from .printing import show_recorded

    directory = output or Path("results") / "-".join(["compare", *dict.fromkeys(Path(path).stem for path in paths)])
    found = compare_recorded(paths, output=directory, figures=figures, **given)
    return Answer(lambda: recorded_document(found), lambda: show_recorded(found, quiet), OK if found.same else FAILED)


def linearize(
    scenario: Scenario,
    *,
    at: Annotated[float, typer.Option("--at", help="Time of the run to linearize at, s: a communication point.")],
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            help="Inputs of the model: train[1].disturbance,target.value; disturbances and sources by default.",
            autocompletion=completing.varied,
        ),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(
            help="Outputs of the model: train[:].speed; all shown states by default.", autocompletion=completing.signals
        ),
    ] = None,
    sampled: Annotated[
        bool, typer.Option("--sampled", help="The model of one communication step, also of a continuous system.")
    ] = False,
    duration: Annotated[float | None, typer.Option(help="Length of the step responses in s.")] = None,
    variant: Variant = None,
    preset: Preset = None,
    settings: Set = None,
    builds: With = None,
    swaps: Swap = None,
    step: Step = None,
    kind: Kind = KindName.auto,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Directory; results/<scenario>-linear by default.")
    ] = None,
    no_figures: Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")] = False,
    figure_format: FigureFormat = None,
    dpi: Dpi = None,
    quiet: Quiet = False,
) -> Answer:
    """Linearize the closed loop at a time of a run: eigenvalues, stability, step and Bode figures, string stability.

    Exit codes: 0 stable (string stability is told, not judged); 1 not stable; 2 the input is wrong; 3 an FMU failed.
    """
    from ..figures import remove_drawn
    from ..linearization import (
        draw_linear,
        stability,
        string_stability,
        write_linear,
    )
    from ..linearization import linearize as linearize_system
    from .documents import linearize_document
    from .lines import and_figures
    from .printing import open_console, say, show_progress
    from .printing.linear import show_linear

    if duration is not None and not 0.0 < duration < float("inf"):
        raise typer.BadParameter("it must be a positive time in s.", param_hint="'--duration'")
    system = load_system(scenario, preset, settings, builds, swaps, variant=variant, step=step)
    with show_progress(system.provenance.name, quiet, system.stepping.start_time) as progress:
        model = linearize_system(
            system,
            at,
            inputs=inputs or (),
            outputs=outputs or (),
            kind=kind.value,
            sampled=sampled,
            progress=progress,
        )
    found, passings = stability(model), string_stability(model)
    directory = output or Path("results") / "-".join(filter(None, (system.provenance.name, preset, "linear")))
    world.mkdir(directory, parents=True, exist_ok=True)
    remove_drawn(directory / "linear.json")
    write_linear(directory, model, found, passings)
    drawn: Any = {"duration": duration, "dpi": dpi} | ({"format": figure_format.value} if figure_format else {})
    figures = [] if no_figures else draw_linear(model, found, passings, directory, **drawn)
    write_linear(directory, model, found, passings, figures)

    def show() -> None:
        if not quiet:
            out = open_console()
            show_linear(out, model, found, passings)
            say(out, f"Files in {directory}: linear.json{and_figures(len(figures))}", whole=True)

    code = OK if found.verdict == "stable" else FAILED
    return Answer(lambda: linearize_document(model, found, passings, directory, figures), show, code)
