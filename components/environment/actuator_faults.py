"""Actuator faults on a schedule: constant and periodic forces that come and go."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..component import Component, Values
from ..declarations import Data, Memory, Output, Parameter, Size
from ..errors import ComponentError
from ..maths import logical_and, maximum, minimum, sin, where
from ..tables import Column, Table

_ROUNDING = 1e-9
"""s: a switching instant that is a communication point belongs to what follows, whatever the rounding of k * step."""
_NEVER = 1e6
"""s: what is reported as the time to the next change where none will come."""
_EXAMPLE = (
    {"carriage": 1, "constant": 16e3, "from": 100.0, "until": 320.0},
    {"carriage": 1, "amplitude": 10e3, "phase": 0.0, "from": 220.0, "until": 460.0},
)


@dataclass(frozen=True)
class Fault:
    """A force f = constant + amplitude sin(omega (t - begin) + phase) of one actuator from ``begin`` until ``end``."""

    carriage: int
    constant: float
    amplitude: float
    phase: float
    begin: float
    end: float


FAULTS = Table(
    "fault",
    [
        Column("carriage", type=int, sign="positive", note="from 1"),
        *(Column(name, unit, default=0.0) for name, unit in (("constant", "N"), ("amplitude", "N"), ("phase", "rad"))),
        Column("from", "s"),
        Column("until", "s", after="from"),
    ],
    make=Fault,
    may_be_empty=True,
)


class ActuatorFaults(Component):
    """Constant and periodic actuator faults of one train, on a schedule (reconstructed after Zhang & Chen 2022).

    ``fault`` is the mean of f over the coming sample, in closed form, so that a plant which holds it over the sample
    receives the right impulse, also where a fault switches off the grid. ``fault_now`` is f at this instant.
    With ``sample_time`` 0 the sample is taken to be as long as the last one, and at time zero as infinitely short.
    Faults that overlap on one actuator add up. Reconstructed: the source states the kinds of faults; the default
    schedule is chosen here.
    """

    source = "Zhang & Chen 2022 (arXiv 2211.02242), eq. 3; schedule chosen"
    equations = (
        r"$f(t) = \sum_k\; c_k + A_k \sin(\omega\,(t - t_k) + \varphi_k)$ over the faults that are active,"
        r" $t_k \leq t < t_k'$",
        r"fault $= \frac{1}{T} \int_{t}^{t+T} f(s)\,ds, \qquad$ fault_now $= f(t)$",
    )
    note = "Reconstructed: the fault model is re-derived from the source's words, and the schedule is ours."

    carriages = Size(3, description="number of carriages")
    schedule = Data(_EXAMPLE, convert=FAULTS.read, description=f"{FAULTS.description}; what is left out is 0")

    omega = Parameter("rad/s", 0.5, minimum=1e-3, description="angular frequency of the periodic faults")

    interval = Memory("s", 0.0, description="length of the last sample")

    fault = Output("N", shape=(carriages,), description="mean fault of each actuator over the coming sample")
    fault_now = Output("N", shape=(carriages,), description="fault f of each actuator at this instant")
    fault_size = Output("N", shape=(carriages,), description="|constant| + amplitude of the faults now active")
    time_to_change = Output(
        "s", shape=(carriages,), description="time until the next begin or end of a fault of this actuator; 1e6: never"
    )

    def initial(self) -> Values:
        return {"interval": self.sample_time}

    def outputs(self) -> Values:
        missing = [fault.carriage for fault in self.schedule if fault.carriage > self.carriages]
        if missing:
            raise ComponentError(f"the fault schedule names carriage {missing[0]} of a train of {self.carriages}")
        numbers = range(1, self.carriages + 1)
        own = [[fault for fault in self.schedule if fault.carriage == number] for number in numbers]
        return {
            "fault": [_sum(self._mean(fault) for fault in faults) for faults in own],
            "fault_now": [_sum(self._now(fault, self._force(fault, self.time)) for fault in faults) for faults in own],
            "fault_size": [
                _sum(self._now(fault, abs(fault.constant) + abs(fault.amplitude)) for fault in faults) for faults in own
            ],
            "time_to_change": [self._time_to_change(faults) for faults in own],
        }

    def update(self) -> Values:
        return {"interval": self.step}

    def _mean(self, fault: Fault) -> Any:
        """1/T times the integral of f over the part of [t, t + T] in which the fault is active."""
        length = where(self.interval > 0.0, self.interval, 1.0)
        begin = maximum(self.time, fault.begin)
        overlap = maximum(minimum(self.time + length, fault.end) - begin, 0.0)
        # In this form, unlike as a difference of cosines, nothing cancels over a short sample.
        angle = self.omega * (begin + 0.5 * overlap - fault.begin) + fault.phase
        periodic = fault.amplitude * sin(angle) * (2.0 / self.omega) * sin(0.5 * self.omega * overlap)
        mean = (fault.constant * overlap + periodic) / length
        return where(self.interval > 0.0, mean, self._now(fault, self._force(fault, self.time)))

    def _force(self, fault: Fault, time: Any) -> Any:
        return fault.constant + fault.amplitude * sin(self.omega * (time - fault.begin) + fault.phase)

    def _now(self, fault: Fault, value: Any) -> Any:
        """A value while the fault is active, else zero."""
        now = self.time + _ROUNDING
        return where(logical_and(now >= fault.begin, now < fault.end), value, 0.0)

    def _time_to_change(self, faults: list[Fault]) -> Any:
        now = self.time + _ROUNDING
        remaining: Any = _NEVER
        for instant in sorted({instant for fault in faults for instant in (fault.begin, fault.end)}, reverse=True):
            remaining = where(now < instant, instant - self.time, remaining)
        return remaining


def _sum(terms: Any) -> Any:
    return sum(terms, 0.0)
