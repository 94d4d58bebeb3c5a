"""What stays one call in the traced expressions, and is a loop over a table in C: look-ups, and products with matrices.

To CasADi they are functions whose bodies it knows, so it evaluates and differentiates them as it does anything.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...components.lookup.cells import Cells
from .ccode import Call, number

KNOWN: dict[str, Call] = {}
"""How the functions that were made are written, by their names, which follow from what they hold."""
TABLES: dict[str, list[NDArray[np.float64]]] = {}
"""The tables they read, by the same names: where the cells begin along each axis, then the constants."""
_MADE: dict[str, Any] = {}
"""CasADi's functions, by the same names."""
_NAME = re.compile(r"\b(?:cells|product)_[0-9a-f]{16}")


class _Find(Call):
    """A pointer to the constants of a cell: `sizes` are the numbers of cells along the axes, then of constants."""

    def __init__(self, name: str, sizes: Sequence[int]) -> None:
        self.name = name
        self.sizes = tuple(sizes)

    def read(self, arguments: tuple[int, ...]) -> tuple[int, ...]:
        return arguments

    def code(self, k: int, arguments: Sequence[str], results: int) -> str:
        row = ""
        for axis, (size, place) in enumerate(zip(self.sizes, arguments, strict=False)):
            found = f"find_cell({self.name}_{axis}, {size}, {place})"
            row = f"({row}) * {size} + {found}" if row else found
        return f"const double *const r{k} = {self.name}_{len(self.sizes) - 1} + {results} * ({row})"

    def result(self, k: int, place: int) -> str:
        return f"r{k}[{place}]"


class _Nothing(Call):
    """The derivative of constants."""

    def read(self, arguments: tuple[int, ...]) -> tuple[int, ...]:
        return ()

    def code(self, k: int, arguments: Sequence[str], results: int) -> str:
        return ""

    def result(self, k: int, place: int) -> str:
        return "0.0"


class _Multiply(Call):
    """A matrix with so many columns times the last arguments: of its derivative along a direction, the direction."""

    def __init__(self, name: str, columns: int) -> None:
        self.name = name
        self.columns = columns

    def read(self, arguments: tuple[int, ...]) -> tuple[int, ...]:
        return arguments[-self.columns :]

    def code(self, k: int, arguments: Sequence[str], results: int) -> str:
        call = f"multiply({self.name}_0, {results}, {self.columns}, v{k}, r{k})"
        return f"const double v{k}[] = {{{', '.join(arguments)}}}; double r{k}[{results}]; {call}"

    def result(self, k: int, place: int) -> str:
        return f"r{k}[{place}]"


def cells(table: Cells, places: Sequence[Any]) -> list[Any]:
    """The constants of the cell that a place is in, which do not change with it."""
    arrays = [*map(np.array, table.starts), table.constants]
    name = _named("cells", arrays)
    KNOWN[name] = _Find(name, table.constants.shape)
    KNOWN[f"fwd1_{name}"] = _Nothing()
    if name not in _MADE:
        where = [ca.SX.sym(f"x{k}") for k in range(len(places))]
        rows = [list(map(ca.SX, row)) for row in table.constants.reshape(-1, table.constants.shape[-1]).tolist()]
        for place, starts in zip(reversed(where), reversed(table.starts), strict=True):
            grouped = [rows[k : k + len(starts)] for k in range(0, len(rows), len(starts))]
            rows = [_chosen(place, starts, group) for group in grouped]
        options: Any = {"never_inline": True, "is_diff_in": [False] * len(places)}
        _MADE[name] = ca.Function(name, where, [ca.vertcat(*rows[0])], options)
    return list(ca.vertsplit(_MADE[name](*places)))


def product(matrix: NDArray[np.float64], vector: Sequence[Any]) -> list[Any]:
    """A matrix times a vector."""
    name = _named("product", [matrix.T])
    KNOWN[name] = KNOWN[f"fwd1_{name}"] = _Multiply(name, matrix.shape[1])
    if name not in _MADE:
        x = ca.SX.sym("x", matrix.shape[1])
        _MADE[name] = ca.Function(name, [x], [ca.densify(ca.mtimes(ca.SX(ca.DM(matrix)), x))], {"never_inline": True})
    return list(ca.vertsplit(_MADE[name](ca.vertcat(*vector))))


def tables(code: str) -> Iterator[str]:
    """The tables that C reads."""
    for name in sorted(set(_NAME.findall(code))):
        for k, array in enumerate(TABLES[name]):
            entries = "".join(f"    {number(x)},\n" for x in array.flat)
            yield f"static const double {name}_{k}[] = {{\n{entries}}};\n"


def _named(kind: str, arrays: list[NDArray[np.float64]]) -> str:
    digest = hashlib.sha256(repr([array.shape for array in arrays]).encode())
    for array in arrays:
        digest.update(array.tobytes())
    name = f"{kind}_{digest.hexdigest()[:16]}"
    TABLES[name] = arrays
    return name


def _chosen(place: Any, starts: Sequence[float], rows: Sequence[Sequence[Any]]) -> list[Any]:
    """The row of the last start not above a place."""
    found = list(rows[0])
    for start, row in zip(starts[1:], rows[1:], strict=True):
        found = [ca.if_else(place >= start, new, old) for new, old in zip(row, found, strict=True)]
    return found
