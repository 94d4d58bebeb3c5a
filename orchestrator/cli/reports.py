"""The command of ``orchestrate`` that makes a page of what runs have left: report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .documents import Answer, written
from .options import Quiet


def report(
    results: Annotated[list[Path], typer.Argument(help="The directory of a run; of several, to see them together.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file; report.html in the first directory by default.")
    ] = None,
    quiet: Quiet = False,
) -> Answer:
    """Make one page of a run: curves to zoom, trains on their line, verdicts, wiring, provenance.

    The page is a file that opens in any browser, from disk and without a network. Needs the extra 'report'.
    """
    from ..report import write_report

    page = write_report([path.parent if path.is_file() else path for path in results], output)
    return written([page], quiet)
