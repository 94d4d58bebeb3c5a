"""What a shipped cruise controller does about old data: extrapolate, then be careful, then rejoin without a jolt."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..component import Values
from ..declarations import Output, Parameter, State
from ..maths import clip, logical_and, logical_or, maximum, minimum, sqrt, where
from .port import CruiseController

_ONSET = 0.2
"""s: time constant with which caution behind the train ahead, and the held bound, follow the onset of an outage."""
_FADE = 2.0
"""s: time constant with which the train behind and the leader fade out: nothing is in a hurry there."""
_FIRMNESS = 4.0
"""How firmly the safe speed is held, over the reaction time: 4 comes to rest without overshoot (critical damping)."""
_FASTEST = 300.0
"""m/s: speeds heard are held below this where they are squared, so that nonsense stays finite."""


class GuardedCruise(CruiseController, ABC):
    """A cruise controller with a fallback for old data (ours; the published laws assume perfect communication).

    Three stages, by the age of what is known of a neighbour, all off with ``fallback = false``:

    1. Older than ``age_limit``: the position is extrapolated at the speed last heard.
    2. Older than ``degraded_age``: ``degraded`` is raised. The train behind and the leader fade out of the law. Behind
       the train ahead, the demand is held below the *safe bound*: the speed from which the own train, braking with
       ``braking`` after ``reaction_time``, stops ``standstill_gap`` short of where the train ahead stops if it has
       braked with ``ahead_braking`` ever since its last message (Gipps 1981),
       v_safe = -b T + sqrt(b^2 T^2 + 2 b (x_a + v_a^2/(2 b_a) - s - x)); bound = max(4 (v_safe - v) / T, -b).
       That stop does not depend on the age, so no message can be too old for it.
    3. After the first fresh message the bound fades with ``rejoin_time``, and what faded out comes back with it.

    With ``guard = true`` the safe bound acts at all times, also with fresh data. Like the bound of stage 2 it stands
    outside ``acceleration_limit``, which holds for the law alone: safety goes before comfort.
    """

    fallback = Parameter("1", True, tunable=True, description="whether anything is done about old data")
    guard = Parameter(
        "1", False, tunable=True, description="whether the safe bound acts at all times, where fallback is on"
    )
    age_limit = Parameter(
        "s", 0.25, tunable=True, minimum=0.0, description="age from which a neighbour's position is extrapolated"
    )
    degraded_age = Parameter("s", 1.0, tunable=True, minimum=0.0, description="age from which the train falls back")
    rejoin_time = Parameter(
        "s", 10.0, tunable=True, minimum=0.1, description="time constant of rejoining after an outage"
    )
    braking = Parameter(
        "m/s2", 0.6, tunable=True, minimum=1e-3, description="braking the own train is sure to reach, b"
    )
    ahead_braking = Parameter(
        "m/s2", 1.0, tunable=True, minimum=1e-3, description="hardest braking expected of the train ahead, b_a"
    )
    reaction_time = Parameter("s", 1.0, tunable=True, minimum=1e-3, description="time before the own brakes act, T")
    standstill_gap = Parameter(
        "m",
        250.0,
        tunable=True,
        minimum=0.0,
        description="gap to keep at rest, front to front: train length and margin, s",
    )

    caution_ahead = State("1", 0.0, description="how much the safe bound still counts, 0 to 1")
    caution_behind = State("1", 0.0, description="how far the train behind has faded out, 0 to 1")
    caution_leader = State("1", 0.0, description="how far the leader has faded out, 0 to 1")
    held_bound = State("m/s2", 0.0, description="the safe bound when the last outage ended")

    bottom_demand = Output("m/s2", description="demand of the law, before any limit and before the fallback")
    degraded = Output("1", bool, description="whether a neighbour's data is too old to be extrapolated")

    # ---------------------------------------------------------------- for the laws

    def _gap_ahead(self) -> Any:
        return self._now(self.ahead_position, self.ahead_speed, self.ahead_age) - self.position

    def _gap_behind(self) -> Any:
        return self.position - self._now(self.behind_position, self.behind_speed, self.behind_age)

    def _share_behind(self) -> Any:
        """How much of the train behind the law still hears."""
        return 1.0 - self.caution_behind

    def _to_leader(self) -> Any:
        """Speed difference to the leader, where it is heard, m/s."""
        return where(self.has_leader, (1.0 - self.caution_leader) * (self.leader_speed - self.speed), 0.0)

    def _guarded(self, demand: Any, surplus: Any = 0.0) -> Any:
        """The law's demand, lowered to the safe bound as far as the fallback asks for it.

        ``surplus`` is what the train accelerates beyond the demand, m/s2: the bound is on both together.
        """
        lost, bound = self._lost_ahead(), self._safe_bound() - surplus
        # Exactly the demand where there is no caution.
        rejoining = demand + self.caution_ahead * minimum(self.held_bound - surplus - demand, 0.0)
        careful = where(lost, minimum(demand, bound), rejoining)
        guarded = logical_and(logical_and(self.fallback, self.guard), self.has_ahead)
        return where(guarded, minimum(careful, bound), careful)

    def _is_degraded(self) -> Any:
        return logical_or(self._lost_ahead(), logical_or(self._lost_behind(), self._lost_leader()))

    def _caution_rates(self) -> Values:
        """Rates of this class's states."""
        lost = self._lost_ahead()
        return {
            "caution_ahead": self._caution_rate(lost, self.caution_ahead, _ONSET),
            "caution_behind": self._caution_rate(self._lost_behind(), self.caution_behind, _FADE),
            "caution_leader": self._caution_rate(self._lost_leader(), self.caution_leader, _FADE),
            "held_bound": where(lost, (self._safe_bound() - self.held_bound) / _ONSET, 0.0),
        }

    # ---------------------------------------------------------------- the fallback itself

    def _now(self, position: Any, speed: Any, age: Any) -> Any:
        """Where a neighbour is, as far as can be known."""
        old = logical_and(self.fallback, age > self.age_limit)
        return where(old, position + speed * age, position)

    def _lost_ahead(self) -> Any:
        return self._lost(self.has_ahead, self.ahead_age)

    def _lost_behind(self) -> Any:
        return self._lost(self.has_behind, self.behind_age)

    def _lost_leader(self) -> Any:
        return self._lost(self.has_leader, self.leader_age)

    def _lost(self, there: Any, age: Any) -> Any:
        return logical_and(logical_and(self.fallback, there), age > self.degraded_age)

    def _caution_rate(self, lost: Any, caution: Any, onset: float) -> Any:
        return where(lost, (1.0 - caution) / onset, -caution / self.rejoin_time)

    def _safe_bound(self) -> Any:
        """Largest demand that keeps the braking distance, m/s2; -braking where it is lost already."""
        heard = clip(self.ahead_speed, 0.0, _FASTEST)
        stop = self.ahead_position + heard * heard / (2.0 * self.ahead_braking) - self.standstill_gap
        lag = self.braking * self.reaction_time
        safe = sqrt(lag * lag + 2.0 * self.braking * maximum(stop - self.position, 0.0)) - lag
        return maximum(_FIRMNESS * (safe - self.speed) / self.reaction_time, -self.braking)
