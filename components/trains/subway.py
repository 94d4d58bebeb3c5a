"""A subway train whose couplers deform as prescribed: one equation of motion for all vehicles."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..component import Values
from ..declarations import Data, Parameter, State
from ..maths import cos, sin, where
from ..tables import Column, Table
from .multiple_unit import MultipleUnit, Resistance
from .port import acting, opposed
from .vehicles import REPEATED, added, pattern

_COUPLERS = (
    {"sine": 0.1e-3},
    {"cosine": 0.15e-3},
    {"sine": 0.1e-3},
    {"cosine": 0.15e-3},
    {"cosine": 0.15e-3},
)


class Coupler(NamedTuple):
    """Amplitudes of a prescribed deformation s = sine sin(w t) + cosine cos(w t), in m."""

    sine: float
    cosine: float


COUPLERS = Table("coupler", [Column("sine", "m", default=0.0), Column("cosine", "m", default=0.0)], make=Coupler)


class Motion(NamedTuple):
    """How vehicle k moves against the first: speed S in m/s and acceleration in m/s2, sums over the couplers ahead."""

    speed: list[Any]
    acceleration: list[Any]


class Balance(NamedTuple):
    """Accelerations in m/s2, as it is and of a motion either way, and the resistance of the train and its vehicles."""

    acceleration: Any
    forward: Any
    backward: Any
    resistance: Resistance
    vehicles: list[Resistance]


class SubwayTrain(MultipleUnit):
    """A six-car subway train with prescribed coupler deformations and time-varying Davis coefficients (the paper's).

    M dv/dt = u - R1(t, x) - R2(t) v - R3(t) v^2 + M d, u = sum(mu_k F_k). Coefficients of the resistance are in N/kN of
    weight. The source uses this formula at every speed; here what opposes motion holds the train at rest, as a whole.
    """

    source = "Liu & Hou 2020, eqs. 1-9, 52-59, 65; units settled, line chosen"
    note = (
        "Specific resistances are read as N/kN. The line and the pitch of the vehicles are chosen: the source's Fig. 2 "
        "is not available. Six couplers are printed for six vehicles; five exist."
    )
    equations = (
        r"$M\dot v = u - R_1 - R_2 v - R_3 v^2 - M r + M d, \qquad u = \sum_k \mu_k F_k, \qquad \dot x = v$",
        r"$R_1 = \sum_k K_k\,(a_k + b_k S_k + c_k S_k^2 + w(x - (k-1) L)) + \sum_k \ddot s_k \sum_{j>k} m_j$",
        r"$R_2 = \sum_k K_k\,(b_k + 2 c_k S_k), \qquad R_3 = \sum_k K_k c_k, \qquad K_k = m_k g / 1000,"
        r" \qquad S_k = \sum_{j<k} \dot s_j$",
        r"$f_k = f_{k-1} + \mu_k F_k - r_k - m_k\,(\dot v - d + \sum_{j<k} \ddot s_j), \qquad f_0 = 0$",
        r"with position $x$, speed $v$, applied_force $u$, vehicle_force $F_k$, coupler_force $f_k$, masses $m_k$"
        r" (times load_factor), weights $\mu_k$, vehicle_length $L$, the line's resistance $w$ in N/kN, line_resistance"
        r" $r$, disturbance $d$, coupler deformations $s_k$, and $a_k, b_k, c_k$ each of the form $a_0 + a_1 \sin"
        r" \omega t$.",
        r"Backwards: $|u|$ for $u$, and the opposite of what in $R_1, R_2, R_3$ and $r$ is neither slope nor coupler,"
        r" at $-v$. At rest: the $\dot v$ of the two which sets the train in motion its own way, if its force is more"
        r" than starting_resistance exceeds $a_k$ by; else 0.",
    )
    recommended_step = 0.01

    couplers = Data(_COUPLERS, convert=COUPLERS.read, description=f"{COUPLERS.description}; {REPEATED}")

    coupler_frequency = Parameter(
        "rad/s", 1.0, minimum=0.0, description="angular frequency of the couplers' deformation"
    )

    position = State("m", 0.0, output=True, description="position of the leading vehicle since departure")
    speed = State("m/s", 0.0, output=True, standstill=True, description="speed of the leading vehicle")

    def derivatives(self) -> Values:
        waiting = self._waiting()
        force = added(self._effective(self._vehicle_forces(self.speed)))
        rates = {
            "position": self.speed,
            "speed": self._balance(force).acceleration,
            **self._drive_rates(self.speed, acting(force, self.speed) * self.speed),
        }
        return {name: where(waiting, 0.0, rate) for name, rate in rates.items()}

    def outputs(self) -> Values:
        waiting = self._waiting()
        forces = [where(waiting, 0.0, force) for force in self._vehicle_forces(self.speed)]
        effective = self._effective(forces)
        balance = self._balance(added(effective))
        motion = self._deformation()
        return {
            "acceleration": where(waiting, 0.0, balance.acceleration),
            "applied_force": added(effective),
            "vehicle_force": forces,
            "coupler_force": [where(waiting, 0.0, force) for force in self._coupler_forces(effective, balance, motion)],
            "resistance": where(self.speed < 0.0, balance.resistance.backward, balance.resistance.forward),
            "resistance_parameters": self._parameters(motion.speed, self._line(self._places()), self._coupling(motion)),
        }

    def update(self) -> Values:
        return self._departing({"position": self.start_offset, "speed": 0.0})

    def _deformation(self) -> Motion:
        clock, w = self._clock(), self.coupler_frequency
        sine, cosine = sin(w * clock), cos(w * clock)
        speed: list[Any] = [0.0]
        acceleration: list[Any] = [0.0]
        for coupler in pattern(self.couplers, self.vehicles - 1):
            speed.append(speed[-1] + w * (coupler.sine * cosine - coupler.cosine * sine))
            acceleration.append(acceleration[-1] - w * w * (coupler.sine * sine + coupler.cosine * cosine))
        return Motion(speed, acceleration)

    def _places(self) -> list[Any]:
        """Where on the line each vehicle is, in m."""
        return [self.position - k * self.vehicle_length for k in range(self.vehicles)]

    def _coupling(self, motion: Motion) -> Any:
        """F_K: what the prescribed accelerations of the vehicles behind the first cost, in N."""
        terms = [mass * a for mass, a in zip(self._masses(), motion.acceleration, strict=True)]
        return added(terms[1:])

    def _balance(self, force: Any) -> Balance:
        """The train under a total force at the wheels in N."""
        motion, drag, mass = self._deformation(), self._drag(), added(self._masses())
        speeds = [self.speed + s for s in motion.speed]
        vehicles = self._resistances(speeds, [self.speed] * self.vehicles, self._line(self._places()))
        coupling = self._coupling(motion)
        whole = Resistance(
            added([r.forward for r in vehicles]) + coupling, added([r.backward for r in vehicles]) + coupling
        )
        forward = (force - whole.forward) / mass - drag.forward
        backward = (abs(force) - whole.backward) / mass - drag.backward
        acceleration = opposed(self.speed, forward, backward, added(self._stuck()) / mass)
        return Balance(acceleration, forward, backward, whole, vehicles)

    def _coupler_forces(self, effective: list[Any], balance: Balance, motion: Motion) -> list[Any]:
        """In-train forces behind each vehicle but the last, from the equations of motion of the vehicles ahead.

        At rest friction takes what the balance needs, of every vehicle the same share.
        """
        width = balance.backward - balance.forward
        share = where(width > 0.0, (balance.backward - balance.acceleration) / where(width > 0.0, width, 1.0), 1.0)
        share = where(self.speed > 0.0, 1.0, where(self.speed < 0.0, 0.0, share))
        rows = zip(effective, balance.vehicles, self._masses(), motion.acceleration, strict=True)
        acceleration, drag = balance.acceleration, self._drag()
        forces: list[Any] = []
        force: Any = 0.0
        for drive, resistance, mass, relative in rows:
            forward = force + drive - resistance.forward - mass * (acceleration + drag.forward + relative)
            backward = force + abs(drive) - resistance.backward - mass * (acceleration + drag.backward + relative)
            force = where(share == 1.0, forward, backward + share * (forward - backward))
            forces.append(force)
        return forces[:-1]
