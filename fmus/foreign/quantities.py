"""Units of foreign data files, and the checks that each of their values passes on its way into SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...components.errors import nearest

_UNITS: dict[str, dict[str, float]] = {
    "place": {"m": 1.0, "km": 1e3},
    "length": {"m": 1.0, "km": 1e3},
    "radius": {"m": 1.0, "km": 1e3},
    "area": {"m^2": 1.0},
    "speed": {"km/h": 1.0 / 3.6, "m/s": 1.0},
    "gradient": {"permil": 1e-3, "%": 1e-2, "-": 1.0},
    "mass": {"kg": 1.0, "t": 1e3},
    "power": {"kW": 1e3, "W": 1.0, "MW": 1e6},
    "force": {"kN": 1e3, "N": 1.0},
    "linear resistance": {"kN/(km/h)": 3.6e3, "N/(m/s)": 1.0},
    "quadratic resistance": {"kN/(km/h)^2": 1e3 * 3.6 * 3.6, "N/(m/s)^2": 1.0},
    "acceleration": {"m/s^2": 1.0},
    "time": {"s": 1.0},
    "share": {"%": 1e-2, "-": 1.0},
    "number": {"-": 1.0},
}
_MAY_BE_NEGATIVE = ("place", "gradient", "radius")
_PER = {"km/h": 3.6, "permil": 1e3, "%": 1e2}
"""Units by whose inverse to divide, because the quotient of decimals is the nearest number to the true one."""


class ForeignError(ValueError):
    """A value of a foreign file is unusable; the message names key and remedy, the reader adds the file."""


def number(value: Any, quantity: str, key: str) -> float:
    """A finite number as it stands in the file, negative only where its quantity may be.

    Raises:
        ForeignError: it is none.
    """
    if isinstance(value, str):
        remedy = f": a decimal point, not a comma, {value.replace(',', '.')}" if "," in value else ""
        raise ForeignError(f"{key}: a number is wanted, not the text {value!r}{remedy}")
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ForeignError(f"{key}: a finite number is wanted, not {value!r}")
    if value < 0.0 and quantity not in _MAY_BE_NEGATIVE:
        raise ForeignError(f"{key}: {value!r} is negative; a {quantity} is positive by convention")
    return float(value)


def converted(value: Any, unit: Any, quantity: str, key: str) -> float:
    """A value in SI units.

    Raises:
        ForeignError: it is no number, or its unit is not one of the quantity.
    """
    known = _UNITS[quantity]
    if unit not in known:
        told = "it has no 'unit'" if unit is None else f"{unit!r} is no unit of a {quantity}"
        raise ForeignError(f"{key}: {told}; known: {', '.join(known)}")
    plain = number(value, quantity, key)
    return plain / _PER[unit] if unit in _PER else plain * known[unit]


@dataclass
class Fields:
    """The fields of a foreign object, taken one by one; what nobody took at the end was misspelt.

    Attributes:
        data: by key.
        within: the key of the object itself, for messages.
    """

    data: Mapping[str, Any]
    within: str = ""
    taken: set[str] = field(default_factory=set)

    def key(self, name: str) -> str:
        """A key as messages name it."""
        return f"{self.within}: {name!r}" if self.within else f"{name!r}"

    def get(self, name: str) -> Any:
        """What stands there, or None."""
        self.taken.add(name)
        return self.data.get(name)

    def has(self, name: str) -> bool:
        """Whether something does."""
        return self.get(name) is not None

    def table(self, name: str) -> Mapping[str, Any]:
        """The object that must stand there.

        Raises:
            ForeignError: it is missing, or something else.
        """
        found = self.get(name)
        if not isinstance(found, Mapping):
            raise ForeignError(f"{self.key(name)} {'is missing' if found is None else f'is no object: {found!r}'}")
        return found

    def value(self, name: str, quantity: str, otherwise: float | None = None) -> float:
        """A value with its unit, ``{"unit": ..., "value": ...}``, in SI units.

        Args:
            name: of the field.
            quantity: of the units above.
            otherwise: what it is where the file has none; without, it is required.

        Raises:
            ForeignError: it is missing or unusable.
        """
        if otherwise is not None and not self.has(name):
            return otherwise
        found = self.table(name)
        return converted(found.get("value"), found.get("unit"), quantity, self.key(name))

    def rows(self, name: str, columns: Mapping[str, str], rising: bool = True) -> list[list[float]]:
        """Rows of values, ``{"units": {column: unit}, "values": [[...], ...]}``, in SI units.

        Args:
            name: of the field.
            columns: their quantities by name, in order; of one column the unit stands in ``unit``, and rows are values.
            rising: whether the first column must rise from row to row.

        Raises:
            ForeignError: it is missing or unusable.
        """
        found, key = self.table(name), self.key(name)
        units = {next(iter(columns)): found.get("unit")} if len(columns) == 1 else found.get("units")
        values = found.get("values")
        if not isinstance(units, Mapping):
            raise ForeignError(f"{key}: it has no 'units', one for each of {', '.join(columns)}")
        if not isinstance(values, Sequence) or isinstance(values, str) or not values:
            raise ForeignError(f"{key}: 'values' is a list of at least one row, not {values!r}")
        rows = []
        for number_, row in enumerate(values, 1):
            cells = [row] if len(columns) == 1 else row
            where = f"{key} row {number_}"
            if not isinstance(cells, Sequence) or isinstance(cells, str) or len(cells) != len(columns):
                raise ForeignError(f"{where}: it has {len(columns)} values, {', '.join(columns)}, not {row!r}")
            converted_row = [
                _radius(cell, units.get(column), f"{where}, {column}")
                if quantity == "radius"
                else converted(cell, units.get(column), quantity, f"{where}, {column}")
                for cell, (column, quantity) in zip(cells, columns.items(), strict=True)
            ]
            rows.append(converted_row)
            if rising and number_ > 1 and not rows[-1][0] > rows[-2][0]:
                raise ForeignError(f"{where}: {next(iter(columns))} {rows[-1][0]:g} does not exceed {rows[-2][0]:g}")
        return rows

    def finish(self) -> None:
        """Refuse what no one asked for.

        Raises:
            ForeignError: a key is not known.
        """
        for unknown in sorted(self.data.keys() - self.taken):
            raise ForeignError(f"{self.within and self.within + ': '}no key {nearest(unknown, sorted(self.taken))}")


def _radius(value: Any, unit: Any, key: str) -> float:
    """Of a curve in m, 0 where the file says "infinity"; its sign says which hand.

    Raises:
        ForeignError: it is zero or no number.
    """
    if value in ("infinity", "-infinity"):
        return 0.0
    radius = converted(value, unit, "radius", key)
    if radius == 0.0:
        raise ForeignError(f'{key}: a radius of 0 is no curve; straight track is "infinity"')
    return radius
