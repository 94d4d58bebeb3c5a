"""A subway train whose vehicles move against one another: spring-damper couplers."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Output, Parameter, State
from ..maths import where
from .multiple_unit import MultipleUnit, Resistance
from .port import acting, opposed
from .vehicles import added

_vehicles = MultipleUnit.vehicles

MOTOR_CARS, ALL_CARS, LEADING_CAR = 0, 1, 2
"""Which vehicles ``position`` and ``speed`` are measured at."""


class CoupledSubwayTrain(MultipleUnit):
    """A subway train of any number of vehicles with spring-damper couplers.

    m_k dv_k/dt = mu_k F_k - r_k + T_k-1 - T_k with T_k = k_c (y_k - y_k+1) + c_c (v_k - v_k+1), y_k the displacement
    since departure, T > 0 tension. ``position`` and ``speed`` are means over the motor cars: traction acts there, and
    feedback of the leading trailer's speed is unstable with the gains that let a controller learn.
    """

    source = "Liu & Hou 2020, eqs. 1, 52-59; couplers chosen"
    note = (
        "The couplers' stiffness and damping are typical magnitudes, not data of this train; the source prescribes "
        "deformations of 0.1 to 0.15 mm instead, about 1/40 of what these couplers show."
    )
    equations = (
        r"$m_k \dot v_k = \mu_k F_k - r_k + T_{k-1} - T_k + m_k\,(d - r), \qquad \dot y_k = v_k$",
        r"$T_k = k_c\,(y_k - y_{k+1}) + c_c\,(v_k - v_{k+1})$",
        r"$r_k = \dfrac{m_k g}{1000} \left[ a_k + b_k v_k + c_k v_k^2 + w(y_k - (k-1) L) \right]$",
        r"with vehicle_position $y_k$, vehicle_speed $v_k$, vehicle_force $F_k$, coupler_force $T_k$, coupler_stiffness"
        r" $k_c$, coupler_damping $c_c$, vehicle_length $L$, the line's resistance $w$ in N/kN, line_resistance $r$ and"
        r" disturbance $d$; position, speed and acceleration are means over the cars that measured_at names.",
        r"Backwards: $|\mu_k F_k|$ for $\mu_k F_k$, and the opposite of what in $r_k$ and $r$ is no slope's, at $-v_k$."
        r" At rest: the acceleration of the two which sets the vehicle in motion its own way, if its force is more than"
        r" starting_resistance exceeds $a_k$ by; else 0.",
    )
    recommended_step = 0.01

    max_step = Parameter("s", 0.002, minimum=0.0, description="longest integration step inside a communication step")
    coupler_stiffness = Parameter("N/m", 1e7, minimum=0.0, description="stiffness k_c of a coupler")
    coupler_damping = Parameter("N.s/m", 5e5, minimum=0.0, description="damping c_c of a coupler")
    measured_at = Parameter(
        "1",
        MOTOR_CARS,
        type=int,
        minimum=MOTOR_CARS,
        maximum=LEADING_CAR,
        description="where position and speed are measured: 0 mean of the motor cars, 1 mass-weighted mean of all, "
        "2 the leading car",
    )

    vehicle_position = State("m", 0.0, shape=(_vehicles,), output=True, description="displacement since departure")
    vehicle_speed = State(
        "m/s", 0.0, shape=(_vehicles,), output=True, standstill=True, description="speed of each vehicle"
    )

    position = Output("m", description="measured position since departure")
    speed = Output("m/s", description="measured speed")

    def derivatives(self) -> Values:
        waiting = self._waiting()
        speed = self._measured(self.vehicle_speed)
        effective = self._effective(self._vehicle_forces(speed))
        power = added([acting(force, v) * v for force, v in zip(effective, self.vehicle_speed, strict=True)])
        accelerations = self._accelerations(effective)
        rates = self._drive_rates(speed, power)
        return {
            "vehicle_position": [where(waiting, 0.0, self.vehicle_speed[k]) for k in range(self.vehicles)],
            "vehicle_speed": [where(waiting, 0.0, a) for a in accelerations],
            **{name: where(waiting, 0.0, rate) for name, rate in rates.items()},
        }

    def outputs(self) -> Values:
        waiting = self._waiting()
        speed = self._measured(self.vehicle_speed)
        forces = [where(waiting, 0.0, force) for force in self._vehicle_forces(speed)]
        effective = self._effective(forces)
        return {
            "position": self._measured(self.vehicle_position),
            "speed": speed,
            "acceleration": where(waiting, 0.0, self._measured(self._accelerations(effective))),
            "applied_force": added(effective),
            "vehicle_force": forces,
            "coupler_force": self._tensions(),
            "resistance": added(
                [
                    where(v < 0.0, r.backward, r.forward)
                    for v, r in zip(self.vehicle_speed, self._opposing(), strict=True)
                ]
            ),
            "resistance_parameters": self._parameters(
                [self.vehicle_speed[k] - speed for k in range(self.vehicles)], self._line(self._places()), 0.0
            ),
        }

    def update(self) -> Values:
        changes = self._departing({})
        waiting, numbers = self._waiting(), range(self.vehicles)
        changes["vehicle_position"] = [where(waiting, self.start_offset, self.vehicle_position[k]) for k in numbers]
        changes["vehicle_speed"] = [where(waiting, 0.0, self.vehicle_speed[k]) for k in numbers]
        return changes

    def _measured(self, values: Any) -> Any:
        """The mean of a quantity over the cars it is measured at."""
        masses = self._masses()
        motored = [k for k, powered in enumerate(self._motored()) if powered] or list(range(self.vehicles))
        motors = added([values[k] for k in motored]) / len(motored)
        everyone = added([masses[k] * values[k] for k in range(self.vehicles)]) / added(masses)
        return where(self.measured_at < 0.5, motors, where(self.measured_at < 1.5, everyone, values[0]))

    def _tensions(self) -> list[Any]:
        y, v = self.vehicle_position, self.vehicle_speed
        k_c, c_c = self.coupler_stiffness, self.coupler_damping
        return [k_c * (y[k] - y[k + 1]) + c_c * (v[k] - v[k + 1]) for k in range(self.vehicles - 1)]

    def _places(self) -> list[Any]:
        """Where on the line each vehicle is, in m."""
        return [self.vehicle_position[k] - k * self.vehicle_length for k in range(self.vehicles)]

    def _opposing(self) -> list[Resistance]:
        """Davis and line resistance of each vehicle."""
        return self._resistances(self.vehicle_speed, self.vehicle_speed, self._line(self._places()))

    def _accelerations(self, effective: list[Any]) -> list[Any]:
        pull = [0.0, *self._tensions(), 0.0]
        drag = self._drag()
        rows = zip(effective, self._opposing(), self._stuck(), self._masses(), strict=True)
        return [
            opposed(
                self.vehicle_speed[k],
                (force - resistance.forward + pull[k] - pull[k + 1]) / mass - drag.forward,
                (abs(force) - resistance.backward + pull[k] - pull[k + 1]) / mass - drag.backward,
                stuck / mass,
            )
            for k, (force, resistance, stuck, mass) in enumerate(rows)
        ]
