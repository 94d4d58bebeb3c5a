"""What the multiple units share: trips, the drive and its limits, force distribution and running resistance."""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from ..component import Values
from ..declarations import Data, Input, Memory, Noise, Output, Parameter, Size, State
from ..environment.track import DESCRIPTION, read_line
from ..maths import clip, maximum, minimum, sin, where
from .metro_line import MILD
from .port import STARTING, Train
from .vehicles import REPEATED, SUBWAY, VEHICLES, distribute, pattern

WAITING = -1e-6
"""s: a train waits while its trip time is below; a departure at zero may be told with a rounding error."""
_GRAVITY = 9.81
"""m/s2."""
_SLOWEST = 0.1
"""m/s: below this speed the power limit is that of this speed."""


class Davis(NamedTuple):
    """Coefficients of one vehicle's running resistance a + b v + c v^2 in N/kN, N.s/(m.kN), N.s2/(m2.kN)."""

    a: Any
    b: Any
    c: Any

    def at(self, speed: Any) -> Any:
        """Against motion at a speed in its direction, in N/kN."""
        return self.a + self.b * speed + self.c * speed * speed


class Resistance(NamedTuple):
    """What a vehicle in motion meets, positive against running forwards, in N: running forwards and backwards."""

    forward: Any
    backward: Any


class TripTrain(Train, ABC):
    """A train that makes trips: it stands at the start, its brake applied, while ``trip_time`` is negative."""

    trip = Input("1", 0, type=int, description="trip number; changes only while trip_time is negative")
    trip_time = Input("s", 0.0, description="time since departure; negative while waiting")

    start_offset = Parameter("m", 0.0, description="position at departure; what an odometer that is not zeroed shows")

    departure_time = Memory("s", 0.0, description="time at which the present trip departs or departed")

    def initial(self) -> Values:
        return {"departure_time": self.time - self.trip_time}

    def _waiting(self) -> Any:
        return self.trip_time < WAITING

    def _clock(self) -> Any:
        """Time since departure in s, also inside an integration step; zero while waiting."""
        return maximum(self.time - self.departure_time, 0.0)


class MultipleUnit(TripTrain, ABC):
    """Vehicles under one drive command (Liu & Hou 2020, section VI).

    The command passes the limits of force and power, then the lag of the drive; it is shared among the vehicles, and
    adhesion cuts what a wheel cannot transmit. Limits, adhesion and lag are off by default, as in the source.

    The source's equation is that of forward motion. Davis, curve and tunnel resistance and the brake turn with the
    motion and hold at rest; ``starting_resistance`` is in N/kN of weight.
    """

    vehicles = Size(6, minimum=2, description="number of vehicles")
    consist = Data(SUBWAY, convert=VEHICLES.read, description=f"{VEHICLES.description}; {REPEATED}")
    line = Data(MILD, convert=read_line, description=DESCRIPTION)

    max_step = Parameter("s", 0.01, minimum=0.0, description="longest integration step inside a communication step")
    load_factor = Parameter("1", 1.0, minimum=0.01, description="masses over those of the vehicles' table")
    vehicle_length = Parameter("m", 19.5, minimum=0.0, description="pitch of the vehicles")
    davis_a = Parameter("N/kN", (1.2799, 1.28), shape=(2,), description="Davis a of motor cars and of trailers")
    davis_b = Parameter("N.s/(m.kN)", (0.02517, 0.0252), shape=(2,), description="Davis b of motor cars and trailers")
    davis_c = Parameter(
        "N.s2/(m2.kN)", (2.995e-4, 2.996e-4), shape=(2,), description="Davis c of motor cars and trailers"
    )
    swing = Parameter(
        "1", (0.275, 0.0024, 4.65e-5), shape=(3,), description="amplitudes of the slow variation of a, b and c"
    )
    swing_frequency = Parameter(
        "rad/s", (0.0039, 0.002), shape=(2,), description="angular frequency of it, motor cars and trailers"
    )
    starting_resistance = Parameter("N/kN", 0.0, minimum=0.0, description=STARTING)
    stiction = Parameter(
        "1", False, description="whether Davis resistance vanishes at standstill, as v / stiction_speed"
    )
    stiction_speed = Parameter("m/s", 0.02, minimum=1e-6, description="speed from which it acts in full, with stiction")
    limit_force = Parameter("1", False, tunable=True, description="whether the force limits act")
    traction_limit = Parameter(
        "N", 400e3, tunable=True, minimum=0.0, description="largest traction force, where limits act"
    )
    braking_limit = Parameter(
        "N", 400e3, tunable=True, minimum=0.0, description="largest braking force, where limits act"
    )
    limit_power = Parameter("1", False, tunable=True, description="whether the power limits act")
    traction_power = Parameter(
        "W", 4e6, tunable=True, minimum=0.0, description="largest traction power, where power limits act"
    )
    braking_power = Parameter(
        "W", 8e6, tunable=True, minimum=0.0, description="largest braking power, where power limits act"
    )
    limit_adhesion = Parameter("1", False, tunable=True, description="whether adhesion limits each vehicle's force")
    adhesion = Parameter(
        "1", 0.15, tunable=True, minimum=0.0, description="adhesion coefficient of a driven or braked vehicle"
    )
    actuator_lag = Parameter("s", 0.0, minimum=0.0, description="time constant of the drive; 0 is none")
    disturbance_size = Parameter("m/s2", 0.0, tunable=True, minimum=0.0, description="largest random load disturbance")
    disturbance_hold = Parameter("s", 0.01, minimum=1e-6, description="how long a random value is held")

    draw = Noise(disturbance_hold, "uniform", description="the random load disturbance")

    drive_force = State("N", 0.0, description="force of the drive, where it lags")
    traction_energy = State("J", 0.0, output=True, description="traction energy at the wheels on this trip")
    braking_energy = State("J", 0.0, output=True, description="braking energy at the wheels on this trip")

    acceleration = Output("m/s2", description="acceleration")
    applied_force = Output("N", description="total force at the wheels after limits, lag and adhesion")
    vehicle_force = Output("N", shape=(vehicles,), description="force F of each vehicle; mu F acts on the train")
    coupler_force = Output("N", shape=(vehicles - 1,), description="force between vehicles k and k+1, tension positive")
    resistance = Output("N", description="total resistance against the train; at rest that against a start")
    resistance_parameters = Output(
        "1", shape=(3,), description="R1 (N), R2 (N.s/m) and R3 (N.s2/m2), what a learning controller estimates"
    )

    def _masses(self) -> list[Any]:
        return [self.load_factor * vehicle.mass for vehicle in pattern(self.consist, self.vehicles)]

    def _weights(self) -> list[float]:
        return [vehicle.weight for vehicle in pattern(self.consist, self.vehicles)]

    def _motored(self) -> list[bool]:
        return [vehicle.motored for vehicle in pattern(self.consist, self.vehicles)]

    def _davis(self, clock: Any) -> list[Davis]:
        """Davis coefficients of each vehicle, with their slow variation."""
        kinds = []
        for k in range(2):
            s = sin(self.swing_frequency[k] * clock)
            kinds.append(
                Davis(
                    self.davis_a[k] + self.swing[0] * s,
                    self.davis_b[k] + self.swing[1] * s,
                    self.davis_c[k] + self.swing[2] * s,
                )
            )
        return [kinds[0] if motored else kinds[1] for motored in self._motored()]

    def _line(self, positions: Iterable[Any]) -> list[Resistance]:
        """Force of the built-in line against each vehicle at its position in N."""
        line, found = self.line, []
        for mass, x in zip(self._masses(), positions, strict=True):
            whole, turning = (mass * resistance for resistance in line.resistance(x))
            found.append(Resistance(whole, whole - 2.0 * turning))
        return found

    def _weight_forces(self) -> list[Any]:
        """Weight of each vehicle in kN: times N/kN it is a force."""
        return [mass * _GRAVITY / 1000.0 for mass in self._masses()]

    def _rolling(self, resistance: Any, speed: Any) -> Any:
        """Davis resistance with stiction, where that is asked for."""
        return where(self.stiction, resistance * clip(speed / self.stiction_speed, -1.0, 1.0), resistance)

    def _resistances(self, speeds: Sequence[Any], paces: Sequence[Any], line: Sequence[Resistance]) -> list[Resistance]:
        """Davis and line resistance of each vehicle for its speed; its pace decides on stiction."""
        rows = zip(self._weight_forces(), self._davis(self._clock()), speeds, paces, line, strict=True)
        return [
            Resistance(
                weight * self._rolling(davis.at(v), pace) + w.forward,
                w.backward - weight * self._rolling(davis.at(-v), -pace),
            )
            for weight, davis, v, pace, w in rows
        ]

    def _stuck(self) -> list[Any]:
        """How much more than of motion the friction of each vehicle is at rest, in N."""
        rows = zip(self._weight_forces(), self._davis(self._clock()), strict=True)
        return [weight * maximum(self.starting_resistance - self._rolling(davis.a, 0.0), 0.0) for weight, davis in rows]

    def _parameters(self, relative: list[Any], line: Sequence[Resistance], coupling: Any) -> list[Any]:
        """R1, R2 and R3 for speeds relative to the measured one, line forces in N, and what the couplers cost in N."""
        r1, r2, r3 = coupling, 0.0, 0.0
        rows = zip(self._weight_forces(), self._davis(self._clock()), relative, line, strict=True)
        for weight, davis, s, w in rows:
            r1 = r1 + weight * (davis.a + davis.b * s + davis.c * s * s) + w.forward
            r2 = r2 + weight * (davis.b + 2.0 * davis.c * s)
            r3 = r3 + weight * davis.c
        return [r1, r2, r3]

    def _drag(self) -> Resistance:
        """Force per mass against the train that is not its own: the external line less the disturbances, in N/kg."""
        random = self.disturbance_size * (2.0 * self.draw - 1.0)
        forward = self.line_resistance - self.disturbance - random
        return Resistance(forward, forward - 2.0 * self.curve_resistance)

    def _limited(self, speed: Any) -> Any:
        """The command after the limits of force and power."""
        moving = maximum(abs(speed), _SLOWEST)
        force = where(self.limit_force, clip(self.force, -self.braking_limit, self.traction_limit), self.force)
        return where(self.limit_power, clip(force, -self.braking_power / moving, self.traction_power / moving), force)

    def _vehicle_forces(self, speed: Any) -> list[Any]:
        """F of each vehicle."""
        drive = where(self.actuator_lag > 0.0, self.drive_force, self._limited(speed))
        weights, masses = self._weights(), self._masses()
        shares = distribute(drive, weights, self._motored(), [1.0] * self.vehicles)
        forces = []
        for share, mu, mass in zip(shares, weights, masses, strict=True):
            limit = self.adhesion * _GRAVITY * mass / mu
            forces.append(where(self.limit_adhesion, maximum(minimum(share, limit), -limit), share))
        return forces

    def _effective(self, forces: list[Any]) -> list[Any]:
        """Mu F of each vehicle."""
        return [mu * force for mu, force in zip(self._weights(), forces, strict=True)]

    def _drive_rates(self, speed: Any, power: Any) -> Values:
        """Rates of the drive's force and of the energies for a power at the wheels."""
        lag = where(self.actuator_lag > 0.0, self.actuator_lag, 1.0)
        return {
            "drive_force": where(self.actuator_lag > 0.0, (self._limited(speed) - self.drive_force) / lag, 0.0),
            "traction_energy": maximum(power, 0.0),
            "braking_energy": maximum(-power, 0.0),
        }

    def _departing(self, moving: Values) -> Values:
        """What a sample changes: the departure, and while waiting all states, which start anew."""
        waiting = self._waiting()
        energies = dict.fromkeys(("drive_force", "traction_energy", "braking_energy"), 0.0)
        return {
            "departure_time": self.time - self.trip_time,
            **{name: where(waiting, start, getattr(self, name)) for name, start in (moving | energies).items()},
        }
