"""The command of ``orchestrate`` that makes a page of what runs have left: report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import ScenarioError
from . import completing
from .documents import Answer, written
from .options import OK, Quiet, Trust, Variant, exit_code, is_scenario, load_system

if TYPE_CHECKING:
    from ..run import Run
    from ..system import System


def report(
    results: Annotated[
        list[str],
        typer.Argument(
            metavar="RESULTS...",
            help="Directories of runs, to see them together; or that of a comparison, a study or a search. A scenario "
            "is run first, as by 'run', into results/<scenario>.",
            autocompletion=completing.scenarios,
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file; report.html in the first directory by default.")
    ] = None,
    *,
    variant: Variant = None,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Put the models of a run into its page, with sliders for their parameters; takes the extra 'cross'.",
        ),
    ] = False,
    trust: Trust = False,
    quiet: Quiet = False,
) -> Answer:
    """Make one page of runs: curves to zoom, trains on their line, verdicts, wiring, provenance; or of a study.

    The page is a file that opens in any browser, from disk and without a network. Needs the extra 'report'. A scenario
    that is run executes the code of all FMUs that it names, with your rights; the exit code is then that of 'run'.
    """
    from ..report import check_drawable, write_report
    from ..scenario import untrusted_code
    from .printing import show_run

    check_drawable()
    wanted = [name for name in results if not Path(name).is_dir() and is_scenario(name)]
    if variant is not None and not wanted:
        raise ScenarioError(f"--variant {variant} is of an .ssp that is to be run; name one")
    systems = {name: load_system(name, None, None, None, None, variant=variant) for name in wanted}
    if not trust and (strange := [problem for system in systems.values() for problem in untrusted_code(system)]):
        raise ScenarioError(strange)
    runs = {name: _run(system, quiet) for name, system in systems.items()}
    places = [runs[name].directory if name in runs else _directory(Path(name)) for name in results]
    page = write_report([place for place in places if place is not None], output, live=live, trust=trust)
    done = written([page], quiet)

    def show() -> None:
        for outcome in runs.values():
            show_run(outcome, None, None, quiet)
        done.show()

    errors = [outcome.error for outcome in runs.values() if outcome.status == "failed"]
    code = max((exit_code(outcome) for outcome in runs.values()), default=OK)
    return Answer(done.document, show, code, next(filter(None, errors), None))


def _directory(path: Path) -> Path:
    return path.parent if path.is_file() else path


def _run(system: System, quiet: bool) -> Run:
    from ..run import execute
    from .printing import show_progress

    name = system.provenance.name
    with show_progress(name, quiet, system.stepping.start_time) as progress:
        writing = progress and progress.writing
        return execute(system, output=Path("results") / name, progress=progress, writing=writing)
