"""Constants by cell, on numbers: a linear search finds the same."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components.lookup.cells import Cells, is_plain, just_above

places = st.floats(-3.0, 3.0) | st.sampled_from([math.inf, -math.inf, -0.0])


@given(st.lists(st.integers(-20, 20), min_size=1, max_size=8, unique=True), places)
def test_the_last_start_that_is_not_above(starts, place):
    starts = sorted(0.1 * start for start in starts)
    expected = [k for k, start in enumerate(starts) if k == 0 or start <= place][-1]
    assert Cells([starts], [[10.0 * k, -k] for k in range(len(starts))]).find(place) == [10.0 * expected, -expected]


@given(places, places)
def test_cells_over_two_variables(x, y):
    rows = [[[1.0], [2.0], [3.0]], [[4.0], [5.0], [6.0]]]
    found = Cells([[0.0, 1.0], [0.0, 0.5, 1.0]], rows).find(x, y)
    assert found == rows[int(x >= 1.0)][int(y >= 0.5) + int(y >= 1.0)]


def test_what_is_no_number_is_in_the_first_cell():
    assert Cells([[0.0, 1.0]], [[3.0], [4.0]]).find(math.nan) == [3.0]


@pytest.mark.parametrize("number", [0.0, -1.0, 1e9, -math.inf])
def test_at_least_the_next_number_is_above(number):
    assert just_above(number) > number
    assert not number < (just_above(number) + number) / 2.0 < just_above(number)


@pytest.mark.parametrize("values", [1, 2.0, np.float64(1.0), [1, (2.0, np.zeros(2))], np.array([1.0, 2], dtype=object)])
def test_numbers_are_plain(values):
    assert is_plain(values)


@pytest.mark.parametrize("values", [object(), [1.0, "x"], np.array([1.0, object()], dtype=object)])
def test_anything_else_is_not(values):
    assert not is_plain(values)
