"""Words as bash parts them: at ``=`` and ``:`` too, which stand inside a word of ours."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO

_BREAKS = "=:"


@contextmanager
def completing_bash(variable: str) -> Iterator[None]:
    """Where bash asks for completions, let it be asked for whole words, and answer with the part that bash replaces.

    Args:
        variable: of the environment, which says that a shell asks.
    """
    if os.environ.get(variable) != "complete_bash":
        yield
        return
    text = os.environ.get("COMP_WORDS", "")
    parts = text.split("\n" if "\n" in text else " ")
    place = int(os.environ.get("COMP_CWORD", "0"))
    whole, at, head = _joined(parts, place)
    os.environ.update(COMP_WORDS="\n".join(whole), COMP_CWORD=str(at))
    said = StringIO()
    try:
        with redirect_stdout(said):
            yield
    finally:
        for line in said.getvalue().splitlines():
            print(line.removeprefix(head), file=sys.stdout)


def _joined(parts: list[str], place: int) -> tuple[list[str], int, str]:
    """The words as they were typed, which of them is being typed, and what bash takes for other words of it."""
    words: list[str] = []
    at, head, glued = 0, "", False
    for k, part in enumerate(parts):
        is_break = bool(part) and not part.strip(_BREAKS) and k > 0
        if (is_break or glued) and words:
            if k == place:
                head = words[-1] + part * is_break
            words[-1] += part
        else:
            words.append(part)
            head = "" if k == place else head
        glued = is_break
        if k == place:
            at = len(words) - 1
    return words, at, head
