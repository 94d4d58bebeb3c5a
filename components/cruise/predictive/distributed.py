"""Distributed model predictive cruise control: each train plans for itself and hears the plan of the train ahead."""

from __future__ import annotations

from typing import Any

from ...component import Values
from ...declarations import Input, Memory, Output, Parameter, Size
from ...maths import clip, logical_and, maximum, minimum, where
from ..guarded import GuardedCruise
from .interior_point import solved
from .motion import Motion, extrapolated, planned, rolled
from .problem import Problem

_MEMORY = 1.0
"""s: time constant with which the acceleration of the train ahead is taken from its speeds."""
_FAR = 1e5
"""m: where a train ahead that is not there may be met."""
_LARGEST_ERROR = 200.0
"""m: errors of the gap count up to this, or a train far behind would catch up at full speed."""
_TELLING = 0.01
"""Share of its scale from which on a violated inequality of the plan is told."""


class DistributedMpc(GuardedCruise):
    """Model predictive cruise controller with limits on gap, speed, jerk and traction (after Dunbar, Caveney 2012).

    At every sample it plans jerks over ``stages`` intervals and takes the first one for the length of the sample. It
    minimises the error to a gap that grows with the speed, the speed difference to the train ahead (of the first train:
    to the target), acceleration and jerk. In the plan each train can always still stop ``standstill_gap`` short of
    where the train ahead stops, as `GuardedCruise` has it, after ``reaction_time`` and ``reserve``. Where the limits
    cannot all be kept the plan violates them, all by some, and ``infeasible`` is raised; the demand keeps its own.

    What the train ahead will do is its own ``plan``, as it comes by radio, where ``has_plan`` says so; else the
    acceleration that its speeds show is taken to go on. For where it can stop the worse of both counts, from now on
    only: as long as it was not heard it may have braked with ``ahead_braking``. The problem is convex. It is solved by
    ``iterations`` Newton steps of a primal-dual interior point method, always the same work, begun from the last plan.

    The safe bound of `GuardedCruise` acts at all times by default, behind a train that does not keep its plan; it knows
    no limit of the jerk.
    """

    source = "structure after Dunbar, Caveney 2012 (IEEE Trans. Autom. Control 57, 620); costs and limits: own"
    equations = (
        r"$\min_{j_0 \ldots j_{N-1}} \sum_{k=1}^{N} w_\mathrm{g} (x_{\mathrm{a},k} - g - h v_k - x_k)^2"
        r" + w_\mathrm{f} (v_{\mathrm{a},k} - v_k)^2 + w_\mathrm{a} a_k^2 + w_\mathrm{j} j_{k-1}^2$;"
        r" without a train ahead $w_\mathrm{v} (v_\mathrm{r} - v_k)^2$ in place of the first two",
        r"$\dot x = v, \; \dot v = a, \; \dot a = j$ over intervals $\Delta$ with constant $j$, from the own position,"
        r" speed and demand",
        r"$x_k + T v_k + v_k^2 / (2 b) \leq x_{\mathrm{a},k} + v_{\mathrm{a},k}^2 / (2 b_\mathrm{a}) - s - e, \quad"
        r" 0 \leq v_k \leq v_\mathrm{max}, \quad -b \leq a_k \leq a_\mathrm{max}, \quad |j_k| \leq j_\mathrm{max}$",
        r"$a_k + R(v_k) + r \leq \min(F_\mathrm{max}, P_\mathrm{max} / v_k) / m$, linear about the present speed",
        r"$u^+ = u + j_0\, \mathrm{d}t, \qquad F = m\,(u + R(v) + r)$",
        r"with stages $N$, prediction_step $\Delta$, standstill_gap $s$, $g = s$ + gap_margin, time_headway $h$, $T$ ="
        r" reaction_time + reserve, braking $b$, ahead_braking $b_\mathrm{a}$, acceleration_limit $a_\mathrm{max}$,"
        r" jerk_limit $j_\mathrm{max}$, speed_limit $v_\mathrm{max}$, traction_limit $F_\mathrm{max}$, power_limit"
        r" $P_\mathrm{max}$, demand $u$, force $F$, mass $m$, resistance $R$, line_resistance $r$, and the predicted"
        r" position and speed of the train ahead $x_\mathrm{a}$, $v_\mathrm{a}$; $e$ is what $x_\mathrm{a} +"
        r" v_\mathrm{a}^2 / (2 b_\mathrm{a})$ is predicted to have gained since the last message. In the limit of the"
        r" gap they are those of its plan or of its speeds, which of them stop earlier.",
    )
    recommended_step = 0.1

    stages = Size(10, minimum=2, description="intervals of the horizon")
    iterations = Size(20, description="Newton steps at each sample")

    has_plan = Input("1", False, optional=True, description="whether the plan of the train ahead is heard")
    ahead_plan = Input(
        "m/s2",
        flag=has_plan,
        shape=(stages + 1,),
        description="accelerations the train ahead plans, an interval apart, as old as its position",
    )

    sample_time = Parameter("s", 0.0, minimum=0.0, description="sample period; 0 plans once per communication step")
    prediction_step = Parameter("s", 2.0, minimum=0.1, description="length of an interval of the horizon")
    guard = Parameter(
        "1", True, tunable=True, description="whether the safe bound acts at all times, where fallback is on"
    )
    braking = Parameter(
        "m/s2", 0.8, tunable=True, minimum=1e-3, description="braking the own train is sure to reach, and its limit, b"
    )
    time_headway = Parameter("s", 20.0, tunable=True, minimum=0.0, description="what the wanted gap grows with speed")
    gap_margin = Parameter("m", 20.0, tunable=True, minimum=0.0, description="wanted gap at rest above standstill_gap")
    reserve = Parameter(
        "s", 0.5, tunable=True, minimum=0.0, description="time beyond reaction_time that the plan keeps to the bound"
    )
    speed_limit = Parameter("m/s", 100.0, tunable=True, minimum=0.1, description="highest speed")
    acceleration_limit = Parameter("m/s2", 0.6, tunable=True, minimum=1e-3, description="largest acceleration")
    jerk_limit = Parameter("m/s3", 0.5, tunable=True, minimum=1e-3, description="largest jerk, either way")
    traction_limit = Parameter("N", 600e3, tunable=True, minimum=1.0, description="largest traction force")
    power_limit = Parameter("W", 60e6, tunable=True, minimum=1.0, description="largest traction power")
    gap_weight = Parameter("1/m2", 2e-3, tunable=True, minimum=0.0, description="weight of the gap's error")
    follow_weight = Parameter(
        "s2/m2", 0.5, tunable=True, minimum=0.0, description="weight of the speed difference to the train ahead"
    )
    speed_weight = Parameter(
        "s2/m2", 0.5, tunable=True, minimum=0.0, description="weight of the first train's error to the target speed"
    )
    acceleration_weight = Parameter("s4/m2", 5.0, tunable=True, minimum=0.0, description="weight of acceleration")
    jerk_weight = Parameter("s6/m2", 50.0, tunable=True, minimum=1e-3, description="weight of the jerk")

    planned_demand = Memory("m/s2", 0.0, description="demand of the plan until the next sample")
    jerks = Memory("m/s3", 0.0, shape=(stages,), description="jerks of the plan, from the next sample on")
    ahead_average = Memory("m/s", 0.0, description="speed of the train ahead, delayed: its rate shows the acceleration")
    infeasible = Memory("1", False, output=True, description="whether the plan violates a limit")

    plan = Output("m/s2", shape=(stages + 1,), description="accelerations planned from now on, an interval apart")

    def initial(self) -> Values:
        return {"ahead_average": where(self.has_ahead, self.ahead_speed, 0.0)}

    def derivatives(self) -> Values:
        return self._caution_rates()

    def outputs(self) -> Values:
        demand = self._guarded(self.planned_demand)
        return {
            "demand": demand,
            "force": self.mass * (self._resistance(self.speed) + demand),
            "bottom_demand": self.planned_demand,
            "range_violated": logical_and(self.has_ahead, self._gap_ahead() <= 0.0),
            "degraded": self._lost_ahead(),
            "plan": rolled(0.0, 0.0, demand, self.jerks, self.prediction_step).acceleration,
        }

    def update(self) -> Values:
        problem = self._problem(*self._ahead())
        jerks = solved(problem, self.jerks, self.iterations)
        worst: Any = 0.0
        for excess in problem.excess(problem.motion(jerks), jerks).ravel().tolist():
            worst = maximum(worst, excess)
        limit = self.jerk_limit
        past = minimum(self.step / self.prediction_step, 1.0)
        after = [*jerks[1:], 0.0]
        heard = where(self.has_ahead, self.ahead_speed, 0.0)
        return {
            "planned_demand": clip(
                problem.acceleration + minimum(self.step, self.prediction_step) * clip(jerks[0], -limit, limit),
                -self.braking,
                self.acceleration_limit,
            ),
            "jerks": [clip(now + past * (then - now), -limit, limit) for now, then in zip(jerks, after, strict=True)],
            "ahead_average": self.ahead_average + minimum(self.step / _MEMORY, 1.0) * (heard - self.ahead_average),
            "infeasible": worst > _TELLING,
        }

    def _ahead(self) -> tuple[Motion, Motion]:
        """What the train ahead is taken to do, and what it would by its speeds alone; far away where there is none."""
        interval, stages = self.prediction_step, self.stages
        position = where(self.has_ahead, self.ahead_position, self.position + _FAR)
        speed = where(self.has_ahead, self.ahead_speed, self.speed)
        age = where(self.has_ahead, maximum(self.ahead_age, 0.0), 0.0)
        told = logical_and(self.has_ahead, self.has_plan)
        plan = [where(told, acceleration, 0.0) for acceleration in self.ahead_plan]
        shown = where(self.has_ahead, (speed - self.ahead_average) / _MEMORY, 0.0)
        times = [age + k * interval for k in range(stages + 1)]
        guessed = extrapolated(position, speed, shown, maximum(speed, self.target_speed), times)
        known = planned(position, speed, plan, age, interval)
        taken = Motion(
            *([where(told, a, b) for a, b in zip(x, y, strict=True)] for x, y in zip(known, guessed, strict=True))
        )
        return taken, guessed

    def _problem(self, ahead: Motion, shown: Motion) -> Problem:
        speed, has_ahead = self.speed, self.has_ahead
        base = self.standstill_gap + self.gap_margin
        error = ahead.position[0] - self.position - base - self.time_headway * speed
        counted = error - clip(error, -_LARGEST_ERROR, _LARGEST_ERROR)
        # No plan is a promise. For where the train ahead can stop the worse of what it says and what is seen counts,
        # and since its message it may have braked as hard as it can.
        stops = [minimum(a, b) for a, b in zip(self._stops(ahead), self._stops(shown), strict=True)]
        heard = self.ahead_position + maximum(self.ahead_speed, 0.0) ** 2 / (2.0 * self.ahead_braking)
        unheard = where(has_ahead, maximum(stops[0] - heard, 0.0), 0.0)
        knee = maximum(speed, self.power_limit / self.traction_limit)
        traction = self.power_limit / (knee * self.mass)
        slope = where(speed < knee, 0.0, traction / knee) + self.c1 + 2.0 * self.c2 * maximum(speed, 0.0)
        return Problem(
            position=self.position,
            speed=speed,
            acceleration=clip(self._guarded(self.planned_demand), -self.braking, self.acceleration_limit),
            interval=self.prediction_step,
            headway=self.time_headway,
            reaction=self.reaction_time + self.reserve,
            braking=self.braking,
            target_speed=self.target_speed,
            fastest=self.speed_limit,
            most=self.acceleration_limit,
            slope=slope,
            pull=traction - self._resistance(speed) + slope * speed,
            jerk_limit=self.jerk_limit,
            gap_weight=where(has_ahead, self.gap_weight, 0.0),
            follow_weight=where(has_ahead, self.follow_weight, 0.0),
            speed_weight=where(has_ahead, 0.0, self.speed_weight),
            acceleration_weight=self.acceleration_weight,
            jerk_weight=self.jerk_weight,
            wanted=[position - base - counted for position in ahead.position[1:]],
            ahead_speed=ahead.speed[1:],
            stop=[stop - unheard - self.standstill_gap for stop in stops[1:]],
        )

    def _stops(self, ahead: Motion) -> list[Any]:
        """Where the train ahead stands if it brakes as hard as it can, m."""
        hardest = 2.0 * self.ahead_braking
        return [x + maximum(v, 0.0) ** 2 / hardest for x, v in zip(ahead.position, ahead.speed, strict=True)]
