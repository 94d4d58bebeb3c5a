"""A line: what slopes and curves add to a train's resistance."""

from __future__ import annotations

from typing import NamedTuple

from ..component import Component, Values
from ..declarations import Data, Input, Output, Parameter, Size
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
    """Begins of the sections in m, their specific resistances in N/kg, and what of these opposes motion either way."""

    positions: list[float]
    resistances: list[float]
    opposing: list[float]


def _section(
    position: float, gradient: float, radius: float, tunnel: float, further: float
) -> tuple[float, float, float]:
    """Begin of a section, its resistance, and what of it is not its slope's."""
    if 0.0 < radius < _TIGHTEST:
        raise ValueError(f"'radius' is in m, 0 for straight track: {radius:g} is tighter than any curve, {_TIGHTEST:g}")
    curve = _CURVE / radius / 1000.0 if radius else 0.0
    inside = _TUNNEL * tunnel / 1000.0
    return position, _GRAVITY * (gradient + curve + inside) + further, _GRAVITY * (curve + inside) + further


SECTIONS = Table(
    "section",
    [
        Column("position", "m", after="position", note="its begin"),
        Column("gradient", default=0.0, within=(-_STEEPEST, _STEEPEST), note="rise over run"),
        Column("radius", "m", default=0.0, sign="non-negative"),
        Column("tunnel", "m", default=0.0, within=(0.0, _LONGEST), note="its length"),
        Column("resistance", "N/kg", default=0.0, within=(0.0, 1.5), note="further resistance to motion"),
    ],
    make=_section,
    whole=lambda sections: Profile(*map(list, zip(*sections, strict=True))),
)


class Line(Component):
    """The resistance of slopes, curves and tunnels at one train's position, constant in each section of the line.

    Specific resistance g (gradient + 0.6 m / radius) + resistance; the gradient is rise over run, uphill positive,
    the curve formula 600/R N/kN, a tunnel of length L adds 0.00013 L N/kN. The train is a point; before the first
    section it has the first one's resistance. ``gradients`` are added to those of the sections.

    ``line_resistance`` is all of it for a train that runs forwards. ``curve_resistance`` is what of it opposes motion,
    whichever way: curve, tunnel and further resistance. A train that is not told takes all for the slope's, and a
    curve may then pull it back at rest.
    """

    source = "gradient: weight along the slope; curves: 600/R N/kN, usual in Chinese traction calculation (TB/T 1407)"
    equations = (
        r"$r = g\,(i + \Delta i) + r_\mathrm{c}, \qquad"
        r" r_\mathrm{c} = g \left( 0.6\,/\,R + 1.3 \cdot 10^{-7} L \right) + r_0$ with a section's gradient $i$, radius"
        r" $R$ and tunnel $L$ in m, further gradient $\Delta i$, further resistance $r_0$; line_resistance $r$ and"
        r" curve_resistance $r_\mathrm{c}$",
    )

    profile = Data([{"position": 0.0, "gradient": 0.0}], convert=SECTIONS.read, description=SECTIONS.description)

    points = Size(1, description="number of further gradients")

    position = Input("m", description="position of the train")
    positions = Parameter("m", 0.0, shape=(points,), rising=True, description="begins of further gradients, rising")
    gradients = Parameter(
        "1", 0.0, shape=(points,), description="rise over run added from each on, to vary without building anew"
    )
    factor = Parameter("1", 1.0, description="factor on the whole profile, to know it wrongly on purpose")

    line_resistance = Output("N/kg", description="resistance of slope, curve and tunnel per mass")
    curve_resistance = Output("N/kg", description="part of it that opposes motion either way: curve and tunnel")

    def outputs(self) -> Values:
        resistance, opposing = (
            piecewise_constant(self.position, self.profile.positions, values)
            for values in (self.profile.resistances, self.profile.opposing)
        )
        further = _GRAVITY * piecewise_constant(self.position, self.positions, self.gradients)
        return {"line_resistance": self.factor * (resistance + further), "curve_resistance": self.factor * opposing}
