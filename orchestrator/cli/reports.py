"""The command of ``orchestrate`` that makes a page of what runs have left: report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .documents import Answer, written
from .options import Quiet, Trust


def report(
    results: Annotated[
        list[Path],
        typer.Argument(help="Directories of runs, to see them together; or that of a comparison, a study or a search."),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file; report.html in the first directory by default.")
    ] = None,
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

    The page is a file that opens in any browser, from disk and without a network. Needs the extra 'report'.
    """
    from ..report import write_report

    directories = [path.parent if path.is_file() else path for path in results]
    return written([write_report(directories, output, live=live, trust=trust)], quiet)
