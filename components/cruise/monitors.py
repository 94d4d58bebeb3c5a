"""Observers as components of their own, to watch a train that something else controls."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..component import Values
from ..declarations import Input, Memory
from ..trains.consist import Carriages
from .observers import Estimator, IntermediateFaultEstimator, Sample, StateFaultEstimator

_carriages = Carriages.carriages


class Monitor(Estimator, ABC):
    """An observer that is told the force which acted over the past step, and advances over that step before it reports.

    Under an exchange in which controllers step before trains, the force of the past step is the controller's output
    one communication point older: connect it with ``delay = 1``.
    """

    position = Input("m", shape=(_carriages,), description="position of each carriage")
    speed = Input("m/s", shape=(_carriages,), description="speed of each carriage")
    force = Input("N", shape=(_carriages,), description="command to each actuator that acted over the past step")

    past_position = Memory("m", 0.0, shape=(_carriages,), description="position at the last sample")
    past_speed = Memory("m/s", 0.0, shape=(_carriages,), description="speed at the last sample")
    past_step = Memory("s", 0.0, description="length of the past step")

    def initial(self) -> Values:
        return {
            **self._keep(self._first(self.position, self.speed)),
            "past_position": self.position,
            "past_speed": self.speed,
        }

    def outputs(self) -> Values:
        return self._estimates(self._read(self._now()), self._retardation(self.position, self.speed))

    def update(self) -> Values:
        return {
            **self._keep(self._now()),
            "past_position": self.position,
            "past_speed": self.speed,
            "past_step": self.step,
        }

    def _now(self) -> list[list[Any]]:
        """The rows at this sample: those of the last one, moved over the past step."""
        numbers = range(self.carriages)
        sample = Sample(
            self.past_position,
            self.past_speed,
            self._retardation(self.past_position, self.past_speed),
            [self._limited(self.force[j]) / self.mass[j] for j in numbers],
        )
        return self._advance(self._memory(), sample, self.past_step)


class StateFaultObserver(StateFaultEstimator, Monitor):
    """State-fault observer of a train's carriages, for monitoring (re-derived after Zhang & Chen 2022, eqs. 13-14).

    It estimates every actuator's force and fault from positions, speeds and commands. The estimate at a sample uses the
    command that acted *until* that sample.
    """

    source = "Zhang & Chen 2022 (arXiv 2211.02242), eqs. 13-14"
    equations = (
        r"$\dot{\hat x} = \hat v + l_x r_x, \quad \dot{\hat v} = \hat p - n(x, v) + l_1 r_v, \quad"
        r" \dot{\hat p} = (-\hat p + u/M + \hat q_0 + \hat q_1)\,/\,\tau + l_2 r_v$",
        r"$\dot{\hat q}_0 = g_0 r_v, \quad \dot{\hat q}_1 = \omega \hat q_2 + g_1 r_v, \quad"
        r" \dot{\hat q}_2 = -\omega \hat q_1 + g_2 r_v, \quad"
        r" \hat F = M \hat p, \quad \hat f = M (\hat q_0 + \hat q_1), \quad \hat a = \hat p - n$",
        r"for each carriage, with $r_x = x - \hat x$, $r_v = v - \hat v$, $n$ and $u$ frozen over a sample. The"
        r" gains $l, g$ place the poles of the error at minus observer_poles and position_pole $l_x$.",
    )
    note = "Re-derived: formulas and gains are ours; the observer has the properties the source states."
    recommended_step = 0.02


class IntermediateEstimator(IntermediateFaultEstimator, Monitor):
    """Intermediate fault estimator of a train's carriages, for monitoring (re-derived after Zhu et al. 2015).

    The baseline for `StateFaultObserver`: it finds constant faults; a periodic fault of angular frequency w leaves the
    residual |jw [(jw + l1)(jw + 1/tau) + l2] / (jw + pole)^3|.
    """

    source = "Zhu, Yang, Wang, Wang: IEEE TAC 61(9), intermediate estimator"
    equations = (
        r"$\dot{\hat v} = \hat p - n(x, v) + l_1 r_v, \quad \dot{\hat p} = \pi + l_2 r_v, \quad"
        r" \dot{\hat s} = -\frac{\mu}{\tau}\,\pi, \quad \pi = (-\hat p + u/M + \hat f/M)\,/\,\tau, \quad"
        r" \hat f = M\,(\hat s + \frac{\mu}{\tau}\,\hat p)$",
        r"for each carriage, with $r_v = v - \hat v$, $n$ and $u$ frozen over a sample. The gains $l_1, l_2, \mu$ place"
        r" the poles of the error at minus observer_poles.",
    )
    note = "Re-derived from the published idea; gains by pole placement instead of the source's matrix inequality."
    recommended_step = 0.02
