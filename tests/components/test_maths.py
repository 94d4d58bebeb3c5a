"""The functions of the equations agree with Python's `math` to the bit, on scalars and in arrays."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components import maths

ordinary = st.floats(-1e6, 1e6)


@pytest.mark.parametrize("name", ["sqrt", "exp", "log", "sin", "cos", "tan", "tanh"])
def test_functions_are_those_of_the_math_module(name):
    """Reference: `math`, bit for bit; NumPy's own differ in the last one here and there."""
    ours, theirs = getattr(maths, name), getattr(math, name)
    values = [0.1, 0.7, 1.0, 2.3, 13.7]
    assert [ours(x) for x in values] == [theirs(x) for x in values]
    array = ours(np.array(values))
    assert array.dtype == np.float64
    assert array.tolist() == [theirs(x) for x in values]
    assert ours(np.array([values, values])).shape == (2, 5)


def test_elements_of_integer_arrays_are_numbers_too():
    assert maths.sqrt(np.array([4, 9])[0]) == 2.0
    assert maths.floor(np.float64(-1.5)) == -2.0
    assert type(maths.floor(2.5)) is float


@given(ordinary, ordinary, ordinary)
def test_choices_against_the_builtins(x, a, b):
    low, high = min(a, b), max(a, b)
    assert maths.minimum(a, b) == min(a, b)
    assert maths.maximum(a, b) == max(a, b)
    assert maths.clip(x, low, high) == min(max(x, low), high)
    assert maths.absolute(x) == abs(x)
    assert maths.sign(x) == (x > 0) - (x < 0)
    assert maths.where(x > a, a, b) == (a if x > a else b)


@pytest.mark.parametrize("a", [False, True])
@pytest.mark.parametrize("b", [False, True])
def test_logic(a, b):
    assert maths.logical_and(a, b) is (a and b)
    assert maths.logical_or(a, b) is (a or b)
    assert maths.logical_not(a) is (not a)
    arrays = np.array([a, a]), np.array([b, b])
    assert maths.logical_and(*arrays).tolist() == [a and b] * 2
    assert maths.logical_or(a, arrays[1]).tolist() == [a or b] * 2
    assert maths.logical_not(arrays[0]).tolist() == [not a] * 2


@pytest.mark.parametrize("condition", [True, False])
def test_the_shape_of_a_choice_does_not_depend_on_the_condition(condition):
    array = np.array([1.0, 2.0, 3.0])
    assert maths.where(condition, array, 0.0).shape == (3,)
    assert maths.where(condition, 0.0, array).shape == (3,)
    assert maths.where(np.array([condition, True]), 1.0, 0.0).tolist() == [float(condition), 1.0]


@pytest.mark.parametrize("condition", [1.0, 1, "yes", np.float64(0.0)])
def test_a_number_is_not_a_condition(condition):
    with pytest.raises(TypeError, match="takes a condition"):
        maths.where(condition, 1.0, 2.0)


def test_total_adds_from_first_to_last():
    """1 + 1e16 - 1e16 is 0 in that order and 1 in another; NumPy's pairwise sum differs on long arrays."""
    assert maths.total(np.array([1.0, 1e16, -1e16])) == 0.0
    values = [0.1 * k for k in range(1000)]
    expected = 0.0
    for value in values:
        expected += value
    assert maths.total(np.array(values)) == expected
    assert maths.total(np.array([[1.0, 2.0], [3.0, 4.0]])) == 10.0


def test_a_product_adds_from_first_to_last():
    assert maths.product(np.array([[1.0, 1.0, 1.0], [0.0, 2.0, 3.0]]), [1.0, 1e16, -1e16]).tolist() == [0.0, -1e16]
    assert maths.product(np.array([[2.0]]), np.array([True])).tolist() == [2.0]


@given(st.floats(-50.0, 50.0))
def test_piecewise_linear_against_numpy(x):
    """Reference: `numpy.interp`."""
    breakpoints, values = [-10.0, 0.0, 1.0, 30.0], [3.0, -1.0, 4.0, 0.5]
    assert maths.piecewise_linear(x, breakpoints, values) == pytest.approx(np.interp(x, breakpoints, values), abs=1e-12)


@pytest.mark.parametrize(
    ("x", "expected"), [(-1.0, 5.0), (0.0, 5.0), (9.99, 5.0), (10.0, 6.0), (20.0, 7.0), (99.0, 7.0)]
)
def test_piecewise_constant_takes_the_value_of_the_last_breakpoint(x, expected):
    assert maths.piecewise_constant(x, [0.0, 10.0, 20.0], [5.0, 6.0, 7.0]) == expected


def test_piecewise_functions_take_arrays_and_keep_their_shape():
    x = np.array([-1.0, 5.0, 30.0])
    assert maths.piecewise_constant(x, [0.0, 10.0], [1.0, 2.0]).tolist() == [1.0, 1.0, 2.0]
    assert maths.piecewise_linear(x, [0.0, 10.0], [1.0, 2.0]).tolist() == [1.0, 1.5, 2.0]
    assert maths.piecewise_constant(x, [0.0], [1.0]).shape == (3,)
    assert maths.piecewise_linear(x, [0.0], [1.0]).shape == (3,)


def test_a_jump_may_be_written_as_two_equal_breakpoints():
    assert maths.piecewise_linear(0.999999, [0.0, 1.0, 1.0, 2.0], [0.0, 0.0, 5.0, 5.0]) == 0.0
    assert maths.piecewise_linear(1.0, [0.0, 1.0, 1.0, 2.0], [0.0, 0.0, 5.0, 5.0]) == 5.0


def test_a_repeated_step_is_an_iteration():
    """Newton's for the square root, and a count."""
    found = maths.repeat(lambda x, a: [0.5 * (x[0] + a[0] / x[0]), x[1] + 1], 6, [2.0, 0], [2.0])
    assert found.tolist() == [pytest.approx(math.sqrt(2.0), abs=1e-15), 6.0]
    assert maths.repeat(lambda x, a: [2.0 * x[0]], 0, [3.0], []).tolist() == [3.0]
