"""Signals that are recorded less often than others: which points have a value, and what is between them."""

import numpy as np
import pytest
from railcosim.orchestrator.evaluation import filled, valued, without_blanks

NAN = np.nan
TIME = np.arange(6) / 10.0


@pytest.mark.parametrize(
    ("values", "places"),
    [
        ([1.0, NAN, 2.0, NAN, 3.0, NAN], [0, 2, 4]),
        ([1.0, NAN, 2.0, NAN, 3.0, 4.0], [0, 2, 4, 5]),
        ([1.0, NAN, NAN, NAN, 3.0, 4.0], [0, 4, 5]),
        ([1.0, NAN, NAN, NAN, NAN, 4.0], [0, 5]),
    ],
)
def test_values_at_every_so_many_points_and_the_last(values, places):
    assert np.flatnonzero(valued(np.array(values))).tolist() == places
    time, there = without_blanks(TIME, np.array(values))
    assert time.tolist() == TIME[places].tolist()
    assert there.tolist() == [values[k] for k in places]


@pytest.mark.parametrize(
    "values",
    [
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        [1.0, NAN, NAN, NAN, NAN, NAN],
        [1.0, 2.0, 3.0, NAN, NAN, NAN],
        [1.0, 2.0, 3.0, 4.0, 5.0, NAN],
        [1.0, NAN, 3.0, NAN, NAN],
        [NAN, 2.0, 3.0, 4.0, 5.0, 6.0],
        [1.0, NAN, 3.0, NAN, NAN, 6.0],
        [1.0, 2.0, NAN, 4.0, 5.0, 6.0],
        [NAN] * 6,
        [],
    ],
)
def test_any_other_nan_is_one(values):
    """What fails on its way, what is not known at first, a gap."""
    assert valued(np.array(values)) is None
    time, there = without_blanks(TIME[: len(values)], np.array(values))
    assert np.array_equal(there, np.array(values), equal_nan=True)
    assert len(time) == len(values)


def test_between_values_is_a_line_or_the_last_value():
    values = np.array([1.0, NAN, 3.0, NAN, 5.0, NAN])
    assert filled(TIME, values, held=False).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 5.0]
    assert filled(TIME, values, held=True).tolist() == [1.0, 1.0, 3.0, 3.0, 5.0, 5.0]
    whole = np.array([1, 2, 3, 4, 5, 6])
    assert filled(TIME, whole, held=True) is whole
