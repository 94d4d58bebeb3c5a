"""Lines beside the results, and what stands in them; what came from outside is made harmless here, and only here."""

from __future__ import annotations

import logging
import re
import sys
import unicodedata
from collections.abc import Iterable

from ..problems import Problem


def printable(text: str) -> str:
    """A text in which nothing steers a terminal: letters that colour, erase, retitle or turn it round are named."""
    if text.isprintable():
        return text
    return "".join(letter if _is_harmless(letter) else letter.encode("unicode_escape").decode() for letter in text)


def _is_harmless(letter: str) -> bool:
    return letter.isprintable() or letter in "\n\t" or unicodedata.category(letter) == "Zs"


def tell(line: str) -> None:
    """Print a line beside the results, at once."""
    print(printable(line), file=sys.stderr, flush=True)


class Log(logging.Handler):
    """Warnings of all rooms, as lines beside the results."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one."""
        tell(f"{record.levelname.lower()}: {record.getMessage()}")


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


def counted(count: int, what: str) -> str:
    """``1 figure``, ``2 figures``."""
    return f"{count} {what}{'s' * (count != 1)}"


def and_figures(count: int) -> str:
    """What a list of files ends with."""
    return f", {counted(count, 'figure')}" if count else ""
