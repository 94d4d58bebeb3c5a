"""Look-up tables over one or two variables, straight or smooth between their breakpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import nearest
from ..maths import clip
from .cells import Cells

Array = NDArray[np.float64]

# From the values at both ends of an interval, then its slopes there times its width, to the coefficients of a
# polynomial in the share of the interval.
_METHODS = {
    "linear": np.array([[1.0, 0.0], [-1.0, 1.0]]),
    "cubic": np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-3.0, 3.0, -2.0, -1.0], [2.0, -2.0, 1.0, 1.0]]),
}
_KEYS = ("breakpoints", "values", "method")


class Lookup:
    """A table over one or two variables; outside of it the values at its edge.

    ``cubic`` is smooth, and monotone along each line of breakpoints wherever the values are: piecewise Hermite cubics
    with the slopes of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984), over two variables their product.

    Args:
        breakpoints: of each variable, rising, (n,) each with n >= 2.
        values: at the breakpoints, shape (n,) or (n, m).
        method: ``"linear"`` or ``"cubic"``.

    Raises:
        ValueError: they do not fit together.
    """

    def __init__(self, breakpoints: Sequence[ArrayLike], values: ArrayLike, method: str = "linear") -> None:
        axes, table = [_numbers("breakpoints", axis) for axis in breakpoints], _numbers("values", values)
        if str(method) not in _METHODS:
            raise ValueError(f"there is no 'method' {nearest(str(method), list(_METHODS))}")
        if len(axes) not in (1, 2):
            raise ValueError(f"'breakpoints' are those of one variable or of two, not of {len(axes)}")
        for axis in axes:
            if axis.ndim != 1 or len(axis) < 2 or not (np.diff(axis) > 0.0).all():
                raise ValueError(
                    f"the 'breakpoints' of a variable are at least two numbers that rise, not {axis.tolist()}"
                )
        if table.shape != tuple(map(len, axes)):
            wanted = " x ".join(str(len(axis)) for axis in axes)
            raise ValueError(f"'values' are {wanted} as the breakpoints are, not {' x '.join(map(str, table.shape))}")
        self._order = len(_METHODS[method])
        self._cells = _coefficients(axes, table, _METHODS[method])

    @classmethod
    def read(cls, data: Any) -> Lookup:
        """A table of JSON data with the keys ``breakpoints``, ``values``, ``method``; for a `Data` declaration.

        Raises:
            ValueError: unusable data; the message names the key and what is wanted.
        """
        if not isinstance(data, Mapping) or not {"breakpoints", "values"} <= data.keys():
            raise ValueError(f"a look-up table has 'breakpoints' and 'values', and may have a 'method', not {data!r}")
        for unknown in sorted(map(str, data.keys() - {*_KEYS})):
            raise ValueError(f"a look-up table has no {nearest(unknown, list(_KEYS))}")
        axes = data["breakpoints"]
        nested = isinstance(axes, Sequence) and bool(axes) and isinstance(axes[0], Sequence)
        return cls(axes if nested else [axes], data["values"], data.get("method", "linear"))

    def __call__(self, *places: Any) -> Any:
        """The value at a place: a number or symbol for each variable."""
        found = self._cells.find(*places)
        axes = len(places)
        shares = [
            clip((place - begin) / width, 0.0, 1.0)
            for place, begin, width in zip(places, found[:axes], found[axes : 2 * axes], strict=True)
        ]
        terms = found[2 * axes :]
        for share in shares:
            terms = [_polynomial(terms[k : k + self._order], share) for k in range(0, len(terms), self._order)]
        return terms[0]


def _numbers(key: str, given: ArrayLike) -> Array:
    try:
        array = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{key!r} are numbers, not {given!r}") from None
    if not np.isfinite(array).all():
        raise ValueError(f"{key!r} are finite numbers, not {array.tolist()}")
    return array


def _coefficients(axes: Sequence[Array], values: Array, basis: Array) -> Cells:
    """By cell: begins and widths along the axes, then the coefficients of the polynomial, as `__call__` takes them."""
    dimensions = len(axes)
    terms = values[..., None]
    for k, axis in enumerate(axes):
        if len(basis) > 2:
            terms = np.concatenate([terms, np.apply_along_axis(_slopes, k, terms, np.diff(axis))], axis=-1)
    terms = terms.reshape(*values.shape, *[len(basis) // 2] * dimensions)  # values and slopes along the last axis first
    for k, axis in enumerate(axes):
        widths = np.expand_dims(np.diff(axis), [d for d in range(terms.ndim - 1) if d != k])
        lower, upper = (np.take(terms, range(first, first + len(axis) - 1), axis=k) for first in (0, 1))
        ends = [lower[..., 0], upper[..., 0]]
        if len(basis) > 2:
            ends += [widths * lower[..., 1], widths * upper[..., 1]]
        # Written out, so that what is multiplied by 0 and 1 stays as it is.
        columns = [sum(float(factor) * end for factor, end in zip(row, ends, strict=True)) for row in basis]
        terms = np.stack(columns, axis=dimensions)
    inner = [axis[:-1] for axis in axes]
    grids = np.meshgrid(*inner, indexing="ij") + np.meshgrid(*map(np.diff, axes), indexing="ij")
    shape = tuple(map(len, inner))
    rows = [*(grid[..., None] for grid in grids), terms.reshape(*shape, -1)]
    return Cells([axis.tolist() for axis in inner], np.concatenate(rows, axis=-1))


def _slopes(values: Array, widths: Array) -> Array:
    """Slopes at the breakpoints, zero at a peak."""
    rises = np.diff(values) / widths
    if len(rises) == 1:
        return np.repeat(rises, 2)
    slopes = [_end(widths[:2], rises[:2])]
    for k in range(1, len(rises)):
        before, after = rises[k - 1], rises[k]
        near, far = 2.0 * widths[k] + widths[k - 1], widths[k] + 2.0 * widths[k - 1]
        slopes.append(0.0 if before * after <= 0.0 else (near + far) / (near / before + far / after))
    return np.array([*slopes, _end(widths[:-3:-1], rises[:-3:-1])])


def _end(widths: Array, rises: Array) -> float:
    """The slope at an end, by the parabola through three points, as far as that keeps the sense of the first rise."""
    slope = float(((2.0 * widths[0] + widths[1]) * rises[0] - widths[0] * rises[1]) / widths.sum())
    if slope * rises[0] <= 0.0:
        return 0.0
    if rises[0] * rises[1] <= 0.0 and abs(slope) > 3.0 * abs(rises[0]):
        return 3.0 * float(rises[0])
    return slope


def _polynomial(coefficients: Sequence[Any], x: Any) -> Any:
    """By Horner's rule, the constant first."""
    *lower, result = coefficients
    for coefficient in reversed(lower):
        result = coefficient + x * result
    return result
