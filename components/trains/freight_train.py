"""A long freight train: wagons with slack between them, and a brake that runs along its pipe."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..component import Values
from ..declarations import Data, Input, Memory, Output, Parameter, Size, State
from ..environment.curve import GRAVITY
from ..environment.line import FLAT
from ..environment.track import DESCRIPTION, read_line
from ..maths import clip, maximum, minimum, where
from .port import DavisResistance, Train, opposed
from .vehicles import added

_CYLINDER_LAG = 0.3
"""s: how fast a brake cylinder follows a small change, which the filling rate does not limit."""


class _Wagon(NamedTuple):
    """What acts on a vehicle in N: slope and outer forces, traction, what opposes it, and of that the brake."""

    outer: Any
    traction: Any
    opposing: Any
    brake: Any


class FreightTrain(DavisResistance, Train):
    """A locomotive and wagons, each a mass of its own, spread over its length for slopes and curves.

    A coupler is loose within its slack; beyond it a spring that hardens with the cube of its travel, and a damper that
    takes hold over the first centimetre. A positive ``force`` pulls at the locomotive, which is the first vehicle; a
    negative one is a share of what all brakes can do together, and runs along the brake pipe from vehicle to vehicle,
    as does ``emergency``: the whole of it. Each vehicle's pipe follows the one ahead with a lag of length over wave
    speed, so that the front of the wave travels with that speed and widens as it goes; with ``electric_control`` each
    is told at once. Cylinders fill and empty at a rate of their own.

    ``energy_residual`` is the integrator's error: what traction gave, less what brakes, dampers and resistance took,
    less what the train has gained in motion, height and springs.
    """

    source = "own; wave speed of at least 250 m/s: UIC 540; filling times of 3 to 5 s (P) or 18 to 30 s (G): UIC 544-1"
    note = "Stiffness, damping and slack of the couplers are typical magnitudes, not data of one draw gear."
    equations = (
        r"$m_k \dot v_k = T_{k-1} - T_k + F_k - b_k m_k c_k - R_k, \qquad \dot y_k = v_k$",
        r"$T_k = k_1 d + k_3 d^3 + c\,\min(|d|\,/\,0.01, 1)\,(v_k - v_{k+1})$, with the travel $d$ of $y_k - y_{k+1}$"
        r" beyond $\pm s / 2$",
        r"$\dot p_k = (p_{k-1} - p_k)\,w\,/\,L, \qquad \dot c_k = \mathrm{clip}((p_k - c_k)\,/\,0.3, -1 /"
        r" t_\mathrm{r}, 1 / t_\mathrm{f})$",
        r"with vehicle_position $y_k$ (displacement since the start), vehicle_speed $v_k$, vehicle_mass $m_k$,"
        r" coupler_force $T_k$, stiffness $k_1$, hardening $k_3$, damping $c$, slack $s$, brake_pipe $p_k$ ($p_0$: what"
        r" is asked for), wave_speed $w$, vehicle_length $L$, brake_cylinder $c_k$, fill_time $t_\mathrm{f}$,"
        r" release_time $t_\mathrm{r}$, brake_deceleration $b_k$, and resistance $R_k$ of motion, slope and curve.",
        r"Backwards, brake and resistance to motion turn; at rest they hold each vehicle.",
    )
    recommended_step = 0.05

    vehicles = Size(4, minimum=2, description="number of vehicles, the locomotive included")
    line = Data(FLAT, convert=read_line, description=DESCRIPTION)

    emergency = Input("1", False, optional=True, description="whether the emergency brake is called for")

    max_step = Parameter("s", 0.005, minimum=0.0, description="longest integration step inside a communication step")
    vehicle_mass = Parameter("kg", 80e3, shape=(vehicles,), minimum=1e3, description="of each vehicle")
    vehicle_length = Parameter("m", 14.0, minimum=1.0, description="pitch of the vehicles")
    brake_deceleration = Parameter(
        "m/s2", 0.7, shape=(vehicles,), minimum=0.0, description="what each vehicle's full brake does to it alone"
    )
    wave_speed = Parameter("m/s", 260.0, minimum=1.0, description="speed of the wave in the brake pipe")
    electric_control = Parameter("1", False, description="whether a wire tells every vehicle at once, not the pipe")
    fill_time = Parameter("s", 5.0, minimum=0.1, description="time in which a brake cylinder fills")
    release_time = Parameter("s", 15.0, minimum=0.1, description="time in which it empties")
    slack = Parameter("m", 0.03, minimum=0.0, description="free travel of a coupler, both ways together")
    stiffness = Parameter("N/m", 1e7, minimum=0.0, description="of a coupler beyond its slack")
    hardening = Parameter("N/m3", 2e9, minimum=0.0, description="what it stiffens by, with the cube of its travel")
    damping = Parameter("N.s/m", 2e5, minimum=0.0, description="of a coupler beyond its slack")

    vehicle_position = State("m", 0.0, shape=(vehicles,), output=True, description="displacement since the start")
    vehicle_speed = State("m/s", 0.0, shape=(vehicles,), output=True, standstill=True, description="of each vehicle")
    brake_pipe = State("1", 0.0, shape=(vehicles,), output=True, description="share of the brake called for, there")
    brake_cylinder = State("1", 0.0, shape=(vehicles,), output=True, description="share of the brake that acts")
    traction_energy = State("J", 0.0, output=True, description="energy given by traction")
    braking_energy = State("J", 0.0, output=True, description="energy taken by the brakes")
    resistance_energy = State("J", 0.0, output=True, description="energy taken by resistance to motion")
    damping_energy = State("J", 0.0, output=True, description="energy taken by the couplers' dampers")
    outer_energy = State("J", 0.0, output=True, description="energy from disturbance and line_resistance")

    first_energy = Memory("J", 0.0, description="energy of motion, height and springs at the start")

    position = Output("m", description="displacement of the first vehicle since the start")
    speed = Output("m/s", description="of the first vehicle")
    acceleration = Output("m/s2", description="of the first vehicle")
    coupler_force = Output("N", shape=(vehicles - 1,), description="behind each vehicle, tension positive")
    largest_tension = Output("N", description="of all couplers at this instant")
    largest_compression = Output("N", description="of all couplers at this instant, positive")
    energy_residual = Output("J", description="energy given less energy taken and gained since the start")

    def initial(self) -> Values:
        return {"first_energy": self._stored()}

    def derivatives(self) -> Values:
        wagons, tensions, v = self._wagons(), self._tensions(), self.vehicle_speed
        asked = self._called_for()
        ahead = [where(self.electric_control, asked, pipe) for pipe in (asked, *self.brake_pipe[:-1])]
        lag = maximum(self.vehicle_length / self.wave_speed, self.max_step)  # a faster one could not be integrated
        pairs = list(zip(ahead, self.brake_pipe, strict=True))
        cylinders = zip(self.brake_pipe, self.brake_cylinder, strict=True)
        rest = [w.opposing - w.brake for w in wagons]
        return {
            "vehicle_position": v,
            "vehicle_speed": self._accelerations(wagons, tensions),
            "brake_pipe": [(first - own) / lag for first, own in pairs],
            "brake_cylinder": [
                clip((pipe - own) / _CYLINDER_LAG, -1.0 / self.release_time, 1.0 / self.fill_time)
                for pipe, own in cylinders
            ],
            "traction_energy": added([w.traction * v[k] for k, w in enumerate(wagons)]),
            "braking_energy": added([w.brake * abs(v[k]) for k, w in enumerate(wagons)]),
            "resistance_energy": added([force * abs(v[k]) for k, force in enumerate(rest)]),
            "damping_energy": added([rate * rate * c for rate, c in self._dampers()]),
            "outer_energy": added([self._outer(k) * v[k] for k in range(self.vehicles)]),
        }

    def outputs(self) -> Values:
        tensions = self._tensions()
        tension: Any = 0.0
        compression: Any = 0.0
        for force in tensions:
            tension, compression = maximum(tension, force), maximum(compression, -force)
        given = self.traction_energy + self.outer_energy
        taken = self.braking_energy + self.resistance_energy + self.damping_energy
        return {
            "position": self.vehicle_position[0],
            "speed": self.vehicle_speed[0],
            "acceleration": self._accelerations(self._wagons(), tensions)[0],
            "coupler_force": tensions,
            "largest_tension": tension,
            "largest_compression": compression,
            "energy_residual": given - taken - (self._stored() - self.first_energy),
        }

    def update(self) -> Values:
        return {"first_energy": self.first_energy}

    def _called_for(self) -> Any:
        """Share of the whole train's brake."""
        most = added([m * b for m, b in zip(self.vehicle_mass, self.brake_deceleration, strict=True)])
        service = clip(-self.force / maximum(most, 1.0), 0.0, 1.0)
        return where(self.emergency, 1.0, service)

    def _outer(self, k: int) -> Any:
        """Disturbance and line_resistance on a vehicle, forwards in N; what of the latter turns, turned."""
        turned = where(self.vehicle_speed[k] < 0.0, 2.0 * self.curve_resistance, 0.0)
        return self.vehicle_mass[k] * (self.disturbance - self.line_resistance + turned)

    def _place(self, k: int) -> Any:
        """Where the front of a vehicle is on the line in m."""
        return self.vehicle_position[k] - k * self.vehicle_length

    def _wagons(self) -> list[_Wagon]:
        wagons = []
        for k in range(self.vehicles):
            mass, v = self.vehicle_mass[k], self.vehicle_speed[k]
            whole, turning = self.line.mean_resistance(self._place(k), self.vehicle_length)
            brake = mass * self.brake_deceleration[k] * self.brake_cylinder[k]
            motion = mass * (self._opposing(abs(v)) + turning)
            traction = maximum(self.force, 0.0) if k == 0 else 0.0
            wagons.append(_Wagon(self._outer(k) - mass * (whole - turning), traction, brake + motion, brake))
        return wagons

    def _travels(self) -> list[Any]:
        """How far each coupler is beyond its slack, in m, tension positive."""
        y, half = self.vehicle_position, 0.5 * self.slack
        stretches = [y[k] - y[k + 1] for k in range(self.vehicles - 1)]
        return [maximum(x - half, 0.0) - maximum(-x - half, 0.0) for x in stretches]

    def _dampers(self) -> list[tuple[Any, Any]]:
        """Of each coupler: how fast it opens, and its damping now."""
        v = self.vehicle_speed
        return [(v[k] - v[k + 1], self.damping * minimum(abs(d) / 0.01, 1.0)) for k, d in enumerate(self._travels())]

    def _tensions(self) -> list[Any]:
        return [
            (self.stiffness + self.hardening * d * d) * d + rate * c
            for d, (rate, c) in zip(self._travels(), self._dampers(), strict=True)
        ]

    def _accelerations(self, wagons: list[_Wagon], tensions: list[Any]) -> list[Any]:
        pull = [0.0, *tensions, 0.0]
        found = []
        for k, (wagon, mass) in enumerate(zip(wagons, self.vehicle_mass, strict=True)):
            free = pull[k] - pull[k + 1] + wagon.outer
            # Traction slows down what rolls backwards, and so does the rest.
            forward, backward = free + wagon.traction - wagon.opposing, free + wagon.traction + wagon.opposing
            found.append(opposed(self.vehicle_speed[k], forward / mass, backward / mass))
        return found

    def _stored(self) -> Any:
        """Energy of motion, height and springs in J."""
        energy: Any = 0.0
        for k, mass in enumerate(self.vehicle_mass):
            v = self.vehicle_speed[k]
            height = self.line.mean_altitude(self._place(k), self.vehicle_length)
            energy = energy + mass * (0.5 * v * v + GRAVITY * height)
        for d in self._travels():
            energy = energy + (0.5 * self.stiffness + 0.25 * self.hardening * d * d) * d * d
        return energy
