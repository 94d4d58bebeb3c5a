"""ETCS speed and distance monitoring (SUBSET-026 4.0.0, 3.13): braking curves, supervision limits, interventions."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..component import Component, Values
from ..declarations import Data, Input, Memory, Output, Parameter
from ..environment.track import DESCRIPTION, read_line
from ..errors import BuildArgumentError
from ..maths import floor, logical_and, logical_not, logical_or, maximum, minimum, where
from ..trains.etcs_brakes import FLIRT
from ..trains.rolling_stock import TRAIN_DESCRIPTION
from .braking import STANDSTILL, brake, hold
from .etcs_limits import (
    T_DRIVER,
    T_WARNING,
    Limits,
    Reaction,
    emergency_limits,
    emergency_margin,
    service_limits,
    service_margin,
    speed_uncertainty,
    warning_margin,
)
from .etcs_targets import Supervised, at_speed, read_train, supervised

CSM, TSM, RSM = 0, 1, 2
"""Ceiling, target and release speed monitoring, 3.13.10.1.2."""
NORMAL, INDICATION, OVERSPEED, WARNING, INTERVENTION = range(5)
"""Supervision statuses, 3.13.10.1.1."""
_FAR = 1e9
"""m: where there is no target."""

LINE = {
    "sections": [
        {"position": 0.0},
        {"position": 2000.0, "gradient": -0.008},
        {"position": 3500.0, "gradient": 0.005},
        {"position": 5000.0},
    ],
    "speed_limits": [[0.0, 36.0], [3000.0, 22.0], [4000.0, 36.0]],
}
"""Chosen."""


class _Watch(NamedTuple):
    """What a target, or several together, ask for: which of their limits are exceeded, and what is shown of them."""

    indication: Any
    overspeed: Any
    warning: Any
    service: Any
    emergency: Any
    permitted_speed: Any
    service_speed: Any


class _Relevant(NamedTuple):
    """The most relevant displayed target: speed in m/s, location in m, permitted speed in m/s."""

    speed: Any
    location: Any
    permitted: Any


class EtcsSupervision(Component):
    """On-board ETCS speed and distance monitoring, between a controller and its train.

    It supervises the line's speed limits for the whole train, and the movement authority: an end of authority (EoA)
    with its supervised location (SvL), or, with an ``authority_speed``, a limit of authority (LoA). Status, brake and
    traction commands are those of SUBSET-026 3.13.10, with the latches and releases of its tables. A train whose rear
    bound of the front end passes the authority is tripped for good: an acknowledgement is not modelled.

    ``force`` is the controller's, without traction from the warning on; while a brake is commanded it is what gives the
    deceleration that ETCS knows of that brake, never weaker than the controller brakes. Build-up times and delays are
    the train's own. Without ``intervene`` it watches only.
    """

    source = "ERA SUBSET-026 issue 4.0.0, chapter 3.13, appendices A.3.1, A.3.2 and A.3.7 to A.3.9"
    note = "Simulation is no evidence for operational safety. What is not modelled: docs/etcs.md."
    equations = (
        r"EBD: $v\,\mathrm{d}v/\mathrm{d}x = -(A_\mathrm{safe}(v) + A_\mathrm{gradient}(x))$ through"
        r" $V + dV_\mathrm{ebi}(V)$ at a limit's begin, through 0 at the SvL;",
        r"SBD: likewise with the service brake, through 0 at the EoA",
        r"$d_\mathrm{EBI} = d_\mathrm{EBD}(V_\mathrm{bec}) - D_\mathrm{bec}, \quad d_\mathrm{SBI2} ="
        r" d_\mathrm{EBI} - v T_\mathrm{bs}, \quad d_\mathrm{SBI1} = d_\mathrm{SBD}(v) - v T_\mathrm{bs}$",
        r"$d_\mathrm{W} = d_\mathrm{SBI} - 2\,\mathrm{s} \cdot v, \quad d_\mathrm{P} = d_\mathrm{SBI} - 4\,\mathrm{s}"
        r" \cdot v, \quad d_\mathrm{I} = d_\mathrm{P} - T_\mathrm{ind}\,v$",
    )

    line = Data(LINE, convert=read_line, description=DESCRIPTION)
    train = Data(FLIRT, convert=read_train, description=TRAIN_DESCRIPTION)

    position = Input("m", description="estimated position of the train's front")
    speed = Input("m/s", description="estimated speed")
    acceleration = Input("m/s2", optional=True, description="estimated acceleration")
    demanded_force = Input("N", description="the controller's force")
    has_authority = Input("1", False, optional=True, description="whether there is an end of the movement authority")
    end_of_authority = Input("m", flag=has_authority, description="end, or limit, of authority")
    supervised_location = Input("m", flag=has_authority, description="supervised location; not before the EoA")
    authority_speed = Input("m/s", optional=True, description="speed at the limit of authority; 0: it is an end")
    release_speed = Input("m/s", optional=True, description="release speed, as the trackside gives it; 0: none")

    intervene = Parameter("1", True, tunable=True, description="whether traction and brakes are acted on")
    service_available = Parameter("1", True, tunable=True, description="whether there is a service brake command")
    cutoff_available = Parameter("1", True, tunable=True, description="whether there is a traction cut-off command")
    release_early = Parameter(
        "1", False, tunable=True, description="whether emergency brakes are released before standstill (Q_NVEMRRLS)"
    )
    compensate_speed = Parameter(
        "1", True, tunable=True, description="whether the speed's inaccuracy is compensated (not Q_NVINHSMICPERM)"
    )
    odometer_offset = Parameter(
        "m", 5.0, tunable=True, minimum=0.0, description="constant part of the position's error"
    )
    odometer_share = Parameter(
        "1", 0.05, tunable=True, minimum=0.0, description="part of it that grows with the way since the last balise"
    )
    balise_spacing = Parameter("m", 500.0, tunable=True, minimum=1.0, description="distance of the balise groups")

    monitoring_before = Memory("1", 0, type=int, description="monitoring at the last sample")
    status_before = Memory("1", 0, type=int, description="status at the last sample")
    relevant_speed = Memory("m/s", 0.0, description="speed of the most relevant target")
    relevant_location = Memory("m", _FAR, description="its location")
    cutoff_latched = Memory("1", False, description="whether the traction is cut off")
    service_latched = Memory("1", False, description="whether the service brake is commanded")
    emergency_latched = Memory("1", False, description="whether the emergency brake is commanded")
    trip_latched = Memory("1", False, description="whether the train has been tripped")
    hold_position = Memory("m", 0.0, description="where a braked train is held")

    force = Output("N", description="force for the train")
    speed_limit = Output("m/s", description="lowest limit under the train, V_MRSP")
    permitted_speed = Output("m/s", description="permitted speed, V_P")
    service_speed = Output("m/s", description="speed at which the service brake intervenes, V_SBI")
    overspeed = Output("m/s", description="speed less permitted speed")
    target_speed = Output("m/s", description="speed of the most relevant target; the limit in ceiling speed monitoring")
    target_distance = Output("m", description="distance to it; 1e9 in ceiling speed monitoring")
    monitoring = Output("1", int, description="0 ceiling, 1 target, 2 release speed monitoring")
    status = Output("1", int, description="0 normal, 1 indication, 2 overspeed, 3 warning, 4 intervention")
    traction_cutoff = Output("1", bool, description="whether the traction is cut off")
    service_brake = Output("1", bool, description="whether the service brake is commanded")
    emergency_brake = Output("1", bool, description="whether the emergency brake is commanded")
    tripped = Output("1", bool, description="whether the train has passed its authority")

    def __init__(self, /, **values: Any) -> None:
        super().__init__(**values)
        try:
            self._supervised()
        except ValueError as error:
            raise BuildArgumentError("line", f"{type(self).__name__}: {error}") from None

    def outputs(self) -> Values:
        seen, relevant, monitoring = self._seen()
        cutoff, service, emergency = self._commands(seen, monitoring)
        targeted, limit = monitoring != CSM, self._limit()
        # 3.13.10.2.3-4: without a service brake it is the emergency brake that is commanded, and revoked, like it
        instead = logical_and(service, logical_not(self.service_available))
        return {
            "force": self._force(cutoff, service, logical_or(emergency, instead)),
            "speed_limit": limit,
            "permitted_speed": seen.permitted_speed,
            "service_speed": seen.service_speed,
            "overspeed": self.speed - seen.permitted_speed,
            "target_speed": where(targeted, relevant.speed, limit),
            "target_distance": where(targeted, maximum(relevant.location - self._front(), 0.0), _FAR),
            "monitoring": monitoring,
            "status": self._status(seen, monitoring, logical_or(service, emergency)),
            "traction_cutoff": cutoff,
            "service_brake": logical_and(service, self.service_available),
            "emergency_brake": logical_or(emergency, instead),
            "tripped": self._tripped(),
        }

    def update(self) -> Values:
        seen, relevant, monitoring = self._seen()
        cutoff, service, emergency = self._commands(seen, monitoring)
        return {
            "monitoring_before": monitoring,
            "status_before": self._status(seen, monitoring, logical_or(service, emergency)),
            "relevant_speed": relevant.speed,
            "relevant_location": relevant.location,
            "cutoff_latched": cutoff,
            "service_latched": service,
            "emergency_latched": emergency,
            "trip_latched": self._tripped(),
            "hold_position": hold(self.position, self.speed, self.hold_position, False),
        }

    # ---------------------------------------------------------------- the train on the line

    def _supervised(self) -> Supervised:
        return supervised(self.line, self.train)

    def _speed(self) -> Any:
        return maximum(self.speed, 0.0)

    def _error(self) -> Any:
        """Half the confidence interval of the position in m (SUBSET-041 5.2.1.1)."""
        travelled = self.position - self.balise_spacing * floor(self.position / self.balise_spacing)
        return self.odometer_offset + self.odometer_share * travelled

    def _front(self) -> Any:
        """The max safe front end in m."""
        return self.position + self._error()

    def _rear_bound(self) -> Any:
        """The min safe front end in m."""
        return self.position - self._error()

    def _limit(self) -> Any:
        """V_MRSP: the lowest limit anywhere under the train (3.13.7.2)."""
        lowest = self.line.limits.lowest(self._rear_bound() - self.train.length, self._front())
        return minimum(lowest, self.train.max_speed)

    def _uncertainty(self, speed: Any) -> Any:
        """V_delta0 in m/s at a speed (3.13.9.3.2.1)."""
        share = self.train.etcs.speed_uncertainty
        return where(self.compensate_speed, share * speed if share else speed_uncertainty(speed), 0.0)

    def _reaction(self, speed: Any, acceleration: Any, stops: bool) -> Reaction:
        """The reaction at a speed, for a target speed of zero or another one."""
        known = self._supervised()
        number = 0 if stops else 1
        service = where(self.service_available, known.service_times[number], 0.0)
        cutoff = self.train.etcs.cutoff_time
        traction = where(self.cutoff_available, maximum(cutoff - (T_WARNING + service), 0.0), cutoff)
        uncertainty = self._uncertainty(speed)
        return Reaction(speed, uncertainty, acceleration, traction, known.emergency_times[number], service)

    def _tripped(self) -> Any:
        passed = logical_and(self.has_authority, self._rear_bound() > self.end_of_authority)
        return logical_or(self.trip_latched, passed)

    # ---------------------------------------------------------------- targets

    def _seen(self) -> tuple[_Watch, _Relevant, Any]:
        """All targets together, the most relevant one, and the monitoring that follows."""
        limit, speed = self._limit(), self._speed()
        service = limit + service_margin(limit)
        warned, stopped = speed > limit + warning_margin(limit), speed > limit + emergency_margin(limit)
        seen = _Watch(False, speed > limit, warned, speed > service, stopped, limit, service)
        relevant = _Relevant(self.relevant_speed, self.relevant_location, _FAR)
        lowest, present = relevant, False
        reaction = self._reaction(speed, self.acceleration, stops=False)
        for target in self._supervised().targets:
            ahead = logical_and(self._front() < target.location, target.speed < limit)
            present = logical_or(present, logical_and(ahead, target.location == self.relevant_location))
            limits = emergency_limits(target.curve, target.speed, target.location, reaction)
            watch = self._watch_target(limits, target.curve, target.speed, reaction, ahead)
            seen, lowest = _joined(seen, watch), _more_relevant(lowest, watch, target.speed, target.location)
        watch, release_started = self._watch_authority(limit)
        same = logical_and(self.has_authority, self.end_of_authority == self.relevant_location)
        present = logical_or(present, same)
        seen = _joined(seen, watch)
        lowest = _more_relevant(
            lowest, watch, where(self.has_authority, self.authority_speed, 0.0), self.end_of_authority
        )
        # 3.13.10.4.5: it stays the most relevant one until it is passed or another one is not faster
        kept = logical_and(logical_and(present, self.relevant_speed < limit), self.monitoring_before == TSM)
        replaced = logical_and(lowest.permitted < _FAR, logical_or(logical_not(kept), lowest.speed <= relevant.speed))
        relevant = _Relevant(*(where(replaced, a, b) for a, b in zip(lowest, relevant, strict=True)))
        entered = logical_and(seen.indication, speed > STANDSTILL)
        monitoring = where(release_started, RSM, where(logical_or(entered, kept), TSM, CSM))
        return seen, relevant, monitoring

    def _watch_target(self, limits: Limits, curve: Any, target: Any, reaction: Reaction, there: Any) -> _Watch:
        """A fall of the limit, or a limit of authority (3.13.10.4, table 8)."""
        v, front = self._speed(), self._front()
        permitted, service = self._emergency_speeds(curve, target, reaction)
        return _Watch(
            logical_and(logical_and(there, v > target), front > limits.indication),
            logical_and(logical_and(there, v > target), front > limits.permitted),
            logical_and(logical_and(there, v > target + warning_margin(target)), front > limits.warning),
            logical_and(logical_and(there, v > target + service_margin(target)), front > limits.service),
            logical_and(logical_and(there, v > target + emergency_margin(target)), front > limits.emergency),
            where(there, maximum(permitted, target), _FAR),
            where(there, maximum(service, where(target > 0.0, target + service_margin(target), 0.0)), _FAR),
        )

    def _emergency_speeds(self, curve: Any, target: Any, reaction: Reaction) -> tuple[Any, Any]:
        """V_P and V_SBI2 in m/s at the max safe front end, from an EBD (3.13.9.3.3.8, 3.13.9.3.5.7)."""
        service = self._front() + self._speed() * reaction.service + reaction.distance(0.0)
        permitted = service + self._speed() * T_DRIVER
        gain = reaction.gain()
        return curve.speed(permitted) - gain, curve.speed(service) - gain

    def _watch_authority(self, limit: Any) -> tuple[_Watch, Any]:
        """The EoA with its SvL, or the LoA (table 9, table 8); and whether release speed monitoring has begun."""
        known, v, front = self._supervised(), self._speed(), self._front()
        limited = logical_and(self.has_authority, self.authority_speed > 0.0)
        ends = logical_and(self.has_authority, logical_not(limited))
        target = where(limited, self.authority_speed, 0.0)
        place = where(limited, self.end_of_authority, self.supervised_location)
        through = where(limited, target + emergency_margin(target), 0.0)
        curve = known.emergency.curve(place, through, target)
        moving, stopping = (self._reaction(v, self.acceleration, stops) for stops in (False, True))
        reaction = Reaction(*(where(limited, a, b) for a, b in zip(moving, stopping, strict=True)))
        emergency = emergency_limits(curve, target, place, reaction)
        seen = self._watch_target(emergency, curve, target, reaction, self.has_authority)

        stop = known.service.rising(self.end_of_authority, 0.0)
        service = service_limits(stop, stopping)
        released = logical_and(self.release_speed > 0.0, self.release_speed < limit)
        release = where(released, self.release_speed, 0.0)
        passed = [_passed(self.position, a, front, b) for a, b in zip(service[1:], emergency[1:], strict=True)]
        fast = logical_and(ends, v > release)
        way = v * reaction.service
        stopped = _Watch(
            logical_and(logical_and(ends, v >= release), passed[3]),
            logical_and(fast, passed[2]),
            logical_and(fast, passed[1]),
            logical_and(fast, passed[0]),
            logical_and(fast, front > emergency.emergency),
            minimum(stop.speed(self.position + way + v * T_DRIVER), seen.permitted_speed),
            minimum(stop.speed(self.position + way), seen.service_speed),
        )
        # RSM begins where SBI1 or SBI2 of the release speed is reached without acceleration (3.13.9.4.6)
        slow = self._reaction(release, 0.0, True)
        svl = emergency_limits(curve, 0.0, place, slow)
        begun = _passed(self.position, service_limits(stop, slow).service, front, svl.service)
        released = logical_and(logical_and(ends, released), begun)
        held = _Watch(True, False, False, False, v > release, stopped.permitted_speed, stopped.service_speed)
        stopped = _Watch(*(where(released, a, b) for a, b in zip(held, stopped, strict=True)))
        return _Watch(*(where(ends, a, b) for a, b in zip(stopped, seen, strict=True))), released

    # ---------------------------------------------------------------- commands

    def _commands(self, seen: _Watch, monitoring: Any) -> tuple[Any, Any, Any]:
        """Traction cut-off, service brake and emergency brake: triggered now, or earlier and not revoked since.

        Triggers: tables 5, 8, 9 and 13. Revocations: tables 6, 10, 11 and 14, and 3.13.10.6.3-4.
        """
        limit, released = self._limit(), monitoring == RSM
        clear = logical_not(seen.overspeed)
        too_fast = logical_or(seen.warning, self._speed() > limit + warning_margin(limit))
        cutoff = logical_or(too_fast, logical_and(self.cutoff_latched, logical_not(clear)))
        service = logical_or(seen.service, logical_and(self.service_latched, logical_not(clear)))
        early = logical_and(logical_and(self.release_early, clear), logical_not(released))
        revoked = logical_or(abs(self.speed) <= STANDSTILL, early)
        emergency = logical_or(seen.emergency, logical_and(self.emergency_latched, logical_not(revoked)))
        return (
            logical_and(logical_and(self.cutoff_available, monitoring == TSM), cutoff),
            logical_and(logical_not(released), service),
            logical_or(self._tripped(), emergency),
        )

    def _status(self, seen: _Watch, monitoring: Any, braked: Any) -> Any:
        """The supervision status by tables 7, 12 and 15: the highest one triggered, or the last one until revoked."""
        least = where(monitoring == CSM, NORMAL, INDICATION)
        last = where(self.status_before > WARNING, WARNING, self.status_before)
        held = where(seen.overspeed, maximum(last, OVERSPEED), least)
        unbraked = where(monitoring == RSM, INDICATION, where(seen.warning, WARNING, maximum(held, least)))
        return where(braked, INTERVENTION, unbraked)

    def _force(self, cutoff: Any, service: Any, emergency: Any) -> Any:
        """What reaches the train: the controller's force, cut off, or a brake that is no weaker."""
        mass = self.train.mass * (1.0 + self.train.rotating_mass)
        speed, brakes = abs(self.speed), self.train.etcs
        deceleration = where(emergency, at_speed(brakes.emergency, speed), at_speed(brakes.service, speed))
        demanded = where(self.speed > STANDSTILL, -self.demanded_force / mass, 0.0)
        stop = brake(mass, maximum(deceleration, demanded), self.position, self.speed, self.hold_position)
        cut = where(cutoff, minimum(self.demanded_force, 0.0), self.demanded_force)
        acted = where(logical_or(service, emergency), stop, cut)
        return where(self.intervene, acted, self.demanded_force)


def _passed(position: Any, first: Any, front: Any, second: Any) -> Any:
    """Whether the estimated front has passed a place of the EoA, or the max safe front one of the SvL."""
    return logical_or(position > first, front > second)


def _joined(a: _Watch, b: _Watch) -> _Watch:
    """What two targets together ask for."""
    indication, overspeed, warning, service, emergency = map(logical_or, a[:5], b[:5])
    permitted = minimum(a.permitted_speed, b.permitted_speed)
    return _Watch(
        indication, overspeed, warning, service, emergency, permitted, minimum(a.service_speed, b.service_speed)
    )


def _more_relevant(relevant: _Relevant, watch: _Watch, speed: Any, location: Any) -> _Relevant:
    """The one with the lower permitted speed, of those whose indication limit is exceeded (3.13.10.4.2, step 0)."""
    lower = logical_and(watch.indication, watch.permitted_speed < relevant.permitted)
    new = (speed, location, watch.permitted_speed)
    return _Relevant(*(where(lower, a, b) for a, b in zip(new, relevant, strict=True)))
