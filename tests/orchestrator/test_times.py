"""Points in time: which are the same, how many steps lie between two, how they are written."""

import math

import pytest
from railcosim.orchestrator.times import count_steps, digits, slack


@pytest.mark.parametrize(
    ("start", "stop", "step", "count"),
    [
        (0.0, 1.0, 0.1, 10),
        (0.0, 0.3, 0.1, 3),
        (1700000000.0, 1700000010.1, 0.1, 101),
        (1000.0, 1000.000003, 1e-6, 3),
        (-1700000000.0, -1699999999.9, 0.1, 1),
        (0.0, 1e9, 1e-3, 10**12),
        (0.0, 1.0, 0.3, None),
        (1700000000.0, 1700000010.15, 0.1, None),
        (1700000000.0, 1700000000.00001, 1e-6, 10),  # a few numbers lie between two points
        (1700000000.0, 1700000000.00001, 1e-7, None),
        (1000.0, 1000.0000035, 1e-6, None),
        (1700000000.0, 1700000001.0, 1e-7, None),  # points that cannot be told apart
        (1.0, 1.0, 0.1, None),
        (1.0, 0.0, 0.1, None),
        (0.0, math.inf, 0.1, None),
    ],
)
def test_steps_are_counted_with_the_rounding_of_their_ends(start, stop, step, count):
    assert count_steps(start, stop, step) == count


@pytest.mark.parametrize(
    ("time", "text"),
    [
        (0.0, "0"),
        (5.0, "5"),
        (-2.5, "-2.5"),
        (0.1 + 0.2, "0.3"),
        (1234567 + 4 * 0.1, "1234567.4"),
        (1700000000.0, "1700000000"),
        (1700000000 + 7 * 0.1, "1700000000.7"),
        (1e9 + 3e-6, "1000000000.000003"),
        (1000 + 2e-6, "1000.000002"),
        (1e-6, "1e-06"),
        (1.0 / 3.0, "0.3333333333333333"),
        (math.inf, "inf"),
    ],
)
def test_a_time_has_the_digits_that_tell_it_from_its_neighbours(time, text):
    assert digits(time) == text


def test_no_two_points_of_a_run_are_written_alike():
    for start, step in ((0.0, 0.1), (1700000000.0, 1e-5), (1e6, 1e-9)):
        shown = [digits(start + k * step) for k in range(500)]
        assert len(set(shown)) == len(shown)
        assert all(abs(float(text) - (start + k * step)) <= slack(step, start) for k, text in enumerate(shown))


def test_a_difference_is_written_with_the_rounding_of_what_it_is_of():
    assert digits(1700000010.1 - 1700000000.0) == "10.09999990463257"
    assert digits(1700000010.1 - 1700000000.0, 1700000010.1) == "10.1"
