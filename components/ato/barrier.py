"""The barrier of a sampled controller: its function, its slope, where it must become a straight line, and stability.

Near the bound the slope of chi exceeds any sampling rate, and beyond it the formula is periodic nonsense: from kappa
times the bound on it is continued as a straight line.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ..maths import clip, cos, logical_and, pi, tan, where

_KAPPA_LOW, _KAPPA_HIGH = 0.5, 0.999
_HALVINGS = 40


class Loop(NamedTuple):
    """What the sampled loop's stability depends on.

    Attributes:
        step: sample period h in s. alpha: in 1/s. beta: in N.s/m. mass: M in kg. delay: of the loop in samples.
        gain: of the estimates' correction on the error, G1 + G2 v^2 + G3 v^4, in N.s/m.
    """

    step: Any
    alpha: Any
    beta: Any
    gain: Any
    mass: Any
    delay: Any


def slope(kappa: Any) -> Any:
    """D chi / d delta at delta = kappa v_b, for |kappa| < 1; it does not depend on v_b."""
    z = 0.5 * pi * kappa * kappa
    c = cos(z)
    return (1.0 + 4.0 * z * tan(z)) / (c * c)


def chi(error: Any, bound: Any, kappa: Any) -> Any:
    """Delta / cos^2(pi delta^2 / (2 v_b^2)) (Liu & Hou 2020, eq. 33), continued linearly beyond kappa v_b."""
    edge = kappa * bound
    inner = clip(error, -edge, edge)
    ratio = inner / bound
    c = cos(0.5 * pi * ratio * ratio)
    return inner / (c * c) + slope(kappa) * (error - inner)


def stretch_begin(loop: Loop) -> Any:
    """kappa: the largest value up to 0.999, but not under 0.5, at which the sampled loop bears the barrier's slope.

    h (alpha + (beta + gain chi'(kappa v_b)) / M) is to stay below 1.5 without delay and 0.8 with one sample of it
    (0.45, ours, with two). The gain is that at the highest speed.
    """
    limit = where(loop.delay < 0.5, 1.5, where(loop.delay < 1.5, 0.8, 0.45))

    def bears(kappa: Any) -> Any:
        return loop.step * (loop.alpha + (loop.beta + loop.gain * slope(kappa)) / loop.mass) <= limit

    low: Any = _KAPPA_LOW
    high: Any = _KAPPA_HIGH
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        good = bears(middle)
        low, high = where(good, middle, low), where(good, high, middle)
    return where(bears(_KAPPA_HIGH), _KAPPA_HIGH, low)


def is_stable(loop: Loop) -> Any:
    """Whether the rigid train under the held force is stable (Jury's criterion), for up to two samples of delay.

    Its characteristic polynomial is z^d (z - 1)^2 + (p + q) z + (p - q) with p = h^2 alpha (beta + gain) / (2 M) and
    q = h (alpha + (beta + gain) / M), the gain that at standstill.
    """
    step, alpha, beta, gain, mass, delay = loop
    p = 0.5 * step * step * alpha * (beta + gain) / mass
    q = step * (mass * alpha + beta + gain) / mass
    first, last = p + q, p - q
    without = logical_and(p < q, q < 2.0)
    one = logical_and(abs(last) < 1.0, 1.0 - last * last > abs(-2.0 * last - (1.0 + first)))
    # Jury's table of z^4 - 2 z^3 + z^2 + first z + last
    b0, b1, b2, b3 = last * last - 1.0, last * first + 2.0, last - 1.0, -2.0 * last - first
    c0, c2 = b0 * b0 - b3 * b3, b0 * b2 - b1 * b3
    two = logical_and(
        logical_and(abs(last) < 1.0, 4.0 - first + last > 0.0), logical_and(abs(b0) > abs(b3), abs(c0) > abs(c2))
    )
    return where(delay < 0.5, without, where(delay < 1.5, one, two))
