"""A line: what slopes and curves add to a train's resistance."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ..component import Component, Values
from ..declarations import Data, Input, Output, Parameter
from ..maths import piecewise_constant
from .profile import number

_GRAVITY = 9.81
"""m/s2."""
_CURVE = 600.0
"""m: a curve of radius R resists with 600/R newtons per kilonewton of weight."""
_TUNNEL = 0.00013
"""1/m: a tunnel of length L resists with 0.00013 L newtons per kilonewton of weight."""
_KEYS = ("position", "gradient", "radius", "tunnel", "resistance")


class Profile(NamedTuple):
    """Begins of the sections in m, and their specific resistances in N/kg."""

    positions: list[float]
    resistances: list[float]


def read_line(data: Any) -> Profile:
    """A line from its data: sections in order, each from its ``position`` to the next one's.

    Raises:
        ValueError: unusable data.
    """
    if not isinstance(data, Sequence) or isinstance(data, str) or not data:
        raise ValueError("a line is a list of sections, each a table with 'position' and 'gradient', 'radius' or both")
    if not all(isinstance(row, Mapping) for row in data):
        raise ValueError("each section of a line is a table, as in { position = 0, gradient = 0.01, radius = 7000 }")
    positions = [number(row, "position") for row in data]
    if any(a >= b for a, b in itertools.pairwise(positions)):
        raise ValueError("the positions of a line's sections must rise")
    return Profile(positions, [_resistance(row) for row in data])


def _resistance(row: Mapping[str, Any]) -> float:
    unknown = sorted(row.keys() - set(_KEYS))
    if unknown:
        raise ValueError(f"a section of a line has no {unknown[0]!r}; it has {', '.join(_KEYS)}")
    slope = number(row, "gradient") if "gradient" in row else 0.0
    further = number(row, "resistance") if "resistance" in row else 0.0
    radius = number(row, "radius") if "radius" in row else 0.0
    tunnel = number(row, "tunnel") if "tunnel" in row else 0.0
    if radius < 0.0:
        raise ValueError(f"a radius is positive, or 0 for a straight track, not {radius:g}")
    curve = _CURVE / radius / 1000.0 if radius else 0.0
    return _GRAVITY * (slope + curve + _TUNNEL * tunnel / 1000.0) + further


class Line(Component):
    """The resistance of slopes, curves and tunnels at one train's position, constant in each section of the line.

    Specific resistance g (gradient + 0.6 m / radius) + resistance; the gradient is rise over run, uphill positive,
    the curve formula 600/R N/kN, a tunnel of length L adds 0.00013 L N/kN. The train is a point; before the first
    section it has the first one's resistance.
    """

    source = "gradient: weight along the slope; curves: 600/R N/kN, usual in Chinese traction calculation (TB/T 1407)"
    equations = (
        r"$r = g \left( i + 0.6\,/\,R \right) + r_0$ with a section's gradient $i$, radius $R$ in m, resistance $r_0$",
    )

    profile = Data(
        [{"position": 0.0, "gradient": 0.0}],
        convert=read_line,
        description="sections, each with 'position' (m, its begin) and any of 'gradient' (rise over run), "
        "'radius' (m), 'tunnel' (m, its length) and 'resistance' (N/kg, further resistance)",
    )

    position = Input("m", description="position of the train")
    factor = Parameter("1", 1.0, description="factor on the whole profile, to know it wrongly on purpose")

    line_resistance = Output("N/kg", description="resistance of slope and curve per mass")

    def outputs(self) -> Values:
        return {
            "line_resistance": self.factor
            * piecewise_constant(self.position, self.profile.positions, self.profile.resistances)
        }
