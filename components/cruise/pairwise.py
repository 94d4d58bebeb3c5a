"""The common frame of three cruise laws: what each pair of trains exchanges is a pull on the rear one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from ..component import Values
from ..declarations import Parameter
from ..maths import clip, logical_and, logical_or, where
from .guarded import GuardedCruise


class PairwiseCruise(GuardedCruise, ABC):
    """A target speed and a pull between neighbours (reconstructed frame of Huang et al. 2022).

    For a pair with gap d the pull on the rear train is f = alpha (v_front - v_rear) + P(d), positive when it
    accelerates. The demand is b = k (v_r - v) + f(ahead) - rho f(behind), and the force m (R + sat(b)). A leader that
    is heard adds alpha (v_leader - v) (ours, for the topology "predecessor and leader").

    A subclass gives P, the speed at which the resistance R is compensated, and the gaps it is made for.
    """

    k = Parameter(
        "1/s", 0.01, tunable=True, minimum=0.0, description="gain on the error to the target speed (reconstructed)"
    )
    alpha = Parameter(
        "1/s", 0.03, tunable=True, minimum=0.0, description="gain on speed differences of neighbours (reconstructed)"
    )
    rho = Parameter("1", 1.0, tunable=True, minimum=0.0, description="weight of the train behind (reconstructed)")
    acceleration_limit = Parameter(
        "m/s2",
        0.0,
        tunable=True,
        minimum=0.0,
        description="hard bound of the law's demand; 0 is none, as in the source's runs",
    )

    def outputs(self) -> Values:
        bottom = self._bottom()
        limit = self.acceleration_limit
        law = where(limit > 0.0, clip(bottom, -limit, limit), bottom)
        # The fallback's bound is on what the train does. A law that compensates the resistance of another speed than
        # the train's own gives it the difference on top of its demand; it is exactly zero for the others.
        surplus = self._davis(self._compensated_speed()) - self._davis(self.speed)
        demand = self._guarded(law, surplus)
        return {
            "demand": demand,
            "force": self.mass * (self._resistance(self._compensated_speed()) + demand),
            "bottom_demand": bottom,
            "range_violated": logical_or(
                logical_and(self.has_ahead, self._outside(self._gap_ahead())),
                logical_and(self.has_behind, self._outside(self._gap_behind())),
            ),
            "degraded": self._is_degraded(),
        }

    def _bottom(self) -> Any:
        ahead = self.alpha * (self.ahead_speed - self.speed) + self._pull(self._gap_ahead())
        behind = self.alpha * (self.speed - self.behind_speed) + self._pull_behind(self._gap_behind())
        return (
            self.k * (self.target_speed - self.speed)
            + where(self.has_ahead, ahead, 0.0)
            - where(self.has_behind, self.rho * self._share_behind() * behind, 0.0)
            + self.alpha * self._to_leader()
        )

    @abstractmethod
    def _pull(self, gap: Any) -> Any:
        """P(gap) in m/s2, positive where the rear train is to catch up."""

    @abstractmethod
    def _pull_behind(self, gap: Any) -> Any:
        """What of the train behind's P(gap) acts back on the own train, before rho, m/s2."""

    @abstractmethod
    def _compensated_speed(self) -> Any:
        """The speed at which the resistance is compensated, m/s."""

    @abstractmethod
    def _outside(self, gap: Any) -> Any:
        """Whether a gap is none the law is made for."""
