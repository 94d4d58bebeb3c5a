"""Estimates with confidence intervals: proportions, means and quantiles of independent runs."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Estimate(NamedTuple):
    """A value, and between what the true one lies with the confidence asked for; NaN where that is not known."""

    value: float
    low: float = math.nan
    high: float = math.nan


UNKNOWN = Estimate(math.nan)


def proportion(hits: int, count: int, independent: float, level: float) -> Estimate:
    """A proportion with Wilson's interval (Wilson 1927; Brown, Cai and DasGupta 2001).

    Args:
        hits: how many runs have it.
        count: how many runs there are.
        independent: how many runs as good as independent these are; 0 where they are no sample, as a grid.
        level: of confidence.
    """
    if not count:
        return UNKNOWN
    share = hits / count
    if not independent:
        return Estimate(share)
    z = NormalDist().inv_cdf((1 + level) / 2)
    centre = (share + z * z / (2 * independent)) / (1 + z * z / independent)
    spread = share * (1 - share) / independent + z * z / (4 * independent**2)
    half = z * math.sqrt(spread) / (1 + z * z / independent)
    return Estimate(share, max(0.0, centre - half), min(1.0, centre + half))


def mean(values: NDArray[np.float64], independent: float, level: float) -> Estimate:
    """A mean with Student's interval; arguments as for `proportion`, values (n,) finite."""
    centre = float(values.mean())
    if independent < 2:
        return Estimate(centre)
    from scipy import stats

    half = float(stats.t.ppf((1 + level) / 2, independent - 1) * values.std(ddof=1) / math.sqrt(independent))
    return Estimate(centre, centre - half, centre + half)


def quantile(ordered: NDArray[np.float64], share: float, independent: float, level: float) -> Estimate:
    """A quantile between two order statistics, whatever the distribution; infinite where the runs are too few.

    Args:
        ordered: (n,), ascending, without NaN.
        share: which quantile, from 0 to 1.
        independent: as for `proportion`.
        level: of confidence.
    """
    count = len(ordered)
    value = float(np.quantile(ordered, share, method="inverted_cdf"))
    if not independent:
        return Estimate(value)
    from scipy import stats

    trials = max(1, round(independent))
    below = int(stats.binom.ppf((1 - level) / 2, trials, share))
    above = int(stats.binom.ppf((1 + level) / 2, trials, share)) + 1
    low = -math.inf if below < 1 else float(ordered[math.ceil(below * count / trials) - 1])
    high = math.inf if above > trials else float(ordered[math.ceil(above * count / trials) - 1])
    return Estimate(value, low, high)


def numbers(column: Any) -> NDArray[np.float64]:
    """A column of a frame as float64; NaN where there is nothing."""
    found: NDArray[np.float64] = column.to_numpy(dtype=np.float64, na_value=np.nan)
    return found
