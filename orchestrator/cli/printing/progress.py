"""How far a run has got."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ...run import Progress as OnProgress
from .console import open_console, tell


@contextmanager
def show_progress(
    title: str, quiet: bool, start: float = 0.0, reached: float | None = None
) -> Iterator[OnProgress | None]:
    """A progress bar on a terminal, one line per 10 % otherwise, nothing when quiet.

    Args:
        title: what is running.
        quiet: whether to show nothing.
        start: where the run begins, in s.
        reached: how far it has got already, in s; nothing is said of that.
    """
    if quiet:
        yield None
    elif sys.stderr.isatty():
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[reached]}"))
        out = open_console(stderr=True)
        with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=out, transient=True) as bar:
            task = bar.add_task(title, total=None, reached="")

            def show(time: float, stop: float) -> None:
                bar.update(task, completed=time - start, total=stop - start, reached=f"{time:.6g} of {stop:.6g} s")

            yield show
    else:
        yield _lines(title, start, start if reached is None else reached)


def _lines(title: str, start: float, reached: float) -> OnProgress:
    told = 0

    def show(time: float, stop: float) -> None:
        nonlocal told
        done, before = (int(10.0 * (t - start) / (stop - start) + 1e-9) for t in (time, reached))
        told = max(told, before)
        while told < done:
            told += 1
            tell(f"{title}: {10 * told} % of {stop - start:g} s")

    return show
