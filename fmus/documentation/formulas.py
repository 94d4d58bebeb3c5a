r"""Formulas as inline SVG, so that a page shows them in any browser, offline and without scripts.

matplotlib's mathtext lays them out: the part of LaTeX that it knows (no environments such as ``cases``). Letters become
outlines, each kept once per page: no font has to be there where the page is read, and the same formula gives the same
bytes.
"""

from __future__ import annotations

import functools
import html
from typing import Any

from ...components.errors import ComponentError

_SIZE = 15.0
"""Font size in px."""
_PIECES = {1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}
"""matplotlib's codes of a path's pieces, in SVG's letters."""


class Formulas:
    """The formulas of one page."""

    def __init__(self) -> None:
        self._outlines: dict[str, str] = {}

    def line(self, text: str) -> str:
        """A line of text with formulas between dollar signs, as HTML.

        Raises:
            ComponentError: a formula that cannot be read.
        """
        parts = text.split("$")
        if len(parts) % 2 == 0:
            raise ComponentError(f"the equation {text!r} opens a formula with $ and does not close it")
        return "".join(self._svg(part) if k % 2 else html.escape(part) for k, part in enumerate(parts))

    def outlines(self) -> str:
        """The letters that the lines so far refer to; it stands anywhere on their page."""
        if not self._outlines:
            return ""
        letters = "".join(f'<path id="letter{k}" d="{d}"/>' for k, d in enumerate(self._outlines.values()))
        return f'<svg width="0" height="0" style="position:absolute" aria-hidden="true"><defs>{letters}</defs></svg>'

    def _svg(self, latex: str) -> str:
        letters, outlines, bars, box, (width, height, depth) = _laid_out(latex)
        places = list(self._outlines)
        drawn = []
        for name, x, y, size in letters:
            if name not in self._outlines:
                self._outlines[name] = outlines[name]
                places.append(name)
            place = f"translate({_number(x)} {_number(-y)})" + (f"scale({_number(size)})" if size != 1.0 else "")
            drawn.append(f'<use href="#letter{places.index(name)}" transform="{place}"/>')
        drawn += (f'<path d="{bar}"/>' for bar in bars)
        return (
            f'<svg role="img" aria-label="{html.escape(latex)}" viewBox="{box}" width="{_number(width)}" '
            f'height="{_number(height)}" style="vertical-align:{_number(-depth)}px" fill="currentColor">'
            f"{''.join(drawn)}</svg>"
        )


@functools.cache
def _laid_out(latex: str) -> tuple[list[Any], dict[str, str], list[str], str, tuple[float, ...]]:
    """Letters with their places, outlines by letter, bars, the box, and width, height and depth; the same each time."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font, text = FontProperties(math_fontfamily="cm"), TextToPath()
    try:
        letters, outlines, bars = text.get_glyphs_mathtext(font, f"${latex}$")
        extent = text.get_text_width_height_descent(f"${latex}$", font, ismath=True)
    except ValueError as error:
        reason = str(error).strip().splitlines()[-1]
        raise ComponentError(f"the formula {latex!r} cannot be read: {reason}") from None
    # The layout is in units of which a font has FONT_SCALE to its size, the extent in points of the font's size.
    width, height, depth = (float(x) / font.get_size_in_points() * _SIZE for x in extent)
    unit = text.FONT_SCALE / _SIZE
    box = " ".join(_number(x * unit) for x in (0.0, depth - height, width, height))
    drawn = {name: _path(*outline) for name, outline in outlines.items()}
    return list(letters), drawn, [_path(*bar) for bar in bars], box, (width, height, depth)


def _path(points: Any, codes: Any) -> str:
    from matplotlib.path import Path

    pieces = []
    for flat, code in Path(points, codes).iter_segments(simplify=False):
        numbers = (f"{round(-v if k % 2 else v)}" for k, v in enumerate(flat.tolist()))
        pieces.append(_PIECES[int(code)] + ("" if int(code) == 79 else " ".join(numbers)))
    return "".join(pieces)


def _number(value: float) -> str:
    return f"{round(value, 2):g}"
