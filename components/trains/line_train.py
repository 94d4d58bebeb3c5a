"""A train of given rolling stock on a given line: its mass spread over its length, and where its energy goes."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..component import Values
from ..declarations import Data, Input, Memory, Output, Parameter, State
from ..environment.curve import GRAVITY
from ..environment.line import FLAT
from ..environment.track import DESCRIPTION, read_line
from ..maths import maximum, where
from .multiple_unit import WAITING
from .port import STARTING, Train, acting, opposed
from .rolling_stock import TRAIN, TRAIN_DESCRIPTION

EXAMPLE = {
    "mass": 120e3,
    "rotating_mass": 0.1,
    "length": 60.0,
    "resistance": {"a": 2400.0, "b": 60.0, "c": 6.0},
    "traction": {"force": 200e3, "power": 2.6e6, "efficiency": 0.9},
    "regenerative_brake": {"force": 200e3, "power": 2.6e6, "efficiency": 0.9},
    "friction_brake": 200e3,
}
"""A light multiple unit of round numbers."""


class _Met(NamedTuple):
    """Forces against the train in N: of slopes; of curves, tunnels and running resistance against its motion."""

    slope: Any
    opposing: Any


class LineTrain(Train):
    """A train from data files on a line from data files.

    The mass is spread evenly over the length: slopes, curves, tunnels and transition curves act as the mean over it,
    exactly, at every stage of the integration. Turning parts add ``rotating_mass`` to its inertia. It makes trips
    where ``trip_time`` is connected, and otherwise runs on. The ``force`` is at the wheels: limits are those of a
    `Drive` ahead of it, or none.

    Energies are integrated beside the motion: ``energy_residual`` is what traction and outer forces gave, less what
    brake and resistance took, less what the train has gained in kinetic and potential energy, since the trip's begin.
    It is the integrator's error, because the potential energy comes from the altitudes of the line, not from work.
    """

    source = "own; running resistance after Davis 1926"
    equations = (
        r"$m\,(1 + \rho)\,\dot v = F - (a + b v + (c + \bar c_\mathrm{t}) v^2) - m\,(\bar r + r - w),"
        r" \qquad \dot x = v$",
        r"with force $F$, the train's mass $m$, rotating mass $\rho$ and resistance $a, b, c$ (times"
        r" resistance_factors), its mean further drag in tunnels $\bar c_\mathrm{t}$, the mean $\bar r$ of the line's"
        r" specific resistance over its length, line_resistance $r$ and disturbance $w$.",
        r"Backwards: $|F|$ for $F$, and the opposite of what is neither slope nor disturbance. At rest: the $\dot v$ of"
        r" the two which sets the train in motion its own way, beyond starting_resistance; else 0.",
        r"$E = \int F v\,\mathrm{d}t + \int m\,(w - r)\,v\,\mathrm{d}t - \int |f_\mathrm{c} v|\,\mathrm{d}t - \Delta"
        r" \left( \dfrac{m\,(1 + \rho)}{2} v^2 + m g\,\bar h \right)$, with resistance to motion $f_\mathrm{c}$, mean"
        r" altitude $\bar h$ and energy_residual $E$.",
    )

    line = Data(FLAT, convert=read_line, description=DESCRIPTION)
    train = Data(EXAMPLE, convert=TRAIN.record, description=TRAIN_DESCRIPTION)

    trip = Input("1", 0, type=int, optional=True, description="trip number; changes only while trip_time is negative")
    trip_time = Input("s", 0.0, optional=True, description="time since departure; negative while waiting")

    start_offset = Parameter("m", 0.0, description="position at departure; what an odometer that is not zeroed shows")
    load = Parameter("kg", 0.0, minimum=0.0, description="mass of what it carries beyond the data's")
    resistance_factors = Parameter(
        "1", 1.0, shape=(3,), minimum=0.0, description="factors on a, b and c of the running resistance"
    )
    starting_resistance = Parameter("N/kg", 0.0, minimum=0.0, description=STARTING)

    position = State("m", 0.0, output=True, description="position of the front, growing in the running direction")
    speed = State("m/s", 0.0, output=True, standstill=True, description="speed")
    traction_energy = State("J", 0.0, output=True, description="traction energy at the wheels on this trip")
    braking_energy = State("J", 0.0, output=True, description="braking energy at the wheels on this trip")
    resistance_energy = State("J", 0.0, output=True, description="energy lost to resistance to motion on this trip")
    outer_energy = State("J", 0.0, output=True, description="energy from disturbance and line_resistance on this trip")

    first_energy = Memory("J", 0.0, description="kinetic and potential energy at the trip's begin")

    acceleration = Output("m/s2", description="acceleration")
    kinetic_energy = Output("J", description="kinetic energy, turning parts included")
    potential_energy = Output("J", description="potential energy above the line's altitude zero")
    energy_residual = Output("J", description="energy given less energy taken and gained on this trip")

    def initial(self) -> Values:
        return {"first_energy": self._kinetic() + self._potential(self.position)}

    def derivatives(self) -> Values:
        speed, met, mass = self.speed, self._met(), self._mass()
        power = acting(self.force, speed) * speed
        turning = mass * self.curve_resistance
        outer = mass * (self.disturbance - self.line_resistance) + where(speed < 0.0, 2.0 * turning, 0.0)
        rates = {
            "position": speed,
            "speed": self._acceleration(met),
            "traction_energy": maximum(power, 0.0),
            "braking_energy": maximum(-power, 0.0),
            "resistance_energy": met.opposing * abs(speed),
            "outer_energy": outer * speed,
        }
        waiting = self._waiting()
        return {name: where(waiting, 0.0, rate) for name, rate in rates.items()}

    def outputs(self) -> Values:
        kinetic, potential = self._kinetic(), self._potential(self.position)
        given = self.traction_energy + self.outer_energy - self.braking_energy - self.resistance_energy
        return {
            "acceleration": where(self._waiting(), 0.0, self._acceleration(self._met())),
            "kinetic_energy": kinetic,
            "potential_energy": potential,
            "energy_residual": given - (kinetic + potential - self.first_energy),
        }

    def update(self) -> Values:
        waiting = self._waiting()
        starts = {"position": self.start_offset, "speed": 0.0}
        starts |= dict.fromkeys(("traction_energy", "braking_energy", "resistance_energy", "outer_energy"), 0.0)
        return {
            "first_energy": where(waiting, self._potential(self.start_offset), self.first_energy),
            **{name: where(waiting, start, getattr(self, name)) for name, start in starts.items()},
        }

    def _waiting(self) -> Any:
        return self.trip_time < WAITING

    def _length(self) -> float:
        """For the mean over it: a point is as good as a metre."""
        length: float = self.train.length
        return max(length, 1.0)

    def _mass(self) -> Any:
        return self.train.mass + self.load

    def _inertia(self) -> Any:
        return self._mass() + self.train.rotating_mass * self.train.mass

    def _kinetic(self) -> Any:
        return 0.5 * self._inertia() * self.speed * self.speed

    def _potential(self, position: Any) -> Any:
        return self._mass() * GRAVITY * self.line.mean_altitude(position, self._length())

    def _met(self) -> _Met:
        line, length, v = self.line, self._length(), abs(self.speed)
        whole, turning = line.mean_resistance(self.position, length)
        drag = line.mean(self.train.tunnel_drags(line.areas), self.position, length)
        a, b, c = (factor * value for factor, value in zip(self.resistance_factors, self.train.resistance, strict=True))
        mass = self._mass()
        return _Met(mass * (whole - turning), a + b * v + (c + drag) * v * v + mass * turning)

    def _acceleration(self, met: _Met) -> Any:
        mass = self._mass()
        outer = mass * (self.disturbance - self.line_resistance) - met.slope
        forward = self.force - met.opposing + outer
        backward = abs(self.force) + met.opposing + outer + 2.0 * mass * self.curve_resistance
        at_rest = self.resistance_factors[0] * self.train.resistance.a
        stuck = maximum(self.starting_resistance * mass - at_rest, 0.0)
        inertia = self._inertia()
        return opposed(self.speed, forward / inertia, backward / inertia, stuck / inertia)
