"""How every picture looks: colours, dashes, and the page of panels above one another.

matplotlib is imported where it is used: importing it costs more than most commands take.
"""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import world

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito 2008, told apart by colour-blind readers too; without their yellow, too pale for a line.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
DASHES = ("-", "--", ":", "-.")
_STYLE: Any = {  # matplotlib's own type for this is a list of every key it knows
    "font.size": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "xtick.color": "#555555",
    "ytick.color": "#555555",
    "xtick.labelcolor": "black",
    "ytick.labelcolor": "black",
    "svg.hashsalt": "railcosim",  # or the same picture would be another file each time
}
_NAMELESS: Any = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
DPI = 100.0
_LEGEND_LETTERS = 24
"""How long a line of a legend may be: what it takes of the page, the panel lacks."""


@contextmanager
def page(
    title: str,
    panels: int,
    path: Path,
    *,
    size: tuple[float, float],
    columns: int = 1,
    title_size: float = 11.5,
    share_x: bool = False,
    dpi: float | None = None,
) -> Iterator[list[Axes]]:
    """The axes of a figure to draw into, which is written at the end in the format of the file's ending.

    Args:
        title: above all panels.
        panels: how many axes there are.
        path: the file.
        size: width and height in inches.
        columns: how many of them stand beside one another, in rows from the top.
        title_size: in points.
        share_x: whether all panels have the x axis of the last.
        dpi: dots per inch, `DPI` by default; of a vector format it only matters to what it shows as an image.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size, dpi=dpi or DPI, layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(wrapped(title, size[0], title_size), x=0.01, ha="left", fontsize=title_size, fontweight="bold")
        made = figure.subplots(-(-panels // columns), columns, sharex=share_x, squeeze=False).ravel()
        for ax in made[panels:]:
            ax.remove()
        yield list(made[:panels])
        layout: Any = figure.get_layout_engine()
        if path.suffix == ".png":  # laid out now, or it would be drawn twice: once to lay it out
            layout.execute(figure)
            figure.set_layout_engine(None)  # "none" would leave a place for one, for whose sake it is drawn twice
        drawn = io.BytesIO()  # of a figure that cannot be drawn, no file is begun
        figure.savefig(drawn, format=path.suffix[1:], metadata=_NAMELESS[path.suffix])
        world.write_bytes(path, drawn.getvalue())


def wrapped(text: str, width: float, size: float = _STYLE["axes.titlesize"]) -> str:
    """A title in lines no longer than a width in inches; its size is in points. A formula is not torn apart."""
    letters = int(72 * width / (0.6 * size))
    return "\n".join(
        line for part in text.splitlines() for line in ([part] if "$" in part else textwrap.wrap(part, letters))
    )


def colour(k: int, count: int) -> Any:
    """The colour of one of `count` curves: of a palette, or along a scale where there are more than it has."""
    if count <= len(COLOURS):
        return COLOURS[k]
    import matplotlib as mpl

    return mpl.colormaps["viridis"](0.92 * k / (count - 1))


def colour_and_dashes(k: int) -> dict[str, Any]:
    """One of many lines that have nothing in common: told apart by colour first."""
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k // len(COLOURS) % 4]}


def room(panels: int, height: float) -> int:
    """How many lines a legend may have beside one of the panels of a page of that height in inches."""
    return max(2, int((height / panels - (0.9 if panels == 1 else 0.35)) / 0.19))


def legend(ax: Axes, handles: Sequence[Any] = (), **more: Any) -> None:
    """A legend beside the axes, where it hides no data: long names in lines, in columns where the panel is not as high.

    Args:
        ax: the axes.
        handles: what it names; all that is drawn there by default.
        **more: what matplotlib is to know of it.
    """
    canvas: Any = ax.figure
    handles = handles or ax.get_legend_handles_labels()[0]
    labels = [_folded(str(handle.get_label())) for handle in handles]
    lines = sum(1 + label.count("\n") for label in labels)
    columns = 1 + (lines - 1) // room(len(canvas.axes), canvas.get_figheight())
    place: Any = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.02), "borderaxespad": 0.0, "ncols": columns}
    ax.legend(handles, labels, **place, **more)


def _folded(label: str) -> str:
    """A name in lines, broken after a sign that parts words."""
    if "$" in label:
        return label
    lines = [""]
    for part in re.split(r"(?<=[ ,=_:/])", label):
        if lines[-1] and len(lines[-1]) + len(part.rstrip()) > _LEGEND_LETTERS:
            lines.append("")
        lines[-1] += part
    return "\n".join(line.rstrip() for line in lines)
