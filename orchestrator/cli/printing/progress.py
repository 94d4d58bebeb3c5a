"""How far a run has got, and what is being compiled."""

from __future__ import annotations

import itertools
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ....fmus import toolchain
from ...bars import progress_bar
from ...run import CSV_FILE, Telling
from ...run import Progress as OnProgress
from ...times import digits
from ..lines import printable, tell
from .console import open_console

if TYPE_CHECKING:
    from ...study.campaign import Pool


class Shown:
    """What is told of a run: how far it has got, and then how far its results are written.

    Args:
        stepping: shows the time reached and the stop time, in s.
        writing: shows rows written, and rows in all.
    """

    def __init__(self, stepping: OnProgress, writing: Telling) -> None:
        self._stepping, self.writing = stepping, writing

    def __call__(self, time: float, stop: float) -> None:
        """As a run calls it."""
        self._stepping(time, stop)


_LONG = 1.0
"""How long something may take before it is told what it is, in s."""


@contextmanager
def show_progress(title: str, quiet: bool, start: float = 0.0, reached: float | None = None) -> Iterator[Shown | None]:
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
        with progress_bar(title, start, console=open_console(stderr=True)) as bar, _compilations(bar.tell):
            yield Shown(bar, lambda done, rows: bar.count(done, rows, f"{done} of {rows} rows", CSV_FILE))
    else:
        with _compilations(tell):
            yield Shown(_lines(title, start, start if reached is None else reached), lambda *_: None)


@contextmanager
def show_compilations(quiet: bool, *, doing: str = "") -> Iterator[None]:
    """What is compiled for another machine, as it is begun: on a terminal with the time it takes, else a line each.

    Args:
        quiet: whether to show nothing.
        doing: what else may take long; it is shown on a terminal once it does.
    """
    if quiet:
        yield
    elif sys.stderr.isatty():
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
        with Progress(*columns, console=open_console(stderr=True), transient=True) as bar:
            task = bar.add_task("", start=False, visible=False)

            def show(what: str) -> None:
                later.cancel()
                bar.reset(task, description=what, visible=True)

            later = threading.Timer(_LONG, lambda: bar.update(task, description=printable(doing), visible=bool(doing)))
            later.daemon = True
            bar.start_task(task)
            later.start()
            try:
                with _compilations(show):
                    yield
            finally:
                later.cancel()
    else:
        with _compilations(tell):
            yield


@contextmanager
def _compilations(show: Callable[[str], object]) -> Iterator[None]:
    """Hand on what the toolchain tells."""
    teller, handler = logging.getLogger(toolchain.__name__), _Teller(show)
    level = teller.level
    teller.setLevel(logging.INFO)
    teller.addHandler(handler)
    try:
        yield
    finally:
        teller.removeHandler(handler)
        teller.setLevel(level)


class _Teller(logging.Handler):
    def __init__(self, show: Callable[[str], object]) -> None:
        super().__init__(logging.INFO)
        self._show = show

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno == logging.INFO:  # warnings are the console's
            self._show(printable(record.getMessage()))


@contextmanager
def show_cases(count: int, quiet: bool) -> Iterator[Callable[[str], None]]:
    """One bar over many runs, on a terminal only; to be told what runs next. What is compiled is told as elsewhere."""
    if quiet:
        yield lambda _: None
    elif sys.stderr.isatty():
        done = itertools.count()
        with progress_bar(console=open_console(stderr=True)) as bar, _compilations(bar.tell):
            yield lambda title: bar.count(at := next(done), count, f"{at} of {count}", title)
    else:
        with _compilations(tell):
            yield lambda _: None


@contextmanager
def show_meshes(title: str, quiet: bool, most: int) -> Iterator[Callable[[int, int], None]]:
    """A bar over the meshes of an optimum, on a terminal only; to be told how many are solved, and the next one's size.

    Args:
        title: what is driven.
        quiet: whether to show nothing.
        most: how many meshes there may be; few need them all.
    """
    if quiet:
        yield lambda *_: None
        return
    with progress_bar(printable(title), console=open_console(stderr=True)) as bar:
        yield lambda done, size: bar.count(done, most, f"{done} meshes solved, {size} intervals")


def _lines(title: str, start: float, reached: float) -> OnProgress:
    told = 0

    def show(time: float, stop: float) -> None:
        nonlocal told
        done, before = (int(10.0 * (t - start) / (stop - start) + 1e-9) for t in (time, reached))
        told = max(told, before)
        while told < done:
            told += 1
            tell(f"{title}: {10 * told} % of {digits(stop - start, start, stop)} s")

    return show


def tell_pool(pool: Pool) -> None:
    """Where one can look at what workers do."""
    if pool.dashboard:
        tell(f"what the workers do: {pool.dashboard}")
