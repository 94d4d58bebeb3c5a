"""Which pictures a study has, and their files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....figures import FORMATS, file_name, legend, page
from ...design import Plan
from ..influence import outputs_of, sensitivity
from ..intervals import numbers
from ..summary import Summary, summarize
from .axes import Axis
from .bands import draw_bands
from .bars import draw_influences, draw_margins, height_of
from .maps import draw_line, draw_values, draw_verdicts
from .scatter import columns_of, draw_matrix

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MOST_PANELS = 12
_MOST_COLUMNS = 5
_MOST_IN_MATRIX = 5000
"""Runs that a scatter matrix shows: of more, all its panels are full."""
_MOST_SIGNALS = 8
_MOST_INFLUENCED = 4
_WIDTH = 8.5


def draw_study(
    frame: pd.DataFrame,
    plan: Plan,
    directory: Path,
    *,
    title: str = "",
    series: pd.DataFrame | None = None,
    units: Mapping[str, str] | None = None,
    format: str = FORMATS[0],
    dpi: float | None = None,
) -> list[Path]:
    """Draw all pictures of a study into a directory.

    Args:
        frame: a row a run, columns as `runs.parquet` has them.
        plan: of the study.
        directory: it exists.
        title: of the scenario.
        series: what was recorded, as `series.parquet` has it; None where nothing was.
        units: of columns of both tables, by name.
        format: one of `figures.FORMATS`.
        dpi: dots per inch.

    Returns:
        The files: maps of requirements, margins, values, scatter matrix, influences, bands; what there is.
    """
    study = _Study(frame, plan, dict(units or {}), _Pages(directory, title, format, dpi))
    study.draw_maps()
    study.draw_margins()
    study.draw_values()
    study.draw_scatter()
    study.draw_influences()
    if series is not None and len(series):
        study.draw_bands(series)
    return study.pages.paths


@dataclass
class _Pages:
    """Where pictures go, and what they have in common; `paths` are those that were begun."""

    directory: Path
    title: str
    format: str
    dpi: float | None
    paths: list[Path] = field(default_factory=list)

    def __call__(self, what: str, panels: int, height: float, columns: int = 1) -> AbstractContextManager[list[Axes]]:
        path = self.directory / file_name("", {"title": what.partition(";")[0], "format": self.format}, self.paths)
        self.paths.append(path)
        heading = f"{self.title}\n{what}" if self.title else what
        return page(heading, panels, path, size=(_WIDTH, height), columns=columns, title_size=10.5, dpi=self.dpi)


class _Study:
    """A study on its way to its pictures."""

    def __init__(self, frame: pd.DataFrame, plan: Plan, units: dict[str, str], pages: _Pages) -> None:
        self.frame, self.plan, self.units, self.pages = frame, plan, units, pages
        varied = [one for one in plan.dimensions if one.law or len(one.values) > 1]
        self.axes = {one.name: Axis(frame, one) for one in varied}
        self.outputs = outputs_of(frame)
        self.ranks: dict[str, list[Axis]] = {}

    @cached_property
    def summary(self) -> Summary:
        return summarize(self.frame, self.plan)

    def verdicts(self, name: str) -> NDArray[Any]:
        found: NDArray[Any] = self.frame[f"verdict.{name}"].astype(object).to_numpy()
        return found

    def overall(self) -> NDArray[Any]:
        """Whether a run keeps all requirements; it fails where one does."""
        found = np.full(len(self.frame), "", dtype=object)
        names = [kept.name for kept in self.summary.requirements]
        for word, holds in (("pass", np.all), ("fail", np.any)):
            if names:
                found[holds([self.verdicts(name) == word for name in names], axis=0)] = word
        return found if names else np.where(self.frame["status"] == "completed", "pass", "")

    def strongest(self, output: str) -> list[Axis]:
        """The parameters in the order of their influence on an output; of two, in the order they were given."""
        if len(self.axes) < 3 or output not in self.outputs:
            return list(self.axes.values())
        if output not in self.ranks:
            found = sensitivity(self.frame, self.plan, output, sure=False).influences
            self.ranks[output] = [self.axes[one.name] for one in found if one.name in self.axes]
        return self.ranks[output]

    def label(self, column: str) -> str:
        group, _, name = column.partition(".") if column.startswith(("metric.", "margin.")) else ("", "", column)
        name = f"margin of {name}" if group == "margin" else name
        unit = self.units.get(column, "")
        return f"{name} [{unit}]" if unit else name

    def others(self, used: int) -> str:
        left = len(self.axes) - used
        return f"; {left} other{'s' * (left > 1)} var{'y' if left > 1 else 'ies'} as well" if left > 0 else ""

    def draw_maps(self) -> None:
        """Where each requirement holds: over the two parameters there are, else over the strongest two."""
        for kept in self.summary.requirements if len(self.axes) > 1 else ():
            if not kept.passed + kept.failed:
                continue
            x, y, *_ = self.strongest(f"margin.{kept.name}")
            with self.pages(f"Where {kept.name} holds{self.others(2)}", 1, 5.0) as (ax,):
                draw_verdicts(ax, x, y, self.verdicts(kept.name))

    def draw_margins(self) -> None:
        kept = [one for one in self.summary.requirements if np.isfinite(self._margins(one.name)).any()][:_MOST_PANELS]
        if not kept:
            return
        columns = 2 if len(kept) > 4 else 1
        rows = -(-len(kept) // columns)
        with self.pages("Margins of requirements", len(kept), 1.0 + 2.1 * rows, columns) as axes:
            for ax, one in zip(axes, kept, strict=True):
                unit = self.units.get(f"margin.{one.name}", "")
                draw_margins(ax, one, self._margins(one.name), label=f"margin [{unit}]" if unit else "margin")

    def _margins(self, name: str) -> NDArray[np.float64]:
        column = f"margin.{name}"
        return numbers(self.frame[column]) if column in self.frame else np.full(len(self.frame), np.nan)

    def draw_values(self) -> None:
        """What came out over two parameters, or over the only one."""
        shown = self.outputs[:_MOST_PANELS] if self.axes else []
        if not shown:
            return
        columns = 1 if len(shown) == 1 else 2
        height = 0.8 + (5.0 if columns == 1 else 3.3) * -(-len(shown) // columns)
        with self.pages(f"What came out{self.others(2)}", len(shown), height, columns) as axes:
            for ax, output in zip(axes, shown, strict=True):
                values, is_margin = numbers(self.frame[output]), output.startswith("margin.")
                name = output.partition(".")[2]
                label = self.label(output)
                if len(self.axes) > 1:
                    x, y, *_ = self.strongest(output)
                    draw_values(ax, x, y, values, label=label, is_margin=is_margin)
                else:
                    (x,) = self.axes.values()
                    known = self.verdicts(name) if is_margin else None
                    draw_line(ax, x, values, known, label=label)

    def draw_scatter(self) -> None:
        if self.plan.design == "grid" or not self.axes or not self.outputs:
            return
        output = self.outputs[0]
        axes = self.strongest(output)[:_MOST_COLUMNS]
        few = self.frame[:_MOST_IN_MATRIX]
        columns = columns_of([Axis(few, one.dimension) for one in axes], [(self.label(output), numbers(few[output]))])
        count, runs = len(columns), len(self.frame)
        size = max(4.5, min(_WIDTH, 1.75 * count + 0.6))
        which = f"; the first {_MOST_IN_MATRIX} of {runs} runs" if runs > _MOST_IN_MATRIX else ""
        heading = f"Every parameter with every other{self.others(len(axes))}{which}"
        with self.pages(heading, count**2, size, count) as panels:
            draw_matrix(panels, columns, self.overall()[:_MOST_IN_MATRIX])

    def draw_influences(self) -> None:
        made = (sensitivity(self.frame, self.plan, output) for output in self.outputs[:_MOST_INFLUENCED])
        found = [one for one in made if len(one.influences) > 1 and one.influences[0].strength]
        if found:
            method = found[0].method
            how = f"shares of the variance, by {method}" if method else "shares of the variance of ranks"
            with self.pages(f"What matters; {how}", len(found), height_of(found)) as axes:
                for ax, one in zip(axes, found, strict=True):
                    draw_influences(ax, one, label=self.label(one.output))
                legend(axes[0], axes[0].get_legend_handles_labels()[0][::-1])

    def draw_bands(self, series: pd.DataFrame) -> None:
        signals = [str(name) for name in series.columns if name not in ("run", "time")][:_MOST_SIGNALS]
        requirements: Sequence[Any] = self.summary.requirements
        worst = min(
            (one.margin.least_run for one in requirements if one.failed and one.margin.count),
            key=lambda run: -sum(one.margin.least_run == run for one in requirements),
            default=None,
        )
        with self.pages("Over time", len(signals), 1.0 + 2.3 * len(signals)) as axes:
            for ax, signal in zip(axes, signals, strict=True):
                draw_bands(ax, series, signal, label=self.label(signal), worst=worst)
            axes[-1].set_xlabel("time [s]")
            legend(axes[0])
