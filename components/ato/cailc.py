"""Speed-constrained adaptive iterative learning control: learning under a barrier on the augmented error."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Memory, Output, Parameter
from ..maths import clip, logical_and, logical_not, logical_or, maximum, where
from ..supervision.braking import brake, hold
from .barrier import Loop, chi, is_stable, stretch_begin
from .learning import LearningAto
from .port import Errors

OK, STRETCHED, VIOLATED, EMERGENCY, REFUSED = range(5)
"""Values of ``status``."""


class Cailc(LearningAto):
    """Speed-constrained adaptive iterative learning control of a subway train (CAILC, Liu & Hou 2020, eqs. 30-35).

    The barrier acts through the estimates alone. Its guarantee |delta| < v_b holds if the force that the estimates
    cannot express stays below beta v_b, or if the bounds contain the true parameters; nowhere else. Beyond kappa v_b
    the barrier function continues as a straight line, kappa following from the gains and the sample time, and
    ``status`` says 1; at v_b it says 2, and ``barrier_reached`` stays true until the trip has ended. A speed above
    the limit latches the emergency brake (3) until the next wait, and the trip is not learned from. With a sampled
    loop that is unstable, or with bounds in the wrong order, the controller refuses to drive (4) and holds the train.
    """

    source = "Liu & Hou 2020, eqs. 30-35"
    note = (
        "Default gain and bounds are corrected: the source's gain hardly learns, and its bounds (no mass in them, the "
        "second minimum above its maximum) cannot contain the parameters. |delta| < v_b is not unconditional."
    )
    equations = (
        r"$\delta = \alpha\,(x - x_\mathrm{r}) + (v - v_\mathrm{r}), \qquad"
        r" \chi = \delta \, / \cos^2\left(\dfrac{\pi \delta^2}{2 v_\mathrm{b}^2}\right)$, linear beyond"
        r" $\kappa v_\mathrm{b}$",
        r"$q_1 = p_1 - \Gamma_1 \chi, \qquad q_2 = p_2 - \Gamma_2 v\,\chi, \qquad q_3 = p_3 - \Gamma_3 v^2 \chi$, each"
        r" within its bounds",
        r"$u = q_1 + q_2 v + q_3 v^2 + M a_\mathrm{r} - M \alpha\,(v - v_\mathrm{r}) - \beta\,\delta$",
        r"$\kappa = \max \{k \leq 0.999 : h\,(\alpha + (\beta + G\,\chi'(k v_\mathrm{b})) / M) \leq c\}, \quad"
        r" G = \Gamma_1 + \Gamma_2 v_\mathrm{c}^2 + \Gamma_3 v_\mathrm{c}^4$, at least 0.5",
        r"with force $u$, estimate $q$, learned $p$ (the estimate of the trip before at this instant),"
        r" augmented_error $\delta$, barrier $v_\mathrm{b}$, position $x$, speed $v$, reference_position"
        r" $x_\mathrm{r}$,"
        r" reference_speed $v_\mathrm{r}$, reference_acceleration $a_\mathrm{r}$, learning_gain $\Gamma$, mass $M$,"
        r" sample_time $h$, cruise_speed $v_\mathrm{c}$, stretch_begin $\kappa$, and $c$ = 1.5, 0.8, 0.45 for a loop"
        r" delay of 0, 1, 2 samples.",
    )
    recommended_step = 0.05

    barrier = Parameter("m/s", 0.1, tunable=True, minimum=1e-6, description="bound v_b of the augmented error")
    limit_estimate = Parameter(
        "1", True, tunable=True, description="whether the estimates are kept within their bounds"
    )
    estimate_min = Parameter(
        "1", (-6e4, 0.0, 0.0), tunable=True, shape=(3,), description="lower bounds of the estimates"
    )
    estimate_max = Parameter(
        "1", (6e4, 100.0, 1.0), tunable=True, shape=(3,), description="upper bounds of the estimates"
    )
    delay = Parameter("1", 0, type=int, minimum=0, maximum=2, description="delay of the loop in samples")
    cruise_speed = Parameter("m/s", 22.2, minimum=0.0, description="speed for which kappa is computed")
    emergency_deceleration = Parameter(
        "m/s2", 1.2, tunable=True, minimum=0.0, description="deceleration of the emergency brake"
    )
    stop_at_barrier = Parameter(
        "1", False, tunable=True, description="whether reaching the barrier, too, latches the emergency brake"
    )
    check_sampling = Parameter("1", True, description="whether to refuse a sampled loop that is unstable")

    stretch_begin = Memory("1", 0.999, output=True, description="kappa: share of the barrier beyond which it is linear")
    refused = Memory("1", False, output=True, description="whether the controller does not drive at all")
    emergency = Memory("1", False, description="whether the emergency brake is latched")
    reached = Memory("1", False, description="whether the barrier was reached on this trip")
    hold_position = Memory("m", 0.0, description="where a braked train is held")
    largest_augmented_error = Memory("m/s", 0.0, output=True, description="largest |augmented error| of this trip")
    stretched_count = Memory("1", 0, type=int, output=True, description="samples of this trip beyond kappa v_b")
    violated_count = Memory("1", 0, type=int, output=True, description="samples of this trip beyond v_b")
    violated_at = Memory(
        "s", -1.0, output=True, description="trip time at which the barrier was first reached; -1: not on this trip"
    )

    status = Output(
        "1", int, description="0 ok, 1 stretched, 2 beyond the barrier, 3 emergency brake latched, 4 refused"
    )

    def initial(self) -> Values:
        gain, v = self.learning_gain, self.cruise_speed
        fast = gain[0] + gain[1] * v * v + gain[2] * v * v * v * v
        loop = Loop(self.sample_time, self.alpha, self.beta, fast, self.mass, self.delay)
        unstable = logical_not(is_stable(loop._replace(gain=gain[0])))
        disordered: Any = False
        for k in range(3):
            disordered = logical_or(disordered, self.estimate_min[k] > self.estimate_max[k])
        return {
            "stretch_begin": stretch_begin(loop),
            "refused": logical_or(
                logical_and(self.check_sampling, unstable), logical_and(self.limit_estimate, disordered)
            ),
        }

    def keep(self) -> Any:
        """A trip that ended in an emergency is not learned from."""
        return logical_and(self._is_numbered(), logical_not(logical_or(self.emergency, self.refused)))

    def outputs(self) -> Values:
        errors = self._errors()
        estimate = self._estimate(errors)
        braking = self._braking(errors)
        stop = brake(self.mass, self.emergency_deceleration, self.position, self.speed, self.hold_position)
        size = abs(errors.augmented)
        beyond = where(size >= self.barrier, VIOLATED, where(size >= self.stretch_begin * self.barrier, STRETCHED, OK))
        reached = logical_or(self.reached, size >= self.barrier)
        return {
            **self._report(where(braking, stop, self._law(estimate, errors)), errors, estimate, reached),
            "status": where(self.refused, REFUSED, where(braking, EMERGENCY, beyond)),
        }

    def update(self) -> Values:
        errors, waiting = self._errors(), self._waiting()
        size = abs(errors.augmented)
        stretched, violated = size >= self.stretch_begin * self.barrier, size >= self.barrier
        first = logical_and(violated, self.violated_at < 0.0)

        def fresh(value: Any, start: Any) -> Any:
            return where(waiting, start, value)

        return {
            **self._record(self._estimate(errors)),
            "stretch_begin": self.stretch_begin,
            "refused": self.refused,
            "emergency": fresh(self._emergency(errors), False),
            "reached": fresh(logical_or(self.reached, violated), False),
            "hold_position": hold(self.position, self.speed, self.hold_position, waiting),
            "largest_augmented_error": fresh(maximum(self.largest_augmented_error, size), 0.0),
            "stretched_count": fresh(self.stretched_count + where(stretched, 1, 0), 0),
            "violated_count": fresh(self.violated_count + where(violated, 1, 0), 0),
            "violated_at": fresh(where(first, self.trip_time, self.violated_at), -1.0),
        }

    def _estimate(self, errors: Errors) -> list[Any]:
        corrected = self._corrected(chi(errors.augmented, self.barrier, self.stretch_begin))
        return [
            where(self.limit_estimate, clip(q, self.estimate_min[k], self.estimate_max[k]), q)
            for k, q in enumerate(corrected)
        ]

    def _emergency(self, errors: Errors) -> Any:
        """The emergency brake: too fast now or earlier on this trip, or, if asked for, at the barrier."""
        late = logical_and(self.stop_at_barrier, abs(errors.augmented) >= self.barrier)
        return logical_or(self.emergency, logical_or(self.speed > self.speed_limit, late))

    def _braking(self, errors: Errors) -> Any:
        return logical_and(logical_not(self._waiting()), logical_or(self.refused, self._emergency(errors)))
