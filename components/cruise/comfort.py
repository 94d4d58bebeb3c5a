"""The comfort-aware cruise law: a potential field between trains under a tanh layer."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Parameter
from ..maths import logical_and, logical_or, tanh, where
from .guarded import GuardedCruise
from .range_field import outside, slope


class ComfortCruise(GuardedCruise):
    """Two-layer potential-field cruise law with a tanh comfort layer (Wang et al. 2020, eqs. 3-9).

    Bottom layer: b = alpha (v_r - v) + beta sum_j (v_j - v) + gamma [U'(gap ahead) - U'(gap behind)], with
    U(d) = 1/(d^2 - gap_min^2) + 1/(gap_max^2 - d^2). Comfort layer: demand = a_max tanh(b / a_max). The force adds the
    resistance at the own present speed, outside the tanh.

    The source's proof that gaps stay in range does not hold under the comfort layer (it treats 1 - tanh^2 as one
    constant for all trains); starts inside the range can leave it. ``range_violated`` says when.

    A leader that is heard counts as one more neighbour in the speed differences (ours). Old data: see `GuardedCruise`;
    with fresh data the law is the published one.
    """

    source = "Wang et al. 2020, eqs. 3-9"
    equations = (
        r"$b = \alpha\,(v_\mathrm{r} - v) + \beta \sum_j\,(v_j - v)"
        r" + \gamma \left[ U'(d_\mathrm{ahead}) - U'(d_\mathrm{behind}) \right]$",
        r"$U(d) = \dfrac{1}{d^2 - d_\mathrm{min}^2} + \dfrac{1}{d_\mathrm{max}^2 - d^2}, \qquad"
        r" U'(d) = \dfrac{2 d}{(d_\mathrm{max}^2 - d^2)^2} - \dfrac{2 d}{(d^2 - d_\mathrm{min}^2)^2}$",
        r"$u = a_\mathrm{max} \tanh(b\,/\,a_\mathrm{max})$ with the comfort layer, else $u = b$",
        r"$F = m\,(u + c_0 + c_1 v + c_2 v^2 + r)$",
        r"with bottom_demand $b$, demand $u$, force $F$, own speed $v$, target_speed $v_\mathrm{r}$, the speeds $v_j$"
        r" of the trains ahead and behind, gaps $d$ to them, gap_min $d_\mathrm{min}$, gap_max $d_\mathrm{max}$,"
        r" acceleration_limit $a_\mathrm{max}$, mass $m$ and line_resistance $r$. A missing neighbour contributes"
        r" nothing; the differences of squares are kept at least 1 m² away from zero.",
    )
    note = (
        "The default gains alpha, beta are the figure-consistent ones (4.8/140 1/s); the source states 0.01 1/s, with "
        "which its own figures do not come out. The source's range guarantee is not valid for the comfort layer."
    )
    recommended_step = 0.1

    alpha = Parameter(
        "1/s", 4.8 / 140.0, tunable=True, minimum=0.0, description="gain on the error to the target speed"
    )
    beta = Parameter(
        "1/s", 4.8 / 140.0, tunable=True, minimum=0.0, description="gain on speed differences to the neighbours"
    )
    gamma = Parameter(
        "m4/s2", 1e8, tunable=True, minimum=0.0, description="gain on the potential field (0.1 (m/s2) km3)"
    )
    gap_min = Parameter("m", 15e3, tunable=True, minimum=0.0, description="lower bound of the gap, front to front")
    gap_max = Parameter("m", 20e3, tunable=True, minimum=0.0, description="upper bound of the gap, front to front")
    comfort_layer = Parameter(
        "1", True, tunable=True, description="whether the tanh layer acts; without it the bottom layer alone"
    )
    acceleration_limit = Parameter(
        "m/s2", 1.0, tunable=True, minimum=1e-6, description="bound of the comfort layer, a_max"
    )

    def derivatives(self) -> Values:
        return self._caution_rates()

    def outputs(self) -> Values:
        bottom = self._bottom()
        limit = self.acceleration_limit
        demand = self._guarded(where(self.comfort_layer, limit * tanh(bottom / limit), bottom))
        return {
            "demand": demand,
            "force": self.mass * (self._resistance(self.speed) + demand),
            "bottom_demand": bottom,
            "range_violated": logical_or(
                logical_and(self.has_ahead, outside(self._gap_ahead(), self.gap_min, self.gap_max)),
                logical_and(self.has_behind, outside(self._gap_behind(), self.gap_min, self.gap_max)),
            ),
            "degraded": self._is_degraded(),
        }

    def _bottom(self) -> Any:
        behind = self._share_behind()
        consensus = where(self.has_ahead, self.ahead_speed - self.speed, 0.0) + where(
            self.has_behind, behind * (self.behind_speed - self.speed), 0.0
        )
        field = where(self.has_ahead, slope(self._gap_ahead(), self.gap_min, self.gap_max), 0.0) - where(
            self.has_behind, behind * slope(self._gap_behind(), self.gap_min, self.gap_max), 0.0
        )
        speeds = self.beta * (consensus + self._to_leader())
        return self.alpha * (self.target_speed - self.speed) + speeds + self.gamma * field
