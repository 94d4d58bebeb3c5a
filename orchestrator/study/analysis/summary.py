"""What a study says: how many runs keep each requirement, by what margin, and which is the worst."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..design import Plan
from .intervals import UNKNOWN, Estimate, mean, numbers, proportion, quantile

if TYPE_CHECKING:
    import pandas as pd

SHARES = (0.05, 0.5, 0.95)
"""The quantiles that are told."""


@dataclass(frozen=True)
class Spread:
    """How a metric or a margin is spread over the runs.

    Attributes:
        name: of the metric or requirement. count: of the runs that have a value, an infinite one as well.
        missing: of those that have none. mean: unknown where a value is infinite.
        sd: standard deviation. quantiles: at `SHARES`.
        least, largest: the values at the ends. least_run, largest_run: the runs that have them; -1 without runs.
    """

    name: str
    count: int
    missing: int
    mean: Estimate
    sd: float
    quantiles: tuple[Estimate, ...]
    least: float
    least_run: int
    largest: float
    largest_run: int


@dataclass(frozen=True)
class Kept:
    """How often a requirement holds.

    Attributes:
        name: of the requirement. passed, failed: how many runs. unjudged: runs without either verdict.
        rate: of passes among runs that pass or fail.
        margin: how the margins are spread; their least is the worst run's.
        failing: the first runs that fail, at most ten.
    """

    name: str
    passed: int
    failed: int
    unjudged: int
    rate: Estimate
    margin: Spread
    failing: tuple[int, ...]


@dataclass(frozen=True)
class Summary:
    """What is said of a study.

    Attributes:
        runs: how many there are. statuses: how many of each status. level: of confidence.
        requirements, metrics: in their order in the table.
        broken: the first runs that failed or were refused, at most ten, with their errors.
        note: what the intervals stand on.
    """

    runs: int
    statuses: dict[str, int]
    level: float
    requirements: tuple[Kept, ...]
    metrics: tuple[Spread, ...]
    broken: tuple[tuple[int, str], ...]
    note: str


def summarize(frame: pd.DataFrame, plan: Plan, *, level: float = 0.95) -> Summary:
    """Summarize a study.

    Args:
        frame: a row a run, columns as `runs.parquet` has them.
        plan: of the study; a grid is no sample of anything, and gets no intervals.
        level: of confidence.
    """
    runs = frame["run"].to_numpy()
    factor, note = _independence(plan, level)
    columns = [str(name) for name in frame.columns]
    kept = []
    for name in (column.removeprefix("verdict.") for column in columns if column.startswith("verdict.")):
        verdicts = frame[f"verdict.{name}"].astype(object).to_numpy()
        passed, failed = int((verdicts == "pass").sum()), int((verdicts == "fail").sum())
        judged = passed + failed
        margins = numbers(frame[f"margin.{name}"]) if f"margin.{name}" in columns else np.full(len(runs), np.nan)
        kept.append(
            Kept(
                name,
                passed,
                failed,
                len(runs) - judged,
                proportion(passed, judged, judged * factor, level),
                _spread(name, margins, runs, factor, level),
                tuple(map(int, runs[verdicts == "fail"][:10])),
            )
        )
    metrics = (name for name in columns if name.startswith("metric."))
    broken = frame[frame["status"].isin(["failed", "refused"])]
    return Summary(
        len(runs),
        dict(Counter(map(str, frame["status"]))),
        level,
        tuple(kept),
        tuple(_spread(name.removeprefix("metric."), numbers(frame[name]), runs, factor, level) for name in metrics),
        tuple((int(run), str(error)) for run, error in zip(broken["run"][:10], broken["error"][:10], strict=True)),
        note,
    )


def _independence(plan: Plan, level: float) -> tuple[float, str]:
    """How many independent runs one counts for, and what to say of it."""
    if plan.design == "grid":
        return 0.0, "A grid is no sample: shares are those of its points, and have no intervals."
    between = f"Brackets are {level:.0%} confidence intervals"
    if plan.design == "saltelli":
        rows = len(plan.dimensions) + 2
        return 2 / rows, f"{between}, in which each block of {rows} runs counts for 2 that are independent."
    even = "" if plan.design == "random" else f"; those of independent runs, to which '{plan.design}' is no worse"
    return 1.0, f"{between}{even}."


def _spread(name: str, values: NDArray[np.float64], runs: NDArray[np.int64], factor: float, level: float) -> Spread:
    there = ~np.isnan(values)
    count, missing = int(there.sum()), int((~there).sum())
    if not count:
        nothing = tuple(UNKNOWN for _ in SHARES)
        return Spread(name, 0, missing, UNKNOWN, math.nan, nothing, math.nan, -1, math.nan, -1)
    values, runs = values[there], runs[there]
    order = np.argsort(values, kind="stable")
    ordered, independent = values[order], count * factor
    finite = bool(np.isfinite(values).all())
    return Spread(
        name,
        count,
        missing,
        mean(values, independent, level) if finite else UNKNOWN,
        float(values.std(ddof=1)) if finite and count > 1 else math.nan,
        tuple(quantile(ordered, share, independent, level) for share in SHARES),
        float(ordered[0]),
        int(runs[order[0]]),
        float(ordered[-1]),
        int(runs[np.argmax(values)]),
    )
