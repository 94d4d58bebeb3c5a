"""What is under a train, against the sum over the whole line that it replaces: to the bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components.environment.under import Under, changes

lengths = st.sampled_from([1.0, 58.6, 74.06, 400.0, 750.25])
positions = st.lists(st.integers(-9000, 90000), min_size=1, max_size=20, unique=True)


def whole_sum(begins, values, position, length):
    result = values[0]
    for begin, change in changes(begins, values):
        result = result + change * min(max((position - begin) / length, 0.0), 1.0)
    return result


@given(positions, lengths, st.data())
def test_the_mean_is_the_same_to_the_bit(begins, length, data):
    begins = sorted(0.1 * begin for begin in begins)
    values = data.draw(st.lists(st.floats(-0.3, 0.3), min_size=len(begins), max_size=len(begins)))
    under = Under(tuple(begins), tuple(values), length)
    places = [place for begin in begins for place in (begin, begin + length, begin + 0.3 * length)]
    for position in [*places, *np.nextafter(places, -np.inf), *np.nextafter(places, np.inf), -1e5, 1e5]:
        result, steps = under.at(position)
        for begin, change in steps:
            result = result + change * min(max((position - begin) / length, 0.0), 1.0)
        assert result == whole_sum(begins, values, position, length)


@pytest.mark.parametrize(("length", "most"), [(50.0, 1), (150.0, 2), (1e4, 3)])
def test_only_the_steps_under_the_train_are_added(length, most):
    _, steps = Under((0.0, 100.0, 200.0, 300.0), (1.0, 2.0, 3.0, 4.0), length).at(250.0)
    assert len(steps) == most
