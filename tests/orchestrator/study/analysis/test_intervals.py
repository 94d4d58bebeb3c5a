"""Intervals against printed numbers."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.study.analysis.intervals import Estimate, mean, proportion, quantile


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilsons_interval_as_newcombe_printed_it(hits, count, low, high):
    """Newcombe 1998, Statistics in Medicine 17, table I, method 3."""
    made = proportion(hits, count, count, 0.95)
    assert made == pytest.approx((hits / count, low, high), abs=5e-5)
    assert proportion(count - hits, count, count, 0.95)[1:] == pytest.approx((1 - high, 1 - low), abs=5e-5)


def test_a_proportion_of_no_sample_and_of_nothing():
    assert proportion(3, 4, 0, 0.95)[0] == 0.75
    assert all(map(math.isnan, proportion(3, 4, 0, 0.95)[1:]))
    assert all(map(math.isnan, proportion(0, 0, 0, 0.95)))
    assert proportion(300, 400, 100, 0.95) == proportion(75, 100, 100, 0.95)


def test_a_mean_with_students_interval():
    """t of 9 degrees of freedom at 97.5 % is 2.262 in every table."""
    values = np.arange(10.0)
    half = 2.262 * values.std(ddof=1) / math.sqrt(10)
    assert mean(values, 10, 0.95) == pytest.approx((4.5, 4.5 - half, 4.5 + half), abs=1e-3)
    assert mean(values, 0, 0.95)[0] == mean(values, 1, 0.95)[0] == 4.5
    assert math.isnan(mean(values, 0, 0.95).low)


def test_a_quantile_lies_between_order_statistics():
    """The median of 100 between the 40th and the 61st: Hahn and Meeker 1991, table A.15a."""
    values = np.arange(1.0, 101.0)
    assert quantile(values, 0.5, 100, 0.95) == Estimate(50, 40, 61)
    assert quantile(values, 0.5, 25, 0.95)[1:] == (32, 72)
    assert quantile(values, 0.5, 0, 0.95)[0] == 50
    assert quantile(values[:20], 0.05, 20, 0.95)[1] == -math.inf
    assert quantile(values[:20], 0.95, 20, 0.95)[2] == math.inf


def test_intervals_cover_as_often_as_they_say():
    rng = np.random.default_rng(1)
    draws = np.sort(rng.exponential(size=(400, 60)), axis=1)
    covered = [(q.low <= math.log(2) <= q.high) for q in (quantile(row, 0.5, 60, 0.9) for row in draws)]
    assert 0.88 <= np.mean(covered) <= 0.97
