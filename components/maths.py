"""The functions equations may use, on floats, arrays and symbols alike.

Scalars go through Python's ``math``, as compiled C goes through its ``libm``; arrays element by element through the
same functions, so that a number does not depend on whether it stood in an array. Anything else is a symbol (a tracer
that follows dependencies, or one that records an expression) and is asked to apply the function itself.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .lookup.cells import Cells, is_plain

pi = math.pi


class SymbolArray(np.ndarray[Any, Any]):
    """An object array of symbols: a comparison gives an array of symbols, where NumPy would ask each for its truth."""

    def __lt__(self, other: Any) -> Any:
        return np.less(self, other, dtype=object)

    def __le__(self, other: Any) -> Any:
        return np.less_equal(self, other, dtype=object)

    def __gt__(self, other: Any) -> Any:
        return np.greater(self, other, dtype=object)

    def __ge__(self, other: Any) -> Any:
        return np.greater_equal(self, other, dtype=object)

    def __eq__(self, other: Any) -> Any:
        return np.equal(self, other, dtype=object)

    def __ne__(self, other: Any) -> Any:
        return np.not_equal(self, other, dtype=object)

    __hash__ = None


def elementwise(function: Callable[..., Any], *arguments: Any) -> Any:
    """A function of scalars on arrays, broadcast: a plain array of numbers, or an array of symbols."""
    arrays = np.broadcast_arrays(*(np.asarray(a, dtype=object) for a in arguments))
    results = [function(*elements) for elements in zip(*(a.flat for a in arrays), strict=True)]
    plain = all(isinstance(r, bool | int | float | np.generic) for r in results)
    if plain:
        return np.array(results).reshape(arrays[0].shape)
    return symbols(results, arrays[0].shape)


def symbols(cells: Sequence[Any], shape: tuple[int, ...]) -> SymbolArray:
    """An array of symbols, among which there may be numbers."""
    array = np.empty(len(cells), dtype=object)
    array[:] = cells
    return array.reshape(shape).view(SymbolArray)


def _unary(name: str, function: Callable[[Any], float], doc: str) -> Callable[[Any], Any]:
    def apply(x: Any) -> Any:
        if isinstance(x, float | int | np.integer):
            return function(x)
        if isinstance(x, np.ndarray):
            return elementwise(apply, x)
        return x.apply(name)

    apply.__name__ = name
    apply.__doc__ = doc
    return apply


sqrt = _unary("sqrt", math.sqrt, "Square root; guard the argument against negative values.")
exp = _unary("exp", math.exp, "Exponential; guard the argument against overflow (above 709).")
log = _unary("log", math.log, "Natural logarithm; guard the argument against values <= 0.")
sin = _unary("sin", math.sin, "Sine of an angle in rad.")
cos = _unary("cos", math.cos, "Cosine of an angle in rad.")
tan = _unary("tan", math.tan, "Tangent of an angle in rad.")
tanh = _unary("tanh", math.tanh, "Hyperbolic tangent.")
floor = _unary("floor", lambda x: float(math.floor(x)), "Largest whole number not above x, as a real.")
absolute = _unary("abs", abs, "Absolute value; ``abs(x)`` does the same.")


def where(condition: Any, then: Any, otherwise: Any) -> Any:
    """``then`` where the condition holds, else ``otherwise``. Both are evaluated: guard their arguments."""
    # Arrays first, even where the condition is one plain boolean: the result's shape must not depend on its value.
    if isinstance(condition, np.ndarray) or isinstance(then, np.ndarray) or isinstance(otherwise, np.ndarray):
        return elementwise(where, condition, then, otherwise)
    if isinstance(condition, bool | np.bool_):
        return then if condition else otherwise
    if isinstance(condition, int | float | str | np.generic):
        raise TypeError(f"where() takes a condition, that is a boolean or a comparison, not {condition!r}")
    return condition.where(then, otherwise)


def minimum(a: Any, b: Any) -> Any:
    """The smaller of two values, element by element."""
    return where(b < a, b, a)


def maximum(a: Any, b: Any) -> Any:
    """The larger of two values, element by element."""
    return where(b > a, b, a)


def clip(x: Any, low: Any, high: Any) -> Any:
    """``x`` held between ``low`` and ``high``."""
    return minimum(maximum(x, low), high)


def sign(x: Any) -> Any:
    """-1, 0 or 1."""
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, 0.0))


def logical_and(a: Any, b: Any) -> Any:
    """Both conditions; ``and`` cannot serve because it asks a symbol for its truth."""
    return where(a, b, False)


def logical_or(a: Any, b: Any) -> Any:
    """Either condition."""
    return where(a, True, b)


def logical_not(a: Any) -> Any:
    """The opposite of a condition."""
    return where(a, False, True)


def total(x: Any) -> Any:
    """Sum of an array's elements from first to last, in that order (NumPy's own sum adds pairwise)."""
    result: Any = 0.0
    for element in np.asarray(x).flat:
        result = result + element
    return result


def product(matrix: NDArray[np.float64], vector: Any) -> Any:
    """A matrix of plain numbers times a vector: each sum from first to last, where ``@`` may add in any order.

    Args:
        matrix: shape (m, n).
        vector: shape (n,).
    """
    cells = np.asarray(vector, dtype=object)
    for cell in cells:
        if not is_plain(cell):
            return symbols(cell.product(matrix, cells.tolist()), (len(matrix),))
    result = np.zeros(len(matrix))
    for column, cell in zip(matrix.T, cells, strict=True):
        result = result + column * float(cell)
    return result


def piecewise_constant(x: Any, breakpoints: Sequence[Any] | np.ndarray, values: Sequence[Any] | np.ndarray) -> Any:
    """The value of the last breakpoint not above ``x``; ``values[0]`` before the first one.

    Args:
        x: where to look up.
        breakpoints: rising positions, shape (n,).
        values: value from each breakpoint on, shape (n,).
    """
    if isinstance(x, np.ndarray):
        return elementwise(lambda place: piecewise_constant(place, breakpoints, values), x)
    if _is_table(x, breakpoints, values):
        return Cells([breakpoints], [[value] for value in values]).find(x)[0]
    result = values[0]
    # The first breakpoint too, though it changes no number: where a symbol is looked up the result is one.
    for position, value in zip(breakpoints, values, strict=True):
        result = where(x >= position, value, result)
    return result


def piecewise_linear(x: Any, breakpoints: Sequence[Any] | np.ndarray, values: Sequence[Any] | np.ndarray) -> Any:
    """Linear interpolation between breakpoints, constant outside them.

    Args:
        x: where to look up.
        breakpoints: strictly rising positions, shape (n,).
        values: value at each breakpoint, shape (n,).
    """
    if isinstance(x, np.ndarray):
        return elementwise(lambda place: piecewise_linear(place, breakpoints, values), x)
    if len(breakpoints) > 1 and _is_table(x, breakpoints, values):
        starts = breakpoints[:-1]
        widths = [b - a or 1.0 for a, b in itertools.pairwise(breakpoints)]
        rows = np.transpose([starts, widths, values[:-1], np.diff(values)])
        begin, width, value, change = Cells([starts], rows).find(x)
        return value + clip((x - begin) / width, 0.0, 1.0) * change
    result = where(x >= breakpoints[0], values[0], values[0])
    for k in range(len(breakpoints) - 1):
        width = breakpoints[k + 1] - breakpoints[k]
        width = where(width > 0.0, width, 1.0)
        fraction = clip((x - breakpoints[k]) / width, 0.0, 1.0)
        result = where(x >= breakpoints[k], values[k] + fraction * (values[k + 1] - values[k]), result)
    return result


def _is_table(x: Any, breakpoints: Sequence[Any] | np.ndarray, values: Sequence[Any] | np.ndarray) -> bool:
    """Whether a symbol is looked up among plain numbers in order."""
    if is_plain(x) or not is_plain([*breakpoints, *values]):
        return False
    return all(a <= b for a, b in itertools.pairwise(breakpoints))


def repeat(step: Callable[[Any, Any], Any], times: int, values: Any, given: Any) -> Any:
    """What a fixed number of equal steps makes of values: an iteration, in C one function that is called as often.

    Args:
        step: takes the values and what is given, and returns the next values; it reads nothing else that varies.
        times: how often.
        values: before the first step, shape (n,).
        given: what every step may read besides, shape (m,).
    """
    column, fixed = _column(values), _column(given)
    symbol = next((cell for cell in (*column, *fixed) if hasattr(cell, "repeated")), None)
    if symbol is not None:
        return symbol.repeated(step, times, column, fixed)
    for _ in range(times):
        column = _column(step(column, fixed))
    return column


def _column(cells: Any) -> Any:
    """Scalars as an array: of numbers, or of symbols."""
    column = np.empty(len(cells), dtype=object)
    column[:] = list(cells)
    plain = all(isinstance(cell, bool | int | float | np.generic) for cell in column)
    return column.astype(float) if plain else column.view(SymbolArray)
