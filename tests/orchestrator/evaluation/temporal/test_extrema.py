"""Sliding extrema and the recursion of `until`, beside loops."""

import numpy as np
from railcosim.orchestrator.evaluation.temporal.extrema import clamped, least


def test_the_least_of_windows_of_any_length():
    source = np.random.default_rng(1)
    values = source.normal(size=60)
    values[[7, 31]] = np.nan
    first = np.sort(source.integers(0, 60, 40))
    last = np.minimum(first + source.integers(0, 20, 40), 60)
    wanted = [values[a:b].min(initial=np.inf) for a, b in zip(first, last, strict=True)]
    assert np.array_equal(least(values, first, last), wanted, equal_nan=True)
    assert least(values, first[:0], last[:0]).shape == (0,)


def test_steps_one_after_another():
    source = np.random.default_rng(2)
    for count in (0, 1, 2, 3, 50):
        low, high = source.normal(size=(2, count))
        wanted, y = [], 0.3
        for a, b in zip(low, high, strict=True):
            y = max(a, min(b, y))
            wanted.append(y)
        assert clamped(low, high, 0.3).tolist() == wanted
    assert np.isnan(clamped(np.array([0.0, np.nan, 1.0]), np.ones(3), 0.0)).tolist() == [False, True, True]
