"""The consist cruise port: what a cooperative cruise controller of a train of carriages takes and gives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

from ..component import Values
from ..declarations import Input, Memory, Output, Parameter
from ..maths import logical_and, logical_or, where
from ..trains.consist import Carriages
from .barrier import Range, outside
from .observers import Estimate, Estimator, Sample

_carriages = Carriages.carriages
_SLOWEST = 0.5
"""What observer pole times sample time must stay below."""


class Ahead(NamedTuple):
    """What the carriage in front tells a carriage: position, speed, estimated acceleration, jerk command."""

    position: Any
    speed: Any
    acceleration: Any
    jerk: Any


class Law(NamedTuple):
    """Results of the control law, by carriage: acceleration estimate, jerk, n, and command in N before its limit."""

    acceleration: list[Any]
    jerk: list[Any]
    retardation: list[Any]
    command: list[Any]


class ConsistCruise(Estimator, ABC):
    """A cooperative cruise controller of one train of carriages, with its observer inside.

    The information pattern: within the train a carriage hears its neighbours over the train bus; the head hears the
    tail of the train ahead over the radio (``ahead_...``) and nothing else; for the first train that is the virtual
    leader. ``ahead_position`` and ``ahead_speed`` come from the train ahead itself, ``ahead_acceleration`` and
    ``ahead_jerk`` from its controller. Positions must be of one instant.

    A subclass gives the jerk command of the head; the other carriages follow by backstepping on the carriage in front.
    With ``limit_force`` the observer and the carriages behind are told what the limited command gives: a jerk command
    that an actuator cannot follow, passed on, would keep the train behind from braking.

    With ``late_action`` the observer is advanced with the command of the sample before, which is the one that acts, and
    the law uses what it foresees for the time at which the new command will: the late exchange costs no precision.

    ``failed_condition`` names the first condition for the design that is not met: 0 none, 1 rho is too large for the
    speed range, 2 rho is too small for the z range alone to keep the distance in range, 3 the start is out of range,
    4 the sample time is too long for the observer. ``conditions_met`` says that it is 0.
    """

    recommended_step = 0.02

    position = Input("m", shape=(_carriages,), description="position of each carriage")
    speed = Input("m/s", shape=(_carriages,), description="speed of each carriage")
    ahead_position = Input("m", description="position of the carriage in front of the head")
    ahead_speed = Input("m/s", description="speed of the carriage in front of the head")
    ahead_acceleration = Input("m/s2", description="estimated acceleration of the carriage in front of the head")
    ahead_jerk = Input("m/s3", description="jerk command of the carriage in front of the head")

    k1 = Parameter("1/s", 0.6, tunable=True, minimum=1e-6, description="backstepping gain on the spacing error")
    k2 = Parameter("1/s", 0.8, tunable=True, minimum=1e-6, description="backstepping gain on the speed error")
    k3 = Parameter("1/s", 1.2, tunable=True, minimum=1e-6, description="backstepping gain on the acceleration error")
    emergency_distance = Parameter("m", 2560.0, minimum=0.0, description="least distance of trains, d_e")
    service_distance = Parameter(
        "m", 3200.0, tunable=True, minimum=0.0, description="distance the trains settle at, d_s"
    )
    radio_distance = Parameter("m", 3700.0, minimum=0.0, description="largest distance, reach of the radio, d_c")
    closing_limit = Parameter("m/s", 10.0, minimum=0.0, description="how much slower the train in front may be, a_v")
    opening_limit = Parameter("m/s", 12.0, minimum=0.0, description="how much faster the train in front may be, b_v")
    rho = Parameter(
        "1/s", 0.014, tunable=True, minimum=0.0, description="rate at which distances settle, in z = e_v + rho e"
    )
    late_action = Parameter(
        "1", False, description="whether commands act one sample late, as where all instances step at once (jacobi)"
    )

    started_inside = Memory("1", True, description="whether the start was inside the ranges")
    interval = Memory("s", 0.0, description="length of the last sample")
    last_command = Memory("N", 0.0, shape=(_carriages,), description="command at the last sample")

    force = Output("N", shape=(_carriages,), description="command to each actuator, u")
    tail_acceleration = Output("m/s2", description="estimated acceleration of the last carriage, for the train behind")
    tail_jerk = Output("m/s3", description="jerk of the last carriage by its limited command, for the train behind")
    distance_error = Output("m", description="distance to the train ahead minus d_s, e")
    combined_error = Output("m/s", description="z = speed difference + rho e")
    barrier_violated = Output("1", bool, description="whether e or z is outside its range: the safe action is on")
    force_limited = Output("1", bool, description="whether a command was cut off at the force limit")
    conditions_met = Output("1", bool, description="whether the conditions of the design hold")
    failed_condition = Output("1", int, description="the first condition that does not hold; 0: none")

    @abstractmethod
    def _head_jerk(self, ahead: Ahead, own: Ahead) -> Any:
        """Jerk command of the head; ``own`` has its own motion, with a jerk that is still to be found."""

    def initial(self) -> Values:
        first = self._first(self.position, self.speed)
        e, z = self._errors()
        inside = where(self._outside(e, z), False, True)
        return {
            **self._keep(first),
            "started_inside": inside,
            "interval": self.sample_time,
            "last_command": self._law(self._read(first)).command,
        }

    def outputs(self) -> Values:
        estimate = self._read(self._memory())
        law = self._law(self._acting())
        e, z = self._errors()
        failed = self._failed_condition()
        tail = self.carriages - 1
        limited: Any = False
        for command in law.command:
            limited = logical_or(limited, self._limited(command) != command)
        return {
            **self._estimates(estimate, law.retardation),
            "force": [self._limited(command) for command in law.command],
            "tail_acceleration": law.acceleration[tail],
            "tail_jerk": law.jerk[tail],
            "distance_error": e,
            "combined_error": z,
            "barrier_violated": self._outside(e, z),
            "force_limited": limited,
            "conditions_met": failed == 0,
            "failed_condition": failed,
        }

    def update(self) -> Values:
        law = self._law(self._acting())
        # The observer needs the very command that acts on the plant over this sample.
        acting = [where(self.late_action, self.last_command[j], law.command[j]) for j in range(self.carriages)]
        return {
            **self._keep(self._observed(acting, self.step)),
            "started_inside": self.started_inside,
            "interval": self.step,
            "last_command": law.command,
        }

    # ---------------------------------------------------------------- the law

    def _acting(self) -> Estimate:
        """The estimate for the time at which the commands act: now, or a sample later."""
        now = self._memory()
        later = self._observed(self.last_command, self.interval)
        numbers = range(self.carriages)
        return self._read(
            [[where(self.late_action, b[j], a[j]) for j in numbers] for a, b in zip(now, later, strict=True)]
        )

    def _observed(self, commands: Sequence[Any], step: Any) -> list[list[Any]]:
        """The observer's rows after a sample in which these commands act."""
        acting = [self._limited(commands[j]) / self.mass[j] for j in range(self.carriages)]
        retardation = self._retardation(self.position, self.speed)
        return self._advance(self._memory(), Sample(self.position, self.speed, retardation, acting), step)

    def _law(self, estimate: Estimate) -> Law:
        x, v = self.position, self.speed
        n = self._retardation(x, v)
        a = [estimate.specific_force[j] - n[j] for j in range(self.carriages)]
        n_rate = self._retardation_rate(v, a)
        ahead = Ahead(self.ahead_position, self.ahead_speed, self.ahead_acceleration, self.ahead_jerk)
        jerks: list[Any] = []
        commands: list[Any] = []
        for j in range(self.carriages):
            own = Ahead(x[j], v[j], a[j], None)
            jerk = self._follow(ahead, own, self.carriage_spacing) if j else self._head_jerk(ahead, own)
            p, fault = estimate.specific_force[j], estimate.specific_fault[j]
            command = self.mass[j] * (p - fault + self.actuator_lag * (jerk + n_rate[j]))
            # Whoever follows must count on the jerk that the limited command gives, not on the one it falls short of.
            jerk = jerk + (self._limited(command) - command) / (self.mass[j] * self.actuator_lag)
            commands.append(command)
            jerks.append(jerk)
            ahead = own._replace(jerk=jerk)
        return Law(a, jerks, n, commands)

    def _follow(self, ahead: Ahead, own: Ahead, spacing: Any) -> Any:
        """Jerk command of a carriage by backstepping on the one in front (eqs. 29-33)."""
        k1, k2, k3 = self.k1, self.k2, self.k3
        dv = own.speed - ahead.speed
        da = own.acceleration - ahead.acceleration
        e1 = own.position - ahead.position + spacing
        e2 = dv + k1 * e1
        e3 = da + k1 * dv + k2 * e2 + e1
        return ahead.jerk - k1 * da - k2 * (da + k1 * dv) - dv - k3 * e3 - e2

    # ---------------------------------------------------------------- ranges and conditions

    def _errors(self) -> tuple[Any, Any]:
        """The errors e in m and z in m/s."""
        e = (self.ahead_position - self.position[0]) - self.service_distance
        return e, self.ahead_speed - self.speed[0] + self.rho * e

    def _distance_range(self) -> Range:
        return Range(self.service_distance - self.emergency_distance, self.radio_distance - self.service_distance)

    def _combined_range(self) -> Range:
        e = self._distance_range()
        return Range(self.closing_limit - self.rho * e.high, self.opening_limit - self.rho * e.low)

    def _outside(self, e: Any, z: Any) -> Any:
        return logical_or(outside(e, self._distance_range()), outside(z, self._combined_range()))

    def _failed_condition(self) -> Any:
        e, z = self._distance_range(), self._combined_range()
        widest = where(self.closing_limit > self.opening_limit, self.closing_limit, self.opening_limit)
        fastest: Any = 0.0
        for pole in self._poles():
            fastest = where(pole > fastest, pole, fastest)
        conditions = [
            logical_and(logical_and(e.low > 0.0, e.high > 0.0), logical_and(z.low > 0.0, z.high > 0.0)),
            self.rho * (e.low + e.high) >= widest,
            self.started_inside,
            fastest * self.interval < _SLOWEST,
        ]
        failed: Any = 0
        for number, holds in reversed(list(enumerate(conditions, 1))):
            failed = where(holds, failed, number)
        return failed
