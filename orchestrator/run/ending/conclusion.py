"""The end of a run whose process is gone: its record says how, and what it has recorded becomes text."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

from ... import world
from ...errors import RailcosimError
from .. import record
from ..directory import RunDirectory
from ..recording import ROWS_FILE, recover_rows


def conclude(directory: Path, process: int, status: str, why: str) -> None:
    """Write down how a run has ended that could not do so itself.

    Args:
        directory: of the run; where it cannot be written, or another run has it by now, it is left alone.
        process: the number of the process that is gone.
        status: how the run ended.
        why: what is known of that.
    """
    with suppress(RailcosimError, OSError, ValueError, LookupError, TypeError), RunDirectory(directory):
        found = json.loads(world.read_text(directory / "run.json", encoding="utf-8"))
        if found["process"]["pid"] != process or found["status"] != "running":
            return
        record.add(directory, status=status, error=why)
        if (directory / ROWS_FILE).is_file():
            recover_rows(directory)
