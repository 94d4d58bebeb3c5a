"""What ETCS supervises on a line with a train: brakes over its gradients, and the places where the limit falls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

from ..environment.track import Track
from ..maths import piecewise_constant
from ..trains.etcs_brakes import Steps
from ..trains.rolling_stock import TRAIN, RollingStock
from .etcs_curves import Brake, FixedCurve, braking, fixed, gradient_accelerations, lower_envelope
from .etcs_limits import emergency_margin

_ROTATING_MAX, _ROTATING_MIN = 0.15, 0.02
"""M_rotating_max and M_rotating_min, shares of the train's mass: SUBSET-026 A.3.1."""
_GRADIENTS = 31
"""Gradients that reach to a moving target: what the trackside tells at most in one message (packet 21, 7.4.2)."""
_ABOVE = 10.0
"""m/s above the train's own largest speed up to which curves are exact."""


class Target(NamedTuple):
    """A place in m where the limit falls to a speed in m/s, and its EBD (3.13.8.2.1 a, 3.13.8.3.1)."""

    location: float
    speed: float
    curve: FixedCurve


@dataclass(frozen=True, eq=False)
class Supervised:
    """A line for a train.

    Attributes:
        emergency, service: brakes for the EBD and SBD curves of an authority, over the line.
        targets: places where the limit falls, in order.
        emergency_times, service_times: T_be and T_bs in s, for a target speed of zero and for others.
    """

    emergency: Brake
    service: Brake
    targets: tuple[Target, ...]
    emergency_times: tuple[float, float]
    service_times: tuple[float, float]


def read_train(data: Any) -> RollingStock:
    """A train that tells its length and ETCS braking data.

    Raises:
        ValueError: unusable data, or one of these is missing.
    """
    stock: RollingStock = TRAIN.record(data)
    if stock.etcs is None or not stock.length:
        raise ValueError(f"supervision needs the train's {'length' if stock.etcs else 'etcs'!r}")
    return stock


@lru_cache(maxsize=64)
def supervised(line: Track, train: RollingStock) -> Supervised:
    """What is supervised on a line with a train that `read_train` gave.

    Raises:
        ValueError: a brake does not hold the train on a slope, or its brake percentage is beyond the conversion model.
    """
    brakes = train.etcs
    assert brakes is not None
    share = train.rotating_mass
    uphill, downhill = (1.0 + (share or fallback) for fallback in (_ROTATING_MAX, _ROTATING_MIN))
    gradients = gradient_accelerations(line.positions, line.gradients, train.length, uphill, downhill)
    national = line.national or {}
    adhesion = national.get("M_NVAVADH", 0.0)
    emergency = braking(brakes.safe(adhesion), *gradients)
    told = lower_envelope(*gradients, _GRADIENTS)
    targets, steps = [], [(location, min(limit, train.max_speed)) for location, limit in line.limits.steps]
    for (_, before), (location, speed) in pairwise(steps):
        if speed < before:
            curve = emergency.curve(location, speed + emergency_margin(speed), speed)
            targets.append(Target(location, speed, fixed(curve, gradients[0], train.max_speed + _ABOVE)))
    moving = braking(brakes.safe(adhesion), *told), braking(brakes.service, *told)
    return Supervised(*moving, tuple(targets), *brakes.times(train.length, train.max_speed, national.get("Kt_int")))


def at_speed(steps: Steps, speed: Any) -> Any:
    """The value of a step function at a speed in m/s."""
    return piecewise_constant(speed, *zip(*steps, strict=True))
