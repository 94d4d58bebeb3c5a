"""Gradients, curves and tunnels, each with begins of their own, as sections that have all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from .quantities import ForeignError

_STRAIGHT = 1e-12
"""1/m: a curvature below this is a rounding error of none."""


class Curve(NamedTuple):
    """A stretch whose curvature changes linearly: begin and end in m, signed radii in m, 0 for straight."""

    begin: float
    end: float
    radius: float
    end_radius: float

    def radius_at(self, position: float) -> float:
        """Signed radius at a position inside; 0 is straight."""
        if position == self.begin or self.radius == self.end_radius:
            return self.radius
        if position == self.end:
            return self.end_radius
        share = (position - self.begin) / (self.end - self.begin)
        k0, k1 = (1.0 / r if r else 0.0 for r in (self.radius, self.end_radius))
        curvature = k0 + share * (k1 - k0)
        return 1.0 / curvature if abs(curvature) > _STRAIGHT else 0.0

    @property
    def turn(self) -> float | None:
        """Where it goes over from one hand to the other."""
        if self.radius * self.end_radius >= 0.0:
            return None
        share = self.end_radius / (self.end_radius - self.radius)
        return self.begin + share * (self.end - self.begin)


class Tunnel(NamedTuple):
    """Begin and end in m, cross-section in m2, 0 where it is not known."""

    begin: float
    end: float
    area: float


def sections(
    length: float,
    gradients: Sequence[tuple[float, float]],
    curves: Sequence[Curve],
    tunnels: Sequence[Tunnel],
) -> list[dict[str, Any]]:
    """Sections of a line in this project's format.

    Args:
        length: of the line in m.
        gradients: begin in m and rise over run; level before the first.
        curves: not overlapping; straight between them.
        tunnels: not overlapping.

    Raises:
        ForeignError: something begins or ends outside of the line.
    """
    turns = [curve.turn for curve in curves]
    begins = {0.0, *(p for p, _ in gradients), *(t for t in turns if t is not None)}
    begins |= {place for curve in curves for place in (curve.begin, curve.end)}
    begins |= {place for tunnel in tunnels for place in (tunnel.begin, tunnel.end)}
    for place in sorted(begins):
        if not 0.0 <= place <= length:
            raise ForeignError(f"position {place:g} m is not on the line, which ends at {length:g} m")
    places = sorted(begins - {length})
    found: list[dict[str, Any]] = []
    for begin, end in zip(places, [*places[1:], length], strict=True):
        section: dict[str, Any] = {"position": begin}
        gradient = next((g for p, g in reversed(gradients) if p <= begin), 0.0)
        curve = next((c for c in curves if c.begin <= begin < c.end), None)
        tunnel = next((t for t in tunnels if t.begin <= begin < t.end), None)
        if gradient:
            section["gradient"] = gradient
        if curve is not None:
            radius = 0.0 if curve.turn == begin else abs(curve.radius_at(begin))
            end_radius = 0.0 if curve.turn == end else abs(curve.radius_at(end))
            if radius:
                section["radius"] = radius
            if end_radius != radius:
                section["end_radius"] = end_radius
        if tunnel is not None:
            section |= {"tunnel": tunnel.end - tunnel.begin} | ({"area": tunnel.area} if tunnel.area else {})
        if not found or section != found[-1] | {"position": begin} or "end_radius" in section:
            found.append(section)
    return found
