"""The error transformation that turns a range into a whole line: bounded there, inside the range here.

For a range (-a, b): s(y) = a b y / Q with Q = (a + y)(b - y). It is normalised to s(0) = 0 and s'(0) = 1, so that gains
keep their physical meaning. Re-derived after Zhang & Chen 2022, eqs. 34-35, properties P1-P3.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..maths import clip, logical_or, where

_NARROWEST = 1e-3
"""A range that wrong parameters turned around is taken to be this wide on that side: finite, and flagged elsewhere."""


class Range(NamedTuple):
    """The open range (-low, high) of an error, both positive."""

    low: Any
    high: Any


class Transformed(NamedTuple):
    """An error and its transformation.

    Attributes:
        y: the error, held inside the given fraction of the range.
        clipped: whether it had to be held; derivatives are then taken as zero.
        s: a b y / Q.
        mu: ds/dy.
        mu_slope: d2s/dy2.
    """

    y: Any
    clipped: Any
    s: Any
    mu: Any
    mu_slope: Any


def usable(limits: Range) -> Range:
    """The range with both sides positive whatever the parameters."""
    return Range(*(where(side > _NARROWEST, side, _NARROWEST) for side in limits))


def outside(y: Any, limits: Range) -> Any:
    """Whether an error has left its range, bounds included."""
    return logical_or(y <= -limits.low, y >= limits.high)


def transform(error: Any, limits: Range, fraction: Any) -> Transformed:
    """The transformation of an error, held inside a fraction of its range."""
    a, b = limits
    y = clip(error, -fraction * a, fraction * b)
    clipped = logical_or(error < -fraction * a, error > fraction * b)
    q, n = (a + y) * (b - y), a * b + y * y
    slope = b - a - 2.0 * y
    return Transformed(y, clipped, a * b * y / q, a * b * n / (q * q), 2.0 * a * b * (y * q - n * slope) / (q * q * q))


def push(e: Transformed) -> tuple[Any, Any]:
    """h(e) = s mu and its slope, zero where e is clipped."""
    return e.s * e.mu, where(e.clipped, 0.0, e.mu * e.mu + e.s * e.mu_slope)


def share(z: Transformed, limits: Range) -> tuple[Any, Any]:
    """g(z) = z / (s mu) = Q^3 / ((a b)^2 N), without 0/0 at z = 0, and its slope, zero where z is clipped."""
    (a, b), y = limits, z.y
    q, n = (a + y) * (b - y), a * b + y * y
    slope = b - a - 2.0 * y
    scale = a * b * a * b * n
    g = q * q * q / scale
    return g, where(z.clipped, 0.0, (3.0 * q * q * slope * n - 2.0 * y * q * q * q) / (scale * n))
