"""The consensus law with a fixed desired gap, a baseline of Huang et al. 2022."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Parameter
from .pairwise import PairwiseCruise


class FixedDistanceCruise(PairwiseCruise):
    """Consensus cruise law with one fixed gap (Bai et al. 2019; reconstructed after its use in Huang et al. 2022).

    P(d) = kappa (d - desired_gap) in the frame b = k (v_r - v) + f(ahead) - rho f(behind), where f is
    alpha (relative speed) + P. The gap is 7.4 km as stated; the structure is given in words, the gains are fitted to
    Table 4 of Huang et al. 2022. The gaps do not react to the target speed. There is no hard bound of the gaps:
    ``range_violated`` says that one is not positive.
    """

    source = "Bai et al. 2019, as reference [17] of Huang et al. 2022 (J. Adv. Transp. 3639586), Table 4"
    equations = (
        r"$b = k\,(v_\mathrm{r} - v) + f_\mathrm{ahead} - \rho\, f_\mathrm{behind}, \qquad"
        r" f = \alpha\,(v_\mathrm{front} - v_\mathrm{rear}) + P(d)$",
        r"$P(d) = \kappa\,(d - d^*)$",
        r"$F = m\,(u + c_0 + c_1 v + c_2 v^2 + r)$, with $u = b$ or, with a limit, $u$ = $b$ held within it",
        r"Reconstructed: with gap $d$, desired_gap $d^*$, gap_gain $\kappa$, demand $u$, force $F$, mass $m$,"
        r" line_resistance $r$.",
    )
    note = "Reconstructed: gains, weight rho and compensation at the own speed are ours, fitted to a published table."
    recommended_step = 0.1

    k = Parameter(
        "1/s", 0.0065, tunable=True, minimum=0.0, description="gain on the error to the target speed (reconstructed)"
    )
    alpha = Parameter(
        "1/s", 0.037, tunable=True, minimum=0.0, description="gain on speed differences of neighbours (reconstructed)"
    )
    rho = Parameter("1", 2.0 / 3.0, tunable=True, minimum=0.0, description="weight of the train behind (reconstructed)")
    gap_gain = Parameter(
        "1/s2", 7.7e-3, tunable=True, minimum=0.0, description="gain on the gap's error, kappa (reconstructed)"
    )
    desired_gap = Parameter("m", 7.4e3, tunable=True, minimum=0.0, description="gap to keep, front to front")

    def derivatives(self) -> Values:
        return self._caution_rates()

    def _pull(self, gap: Any) -> Any:
        return self.gap_gain * (gap - self.desired_gap)

    def _pull_behind(self, gap: Any) -> Any:
        return self._pull(gap)

    def _compensated_speed(self) -> Any:
        return self.speed

    def _outside(self, gap: Any) -> Any:
        return gap <= 0.0
