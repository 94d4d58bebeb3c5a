"""Fixed values and formulas of ETCS speed and distance monitoring that hold for every target."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..maths import clip, maximum, minimum

_KMH = 1.0 / 3.6
T_WARNING = 2.0
"""s: from the warning limit to the service brake's, SUBSET-026 A.3.1."""
T_DRIVER = 4.0
"""s: from the permitted speed to the service brake's limit, A.3.1."""
_T_INDICATION = 5.0
"""s: least part of the time from the indication to the permitted speed, 3.13.9.3.6.2."""
_MOST_LATE = 0.4
"""m/s2: most that counts as acceleration once the traction is cut off, 3.13.9.3.2.9."""
_EBI, _SBI, _WARNING = (7.5, 15.0, 110.0, 210.0), (5.5, 10.0, 110.0, 210.0), (4.0, 5.0, 110.0, 140.0)
"""km/h: least and largest margin of each ceiling limit, and between which speeds it grows, A.3.1."""
_ODOMETRY = (2.0, 12.0, 30.0, 500.0)
"""km/h: likewise the speed's under-reading, SUBSET-041 5.3.1.2 (as open implementations give it)."""


def _growing(speed: Any, values: tuple[float, float, float, float]) -> Any:
    least, largest, begin, end = (value * _KMH for value in values)
    return least + (largest - least) / (end - begin) * (clip(speed, begin, end) - begin)


def emergency_margin(speed: Any) -> Any:
    """dV_ebi in m/s above a ceiling or target speed, 3.13.9.2.3."""
    return _growing(speed, _EBI)


def service_margin(speed: Any) -> Any:
    """dV_sbi in m/s, 3.13.9.2.5."""
    return _growing(speed, _SBI)


def warning_margin(speed: Any) -> Any:
    """dV_warning in m/s, 3.13.9.2.6."""
    return _growing(speed, _WARNING)


def speed_uncertainty(speed: Any) -> Any:
    """f41, how much faster than measured a train may be, in m/s: SUBSET-041 5.3.1.2."""
    return _growing(speed, _ODOMETRY)


class Reaction(NamedTuple):
    """What happens between an intervention and full brakes, for one estimated speed (3.13.9.3.2).

    Attributes:
        speed: estimated speed in m/s. uncertainty: V_delta0 in m/s. acceleration: estimated, in m/s2.
        traction: T_traction in s. emergency: T_be in s. service: T_bs in s, 0 where there is no service brake.
    """

    speed: Any
    uncertainty: Any
    acceleration: Any
    traction: Any
    emergency: Any
    service: Any

    def _gains(self) -> tuple[Any, Any, Any]:
        """V_delta1, V_delta2 in m/s and T_berem in s."""
        remaining = maximum(self.emergency - self.traction, 0.0)
        pull = maximum(self.acceleration, 0.0)
        return pull * self.traction, minimum(pull, _MOST_LATE) * remaining, remaining

    def compensated_speed(self, target: Any) -> Any:
        """V_bec in m/s for a target speed in m/s, 3.13.9.3.2.10."""
        first, second, _ = self._gains()
        return maximum(self.speed + self.uncertainty + first, target) + second

    def distance(self, target: Any) -> Any:
        """D_bec in m for a target speed in m/s, 3.13.9.3.2.10."""
        first, second, remaining = self._gains()
        before = maximum(self.speed + self.uncertainty + 0.5 * first, target)
        after = maximum(self.speed + self.uncertainty + first, target) + 0.5 * second
        return before * self.traction + after * remaining

    def gain(self) -> Any:
        """V_delta0 + V_delta1 + V_delta2 in m/s."""
        first, second, _ = self._gains()
        return self.uncertainty + first + second

    def indication(self) -> Any:
        """T_indication in s, 3.13.9.3.6.2."""
        return maximum(0.8 * self.service, _T_INDICATION) + T_DRIVER


class Limits(NamedTuple):
    """Locations in m of the supervision limits of one target for the estimated speed, the latest first (3.13.9.3)."""

    emergency: Any
    service: Any
    warning: Any
    permitted: Any
    indication: Any


def emergency_limits(curve: Any, target: Any, location: Any, reaction: Reaction) -> Limits:
    """Limits of a target whose curve is an EBD (3.13.9.3.2.12 to 3.13.9.3.6.1).

    Args:
        curve: its EBD.
        target: its speed in m/s.
        location: m.
        reaction: of the train.
    """
    speed = reaction.speed
    emergency = curve.location(reaction.compensated_speed(target)) - reaction.distance(target)
    service = emergency - speed * reaction.service
    permitted = minimum(service - speed * T_DRIVER, location)
    indication = permitted - speed * reaction.indication()
    return Limits(emergency, service, service - speed * T_WARNING, permitted, indication)


def service_limits(curve: Any, reaction: Reaction) -> Limits:
    """Limits of an EOA, whose curve is an SBD; it has no emergency limit, which stands at its foot (3.13.9.3.3.1)."""
    speed = reaction.speed
    service = curve.location(speed) - speed * reaction.service
    permitted = service - speed * T_DRIVER
    indication = permitted - speed * reaction.indication()
    return Limits(curve.knots[0], service, service - speed * T_WARNING, permitted, indication)
