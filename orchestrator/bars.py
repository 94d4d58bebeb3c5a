"""`progress_bar`: how far something has got, on a terminal and in a notebook, once it takes longer than a second."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from rich.console import Console
from rich.table import Column

from . import world
from .times import digits

_LONG = 1.0
"""How long something may take before there is a bar, in s."""
_NARROW, _WIDE = 60, 100
"""Below so many columns there is no room for the bar itself; from so many on there is room for everything."""


class Bar:
    """A bar, to be told how far a run has got: ``bar(time, stop)``, both in s.

    Args:
        display: of rich, with the one task; None where nothing is shown.
        title: what goes on. start: where the run begins, in s.
    """

    def __init__(self, display: Any, title: str, start: float) -> None:
        self._display, self._title, self._start = display, title, start
        self._task = None if display is None else display.add_task(title, total=None, told="")
        self._first: tuple[float, float] | None = None

    def __call__(self, time: float, stop: float) -> None:
        """Show the simulated time, and how much faster than real time it goes."""
        if self._display is None:
            return
        now = world.monotonic()
        since, began = self._first = self._first or (time, now)
        told = f"{digits(_rounded(time, (stop - self._start) / 10))} of {digits(stop)} s"
        if now > began and time > since:
            told += f", {_rounded(speed := (time - since) / (now - began), speed):.15g}x real time"
        self._show(time - self._start, stop - self._start, told, self._title)

    def count(self, done: float, of: float, told: str, title: str = "") -> None:
        """Show that so many of so many are done, and what is told of it."""
        self._show(done, of, told, title or self._title)

    def tell(self, what: str) -> None:
        """Show what else takes its time."""
        if self._display is not None:
            self._display.update(self._task, description=what)

    def _show(self, done: float, of: float, told: str, title: str) -> None:
        if self._display is not None:
            self._display.update(self._task, completed=done, total=of, told=told, description=title)


@contextmanager
def progress_bar(title: str = "", start: float = 0.0, *, console: Console | None = None) -> Iterator[Bar]:
    """A bar for as long as the block lasts; in a pipe or file, or a notebook without ipywidgets, nothing is shown.

    ``with progress_bar("night train") as bar: run(system, progress=bar)``.

    Args:
        title: what goes on.
        start: where the run begins, in s.
        console: of rich; standard error by default.
    """
    out = console or Console(stderr=True)
    shows = find_spec("ipywidgets") is not None if out.is_jupyter else out.is_terminal
    if not shows:
        yield Bar(None, title, start)
        return
    from rich.progress import Progress

    display = Progress(*_columns(out.width), console=out, transient=True)
    timer = threading.Timer(_LONG, display.start)
    timer.daemon = True
    timer.start()
    try:
        yield Bar(display, title, start)
    finally:
        timer.cancel()
        timer.join()  # or it would begin after the end
        display.stop()


def _rounded(value: float, size: float) -> float:
    """As many digits as a reader takes in, of a value in something of a size."""
    return round(value, 2 - math.floor(math.log10(size))) if size > 0 else value


def _columns(width: int) -> list[Any]:
    """What there is room for."""
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    title = TextColumn(
        "{task.description}", markup=False, table_column=Column(no_wrap=True, max_width=max(20, width // 3 - 13))
    )
    told = TextColumn("{task.fields[told]}", markup=False, table_column=Column(no_wrap=True))
    left = [TimeRemainingColumn(compact=True), TextColumn("left")]
    if width < _NARROW:
        return [title, TaskProgressColumn(), *left]
    if width < _WIDE:
        return [title, BarColumn(10), told, *left]
    return [title, BarColumn(), told, TimeElapsedColumn(), TextColumn("gone,"), *left]
