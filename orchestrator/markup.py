"""Text as HTML. What comes from a scenario or an FMU is escaped here: markup in a name is shown and does nothing."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def escaped(text: object) -> str:
    """Text that came from outside, as markup that shows it."""
    return html.escape(str(text), quote=True)


def number(value: object) -> str:
    """A number as a table shows it."""
    return "–" if value is None else f"{value:.6g}" if isinstance(value, float) else escaped(value)


MOST_ROWS = 30
"""Of a table in a notebook, which is to be small."""


def table(
    heads: Sequence[str], rows: Iterable[Sequence[str]], caption: str, kind: str = "", most: int | None = None
) -> str:
    """A table.

    Args:
        heads: of the columns, as text.
        rows: of cells, which are markup.
        caption: above it, as text.
        kind: its class, for scripts and style.
        most: how many rows are shown; of more, the caption tells how many there are. All by default.
    """
    every = list(rows)
    if most is not None and len(every) > most:
        every, caption = every[:most], f"{caption}, the first {most} of {len(every)}"
    head = "".join(f'<th scope="col">{escaped(name)}</th>' for name in heads)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in every)
    return (
        f'<table class="{kind}"><caption>{escaped(caption)}</caption><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table>"
    )
