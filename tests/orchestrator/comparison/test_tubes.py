"""Tubes around a curve, against the geometry that defines them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.comparison.tubes import Tube, departure, envelope

FLOATS = st.floats(-10, 10)


@settings(max_examples=40)
@given(
    st.lists(st.tuples(st.integers(0, 3), FLOATS), min_size=1, max_size=20),
    st.lists(st.floats(0, 20), min_size=1, max_size=5),
    st.floats(0, 6),
)
def test_an_envelope_has_the_extremes_of_the_curve_within_the_width(points, at, width):
    time = np.cumsum([float(step) for step, _ in points])
    values, at = np.array([value for _, value in points]), np.clip(at, time[0], time[-1])
    least, greatest = envelope(time, values, at, width)
    for k, moment in enumerate(at):
        ends = np.clip([moment - width, moment + width], time[0], time[-1])
        near = [*values[(time >= moment - width) & (time <= moment + width)], *np.interp(ends, time, values)]
        assert (least[k], greatest[k]) == (min(near), max(near))


def test_distance_height_and_the_worst_point():
    time, at = np.array([0.0, 10.0]), np.array([1.0, 5.0, 9.0])
    found = departure(time, np.array([0.0, 10.0]), at, np.array([1.0, 8.0, 8.5]), Tube(1.0, 1.5))
    assert (found.distance, found.at, found.value, found.least, found.greatest) == (2.0, 5.0, 8.0, 4.0, 6.0)
    assert (found.outside, found.points) == (1, 3)


def test_a_jump_is_met_anywhere_between():
    time, values = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 0.0, 5.0, 5.0])
    found = departure(time, values, np.array([1.0]), np.array([2.5]), Tube(0.0, 1e-9))
    assert found.distance == 0.0


def test_what_is_no_number_is_like_its_like_alone():
    time = np.arange(4.0)
    values = np.array([1.0, np.nan, np.inf, 1.0])
    same = departure(time, values, time, values.copy(), Tube(0.0, 1.0))
    assert (same.distance, same.outside) == (0.0, 0)
    other = departure(time, values, time, np.array([1.0, np.nan, np.inf, np.nan]), Tube(0.0, 1.0))
    assert (other.distance, other.at, other.outside) == (np.inf, 3.0, 1)
    assert departure(time, values, time[2:3], np.array([-np.inf]), Tube(0.0, 1.0)).distance == np.inf


@pytest.mark.parametrize("width", [0.0, 0.3])
def test_a_sine_that_is_late_is_inside_if_the_tube_is_as_wide(width):
    time = np.linspace(0, 20, 2001)
    found = departure(time, np.sin(time), time[25:], np.sin(time[25:] - 0.25), Tube(width, 1e-3))
    if width:
        assert found.outside == 0
    else:
        assert found.distance == pytest.approx(2 * np.sin(0.125), rel=1e-3)
