"""The range-keeping potential law, a baseline of Huang et al. 2022."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Parameter
from .pairwise import PairwiseCruise
from .range_field import outside, walls


class RangePotentialCruise(PairwiseCruise):
    """Cruise law that lets gaps be anywhere in a range (Li, Yang, Gao 2015; reconstructed after Huang et al. 2022).

    P(d) = kappa ([h/(d_max - d) - 1]+ - [l/(d - d_min) - 1]+), zero but for margins l and h at the ends of the range,
    in the frame b = k (v_r - v) + f(ahead) - rho f(behind), f = alpha (relative speed) + P, of which P(behind) counts
    by ``field_rho``. As in the source the resistance is compensated at the target speed, which adds the damping
    R(v_r) - R(v). The range is stated; the source's own potential is not known here. This one is flat inside, because
    the article has gaps stay once speeds agree; its margins, ``field_rho`` and the gains are fitted to what the article
    says of the law's run and to its Table 4.

    Gaps that start strictly inside the range stay inside in continuous exchange and without a limit on the demand.
    ``range_violated`` says when one is outside.
    """

    source = (
        "Li, Yang, Gao 2015, as reference [20] of Huang et al. 2022 (J. Adv. Transp. 3639586), section 4.3, Table 4"
    )
    equations = (
        r"$b = k\,(v_\mathrm{r} - v) + f_\mathrm{ahead} - \rho\, f_\mathrm{behind}, \qquad"
        r" f = \alpha\,(v_\mathrm{front} - v_\mathrm{rear}) + P(d)$, in $f_\mathrm{behind}$ with $\sigma\, P(d)$",
        r"$P(d) = \kappa \left( \left[ \dfrac{h}{d_\mathrm{max} - d} - 1 \right]^+"
        r" - \left[ \dfrac{l}{d - d_\mathrm{min}} - 1 \right]^+ \right)$",
        r"$F = m\,(u + c_0 + c_1 v_\mathrm{r} + c_2 v_\mathrm{r}^2 + r)$, with $u = b$ or, with a limit, $u$ = $b$ held"
        r" within it",
        r"Reconstructed: with gap $d$, field_gain $\kappa$, gap_min $d_\mathrm{min}$, gap_max $d_\mathrm{max}$,"
        r" low_margin $l$, high_margin $h$, field_rho $\sigma$, target_speed $v_\mathrm{r}$, demand $u$, force $F$,"
        r" mass $m$, line_resistance $r$. The differences in $P$ are kept at least 1 m.",
    )
    note = "Reconstructed: the source's potential is not known here; margins and gains are fitted to prose and a table."
    recommended_step = 0.1

    k = Parameter(
        "1/s", 0.008, tunable=True, minimum=0.0, description="gain on the error to the target speed (reconstructed)"
    )
    alpha = Parameter(
        "1/s", 0.082, tunable=True, minimum=0.0, description="gain on speed differences of neighbours (reconstructed)"
    )
    field_gain = Parameter(
        "m/s2", 1.23, tunable=True, minimum=0.0, description="gain on the field, kappa (reconstructed)"
    )
    field_rho = Parameter(
        "1",
        0.345,
        tunable=True,
        minimum=0.0,
        description="weight of the field of the train behind, beside rho (reconstructed)",
    )
    low_margin = Parameter(
        "m",
        770.0,
        tunable=True,
        minimum=0.0,
        description="where the field begins above the lower bound (reconstructed)",
    )
    high_margin = Parameter(
        "m",
        422.0,
        tunable=True,
        minimum=0.0,
        description="where the field begins below the upper bound (reconstructed)",
    )
    gap_min = Parameter("m", 6.5e3, tunable=True, minimum=0.0, description="lower bound of the gap, front to front")
    gap_max = Parameter("m", 8.0e3, tunable=True, minimum=0.0, description="upper bound of the gap, front to front")

    def derivatives(self) -> Values:
        return self._caution_rates()

    def _pull(self, gap: Any) -> Any:
        return self.field_gain * walls(gap, self.gap_min, self.gap_max, self.low_margin, self.high_margin)

    def _pull_behind(self, gap: Any) -> Any:
        return self.field_rho * self._pull(gap)

    def _compensated_speed(self) -> Any:
        return self.target_speed

    def _outside(self, gap: Any) -> Any:
        return outside(gap, self.gap_min, self.gap_max)
