"""A line: what slopes and curves add to a train's resistance."""

from __future__ import annotations

from typing import NamedTuple

from ..component import Component, Values
from ..declarations import Data, Input, Output, Parameter
from ..maths import piecewise_constant
from ..tables import Column, Table

_GRAVITY = 9.81
"""m/s2."""
_CURVE = 600.0
"""m: a curve of radius R resists with 600/R newtons per kilonewton of weight."""
_TUNNEL = 0.00013
"""1/m: a tunnel of length L resists with 0.00013 L newtons per kilonewton of weight."""
_STEEPEST = 0.15
"""Steeper than any adhesion railway (Lisbon's trams: 0.135); 5 is 500 %, and meant as per mille."""
_TIGHTEST = 10.0
"""m: tighter than any tram's curve; less is meant as km, or as a curvature."""
_LONGEST = 1e5
"""m: longer than any tunnel (Gotthard: 57 km)."""


class Profile(NamedTuple):
    """Begins of the sections in m, and their specific resistances in N/kg."""

    positions: list[float]
    resistances: list[float]


def _section(position: float, gradient: float, radius: float, tunnel: float, further: float) -> tuple[float, float]:
    """Begin and resistance of a section."""
    if 0.0 < radius < _TIGHTEST:
        raise ValueError(f"'radius' is in m, 0 for straight track: {radius:g} is tighter than any curve, {_TIGHTEST:g}")
    curve = _CURVE / radius / 1000.0 if radius else 0.0
    return position, _GRAVITY * (gradient + curve + _TUNNEL * tunnel / 1000.0) + further


SECTIONS = Table(
    "section",
    [
        Column("position", "m", after="position", note="its begin"),
        Column("gradient", default=0.0, within=(-_STEEPEST, _STEEPEST), note="rise over run"),
        Column("radius", "m", default=0.0, sign="non-negative"),
        Column("tunnel", "m", default=0.0, within=(0.0, _LONGEST), note="its length"),
        Column("resistance", "N/kg", default=0.0, within=(-1.5, 1.5), note="further resistance"),
    ],
    make=_section,
    whole=lambda sections: Profile(*map(list, zip(*sections, strict=True))),
)


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

    profile = Data([{"position": 0.0, "gradient": 0.0}], convert=SECTIONS.read, description=SECTIONS.description)

    position = Input("m", description="position of the train")
    factor = Parameter("1", 1.0, description="factor on the whole profile, to know it wrongly on purpose")

    line_resistance = Output("N/kg", description="resistance of slope and curve per mass")

    def outputs(self) -> Values:
        return {
            "line_resistance": self.factor
            * piecewise_constant(self.position, self.profile.positions, self.profile.resistances)
        }
