"""The constant time headway law, the field's yardstick for what a controller does with the train ahead alone."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Output, Parameter
from ..maths import clip, logical_and, minimum, where
from .guarded import GuardedCruise


class TimeHeadwayCruise(GuardedCruise):
    """Cruise law that keeps a gap growing with the own speed (Ioannou, Chien 1993; Rajamani 2012, section 6.5).

    Behind a train the demand is [(v_a - v) + lambda (d - s - h v)] / h, where d is the gap front to front; it is held
    below k (v_r + c - v), so that a train catches up by at most c above the target speed. The first train keeps the
    target speed by k alone. Nothing but the train ahead is heard.

    Followers of ideal trains are string stable for any headway: their speeds follow 1 / (h s + 1). With a drive of
    first order and time constant ``lag`` they are if, and only if, h >= 2 lag (Swaroop, Rajagopal 2001;
    Rajamani 2012, eq. 6.27), whatever lambda; ``string_stable`` says so. Half a step counts as such a lag, too.
    """

    source = "Ioannou, Chien 1993 (IEEE Trans. Veh. Technol. 42, 657); Rajamani 2012, section 6.5; speed bound: own"
    equations = (
        r"$b = \min \left( k\,(v_\mathrm{r} + c - v), \; \dfrac{1}{h} \left[ v_\mathrm{a} - v"
        r" + \lambda\,(d - s - h\,v) \right] \right)$; without a train ahead $b = k\,(v_\mathrm{r} - v)$",
        r"$F = m\,(u + c_0 + c_1 v + c_2 v^2 + r)$, with $u = b$ or, with a limit, $u$ = $b$ held within it",
        r"string stable if and only if $h \geq 2 \tau$",
        r"with gap $d$, standstill_gap $s$, time_headway $h$, gap_rate $\lambda$, lag $\tau$, catch_up $c$,"
        r" target_speed $v_\mathrm{r}$, ahead_speed $v_\mathrm{a}$, own speed $v$, bottom_demand $b$, demand $u$,"
        r" force $F$, mass $m$, line_resistance $r$.",
    )
    recommended_step = 0.1

    k = Parameter("1/s", 0.1, tunable=True, minimum=0.0, description="gain on the error to the target speed")
    time_headway = Parameter(
        "s", 20.0, tunable=True, minimum=1e-3, description="gap to keep, beyond standstill_gap, by speed"
    )
    gap_rate = Parameter("1/s", 0.1, tunable=True, minimum=0.0, description="rate at which the gap's error fades")
    catch_up = Parameter(
        "m/s", 3.0, tunable=True, minimum=0.0, description="how much faster than the target a train may catch up"
    )
    acceleration_limit = Parameter(
        "m/s2", 0.8, tunable=True, minimum=0.0, description="hard bound of the law's demand; 0 is none"
    )
    lag = Parameter(
        "s", 0.5, tunable=True, minimum=0.0, description="time constant of the train's drive, for string_stable alone"
    )

    desired_gap = Output("m", description="gap that is kept at the present speed, front to front")
    string_stable = Output("1", bool, description="whether deviations shrink from train to train")

    def derivatives(self) -> Values:
        return self._caution_rates()

    def outputs(self) -> Values:
        bottom = self._bottom()
        limit = self.acceleration_limit
        demand = self._guarded(where(limit > 0.0, clip(bottom, -limit, limit), bottom))
        return {
            "demand": demand,
            "force": self.mass * (self._resistance(self.speed) + demand),
            "bottom_demand": bottom,
            "range_violated": logical_and(self.has_ahead, self._gap_ahead() <= 0.0),
            "degraded": self._lost_ahead(),
            "desired_gap": self._desired_gap(),
            "string_stable": self.time_headway >= 2.0 * self.lag,
        }

    def _desired_gap(self) -> Any:
        return self.standstill_gap + self.time_headway * self.speed

    def _bottom(self) -> Any:
        error = self._gap_ahead() - self._desired_gap()
        follow = (self.ahead_speed - self.speed + self.gap_rate * error) / self.time_headway
        alone = self.k * (self.target_speed - self.speed)
        return where(self.has_ahead, minimum(alone + self.k * self.catch_up, follow), alone)
