"""Observers of every carriage's actuator: the force it exerts and the fault it suffers, from positions and speeds.

Both observers inject everything that is measured (n, see `Carriages`), so that their errors are linear, decentralised
and independent of the command. They are sampled: innovation, n and command are frozen over a sample, and the linear
equations take one Runge-Kutta step. Freezing the measurement instead would follow a signal that is late by half a
sample, and leave a fault error of about 0.8 per second of sample time.

Re-derived after Zhang & Chen 2022, eqs. 13-14, and Zhu et al. 2015: the properties are the sources', the formulas ours.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..component import Values
from ..declarations import Memory, Output, Parameter
from ..maths import where
from ..trains.consist import Carriages

_carriages = Carriages.carriages
_LEAST = 1e-9
"""1/s2: how near to zero a gain that is divided by may come."""


class Estimate(NamedTuple):
    """What a controller needs of an observer: specific actuator force p = F/M (m/s2) and f/M (N/kg), by carriage."""

    specific_force: list[Any]
    specific_fault: list[Any]


class Sample(NamedTuple):
    """What an observer holds over a sample, by carriage: measured position, speed and n, and command per mass."""

    position: Any
    speed: Any
    retardation: Any
    command: Any


class FaultGains(NamedTuple):
    """Gains of the state-fault observer on the speed innovation."""

    speed: Any
    force: Any
    constant: Any
    sine: Any
    cosine: Any


class IntermediateGains(NamedTuple):
    """Gains of the intermediate estimator on the speed innovation, and its factor mu."""

    speed: Any
    force: Any
    mu: Any


def polynomial(poles: Sequence[Any]) -> list[Any]:
    """Coefficients of the product of (s + pole), lowest power first, without the leading one."""
    coefficients: list[Any] = []
    for pole in poles:
        padded = [0.0, *coefficients]
        coefficients = [low + pole * high for low, high in zip(padded, [*coefficients, 1.0], strict=True)]
    return coefficients


def fault_gains(poles: Sequence[Any], lag: Any, omega: Any) -> FaultGains:
    """Gains that place the five poles of the error of (v, p, q0, q1, q2) at minus the given ones.

    Args:
        poles: five positive numbers in 1/s.
        lag: of the actuator in s, positive.
        omega: angular frequency of the periodic faults in rad/s, positive.
    """
    a0, a1, a2, a3, a4 = polynomial(poles)
    square = omega * omega
    speed = a4 - 1.0 / lag
    constant = lag * a0 / square
    return FaultGains(
        speed,
        a3 - square - speed / lag,
        constant,
        lag * (a2 - a4 * square) - constant,
        lag / omega * (a1 - (a3 - square) * square),
    )


def intermediate_gains(poles: Sequence[Any], lag: Any) -> IntermediateGains:
    """Gains that place the three poles of the intermediate estimator at minus the given ones, in 1/s."""
    a0, a1, a2 = polynomial(poles)
    speed = a2 - 1.0 / lag
    force = a1 - speed / lag
    # Never zero for equal poles; poles far apart can make it so.
    force = where(abs(force) > _LEAST, force, _LEAST)
    return IntermediateGains(speed, force, lag * lag * a0 / force)


def runge_kutta(rates: Callable[[Sequence[Any]], list[Any]], x: Sequence[Any], h: Any) -> list[Any]:
    """One classical Runge-Kutta step of length ``h``."""
    k1 = rates(x)
    k2 = rates([a + 0.5 * h * k for a, k in zip(x, k1, strict=True)])
    k3 = rates([a + 0.5 * h * k for a, k in zip(x, k2, strict=True)])
    k4 = rates([a + h * k for a, k in zip(x, k3, strict=True)])
    return [
        a + (h / 6.0) * (((d1 + 2.0 * d2) + 2.0 * d3) + d4) for a, d1, d2, d3, d4 in zip(x, k1, k2, k3, k4, strict=True)
    ]


class Estimator(Carriages, ABC):
    """An observer's memory and equations, to be completed with what it is told and what becomes of its estimate.

    A subclass fills in the methods below, on its memory ``kept``: a row for each estimated quantity, with a value for
    each carriage.
    """

    acceleration_estimate = Output("m/s2", shape=(_carriages,), description="estimated acceleration of each carriage")
    actuator_force_estimate = Output("N", shape=(_carriages,), description="estimated force of each actuator")
    fault_estimate = Output("N", shape=(_carriages,), description="estimated fault of each actuator")

    @abstractmethod
    def _poles(self) -> list[Any]:
        """Where the modes of the error are placed, sign turned, in 1/s."""

    @abstractmethod
    def _memory(self) -> list[Any]:
        """The present rows."""

    @abstractmethod
    def _keep(self, kept: Sequence[Sequence[Any]]) -> Values:
        """Rows, by the names of the memory they belong to."""

    @abstractmethod
    def _first(self, position: Any, speed: Any) -> list[list[Any]]:
        """Rows at the start: as measured, with zero acceleration and no fault."""

    @abstractmethod
    def _read(self, kept: Sequence[Any]) -> Estimate:
        """The estimate that rows stand for."""

    @abstractmethod
    def _advance(self, kept: Sequence[Any], sample: Sample, step: Any) -> list[list[Any]]:
        """Rows one sample later."""

    def _estimates(self, estimate: Estimate, retardation: Sequence[Any]) -> Values:
        """The outputs that every user of an observer shows."""
        force, fault = estimate
        numbers = range(self.carriages)
        return {
            "acceleration_estimate": [force[j] - retardation[j] for j in numbers],
            "actuator_force_estimate": [self.mass[j] * force[j] for j in numbers],
            "fault_estimate": [self.mass[j] * fault[j] for j in numbers],
        }

    def _by_row(self, columns: Sequence[Sequence[Any]]) -> list[list[Any]]:
        return [list(row) for row in zip(*columns, strict=True)]


class StateFaultEstimator(Estimator, ABC):
    """State-fault observer: actuator force and fault, from an internal model of constant and periodic faults.

    With p = F/M, q = theta/M and innovations r_x = x - x^, r_v = v - v^, for each carriage by itself:
    x^' = v^ + lx r_x, v^' = p^ - n + l1 r_v, p^' = (-p^ + u/M + q^0 + q^1)/tau + l2 r_v,
    q^0' = g0 r_v, q^1' = omega q^2 + g1 r_v, q^2' = -omega q^1 + g2 r_v. Constant disturbances and model errors end up
    in q^0: an estimated fault is only as good as mass and resistance.
    """

    observer_poles = Parameter(
        "1/s",
        2.0,
        tunable=True,
        shape=(5,),
        minimum=1e-3,
        description="speed at which each mode of the observer's error decays",
    )
    position_pole = Parameter("1/s", 2.0, tunable=True, minimum=0.0, description="the same of the position's estimate")
    omega = Parameter("rad/s", 0.5, minimum=1e-3, description="angular frequency of the periodic faults")

    observed_position = Memory("m", 0.0, shape=(_carriages,), description="estimated position")
    observed_speed = Memory("m/s", 0.0, shape=(_carriages,), description="estimated speed")
    observed_force = Memory("m/s2", 0.0, shape=(_carriages,), description="estimated actuator force per mass")
    observed_constant = Memory("N/kg", 0.0, shape=(_carriages,), description="constant part of the fault per mass")
    observed_sine = Memory("N/kg", 0.0, shape=(_carriages,), description="periodic part of the fault per mass")
    observed_cosine = Memory("N/kg", 0.0, shape=(_carriages,), description="periodic part a quarter period later")

    def _poles(self) -> list[Any]:
        return [self.observer_poles[k] for k in range(5)]

    def _memory(self) -> list[Any]:
        return [
            self.observed_position,
            self.observed_speed,
            self.observed_force,
            self.observed_constant,
            self.observed_sine,
            self.observed_cosine,
        ]

    def _keep(self, kept: Sequence[Sequence[Any]]) -> Values:
        names = ("position", "speed", "force", "constant", "sine", "cosine")
        return {f"observed_{name}": row for name, row in zip(names, kept, strict=True)}

    def _first(self, position: Any, speed: Any) -> list[list[Any]]:
        none = [0.0] * self.carriages
        return [list(position), list(speed), self._retardation(position, speed), none, none, none]

    def _read(self, kept: Sequence[Any]) -> Estimate:
        numbers = range(self.carriages)
        return Estimate([kept[2][j] for j in numbers], [kept[3][j] + kept[4][j] for j in numbers])

    def _advance(self, kept: Sequence[Any], sample: Sample, step: Any) -> list[list[Any]]:
        gains = fault_gains(self._poles(), self.actuator_lag, self.omega)
        columns = []
        for j in range(self.carriages):
            x = [row[j] for row in kept]
            innovation = (sample.position[j] - x[0], sample.speed[j] - x[1])
            columns.append(runge_kutta(self._rates(innovation, sample, j, gains), x, step))
        return self._by_row(columns)

    def _rates(
        self, innovation: tuple[Any, Any], sample: Sample, j: int, gains: FaultGains
    ) -> Callable[[Sequence[Any]], list[Any]]:
        r_x, r_v = innovation
        return lambda x: [
            x[1] + self.position_pole * r_x,
            x[2] - sample.retardation[j] + gains.speed * r_v,
            (sample.command[j] - x[2] + (x[3] + x[4])) / self.actuator_lag + gains.force * r_v,
            gains.constant * r_v,
            self.omega * x[5] + gains.sine * r_v,
            gains.cosine * r_v - self.omega * x[4],
        ]


class IntermediateFaultEstimator(Estimator, ABC):
    """Intermediate estimator (Zhu et al. 2015): finds constant faults; periodic ones leave a residual.

    With the intermediate variable s = f/M - (mu/tau) p and pi = (-p^ + u/M + f^/M)/tau, for each carriage by itself:
    v^' = p^ - n + l1 r_v, p^' = pi + l2 r_v, s^' = -(mu/tau) pi, f^/M = s^ + (mu/tau) p^. The gains come from declared
    poles instead of the source's matrix inequality.
    """

    observer_poles = Parameter(
        "1/s", 2.0, shape=(3,), minimum=1e-3, description="speed at which each mode of the observer's error decays"
    )

    observed_speed = Memory("m/s", 0.0, shape=(_carriages,), description="estimated speed")
    observed_force = Memory("m/s2", 0.0, shape=(_carriages,), description="estimated actuator force per mass")
    intermediate = Memory("N/kg", 0.0, shape=(_carriages,), description="intermediate variable per mass")

    def _poles(self) -> list[Any]:
        return [self.observer_poles[k] for k in range(3)]

    def _memory(self) -> list[Any]:
        return [self.observed_speed, self.observed_force, self.intermediate]

    def _keep(self, kept: Sequence[Sequence[Any]]) -> Values:
        names = ("observed_speed", "observed_force", "intermediate")
        return dict(zip(names, kept, strict=True))

    def _first(self, position: Any, speed: Any) -> list[list[Any]]:
        force = self._retardation(position, speed)
        ratio = self._gains().mu / self.actuator_lag
        return [list(speed), force, [-ratio * p for p in force]]

    def _read(self, kept: Sequence[Any]) -> Estimate:
        ratio = self._gains().mu / self.actuator_lag
        numbers = range(self.carriages)
        return Estimate([kept[1][j] for j in numbers], [kept[2][j] + ratio * kept[1][j] for j in numbers])

    def _advance(self, kept: Sequence[Any], sample: Sample, step: Any) -> list[list[Any]]:
        gains = self._gains()
        columns = []
        for j in range(self.carriages):
            x = [row[j] for row in kept]
            columns.append(runge_kutta(self._rates(sample.speed[j] - x[0], sample, j, gains), x, step))
        return self._by_row(columns)

    def _gains(self) -> IntermediateGains:
        return intermediate_gains(self._poles(), self.actuator_lag)

    def _rates(
        self, r_v: Any, sample: Sample, j: int, gains: IntermediateGains
    ) -> Callable[[Sequence[Any]], list[Any]]:
        ratio = gains.mu / self.actuator_lag

        def rates(x: Sequence[Any]) -> list[Any]:
            flow = (sample.command[j] - x[1] + (x[2] + ratio * x[1])) / self.actuator_lag
            return [x[1] - sample.retardation[j] + gains.speed * r_v, flow + gains.force * r_v, -ratio * flow]

        return rates
