"""Lines on the terminal, or in a file or pipe."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable

from rich.console import Console
from rich.text import Text

from ...problems import Problem

_PIPE_WIDTH = 160


def open_console(stderr: bool = False) -> Console:
    """A console as wide as the terminal, or as ``COLUMNS`` says; wide enough for tables in a file or a pipe."""
    stream = sys.stderr if stderr else sys.stdout
    follow = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return Console(stderr=stderr, width=None if follow else _PIPE_WIDTH, highlight=False)


def say(out: Console, text: str, style: str = "", *, whole: bool = False) -> None:
    """Print a line; it is folded on a terminal only, and not even there if it has to be copied ``whole``."""
    out.print(Text(text, style=style), soft_wrap=whole or not out.is_terminal)


def folded(problems: Iterable[Problem | str]) -> list[str]:
    """Problems that differ in an instance's index only, told once: four trains make one mistake, not four.

    A problem knows its kind; of notes, which are sentences, every number in brackets counts as an index.
    """
    alike: dict[str, list[Problem | str]] = {}
    for problem in problems:
        kind = problem.kind if isinstance(problem, Problem) else re.sub(r"(?<=\w)\[\d+\]", "[i]", problem)
        alike.setdefault(kind, []).append(problem)
    return [
        str(first) + (f" (and {len(rest)} more like it, for other indices)" if rest else "")
        for first, *rest in alike.values()
    ]


def show_notes(out: Console, notes: Iterable[str]) -> None:
    """What a user should know before reading on."""
    for note in folded(notes):
        say(out, f"note: {note}", "yellow")


def counted(count: int, what: str) -> str:
    """``1 figure``, ``2 figures``."""
    return f"{count} {what}{'s' * (count != 1)}"


def and_figures(count: int) -> str:
    """What a list of files ends with."""
    return f", {counted(count, 'figure')}" if count else ""
