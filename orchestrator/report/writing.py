"""Which page belongs to directories: of a run, of the variants of a comparison, of a study or a search."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import ScenarioError
from ..run import read_json
from . import studies
from .live import make_live
from .page import write_runs

REPORT_FILE = "report.html"
_RUN, _COMPARISON, _STUDIES = "run.json", "compare.json", ("study.json", "search.json")


def write_report(
    directories: Sequence[Path],
    output: Path | None = None,
    names: Sequence[str] = (),
    *,
    live: bool = False,
    trust: bool = False,
) -> Path:
    """Write the page of what directories hold.

    Args:
        directories: of runs or comparisons, which are seen together; or of one study or search.
        output: the file; in the first of the directories by default.
        names: what each run is called; scenario and preset, or else the directory, by default.
        live: whether the models of the run are in the page, to change their parameters; it is a single run then.
        trust: see `make_live`.

    Returns:
        The file.

    Raises:
        ScenarioError: a directory holds nothing that can be read, what does not go with the others, or no run that a
            page can do again.
        ComponentError: a model cannot be compiled for a page.
        RailcosimError: the library that draws is not installed, or the file cannot be written.
    """
    path = output if output is not None else directories[0] / REPORT_FILE
    many = [directory for directory in directories if _is_study(directory)]
    if many and len(directories) > 1:
        raise ScenarioError(f"{many[0]} is a study or a search, of which a page shows one alone; make one of each")
    if many and live:
        raise ScenarioError(f"{many[0]} is a study or a search: a live page has the models of one run; replay one")
    if many:
        return studies.write_study(directories[0], path)
    found = [pair for directory in directories for pair in _runs_in(directory)]
    known = list(names) or ([name for name, _ in found] if all(name for name, _ in found) else [])
    if live and len(found) > 1:
        raise ScenarioError("a live page has the models of one run: name one directory, or leave --live out")
    models = make_live(found[0][1], trust=trust) if live else None
    return write_runs([each for _, each in found], path, known, models)


def _is_study(directory: Path) -> bool:
    """Whether it holds a study or a search, and no run."""
    return not (directory / _RUN).is_file() and any((directory / name).is_file() for name in _STUDIES)


def _runs_in(directory: Path) -> Iterator[tuple[str, Path]]:
    """The run that a directory holds, or those of the variants that were compared there, with their names."""
    if (directory / _RUN).is_file() or not (directory / _COMPARISON).is_file():
        yield "", directory
        return
    try:
        told = [(str(each["name"]), each["results"]) for each in read_json(directory / _COMPARISON)["variants"]]
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise ScenarioError(f"{directory} holds no comparison that can be read: {error}") from error
    runs = [
        (name, directory / folder)
        for name, folder in told
        if isinstance(folder, str) and Path(folder).name == folder and (directory / folder / _RUN).is_file()
    ]
    if not runs:
        raise ScenarioError(f"{directory}: no variant that was compared has left results")
    yield from runs
