"""How every picture looks: colours, dashes, and the page of panels above one another.

matplotlib is imported where it is used: importing it costs more than most commands take.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator
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


@contextmanager
def page(
    title: str,
    panels: int,
    path: Path,
    *,
    size: tuple[float, float],
    title_size: float = 11.5,
    share_x: bool = False,
    dpi: float | None = None,
) -> Iterator[list[Axes]]:
    """The axes of a figure to draw into, which is written at the end in the format of the file's ending.

    Args:
        title: above all panels.
        panels: how many axes stand above one another.
        path: the file.
        size: width and height in inches.
        title_size: in points.
        share_x: whether all panels have the x axis of the last.
        dpi: dots per inch, `DPI` by default; of a vector format it only matters to what it shows as an image.
    """
    import matplotlib as mpl  # noqa: PLC0415
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size, dpi=dpi or DPI, layout="constrained")
        FigureCanvasAgg(figure)
        letters = int(72 * size[0] / (0.6 * title_size))
        lines = [line for part in title.splitlines() for line in textwrap.wrap(part, letters)]
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=title_size, fontweight="bold")
        yield list(figure.subplots(panels, 1, sharex=share_x, squeeze=False)[:, 0])
        drawn = io.BytesIO()  # of a figure that cannot be drawn, no file is begun
        figure.savefig(drawn, format=path.suffix[1:], metadata=_NAMELESS[path.suffix])
        world.write_bytes(path, drawn.getvalue())


def colour(k: int, count: int) -> Any:
    """The colour of one of `count` curves: of a palette, or along a scale where there are more than it has."""
    if count <= len(COLOURS):
        return COLOURS[k]
    import matplotlib as mpl  # noqa: PLC0415

    return mpl.colormaps["viridis"](0.92 * k / (count - 1))


def colour_and_dashes(k: int) -> dict[str, Any]:
    """One of many lines that have nothing in common: told apart by colour first."""
    return {"color": COLOURS[k % len(COLOURS)], "linestyle": DASHES[k // len(COLOURS) % 4]}


def room(panels: int, height: float) -> int:
    """How many lines a legend may have beside one of the panels of a page of that height in inches."""
    return max(2, int((height / panels - (0.9 if panels == 1 else 0.35)) / 0.19))


def legend(ax: Axes, count: int, **more: Any) -> None:
    """A legend of `count` lines beside the axes, where it hides no data; in columns where the panel is not as high."""
    canvas: Any = ax.figure
    lines = room(len(canvas.axes), canvas.get_figheight())
    columns = 1 + (count - 1) // lines
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0.0, ncols=columns, **more)
