"""What a curve resists with, and the exact integral of it along a transition curve."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..maths import log

GRAVITY = 9.81
"""m/s2."""
_ROUNDING = 1e-12
"""Of a curvature that was computed from a radius."""


class CurveLaw(NamedTuple):
    """A resistance of a / (R - b) newtons per kilonewton of weight, a and b in m, for radii R from ``smallest`` on."""

    a: float
    b: float
    smallest: float


LAWS = {
    "600/R": (CurveLaw(600.0, 0.0, 10.0),),
    "roeckl": (CurveLaw(650.0, 55.0, 300.0), CurveLaw(500.0, 30.0, 100.0)),
}
"""By name, widest curves first: that of Chinese traction calculation (TB/T 1407), and Röckl's for standard gauge."""


def arc(radius: float, name: str) -> float:
    """Resistance of an arc of a radius in m, in N per N of weight; 0 is straight.

    Raises:
        ValueError: it is tighter than the law holds for.
    """
    if not radius:
        return 0.0
    for law in LAWS[name]:
        if radius >= law.smallest:
            return law.a / (radius - law.b) / 1000.0
    raise _too_tight(radius, name)


class Transition(NamedTuple):
    """A part of a transition curve under one law: begin, end (m), curvature at the begin (1/m), its slope (1/m2)."""

    begin: float
    end: float
    curvature: float
    slope: float
    law: CurveLaw

    def at(self, position: Any) -> Any:
        """Resistance at a position inside, in N/kg."""
        k = self.curvature + self.slope * (position - self.begin)
        return GRAVITY * self.law.a / 1000.0 * k / (1.0 - self.law.b * k)

    def until(self, way: Any) -> Any:
        """Integral of the resistance over the first ``way`` metres, in J/kg: of a k / (1 - b k) with linear k."""
        s, b, k = self.slope, self.law.b, self.curvature
        if b == 0.0:
            integral = way * (k + 0.5 * s * way)
        else:
            integral = -(way + log(1.0 - b * s * way / (1.0 - b * k)) / (b * s)) / b
        return GRAVITY * self.law.a / 1000.0 * integral


def transitions(begin: float, end: float, radius: float, end_radius: float, name: str) -> list[Transition]:
    """A transition curve in parts under one law each: its curvature changes linearly from one radius to the other.

    Args:
        begin: in m.
        end: in m, beyond it.
        radius: at the begin, in m; 0 is straight.
        end_radius: at the end, another one.
        name: of the law.

    Raises:
        ValueError: it is tighter than the law holds for.
    """
    k0, k1 = (1.0 / r if r else 0.0 for r in (radius, end_radius))
    slope = (k1 - k0) / (end - begin)
    found, low = [], 0.0
    for law in LAWS[name]:
        high = 1.0 / law.smallest
        a, b = (begin + (min(max(k, low), high) - k0) / slope for k in (k0, k1))
        if b > a:
            found.append(Transition(a, b, k0 + slope * (a - begin), slope, law))
        low = high
    if max(k0, k1) > low * (1.0 + _ROUNDING):
        raise _too_tight(1.0 / max(k0, k1), name)
    return sorted(found)


def _too_tight(radius: float, name: str) -> ValueError:
    return ValueError(
        f"'radius' is in m, 0 for straight track: {radius:g} is tighter than any curve of {name}, "
        f"{LAWS[name][-1].smallest:g}"
    )
