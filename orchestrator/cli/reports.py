"""The command of ``orchestrate`` that makes a page of what runs have left: report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import RailcosimError, ScenarioError
from ..problems import Problem, suggestion
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
    from ..report import check_drawable, check_live, write_report
    from ..scenario import untrusted_code
    from ..ssp import is_ssp_name

    check_drawable()
    wanted = [name for name in results if not Path(name).is_dir() and is_scenario(name)]
    _check_there([name for name in results if name not in wanted])
    if variant is not None and not any(map(is_ssp_name, wanted)):
        raise ScenarioError(f"--variant {variant} is of an .ssp that is to be run; name one")
    variants = {name: variant if is_ssp_name(name) else None for name in wanted}
    systems = {name: load_system(name, None, None, None, None, variant=which) for name, which in variants.items()}
    _check_apart(systems)
    if not trust and (strange := [problem for system in systems.values() for problem in untrusted_code(system)]):
        raise ScenarioError(strange)
    if live and len(results) > 1:
        raise ScenarioError("a live page has the models of one run: name one, or leave --live out")
    for system in systems.values() if live else ():
        check_live(system, "auto")
    runs: dict[str, Run] = {}
    for name, system in systems.items():
        runs[name] = _run(system, quiet)
        if runs[name].status == "interrupted":
            return Answer(written([], quiet).document, lambda: _show(runs, quiet), exit_code(runs[name]))
    places = [_home(systems[name]) if name in systems else _directory(Path(name)) for name in results]
    goes = live and all(outcome.status == "completed" for outcome in runs.values())
    try:
        page = write_report(places, output, live=goes, trust=trust)
    except RailcosimError:
        _show(runs, quiet)
        raise
    done = written([page], quiet)

    def show() -> None:
        _show(runs, quiet)
        done.show()

    errors = [outcome.error for outcome in runs.values() if outcome.status == "failed"]
    code = max((exit_code(outcome) for outcome in runs.values()), default=OK)
    return Answer(done.document, show, code, next(filter(None, errors), None))


def _check_there(names: Sequence[str]) -> None:
    """Refuse what is neither a scenario nor results, before anything is run."""
    from ..scenario import shipped

    for name in names:
        if not Path(name).exists():
            message = f"there is no directory and no scenario '{name}'"
            raise ScenarioError(Problem("", message, suggestion(name, dict(shipped()))))


def _check_apart(systems: Mapping[str, System]) -> None:
    """Refuse scenarios whose results would stand in the same directory."""
    taken: dict[str, str] = {}
    for name, system in systems.items():
        if (other := taken.setdefault(system.provenance.name, name)) != name:
            message = f"{other} and {name} would both have their results in {_home(system)}"
            raise ScenarioError(Problem("", message, "run each first, with an -o of its own"))


def _show(runs: Mapping[str, Run], quiet: bool) -> None:
    from .printing import show_run

    for outcome in runs.values():
        show_run(outcome, None, None, quiet)


def _home(system: System) -> Path:
    return Path("results") / system.provenance.name


def _directory(path: Path) -> Path:
    return path.parent if path.is_file() else path


def _run(system: System, quiet: bool) -> Run:
    from ..run import execute
    from .printing import show_progress

    name = system.provenance.name
    with show_progress(name, quiet, system.stepping.start_time) as progress:
        writing = progress and progress.writing
        return execute(system, output=_home(system), progress=progress, writing=writing)
