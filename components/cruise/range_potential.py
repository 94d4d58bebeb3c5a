"""The range-keeping potential law, a baseline of Huang et al. 2022."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Parameter
from .pairwise import PairwiseCruise
from .range_field import outside, slope


class RangePotentialCruise(PairwiseCruise):
    """Cruise law whose potential keeps the gaps in a range (Li, Yang, Gao 2015; reconstructed after Huang et al. 2022).

    P(d) = kappa U'(d) with U(d) = 1/(d^2 - gap_min^2) + 1/(gap_max^2 - d^2), in the frame
    b = k (v_r - v) + f(ahead) - rho f(behind), f = alpha (relative speed) + P. As in the source the resistance is
    compensated at the target speed, which adds the damping R(v_r) - R(v). The range is stated; the source's own
    potential is not known here, U takes its place, and the gains are fitted to Table 4 of Huang et al. 2022.

    Gaps that start strictly inside the range stay inside in continuous exchange and without a limit on the demand.
    ``range_violated`` says when one is outside.
    """

    source = "Li, Yang, Gao 2015, as reference [20] of Huang et al. 2022 (J. Adv. Transp. 3639586), Table 4"
    equations = (
        r"$b = k\,(v_\mathrm{r} - v) + f_\mathrm{ahead} - \rho\, f_\mathrm{behind}, \qquad"
        r" f = \alpha\,(v_\mathrm{front} - v_\mathrm{rear}) + P(d)$",
        r"$P(d) = \kappa\, U'(d), \qquad"
        r" U(d) = \dfrac{1}{d^2 - d_\mathrm{min}^2} + \dfrac{1}{d_\mathrm{max}^2 - d^2}$",
        r"$F = m\,(u + c_0 + c_1 v_\mathrm{r} + c_2 v_\mathrm{r}^2 + r)$, with $u = b$ or, with a limit, $u$ = $b$ held"
        r" within it",
        r"Reconstructed: with gap $d$, field_gain $\kappa$, gap_min $d_\mathrm{min}$, gap_max $d_\mathrm{max}$,"
        r" target_speed $v_\mathrm{r}$, demand $u$, force $F$, mass $m$, line_resistance $r$.",
    )
    note = "Reconstructed: the source's potential is replaced by the one of Wang et al. 2020; gains fitted to a table."
    recommended_step = 0.1

    k = Parameter("1/s", 0.019, minimum=0.0, description="gain on the error to the target speed (reconstructed)")
    alpha = Parameter("1/s", 0.016, minimum=0.0, description="gain on speed differences of neighbours (reconstructed)")
    field_gain = Parameter(
        "m4/s2", 2e8, minimum=0.0, description="gain on the field, kappa: 0.2 (m/s2) km3 (reconstructed)"
    )
    gap_min = Parameter("m", 6.5e3, minimum=0.0, description="lower bound of the gap, front to front")
    gap_max = Parameter("m", 8.0e3, minimum=0.0, description="upper bound of the gap, front to front")

    def derivatives(self) -> Values:
        return self._caution_rates()

    def _pull(self, gap: Any) -> Any:
        return self.field_gain * slope(gap, self.gap_min, self.gap_max)

    def _compensated_speed(self) -> Any:
        return self.target_speed

    def _outside(self, gap: Any) -> Any:
        return outside(gap, self.gap_min, self.gap_max)
