"""The composite energy function behind the convergence proof, watched while the controller learns."""

from __future__ import annotations

from typing import Any

from ..component import Component, Values
from ..declarations import Input, Memory, Output, Parameter, Tape
from ..maths import clip, logical_and, maximum, pi, tan, where
from ..trains.multiple_unit import WAITING

_NONE = -1e12
"""J: a change from trip to trip before there was one."""


class LearningEnergy(Component):
    """Composite energy E_i(t) of a learning controller, and its change from trip to trip (Liu & Hou 2020, eqs. 19, 44).

    It needs the train's true parameters, which only a simulation knows. The proof says that E falls from trip to trip,
    at every instant, if the true parameters are the same on each trip and within the bounds.
    """

    source = "Liu & Hou 2020, eqs. 14, 19, 37, 44"
    equations = (
        r"$E_i(\tau) = \dfrac{M v_\mathrm{b}^2}{\pi} \tan\left(\dfrac{\pi \delta^2}{2 v_\mathrm{b}^2}\right) +"
        r" \dfrac{1}{2} \int_0^\tau \sum_k \dfrac{(R_k - q_k)^2}{\Gamma_k}\,dt$; without barrier the first term is"
        r" $M \delta^2 / 2$",
        r"with energy $E_i$ on trip $i$, change $E_i - E_{i-1}$, augmented_error $\delta$, barrier $v_\mathrm{b}$,"
        r" resistance_parameters $R_k$, estimate $q_k$, learning_gain $\Gamma_k$ and mass $M$.",
    )

    trip = Input("1", 0, type=int, description="trip number; changes only while trip_time is negative")
    trip_time = Input("s", 0.0, description="time since departure; negative while waiting")
    augmented_error = Input("m/s", description="augmented error delta")
    estimate = Input("1", shape=(3,), description="the controller's estimates")
    resistance_parameters = Input("1", shape=(3,), description="the train's R1, R2 and R3")

    sample_time = Parameter("s", 0.01, minimum=1e-6, description="sample period")
    tape_duration = Parameter("s", 200.0, minimum=0.0, description="longest trip the tape can hold")
    mass = Parameter("kg", 194295.0, minimum=1.0, description="mass of the train")
    barrier = Parameter("m/s", 0.1, minimum=1e-6, description="bound v_b of the augmented error")
    has_barrier = Parameter("1", True, description="whether the controller has a barrier")
    watched = Parameter(
        "1", True, description="whether the change is computed; the proof knows no wrong mass, no noise"
    )
    learning_gain = Parameter("1", (5e5, 0.01, 0.01), shape=(3,), minimum=1e-12, description="gains Gamma, as its")

    past_energy = Tape("J", 0.0, description="E of the trip before at this instant")
    past_known = Tape("1", 0.0, description="1 where it is known")
    integral = Memory("J", 0.0, description="the integral up to the last sample")
    past_rate = Memory("W", 0.0, description="its integrand at the last sample")
    largest_change = Memory(
        "J", -1e12, output=True, description="largest change from trip to trip so far, at any instant"
    )

    energy = Output("J", description="composite energy E")
    change = Output("J", description="E less that of the trip before at this instant; 0 on the first trip")

    def outputs(self) -> Values:
        energy = self._energy()
        return {"energy": energy, "change": where(self._comparable(), energy - self.past_energy, 0.0)}

    def update(self) -> Values:
        waiting, energy = self.trip_time < WAITING, self._energy()
        change = where(self._comparable(), energy - self.past_energy, _NONE)
        return {
            "past_energy": energy,
            "past_known": 1.0,
            "integral": where(waiting, 0.0, self._integral()),
            "past_rate": where(waiting, 0.0, self._rate()),
            "largest_change": where(waiting, self.largest_change, maximum(self.largest_change, change)),
        }

    def _comparable(self) -> Any:
        """Whether there is a trip before to compare with."""
        return logical_and(self.watched, self.past_known > 0.5)

    def _rate(self) -> Any:
        rate: Any = 0.0
        for k in range(3):
            error = self.resistance_parameters[k] - self.estimate[k]
            rate = rate + 0.5 * error * error / self.learning_gain[k]
        return rate

    def _integral(self) -> Any:
        """By rectangles: the estimate of a sample holds over the sample that follows."""
        return self.integral + self.past_rate * self.sample_time

    def _energy(self) -> Any:
        ratio = clip(self.augmented_error / self.barrier, -0.999, 0.999)
        with_barrier = self.mass * self.barrier * self.barrier / pi * tan(0.5 * pi * ratio * ratio)
        kinetic = 0.5 * self.mass * self.augmented_error * self.augmented_error
        energy = where(self.has_barrier, with_barrier, kinetic) + self._integral()
        return where(self.trip_time < WAITING, 0.0, energy)
