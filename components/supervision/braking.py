"""Braking to a standstill and staying there, by a force that a train model without brake shoes understands."""

from __future__ import annotations

from typing import Any

from ..maths import clip, where

STANDSTILL = 0.05
"""m/s: a braked train below this speed is held where it is."""
_DAMPING, _STIFFNESS = 4.0, 4.0
"""1/s and 1/s2: the last 0.3 m/s and the hold are critically damped at 2 rad/s, slow enough for samples of 0.1 s."""


def brake(mass: Any, deceleration: Any, position: Any, speed: Any, hold_position: Any) -> Any:
    """Force in N that brakes with at most the given deceleration in m/s2, and holds a train that stands.

    A constant force would push a standing train backwards; one proportional to speed would let it creep downhill.
    """
    offset = where(abs(speed) > STANDSTILL, 0.0, position - hold_position)
    return -mass * clip(_DAMPING * speed + _STIFFNESS * offset, -deceleration, deceleration)


def hold(position: Any, speed: Any, hold_position: Any, waiting: Any) -> Any:
    """Where to hold the train: where it last moved."""
    return where(waiting, position, where(abs(speed) > STANDSTILL, position, hold_position))
