"""Lines on the terminal, or in a file or pipe."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook, RenderResult
from rich.segment import Segment
from rich.text import Text

from ..lines import folded, printable

_PIPE_WIDTH = 160


def open_console(stderr: bool = False) -> Console:
    """A console as wide as the terminal, or as ``COLUMNS`` says; wide enough for tables in a file or a pipe."""
    stream = sys.stderr if stderr else sys.stdout
    follow = stream.isatty() or os.environ.get("COLUMNS", "").isdigit()
    console = Console(stderr=stderr, width=None if follow else _PIPE_WIDTH, highlight=False)
    console.push_render_hook(_Harmless())
    return console


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


def say(out: Console, text: str, style: str = "", *, whole: bool = False) -> None:
    """Print a line; it is folded on a terminal only, and not even there if it has to be copied ``whole``."""
    out.print(Text(text, style=style), soft_wrap=whole or not out.is_terminal)


def show_notes(out: Console, notes: Iterable[str]) -> None:
    """What a user should know before reading on."""
    for note in folded(notes):
        say(out, f"note: {note}", "yellow")


def show_page(page: Path | None, quiet: bool) -> None:
    """Say where a page is, if there is one."""
    if page is not None and not quiet:
        say(open_console(), f"Report: {page}", whole=True)
