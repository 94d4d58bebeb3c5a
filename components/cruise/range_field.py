"""The potential of a range of gaps, U(d) = 1/(d^2 - low^2) + 1/(high^2 - d^2): it grows without bound at both ends."""

from __future__ import annotations

from typing import Any

from ..maths import logical_or, maximum, where

_FLOOR = 1.0
"""m2: how near to a bound the potential's denominators may come (1e-6 km2), sign kept."""


def slope(gap: Any, low: Any, high: Any) -> Any:
    """U'(gap) in 1/m3: negative near the lower bound, positive near the upper one, restoring beyond them too."""
    below = _away_from_zero(gap * gap - low * low)
    above = _away_from_zero(high * high - gap * gap)
    return 2.0 * gap / (above * above) - 2.0 * gap / (below * below)


def outside(gap: Any, low: Any, high: Any) -> Any:
    """Whether a gap has left the open range."""
    return logical_or(gap <= low, gap >= high)


def _away_from_zero(difference: Any) -> Any:
    """Keep a difference of squares away from zero, its sign kept."""
    return where(difference < 0.0, -maximum(-difference, _FLOOR), maximum(difference, _FLOOR))
