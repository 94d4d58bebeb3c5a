"""A train of carriages: coupled masses, each with its own lagging and possibly faulty actuator."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from typing import Any

from ..component import Values
from ..declarations import Input, Output, Parameter, Size, State
from ..maths import clip, maximum, where
from .port import STARTING, DavisResistance, opposed


class Carriages(DavisResistance, ABC):
    """Masses, couplers, resistance and actuators of a train's carriages, for components that know their train.

    Carriage 1 is the head; positions fall from carriage to carriage. Per unit mass, everything but the actuator that
    acts on carriage j is n_j = R(v_j) + (T_j,j+1 - T_j-1,j) / M_j with the coupler tension
    T_j,j+1 = k (x_j - x_j+1 - l) + b (v_j - v_j+1); there is no tension ahead of the head and behind the tail.
    """

    carriages = Size(3, description="number of carriages")

    mass = Parameter("kg", 80e3, shape=(carriages,), minimum=1.0, description="mass of each carriage")
    c2 = Parameter("N.s2/(m2.kg)", 1.6e-5, minimum=0.0, description="Davis coefficient: part quadratic in speed")
    coupler_stiffness = Parameter("N/m", 8e4, minimum=0.0, description="stiffness k of a coupler")
    coupler_damping = Parameter("N.s/m", 5e3, minimum=0.0, description="damping b of a coupler")
    carriage_spacing = Parameter("m", 25.0, minimum=0.0, description="distance l of carriages whose coupler is slack")
    actuator_lag = Parameter("s", 0.4, minimum=1e-3, description="time constant tau of an actuator")
    limit_force = Parameter("1", False, tunable=True, description="whether commands are cut off at the force limit")
    force_limit = Parameter(
        "N", 100e3, tunable=True, minimum=0.0, description="largest command to an actuator, where the limit acts"
    )

    def _retardation(self, position: Any, speed: Any) -> list[Any]:
        """N of each carriage in m/s2."""
        pull = self._pull(position, speed, self.carriage_spacing)
        return [self._davis(speed[j]) + (pull[j + 1] - pull[j]) / self.mass[j] for j in range(self.carriages)]

    def _retardation_rate(self, speed: Any, acceleration: Sequence[Any]) -> list[Any]:
        """dn/dt of each carriage in m/s3, for given accelerations."""
        pull = self._pull(speed, acceleration, 0.0)
        return [
            (self.c1 + 2.0 * self.c2 * abs(speed[j])) * acceleration[j] + (pull[j + 1] - pull[j]) / self.mass[j]
            for j in range(self.carriages)
        ]

    def _pull(self, x: Any, v: Any, slack: Any) -> list[Any]:
        """Tension of every coupler from ahead of the head (none) to behind the tail (none), or its rate."""
        k, b = self.coupler_stiffness, self.coupler_damping
        tensions = [k * (x[j] - x[j + 1] - slack) + b * (v[j] - v[j + 1]) for j in range(self.carriages - 1)]
        return [0.0, *tensions, 0.0]

    def _limited(self, command: Any) -> Any:
        """A command in N after the force limit, if it acts."""
        return where(self.limit_force, clip(command, -self.force_limit, self.force_limit), command)


class Consist(Carriages):
    """Coupled carriages with actuators of first order that may be faulty (reconstructed after Zhang & Chen 2022).

    Reconstructed: the source states the structure; the formulas and all numbers are re-derived or chosen here.
    dx/dt = v, M dv/dt = F - M n(x, v) + M d, tau dF/dt = -F + u + f for each carriage, with the command u (``force``),
    the fault f and the disturbance d. At the start every actuator force balances the running resistance.

    The formulas are those of forward motion. Each carriage's resistance turns with its motion and holds it at rest, and
    so does a negative actuator force, which brakes and never reverses.
    """

    source = "Zhang & Chen 2022 (arXiv 2211.02242), eqs. 1-3"
    equations = (
        r"$\dot x_j = v_j, \qquad M_j \dot v_j = F_j - M_j n_j + M_j d_j, \qquad \tau \dot F_j = -F_j + u_j + f_j$",
        r"$n_j = c_0 + c_1 v_j + c_2 v_j^2 + (T_{j,j+1} - T_{j-1,j})\,/\,M_j, \qquad"
        r" T_{j,j+1} = k\,(x_j - x_{j+1} - l) + b\,(v_j - v_{j+1}), \qquad F_j(0) = M_j R(v_j)$",
        r"with position $x$, speed $v$, actuator_force $F$, force $u$, fault $f$, disturbance $d$, mass $M$,"
        r" actuator_lag $\tau$, coupler_stiffness $k$, coupler_damping $b$ and carriage_spacing $l$; no tension ahead"
        r" of the head and behind the tail. With limit_force, $u$ is cut off at $\pm$ force_limit.",
        r"Backwards, $v_j < 0$: $|F_j|$ for $F_j$ and $-R(-v_j)$ for $R(v_j) = c_0 + c_1 v_j + c_2 v_j^2$. At rest: the"
        r" acceleration of the two which sets the carriage in motion its own way, if it is more than"
        r" starting_resistance exceeds $c_0$ by; else 0.",
    )
    note = (
        "Reconstructed: formulas and numbers are re-derived to meet the source's statements, not transcribed from it."
    )
    recommended_step = 0.1

    force = Input("N", shape=(Carriages.carriages,), description="command to each actuator, u")
    fault = Input("N", shape=(Carriages.carriages,), optional=True, description="fault of each actuator, f")
    disturbance = Input(
        "m/s2", shape=(Carriages.carriages,), optional=True, description="disturbing force per mass, positive forwards"
    )

    starting_resistance = Parameter("N/kg", 0.0, minimum=0.0, description=STARTING)

    position = State("m", 0.0, shape=(Carriages.carriages,), output=True, description="position of each carriage")
    speed = State(
        "m/s", 0.0, shape=(Carriages.carriages,), output=True, standstill=True, description="speed of each carriage"
    )
    actuator_force = State("N", 0.0, shape=(Carriages.carriages,), output=True, description="force F of each actuator")

    acceleration = Output("m/s2", shape=(Carriages.carriages,), description="acceleration of each carriage")
    tail_position = Output("m", description="position of the last carriage")
    tail_speed = Output("m/s", description="speed of the last carriage")

    def initial(self) -> Values:
        resistances = [self._davis(self.speed[j]) for j in range(self.carriages)]
        return {"actuator_force": [m * maximum(r, 0.0) for m, r in zip(self.mass, resistances, strict=True)]}

    def derivatives(self) -> Values:
        lag = self.actuator_lag
        return {
            "position": self.speed,
            "speed": self._acceleration(),
            "actuator_force": [
                (self._limited(self.force[j]) + self.fault[j] - self.actuator_force[j]) / lag
                for j in range(self.carriages)
            ],
        }

    def outputs(self) -> Values:
        return {
            "acceleration": self._acceleration(),
            "tail_position": self.position[self.carriages - 1],
            "tail_speed": self.speed[self.carriages - 1],
        }

    def _acceleration(self) -> list[Any]:
        pull = self._pull(self.position, self.speed, self.carriage_spacing)
        stuck = maximum(self.starting_resistance - self.c0, 0.0)
        found = []
        for j in range(self.carriages):
            v, drive = self.speed[j], self.actuator_force[j] / self.mass[j]
            couplers = (pull[j + 1] - pull[j]) / self.mass[j]
            forward = drive - (self._opposing(v) + couplers) + self.disturbance[j]
            backward = abs(drive) - (couplers - self._opposing(-v)) + self.disturbance[j]
            found.append(opposed(v, forward, backward, stuck))
        return found
