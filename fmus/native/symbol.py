"""What stands in for a value while equations are traced into CasADi's expressions."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...components.lookup.cells import Cells
from ...components.maths import SymbolArray, elementwise
from ...components.tracing import TracingError
from . import calls

_FUNCTIONS = {
    "sqrt": ca.sqrt,
    "exp": ca.exp,
    "log": ca.log,
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "tanh": ca.tanh,
    "floor": ca.floor,
    "abs": ca.fabs,
}
_NUMBERS = itertools.count()
"""CasADi tells functions apart by name."""


class Symbol:
    """A scalar expression that stands in for a number in the equations and refuses to be taken for one.

    Bare CasADi symbols would fail silently: ``math.tanh`` of one is NaN, an array times one is a matrix.
    """

    __slots__ = ("sx",)
    __array_priority__ = 1000.0
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, sx: Any) -> None:
        self.sx = sx

    def apply(self, function: str) -> Symbol:
        """The result of a unary function of `maths`."""
        return Symbol(_FUNCTIONS[function](self.sx))

    def where(self, then: Any, otherwise: Any) -> Symbol:
        """The result of a choice on this condition."""
        return Symbol(ca.if_else(self.sx, expression(then), expression(otherwise)))

    def cells(self, table: Cells, places: Sequence[Any]) -> list[Symbol]:
        """The constants of the cell of a table that a place is in."""
        return [Symbol(sx) for sx in calls.cells(table, [expression(place) for place in places])]

    def product(self, matrix: NDArray[np.float64], vector: Sequence[Any]) -> list[Symbol]:
        """A matrix times a vector."""
        return [Symbol(sx) for sx in calls.product(matrix, [expression(cell) for cell in vector])]

    def repeated(self, step: Callable[[Any, Any], Any], times: int, values: Any, given: Any) -> Any:
        """The result of a `maths.repeat` on symbols: calls of one function."""
        known = [ca.SX.sym(name, len(cells)) for name, cells in (("values", values), ("given", given))]
        cells = step(*(arranged([Symbol(x) for x in ca.vertsplit(column)], column.shape[:1]) for column in known))
        once = _kept(known, ca.vertcat(*map(expression, cells)))
        column, fixed = (ca.vertcat(*map(expression, cells)) for cells in (values, given))
        while times:  # by its binary digits: each call takes a line of C for each value
            column = once(column, fixed) if times & 1 else column
            times >>= 1
            once = _kept(known, once(once(*known), known[1])) if times else once
        return arranged([Symbol(x) for x in ca.vertsplit(column)], column.shape[:1])

    def _refuse(self, *_: Any) -> Any:
        raise TracingError(
            "a value was asked for its truth or turned into a plain number: use railcosim.components.maths "
            "(where, tanh, clip, logical_and, ...) instead of if, and, or, float() or the math module"
        )

    def _refuse_division(self, *_: Any) -> Any:
        raise TracingError("// and % cannot be traced: Python and C round them differently; use maths.floor")

    __bool__ = __float__ = __int__ = __index__ = __complex__ = _refuse
    __floordiv__ = __rfloordiv__ = __mod__ = __rmod__ = _refuse_division

    def __neg__(self) -> Symbol:
        return Symbol(-self.sx)

    def __pos__(self) -> Symbol:
        return self

    def __abs__(self) -> Symbol:
        return Symbol(ca.fabs(self.sx))


def _kept(arguments: list[Any], result: Any) -> Any:
    """A function that stays one where it is called."""
    return ca.Function(f"step{next(_NUMBERS)}", arguments, [result], {"cse": True, "never_inline": True})


def _binary(operation: Callable[[Any, Any], Any], swapped: bool = False) -> Callable[[Symbol, Any], Any]:
    def method(self: Symbol, other: Any) -> Any:
        # NumPy leaves an operation of an array with a symbol to the symbol, whichever side it stands on.
        if isinstance(other, np.ndarray):
            return elementwise(functools.partial(method, self), other)
        a, b = self.sx, expression(other)
        return Symbol(operation(b, a) if swapped else operation(a, b))

    return method


def expression(value: Any) -> Any:
    """A value as a CasADi scalar; truth values are 0 and 1, as in C."""
    if isinstance(value, Symbol):
        return value.sx
    if isinstance(value, bool | int | float | np.bool_ | np.integer | np.floating):
        return ca.SX(float(value))
    raise TracingError(f"{value!r} is neither a number nor an expression")


for _name, _operation in {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "truediv": lambda a, b: a / b,
    "pow": lambda a, b: a**b,
}.items():
    setattr(Symbol, f"__{_name}__", _binary(_operation))
    setattr(Symbol, f"__r{_name}__", _binary(_operation, swapped=True))
for _name, _operation in {
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
}.items():
    setattr(Symbol, f"__{_name}__", _binary(_operation))


class Text:
    """Stands in for a text: a native FMU carries texts, but its equations cannot read them."""

    __hash__ = None  # type: ignore[assignment]

    def _refuse(self, *_: Any) -> Any:
        raise TracingError("a text is read, which only a Python FMU can: use a boolean or an integer to choose")

    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _refuse
    __add__ = __radd__ = __mul__ = __rmul__ = __mod__ = __getitem__ = __contains__ = __iter__ = __getattr__ = _refuse
    __bool__ = __len__ = __str__ = __repr__ = __format__ = __int__ = __float__ = _refuse


def arranged(cells: list[Any], shape: tuple[int, ...]) -> Any:
    """Cells in the shape of their slot."""
    if not shape:
        return cells[0]
    array = np.empty(len(cells), dtype=object)
    for k, cell in enumerate(cells):  # one by one: NumPy would look for numbers inside each of a list
        array[k] = cell
    return array.reshape(shape).view(SymbolArray)
