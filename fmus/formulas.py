r"""Formulas as inline SVG, so that a page shows them in any browser, offline and without scripts.

matplotlib's mathtext lays them out: the part of LaTeX that it knows (no environments such as ``cases``). Letters become
outlines: no font has to be there where the page is read, and the same formula gives the same bytes.
"""

from __future__ import annotations

import html

from ..components.component import ComponentError

_SIZE = 11.0
"""Font size in px."""
_PIECES = {0: "Z", 1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}
"""matplotlib's codes of a path's pieces, in SVG's letters."""


def rendered(line: str) -> str:
    """A line of text with formulas between dollar signs as HTML.

    Raises:
        ComponentError: a formula that cannot be read.
    """
    parts = line.split("$")
    if len(parts) % 2 == 0:
        raise ComponentError(f"the equation {line!r} opens a formula with $ and does not close it")
    return "".join(_svg(part) if k % 2 else html.escape(part) for k, part in enumerate(parts))


def _svg(latex: str) -> str:
    from matplotlib.font_manager import FontProperties  # noqa: PLC0415 (slow to import, and not needed on a cache hit)
    from matplotlib.textpath import TextPath, TextToPath  # noqa: PLC0415

    font = FontProperties(size=_SIZE, math_fontfamily="cm")
    try:
        path = TextPath((0, 0), f"${latex}$", prop=font)
        width, height, depth = TextToPath().get_text_width_height_descent(f"${latex}$", font, ismath=True)
    except ValueError as error:
        raise ComponentError(f"the formula {latex!r} cannot be read: {str(error).strip().splitlines()[-1]}") from None
    drawn = "".join(_PIECES[int(code)] + _points(points) for points, code in path.iter_segments(simplify=False))
    # 1.35: Computer Modern is drawn small beside a browser's sans serif of the same size.
    scale = 1.35
    box = f"0 {-(height - depth):.1f} {width:.1f} {height:.1f}"
    return (
        f'<svg role="img" aria-label="{html.escape(latex)}" viewBox="{box}" width="{width * scale:.1f}" '
        f'height="{height * scale:.1f}" style="vertical-align:{-depth * scale:.1f}px">'
        f'<path fill="currentColor" d="{drawn}"/></svg>'
    )


def _points(flat: object) -> str:
    numbers = [float(x) for x in flat]  # type: ignore[attr-defined]
    return " ".join(f"{-y if k % 2 else y:.2f}".rstrip("0").rstrip(".") or "0" for k, y in enumerate(numbers))
