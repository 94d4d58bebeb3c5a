"""One probe of one FMU, run by `probing` in a process of its own, which the FMU may take down.

What it needs to know stands in the file named as its only argument; it adds its verdict to the file named in there.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

from .. import world
from ..errors import FmuError
from ..fmi.guard import stand_aside
from . import claims, misuse, probes
from .probes import DoubtfulError, NotedError, Task

PROBES = {**probes.PROBES, **claims.PROBES, **misuse.PROBES}
_KEPT = 5
"""Lines of what an FMU said that stand under what it did."""


def main(path: str) -> None:
    """Run the probe that the file asks for, and write its verdict."""
    stand_aside()  # this process may end as it likes: who has started it tells how
    task = Task.read(Path(path))
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            detail = PROBES[task.probe](task)
        verdict = "skipped" if detail.startswith("skipped: ") else "pass"
    except (DoubtfulError, NotedError) as error:
        verdict, detail = "warning" if isinstance(error, DoubtfulError) else "note", str(error)
    except FmuError as error:
        verdict, detail = "fail", _in_a_line(error, printed.getvalue())
    except Exception as error:
        verdict, detail = "fail", f"{type(error).__name__}: {error}"
    task.record.add(verdict=verdict, detail=detail.removeprefix("skipped: "))
    # A library that crashes while it is unloaded has done its part by now (pythonfmu 0.7 does, in one exit of a few).
    world.exit_at_once(0)


def _in_a_line(error: FmuError, printed: str) -> str:
    """An FMU's failure, and the last of what it said.

    Messages that an FMU passes on under a wrong name, no instance takes for its own: they are printed.
    """
    error.instance = ""  # one of a probe's, of which no user knows
    what, *said = str(error).split("\n")
    kept = " / ".join([line.strip() for line in [*printed.splitlines(), *said] if line.strip()][-_KEPT:])
    return f"{what}; it said: {kept}" if kept else what
