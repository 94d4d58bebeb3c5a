"""The cruise law with a tunable potential: the desired gap follows the target speed, within a band of free choice."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Parameter, State
from ..maths import clip, sqrt
from .pairwise import PairwiseCruise

_SETTLE = 1.0
"""s: time constant with which the desired gap comes to rest, after the stretch of limited rate."""


class TunablePotentialCruise(PairwiseCruise):
    """Cruise law with a tunable potential and a gap that follows the speed (reconstructed after Huang et al. 2022).

    With the error e = d - d* and s = e - clip(e, -delta, delta), the pull is P = kappa s / sqrt(s^2 + w^2): nothing
    within the tolerance delta, never more than kappa. Trains may come to rest anywhere in [d* - delta, d* + delta]:
    that is the "controllable range" of the source. The desired gap is a moving-block distance,
    d*(v) = gap_base + gap_time v + v^2 / (2 gap_braking) at the target speed, its rate limited to ``gap_rate``. The
    frame is b = k (v_r - v) + f(ahead) - rho f(behind), f = alpha (relative speed) + P.

    None of these formulas is the authors': theirs are lost. They satisfy the article's prose and fit its Table 4. There
    is no hard bound of the gaps: ``range_violated`` says that one is not positive.
    """

    source = "Huang et al. 2022 (J. Adv. Transp. 3639586): prose and Table 4; formulas reconstructed"
    equations = (
        r"$b = k\,(v_\mathrm{r} - v) + f_\mathrm{ahead} - \rho\, f_\mathrm{behind}, \qquad"
        r" f = \alpha\,(v_\mathrm{front} - v_\mathrm{rear}) + P(d)$",
        r"$e = d - d^*, \qquad s = e - \mathrm{clip}(e, -\delta, \delta), \qquad"
        r" P = \kappa\, s\,/\,\sqrt{s^2 + w^2}$",
        r"$d^* \rightarrow d_0 + \tau v_\mathrm{r} + v_\mathrm{r}^2\,/\,(2 b_0)$, at the rate gap_rate at most",
        r"$F = m\,(u + c_0 + c_1 v + c_2 v^2 + r)$, with $u = b$ or, with a limit, $u$ = $b$ held within it",
        r"Reconstructed: with gap $d$, desired_gap $d^*$, gap_tolerance $\delta$, pull_limit $\kappa$, gap_width $w$,"
        r" gap_base $d_0$, gap_time $\tau$, gap_braking $b_0$, demand $u$, force $F$, mass $m$, line_resistance $r$.",
    )
    note = "Reconstructed: the source's formulas and most of its parameters are lost; law and gains are ours."
    recommended_step = 0.1

    k = Parameter(
        "1/s", 0.0094, tunable=True, minimum=0.0, description="gain on the error to the target speed (reconstructed)"
    )
    alpha = Parameter(
        "1/s", 0.035, tunable=True, minimum=0.0, description="gain on speed differences of neighbours (reconstructed)"
    )
    rho = Parameter("1", 2.0 / 3.0, tunable=True, minimum=0.0, description="weight of the train behind (reconstructed)")
    pull_limit = Parameter(
        "m/s2", 2.3, tunable=True, minimum=0.0, description="largest pull of a gap, kappa (reconstructed)"
    )
    gap_tolerance = Parameter(
        "m",
        50.0,
        tunable=True,
        minimum=0.0,
        description="half width of the band of free gaps, delta: the tuning parameter",
    )
    gap_width = Parameter(
        "m", 200.0, tunable=True, minimum=1e-3, description="how soon the pull saturates, w (reconstructed)"
    )
    gap_base = Parameter(
        "m", 1.8e3, tunable=True, minimum=0.0, description="constant part of the desired gap (reconstructed)"
    )
    gap_time = Parameter(
        "s", 30.0, tunable=True, minimum=0.0, description="part of the desired gap per speed (reconstructed)"
    )
    gap_braking = Parameter(
        "m/s2", 0.7, tunable=True, minimum=1e-3, description="braking behind the desired gap (reconstructed)"
    )
    gap_rate = Parameter(
        "m/s", 1.0, tunable=True, minimum=0.0, description="largest rate of the desired gap (reconstructed)"
    )

    desired_gap = State("m", 7.4e3, output=True, description="desired gap d*, front to front")

    def initial(self) -> Values:
        return {"desired_gap": self._moving_block()}

    def derivatives(self) -> Values:
        rate = clip((self._moving_block() - self.desired_gap) / _SETTLE, -self.gap_rate, self.gap_rate)
        return {**self._caution_rates(), "desired_gap": rate}

    def _moving_block(self) -> Any:
        """The desired gap at rest, m."""
        v = self.target_speed
        return self.gap_base + self.gap_time * v + v * v / (2.0 * self.gap_braking)

    def _pull(self, gap: Any) -> Any:
        error = gap - self.desired_gap
        s = error - clip(error, -self.gap_tolerance, self.gap_tolerance)
        return self.pull_limit * s / sqrt(s * s + self.gap_width * self.gap_width)

    def _pull_behind(self, gap: Any) -> Any:
        return self._pull(gap)

    def _compensated_speed(self) -> Any:
        return self.speed

    def _outside(self, gap: Any) -> Any:
        return gap <= 0.0
