"""Fields that keep gaps in a range: their potentials grow without bound at both ends."""

from __future__ import annotations

from typing import Any

from ..maths import logical_or, maximum, where

_FLOOR = 1.0
"""m2: how near to a bound the potential's denominators may come (1e-6 km2), sign kept."""
_NEAREST = 1.0
"""m: how near to a bound the walls' denominators may come."""


def slope(gap: Any, low: Any, high: Any) -> Any:
    """U'(gap) in 1/m3 of U(d) = 1/(d^2 - low^2) + 1/(high^2 - d^2).

    Negative near the lower bound, positive near the upper one, restoring beyond them too.
    """
    below = _away_from_zero(gap * gap - low * low)
    above = _away_from_zero(high * high - gap * gap)
    return 2.0 * gap / (above * above) - 2.0 * gap / (below * below)


def walls(gap: Any, low: Any, high: Any, low_margin: Any, high_margin: Any) -> Any:
    """Zero inside the range but for margins at its ends, where it grows without bound; restoring beyond them too.

    [h/(high - gap) - 1]+ - [l/(gap - low) - 1]+ with the margins l and h: the slope of logarithmic barriers that begin
    where the margins do. Without a unit.
    """
    upper = maximum(high_margin / maximum(high - gap, _NEAREST) - 1.0, 0.0)
    lower = maximum(low_margin / maximum(gap - low, _NEAREST) - 1.0, 0.0)
    return upper - lower


def outside(gap: Any, low: Any, high: Any) -> Any:
    """Whether a gap has left the open range."""
    return logical_or(gap <= low, gap >= high)


def _away_from_zero(difference: Any) -> Any:
    """Keep a difference of squares away from zero, its sign kept."""
    return where(difference < 0.0, -maximum(-difference, _FLOOR), maximum(difference, _FLOOR))
