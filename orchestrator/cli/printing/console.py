"""Lines on the terminal, or in a file or pipe. What came from outside is made harmless here, and only here."""

from __future__ import annotations

import logging
import os
import re
import sys
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook, RenderResult
from rich.segment import Segment
from rich.text import Text

from ...problems import Problem

_PIPE_WIDTH = 160


def open_console(stderr: bool = False) -> Console:
    """A console as wide as the terminal, or as ``COLUMNS`` says; wide enough for tables in a file or a pipe."""
    stream = sys.stderr if stderr else sys.stdout
    follow = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    console = Console(stderr=stderr, width=None if follow else _PIPE_WIDTH, highlight=False)
    console.push_render_hook(_Harmless())
    return console


def printable(text: str) -> str:
    """A text in which nothing steers a terminal: letters that colour, erase, retitle or turn it round are named."""
    if text.isprintable():
        return text
    return "".join(letter if _is_harmless(letter) else letter.encode("unicode_escape").decode() for letter in text)


def _is_harmless(letter: str) -> bool:
    return letter.isprintable() or letter in "\n\t" or unicodedata.category(letter) == "Zs"


class _Harmless(RenderHook):
    """Makes all that a console prints `printable`, but for the console's own colours."""

    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        return [_Rendered(renderable) for renderable in renderables]


class _Rendered:
    def __init__(self, renderable: ConsoleRenderable) -> None:
        self._renderable = renderable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for text, style, control in console.render(self._renderable, options):
            yield Segment(text if control else printable(text), style, control)


def tell(line: str) -> None:
    """Print a line beside the results, at once."""
    print(printable(line), file=sys.stderr, flush=True)


class Log(logging.Handler):
    """Warnings of all rooms, as lines beside the results."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        tell(f"{record.levelname.lower()}: {record.getMessage()}")


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


def show_page(page: Path, quiet: bool) -> None:
    """Say where a page is."""
    if not quiet:
        say(open_console(), f"Report: {page}", whole=True)
