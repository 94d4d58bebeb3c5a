"""Pictures of recorded results against a reference: those signals that depart most, in their tubes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..evaluation import without_blanks
from ..figures import COLOURS, DASHES, bracketed, file_name, legend, page
from .deviations import Deviation, RecordedComparison, Tested
from .tubes import envelope

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_PANELS = 6
_NEAR = 0.02
"""Which part of the duration is shown to either side of where a signal departs most."""
_POINTS = 2000
"""At how many points in time a tube is drawn."""


def draw_tubes(comparison: RecordedComparison, directory: Path) -> list[Path]:
    """Draw of each of the results the signals that depart most from the reference.

    Args:
        comparison: what was compared.
        directory: it exists.

    Returns:
        The files.
    """
    paths: list[Path] = []
    for one in comparison.tested:
        title = f"{Path(one.name).name} against {Path(comparison.reference).name}"
        worst = [row for row in one.deviations if not row.inside] or one.deviations
        shown = worst[:_PANELS]
        path = directory / file_name("", {"title": title}, paths)
        size = (11.0, 4.0 if len(shown) == 1 else 0.7 + 2.3 * len(shown))
        with page(title, 2 * len(shown), path, size=size, columns=2) as axes:
            for whole, near, row in zip(axes[::2], axes[1::2], shown, strict=True):
                _panels(whole, near, row, one, comparison)
            for ax in axes[-2:]:
                ax.set_xlabel("time [s]")
            legend(axes[1])
        paths.append(path)
    return paths


def _panels(whole: Axes, near: Axes, row: Deviation, one: Tested, comparison: RecordedComparison) -> None:
    """A signal over all its time, and from near where it departs most."""
    time, told, width = comparison.results.time, row.departure, row.tube.width
    begin, end = float(time[0]), float(time[-1])
    about = max(_NEAR * (end - begin), 4 * width)
    _draw(whole, row, one, comparison, (begin, end))
    _draw(near, row, one, comparison, (max(begin, told.at - about), min(end, told.at + about)))
    verdict = "inside" if row.inside else f"{told.outside} of {told.points} points outside"
    whole.set_title(f"{row.signal}: {verdict}".replace("$", r"\$"))
    whole.set_ylabel(bracketed(row.unit))
    near.set_title(f"about {told.at:.6g} s")
    near.plot([told.at], [told.value], "o", color=COLOURS[6], markersize=6, fillstyle="none", label="furthest away")


def _draw(ax: Axes, row: Deviation, one: Tested, comparison: RecordedComparison, within: tuple[float, float]) -> None:
    reference, height = comparison.results, row.tube.height
    at = np.linspace(*within, _POINTS)
    known = without_blanks(reference.time, reference[row.signal].astype(float))
    least, greatest = envelope(*known, at, row.tube.width)
    ax.fill_between(at, least - height, greatest + height, color="#cfe3f1", linewidth=0, label="tube")
    for k, (name, results) in enumerate(((comparison.reference, reference), (one.name, one.results))):
        time, values = without_blanks(results.time, results[row.signal])
        first, last = np.add(np.searchsorted(time, within), (-1, 1))  # a line to the next point outside
        part = slice(max(0, first), last)
        ax.plot(time[part], values[part], color=COLOURS[k], linestyle=DASHES[k], label=Path(name).name)
    ax.set_xlim(*within)
