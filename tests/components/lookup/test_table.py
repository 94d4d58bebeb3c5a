"""Look-up tables against SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components import Lookup
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator

X, Y = [-1.0, 0.5, 0.75, 2.0, 4.0], [0.0, 1.0, 1.5, 4.0]
GRID = np.random.default_rng(1).normal(size=(len(X), len(Y)))


def near(value):
    return pytest.approx(value, rel=1e-13, abs=1e-13)


@given(st.lists(st.sampled_from([0.0, 1.0, 1.2, -3.0, 7.0, 1e3]), min_size=2, max_size=9), st.floats(0.0, 1.0))
def test_a_cubic_is_that_of_scipy(values, share):
    """Both are after Fritsch and Butland; peaks, plateaus and ends included."""
    x = np.cumsum([0.3 + 0.7 * (k % 3) for k in range(len(values))])
    place = float(x[0] + share * (x[-1] - x[0]))
    expected = float(PchipInterpolator(x, values)(place))
    assert Lookup([x], values, "cubic")(place) == pytest.approx(expected, rel=1e-12, abs=1e-11)


@given(st.floats(-1.0, 4.0))
def test_straight_lines_are_those_of_numpy(place):
    assert Lookup([X], GRID[:, 0])(place) == near(np.interp(place, X, GRID[:, 0]))


@given(st.floats(-1.0, 4.0), st.floats(0.0, 4.0))
def test_two_variables_are_those_of_scipy(x, y):
    assert Lookup([X, Y], GRID)(x, y) == near(float(RegularGridInterpolator((X, Y), GRID)((x, y))))


@pytest.mark.parametrize("place", np.linspace(0.0, 4.0, 9).tolist())
def test_a_smooth_surface_is_a_smooth_line_over_each_line_of_breakpoints(place):
    table = Lookup([X, Y], GRID, "cubic")
    for k, x in enumerate(X):
        assert table(x, place) == near(float(PchipInterpolator(Y, GRID[k])(place)))
    for k, y in enumerate(Y):
        assert table(place, y) == near(float(PchipInterpolator(X, GRID[:, k])(place)))


def test_a_smooth_surface_has_no_edges():
    """Across a border of two cells the slope along the other axis goes on: the difference of slopes vanishes with h."""
    table, h = Lookup([X, Y], GRID, "cubic"), 1e-6
    for x in X[1:-1]:
        before, after = ((table(x + d, 0.7) - table(x + d - h, 0.7)) / h for d in (0.0, h))
        assert before == pytest.approx(after, abs=1e-4)


@pytest.mark.parametrize("method", ["linear", "cubic"])
def test_outside_the_edge_goes_on(method):
    line, surface = Lookup([X], GRID[:, 0], method), Lookup([X, Y], GRID, method)
    assert line(-9.0) == line(-1.0) == GRID[0, 0]
    assert line(9.0) == line(4.0) == near(GRID[-1, 0])
    assert surface(9.0, -9.0) == near(GRID[-1, 0])
    assert surface(-9.0, 9.0) == near(GRID[0, -1])


def test_data_are_read():
    assert Lookup.read({"breakpoints": [0, 2], "values": [1, 5]})(0.5) == 2.0
    data = {"breakpoints": [[0, 2], [0, 1]], "values": [[1, 5], [3, 9]], "method": "cubic"}
    assert Lookup.read(data)(0.0, 1.0) == 5.0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (7, "has 'breakpoints' and 'values'"),
        ({"breakpoints": [0, 1]}, "has 'breakpoints' and 'values'"),
        ({"breakpoints": [0, 1], "values": [0, 1], "mehtod": "cubic"}, "did you mean 'method'"),
        ({"breakpoints": [0, 1], "values": [0, 1], "method": "cubik"}, "did you mean 'cubic'"),
        ({"breakpoints": [0, 1], "values": [0, 1], "method": 3}, "there is no 'method' '3'"),
        ({"breakpoints": [0, "a"], "values": [0, 1]}, "'breakpoints' are numbers"),
        ({"breakpoints": [0, 1], "values": [0, float("nan")]}, "'values' are finite numbers"),
        ({"breakpoints": [0, 0], "values": [0, 1]}, "at least two numbers that rise"),
        ({"breakpoints": [], "values": []}, "at least two numbers that rise"),
        ({"breakpoints": 3, "values": [1]}, "at least two numbers that rise"),
        ({"breakpoints": [0, 1], "values": [0, 1, 2]}, "'values' are 2 as the breakpoints are, not 3"),
        ({"breakpoints": [[0, 1]] * 3, "values": [0]}, "of one variable or of two, not of 3"),
        ({"breakpoints": [[0, 1], [0, 1]], "values": [0, 1]}, "'values' are 2 x 2"),
    ],
)
def test_unusable_data_are_refused(data, message):
    with pytest.raises(ValueError, match=message):
        Lookup.read(data)
