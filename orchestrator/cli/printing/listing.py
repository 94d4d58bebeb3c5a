"""Listings: tables of perhaps a hundred thousand rows, laid out in one pass over plain text."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from ..lines import printable
from .console import open_console, say

if TYPE_CHECKING:
    from ...driving import ListedCase
    from ...scenario import Listed

_GAP = "  "
_NARROWEST = 8
"""Columns that a column which may take several lines keeps at least."""


def show_listing(
    out: Console,
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    right: Collection[str] = (),
    fold: Collection[str] = (),
) -> None:
    """Print a table.

    Args:
        out: where.
        title: above it.
        heads: of the columns.
        rows: as many texts each as there are columns.
        right: which columns are aligned to the right.
        fold: which of them may take several lines a row, where the console is narrow.
    """
    cells = [[printable(cell).replace("\n", " ").replace("\t", " ") for cell in row] for row in rows]
    widths = [max(map(_length, column)) for column in zip(heads, *cells, strict=True)]
    wraps = [k for k, head in enumerate(heads) if head in fold]
    widths = _fitted(widths, wraps, out.width - len(_GAP) * (len(heads) - 1))
    to_right = [head in right for head in heads]
    out.print(Text(f"\n{title}", style="bold"))
    for line in _lines(out, heads, widths, to_right):
        out.print(Text(line, style="underline"), soft_wrap=True)
    lines: list[str] = []
    for row in cells:
        lines += _lines(out, row, widths, to_right)
    out.file.write("".join(f"{line}\n" for line in lines))  # printed, each line would be laid out once more


def _length(text: str) -> int:
    return len(text) if text.isascii() else cell_len(text)


def _fitted(widths: Sequence[int], wraps: Collection[int], room: int) -> list[int]:
    """Widths that fit into the room, the widest of those that may be cut being cut first."""
    fitted = list(widths)
    while sum(fitted) > room:
        widest = max(wraps, key=fitted.__getitem__, default=None)
        if widest is None or fitted[widest] <= _NARROWEST:
            break
        fitted[widest] -= 1
    return fitted


def _lines(out: Console, row: Sequence[str], widths: Sequence[int], to_right: Sequence[bool]) -> Iterable[str]:
    parts = [
        [cell] if _length(cell) <= width else [line.plain for line in Text(cell).wrap(out, width, overflow="fold")]
        for cell, width in zip(row, widths, strict=True)
    ]
    height = max(map(len, parts))
    for k in range(height):
        yield _line([part[k] if k < len(part) else "" for part in parts], widths, to_right)


def _line(cells: Sequence[str], widths: Sequence[int], to_right: Sequence[bool]) -> str:
    padded = []
    for cell, width, at_right in zip(cells, widths, to_right, strict=True):
        blank = " " * (width - _length(cell))
        padded.append(blank + cell if at_right else cell + blank)
    return _GAP.join(padded).rstrip()


def show_list(
    scenarios: Iterable[Listed],
    drives: Iterable[ListedCase],
    components: Mapping[str, str],
    algorithms: Mapping[str, str],
) -> None:
    """What there is: scenarios with their presets; the others with what they are."""
    out = open_console()
    say(out, "Scenarios (orchestrate run NAME)", "bold")
    for scenario in scenarios:
        say(out, f"  {scenario.name}: {scenario.title}")
        for preset, what in scenario.presets.items():
            say(out, f"      --preset {preset}" + (f": {what}" if what else ""), "dim")
    say(out, "Driving (orchestrate drive NAME)", "bold")
    for case in drives:
        say(out, f"  {case.name}: {case.title}")
    say(out, "Components (orchestrate describe NAME)", "bold")
    for name, what in components.items():
        say(out, f"  {name}: {what}")
    say(out, "Master algorithms (orchestrate run SCENARIO --algorithm NAME)", "bold")
    for name, what in algorithms.items():
        say(out, f"  {name}: {what}")
