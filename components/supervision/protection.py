"""Train protection (ATP): a speed limit, and brakes for a train that does not keep it."""

from __future__ import annotations

from typing import Any

from ..component import Component, Values
from ..declarations import Data, Input, Memory, Output, Parameter
from ..maths import logical_and, logical_not, logical_or, maximum, where
from ..trains.multiple_unit import WAITING
from .braking import STANDSTILL, brake, hold
from .speed_limit import LIMITS, LIMITS_BY_PLACE, STEPS


class Protection(Component):
    """Supervision of the speed limit, between a controller and its train: its force overrides the controller's.

    Above the limit less ``warning_margin`` it warns, above the limit it applies the service brake, above the limit
    plus ``emergency_margin`` the emergency brake. A brake is never released while the train moves: it is held to the
    standstill and there until the next wait (``trip_time`` negative), or, if ``release_at_standstill`` says so, the
    service brake is released at the standstill. While the train moves, the brake that
    acts is never weaker than the controller's own: it decelerates by the larger of the two, and eases into the
    standstill over the last 0.3 m/s or so. Without ``intervene`` it watches only.
    """

    note = "Margins and decelerations other than the emergency brake's 1.2 m/s2 are chosen."
    source = "limits: Liu & Hou 2020, eq. 64"
    equations = (
        r"overspeed $o = v - v_\mathrm{lim}$, with $v_\mathrm{lim}$ at the trip time, or at the position where by_place"
        r" is set",
        r"warning: $o > -m_\mathrm{w}$; service_brake: from $o > 0$ on; emergency_brake: from $o > m_\mathrm{e}$ on",
        r"force $= -M \min(\max(a_\mathrm{b}, -F_\mathrm{d} / M), k v)$ while a brake acts, until the train stands,"
        r" then what holds it; else $F_\mathrm{d}$",
        r"with warning_margin $m_\mathrm{w}$, emergency_margin $m_\mathrm{e}$, mass $M$, demanded_force $F_\mathrm{d}$,"
        r" the deceleration $a_\mathrm{b}$ of the stronger brake that acts and $k = 4$ per second, which eases it off.",
    )

    limits = Data(LIMITS, convert=STEPS.read, description="speed limit over trip time, pairs of begin (s) and m/s")
    limits_by_place = Data(
        LIMITS_BY_PLACE, convert=STEPS.read, description="speed limit over position, pairs of begin (m) and m/s"
    )

    trip_time = Input("s", 0.0, description="time since departure; negative while waiting")
    position = Input("m", description="position since departure")
    speed = Input("m/s", description="speed")
    demanded_force = Input("N", description="the controller's force")

    mass = Parameter("kg", 194295.0, minimum=1.0, description="mass of the train")
    by_place = Parameter("1", False, description="whether the limit is one over position, not over trip time")
    intervene = Parameter(
        "1", True, tunable=True, description="whether the brakes act; otherwise they are only reported"
    )
    warning_margin = Parameter(
        "m/s", 0.1, tunable=True, minimum=0.0, description="how far below the limit the warning begins"
    )
    emergency_margin = Parameter(
        "m/s", 0.5, tunable=True, minimum=0.0, description="how far above it the emergency brake begins"
    )
    service_deceleration = Parameter(
        "m/s2", 0.9, tunable=True, minimum=0.0, description="deceleration of the service brake"
    )
    emergency_deceleration = Parameter(
        "m/s2", 1.2, tunable=True, minimum=0.0, description="deceleration of the emergency brake"
    )
    release_at_standstill = Parameter(
        "1", False, tunable=True, description="whether the service brake is released at standstill"
    )

    service_latched = Memory("1", False, description="whether the service brake is applied")
    emergency_latched = Memory("1", False, description="whether the emergency brake is applied")
    hold_position = Memory("m", 0.0, description="where a braked train is held")

    force = Output("N", description="force for the train")
    speed_limit = Output("m/s", description="the limit that is supervised")
    overspeed = Output("m/s", description="speed less limit")
    warning = Output("1", bool, description="whether the warning is on")
    service_brake = Output("1", bool, description="whether the service brake is called for")
    emergency_brake = Output("1", bool, description="whether the emergency brake is called for")

    def outputs(self) -> Values:
        overspeed = self._overspeed()
        service, emergency = self._brakes(overspeed)
        deceleration = where(emergency, self.emergency_deceleration, self.service_deceleration)
        # Never less than the controller brakes, or to intervene could mean to brake less; a stand is the brake's alone.
        demanded = where(self.speed > STANDSTILL, -self.demanded_force / self.mass, 0.0)
        deceleration = maximum(deceleration, demanded)
        stop = brake(self.mass, deceleration, self.position, self.speed, self.hold_position)
        acts = logical_and(self.intervene, logical_or(service, emergency))
        return {
            "force": where(acts, stop, self.demanded_force),
            "speed_limit": self._limit(),
            "overspeed": overspeed,
            "warning": logical_and(logical_not(self._waiting()), overspeed > -self.warning_margin),
            "service_brake": service,
            "emergency_brake": emergency,
        }

    def update(self) -> Values:
        service, emergency = self._brakes(self._overspeed())
        released = logical_and(self.release_at_standstill, abs(self.speed) <= STANDSTILL)
        return {
            "service_latched": logical_and(service, logical_not(released)),
            "emergency_latched": emergency,
            "hold_position": hold(self.position, self.speed, self.hold_position, self._waiting()),
        }

    def _waiting(self) -> Any:
        return self.trip_time < WAITING

    def _limit(self) -> Any:
        return where(self.by_place, self.limits_by_place.at(self.position), self.limits.at(self.trip_time))

    def _overspeed(self) -> Any:
        return self.speed - self._limit()

    def _brakes(self, overspeed: Any) -> tuple[Any, Any]:
        """Service and emergency brake: called for now, or earlier on this trip."""
        under_way = logical_not(self._waiting())
        service = logical_or(self.service_latched, overspeed > 0.0)
        emergency = logical_or(self.emergency_latched, overspeed > self.emergency_margin)
        return logical_and(under_way, service), logical_and(under_way, emergency)
