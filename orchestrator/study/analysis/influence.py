"""Which parameters matter: Sobol indices by SALib, and rank correlation and regression as cheap screening.

First-order and total indices with their intervals take a design of their own (`saltelli`). Of every other sample the
first-order indices are estimated from the runs as they are, at no further cost: by RBD-FAST (Tarantola, Gatelli and
Mara 2006; Plischke 2010) for what has a distribution, by the means over runs with the same value for lists and grids,
whose steps ten harmonics do not follow. Total indices cannot be had from such runs, and are not guessed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..design import Dimension, Plan
from .intervals import UNKNOWN, Estimate, numbers

if TYPE_CHECKING:
    import pandas as pd

FEWEST = 100
"""Runs, below which RBD-FAST with its ten harmonics says nothing."""
MOST = 10_000
"""Runs that RBD-FAST takes: with these it is as sharp as anybody reads it, and it takes a second."""
_RESAMPLES = 100
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Influence:
    """What one parameter does to one output.

    Attributes:
        name: of the parameter.
        correlation: Spearman's rank correlation. regression: the standardised coefficient of a regression of ranks on
            all parameters at once; both unknown for values that have no order.
        first: the share of the output's variance that the parameter makes alone. total: with all it takes part in.
    """

    name: str
    correlation: Estimate = UNKNOWN
    regression: Estimate = UNKNOWN
    first: Estimate = UNKNOWN
    total: Estimate = UNKNOWN

    @property
    def of_ranks(self) -> Estimate:
        """The square of the rank correlation: the share of the ranks' variance that goes up or down with it."""
        value, *ends = self.correlation
        low = 0.0 if self.correlation.low < 0 < self.correlation.high else min(x * x for x in ends)
        return Estimate(value * value, low, max(x * x for x in ends))

    @property
    def strength(self) -> float:
        """What parameters are ordered by: the total index, else the larger of `first` and `of_ranks`; or 0."""
        # A single run that goes astray spoils shares of the variance, but not those of ranks.
        known = [self.total.value] if not math.isnan(self.total.value) else [self.first.value, self.of_ranks.value]
        return max((value for value in known if not math.isnan(value)), default=0.0)


@dataclass(frozen=True)
class Sensitivity:
    """What all parameters do to one output.

    Attributes:
        output: its column, `metric.settling` or `margin.spacing`. runs: how many it stands on.
        method: how the indices were estimated; empty where they were not.
        explained: the share of the ranks' variance that the regression explains: how far the output rises or falls
            with each parameter alone.
        influences: the strongest first.
    """

    output: str
    runs: int
    method: str
    explained: float
    influences: tuple[Influence, ...]


def outputs_of(frame: pd.DataFrame) -> list[str]:
    """The columns of numbers that came out and are not all the same: margins first, then metrics."""
    found = []
    for group in ("margin.", "metric."):
        for name in map(str, frame.columns):
            values = numbers(frame[name]) if name.startswith(group) else np.empty(0)
            values = values[np.isfinite(values)]
            if len(values) and np.ptp(values) > 0:
                found.append(name)
    return found


def sensitivity(frame: pd.DataFrame, plan: Plan, output: str, *, level: float = 0.95, sure: bool = True) -> Sensitivity:
    """What the parameters of a study do to one output.

    Args:
        frame: a row a run, columns as `runs.parquet` has them.
        plan: of the study.
        output: a column, `metric.settling` or `margin.spacing`.
        level: of confidence.
        sure: whether indices get intervals, which take far longer than their values.
    """
    y = numbers(frame[output])
    good = np.isfinite(y)
    x = np.column_stack([codes(frame[one.name], one) for one in plan.dimensions] or [np.empty((len(y), 0))])
    indices, method = _indices(frame, plan, x, y, (level, _RESAMPLES if sure else 2))
    if not sure:
        indices = [(Estimate(first.value), Estimate(total.value)) for first, total in indices]
    x, y = x[good], y[good]
    ordered = [is_ordered(one) for one in plan.dimensions]
    regression, explained = _regression(x, y, ordered, level)
    found = [
        Influence(
            one.name,
            _correlation(x[:, k], y, level) if ordered[k] else UNKNOWN,
            regression[k],
            *(indices[k] if indices else ()),
        )
        for k, one in enumerate(plan.dimensions)
    ]
    found.sort(key=lambda one: -one.strength)
    return Sensitivity(output, len(y), method, explained, tuple(found))


def is_ordered(dimension: Dimension) -> bool:
    """Whether more or less of it means something: numbers, and anything with two values."""
    return dimension.is_numeric or len(dimension.values) == 2


def codes(column: Any, dimension: Dimension) -> Array:
    """The values of a dimension as numbers: texts by their place among its values."""
    if dimension.is_numeric:
        return numbers(column)
    places = {str(value): k for k, value in enumerate(dimension.values)}
    return np.array([places.get(str(value), -1) for value in column], dtype=np.float64)


def _indices(
    frame: pd.DataFrame, plan: Plan, x: Array, y: Array, how: tuple[float, int]
) -> tuple[list[tuple[Estimate, Estimate]], str]:
    """First and total index of each parameter, and how they were estimated; `how`: level, and number of resamples."""
    good = np.isfinite(y)
    width = len(plan.dimensions)
    if not width or not good.any() or np.ptp(y[good]) == 0:
        return [], ""
    if plan.design == "saltelli":
        return _saltelli(frame["run"].to_numpy(), y, width, how)
    x, y = x[good], y[good]
    if plan.design == "grid":
        return [(Estimate(_of_equals(x[:, k], y)), UNKNOWN) for k in range(width)], "means over equal values"
    if len(y) < FEWEST:
        return [], ""
    found = [
        _of_samples(x[:MOST, k], y[:MOST], how) if one.law else _of_lists(x[:, k], y, how)
        for k, one in enumerate(plan.dimensions)
    ]
    fast = "RBD-FAST" if len(y) <= MOST else f"RBD-FAST of the first {MOST} runs"
    methods = dict.fromkeys(fast if one.law else "means over equal values" for one in plan.dimensions)
    return [(one, UNKNOWN) for one in found], ", ".join(methods)


def _of_samples(x: Array, y: Array, how: tuple[float, int]) -> Estimate:
    from SALib.analyze import rbd_fast

    level, resamples = how
    problem = {"num_vars": 1, "names": ["x"]}
    made = rbd_fast.analyze(problem, x[:, None], y, num_resamples=resamples, conf_level=level, seed=1)
    return _around(made["S1"][0], made["S1_conf"][0])


def _of_lists(x: Array, y: Array, how: tuple[float, int]) -> Estimate:
    """The share of the means, less what means of so few runs differ by chance; its interval by a bootstrap."""
    level, resamples = how
    rng = np.random.default_rng(1)
    draws = (rng.integers(len(y), size=len(y)) for _ in range(resamples))
    values = [_corrected(x[draw], y[draw]) for draw in draws]
    half = NormalDist().inv_cdf((1 + level) / 2) * float(np.std(values, ddof=1))
    return _around(_corrected(x, y), half)


def _corrected(x: Array, y: Array) -> float:
    share, freedom = _of_equals(x, y), len(y) - len(np.unique(x))
    return 1 - (1 - share) * (len(y) - 1) / freedom if freedom > 0 else math.nan


def _saltelli(runs: Any, y: Array, width: int, how: tuple[float, int]) -> tuple[list[tuple[Estimate, Estimate]], str]:
    """Indices of the blocks that are whole: one run that failed takes its block along."""
    from SALib.analyze import sobol

    rows = width + 2
    table = np.full((int(runs.max()) // rows + 1) * rows, np.nan)
    table[runs] = y
    blocks = table.reshape(-1, rows)
    whole = blocks[np.isfinite(blocks).all(axis=1)]
    if len(whole) < 2 or np.ptp(whole) == 0:
        return [], ""
    level, resamples = how
    problem = {"num_vars": width, "names": [str(k) for k in range(width)], "bounds": [[0.0, 1.0]] * width}
    y = whole.ravel()
    made = sobol.analyze(problem, y, calc_second_order=False, num_resamples=resamples, conf_level=level, seed=1)
    first = [_around(*pair) for pair in zip(made["S1"], made["S1_conf"], strict=True)]
    total = [_around(*pair) for pair in zip(made["ST"], made["ST_conf"], strict=True)]
    return list(zip(first, total, strict=True)), f"Saltelli, {len(whole)} of {len(blocks)} blocks whole"


def _around(value: float, half: float) -> Estimate:
    return Estimate(float(value), float(value - half), float(value + half))


def _of_equals(x: Array, y: Array) -> float:
    """The variance of the means over all runs with the same value, as a share of all."""
    _, place, counts = np.unique(x, return_inverse=True, return_counts=True)
    means = np.bincount(place, weights=y) / counts
    return float(np.average((means - y.mean()) ** 2, weights=counts) / y.var())


def _correlation(x: Array, y: Array, level: float) -> Estimate:
    """Spearman's rank correlation, with the interval of Bonett and Wright (2000)."""
    if len(y) < 4 or np.ptp(x) == 0 or np.ptp(y) == 0:
        return UNKNOWN
    from scipy import stats

    value = float(np.clip(np.corrcoef(stats.rankdata(x), stats.rankdata(y))[0, 1], -1, 1))
    half = NormalDist().inv_cdf((1 + level) / 2) * math.sqrt((1 + value**2 / 2) / (len(y) - 3))
    centre = math.atanh(max(-1 + 1e-15, min(1 - 1e-15, value)))
    return Estimate(value, math.tanh(centre - half), math.tanh(centre + half))


def _regression(x: Array, y: Array, ordered: list[bool], level: float) -> tuple[list[Estimate], float]:
    """Standardised coefficients of the ranks of the output on those of the parameters, and R squared."""
    found = [UNKNOWN] * len(ordered)
    used = [k for k, has_order in enumerate(ordered) if has_order and len(y) and np.ptp(x[:, k]) > 0]
    freedom = len(y) - len(used) - 1
    if not used or freedom < 1 or np.ptp(y) == 0:
        return found, math.nan
    from scipy import stats

    a = np.column_stack([stats.zscore(stats.rankdata(x[:, k])) for k in used])
    b = stats.zscore(stats.rankdata(y))
    weights, *_ = np.linalg.lstsq(a, b, rcond=None)
    left = float(((b - a @ weights) ** 2).sum())
    spread = np.sqrt(left / freedom * np.diag(np.linalg.pinv(a.T @ a)))
    half = stats.t.ppf((1 + level) / 2, freedom) * spread
    for place, k in enumerate(used):
        found[k] = _around(weights[place], half[place])
    return found, 1 - left / len(b)
