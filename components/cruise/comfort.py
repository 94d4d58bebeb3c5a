"""The comfort-aware cruise law: a potential field between trains under a tanh layer."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Output, Parameter
from ..maths import logical_and, logical_or, maximum, tanh, where
from .port import CruiseController

_GAP_FLOOR = 1.0
"""m2: how near to a bound the potential's denominators may come (1e-6 km2 of the specification), sign kept."""


class ComfortCruise(CruiseController):
    """Two-layer potential-field cruise law with a tanh comfort layer (Wang et al. 2020, eqs. 3-9).

    Bottom layer: b = alpha (v_r - v) + beta sum_j (v_j - v) + gamma [U'(gap ahead) - U'(gap behind)], with
    U(d) = 1/(d^2 - gap_min^2) + 1/(gap_max^2 - d^2). Comfort layer: demand = a_max tanh(b / a_max). The force adds the
    resistance at the own present speed, outside the tanh.

    The source's proof that gaps stay in range does not hold under the comfort layer (it treats 1 - tanh^2 as one
    constant for all trains); starts inside the range can leave it. ``range_violated`` says when.
    """

    source = "Wang et al. 2020, eqs. 3-9"
    note = (
        "The default gains alpha, beta are the figure-consistent ones (4.8/140 1/s); the source states 0.01 1/s, with "
        "which its own figures do not come out. The source's range guarantee is not valid for the comfort layer."
    )
    recommended_step = 0.1

    alpha = Parameter("1/s", 4.8 / 140.0, minimum=0.0, description="gain on the error to the target speed")
    beta = Parameter("1/s", 4.8 / 140.0, minimum=0.0, description="gain on speed differences to the neighbours")
    gamma = Parameter("m4/s2", 1e8, minimum=0.0, description="gain on the potential field (0.1 (m/s2) km3)")
    gap_min = Parameter("m", 15e3, minimum=0.0, description="lower bound of the gap, front to front")
    gap_max = Parameter("m", 20e3, minimum=0.0, description="upper bound of the gap, front to front")
    comfort_layer = Parameter("1", True, description="whether the tanh layer acts; without it the bottom layer alone")
    acceleration_limit = Parameter("m/s2", 1.0, minimum=1e-6, description="bound of the comfort layer, a_max")

    bottom_demand = Output("m/s2", description="demand of the bottom layer, before the comfort layer")

    def outputs(self) -> Values:
        bottom = self._bottom()
        limit = self.acceleration_limit
        demand = where(self.comfort_layer, limit * tanh(bottom / limit), bottom)
        resistance = self._davis(self.speed) + self.line_resistance
        return {
            "demand": demand,
            "force": self.mass * (resistance + demand),
            "bottom_demand": bottom,
            "range_violated": logical_or(
                logical_and(self.has_ahead, self._outside(self._gap_ahead())),
                logical_and(self.has_behind, self._outside(self._gap_behind())),
            ),
        }

    def _bottom(self) -> Any:
        consensus = where(self.has_ahead, self.ahead_speed - self.speed, 0.0) + where(
            self.has_behind, self.behind_speed - self.speed, 0.0
        )
        field = where(self.has_ahead, self._slope(self._gap_ahead()), 0.0) - where(
            self.has_behind, self._slope(self._gap_behind()), 0.0
        )
        return self.alpha * (self.target_speed - self.speed) + self.beta * consensus + self.gamma * field

    def _gap_ahead(self) -> Any:
        return self.ahead_position - self.position

    def _gap_behind(self) -> Any:
        return self.position - self.behind_position

    def _outside(self, gap: Any) -> Any:
        return logical_or(gap <= self.gap_min, gap >= self.gap_max)

    def _slope(self, gap: Any) -> Any:
        """U'(gap) in 1/m3: negative near the lower bound, positive near the upper one, restoring beyond them too."""
        low = _guarded(gap * gap - self.gap_min * self.gap_min)
        high = _guarded(self.gap_max * self.gap_max - gap * gap)
        return 2.0 * gap / (high * high) - 2.0 * gap / (low * low)


def _guarded(difference: Any) -> Any:
    """Keep a difference of squares away from zero, its sign kept."""
    return where(difference < 0.0, -maximum(-difference, _GAP_FLOOR), maximum(difference, _GAP_FLOOR))
