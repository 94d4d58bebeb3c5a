"""The vehicles of a multiple unit, and how a total force is shared among them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..maths import where
from ..tables import Column, Table


@dataclass(frozen=True)
class Vehicle:
    """One vehicle.

    Attributes:
        mass: in kg. weight: effectiveness mu of its force (the paper's Upsilon). motored: whether it gives traction.
    """

    mass: float
    weight: float
    motored: bool


SUBWAY = (
    {"mass": 32939.0, "weight": 1.0, "motored": False},
    {"mass": 32957.0, "weight": 0.5, "motored": True},
    {"mass": 27090.0, "weight": 0.4, "motored": False},
    {"mass": 34050.0, "weight": 0.6, "motored": True},
    {"mass": 33785.0, "weight": 1.0, "motored": True},
    {"mass": 33474.0, "weight": 0.5, "motored": False},
)
"""The train of Liu & Hou 2020, section VI: 194 295 kg."""


VEHICLES = Table(
    "vehicle",
    [
        Column("mass", "kg", sign="positive"),
        Column("weight", sign="positive", note="mu of its force"),
        Column("motored", type=bool),
    ],
    make=Vehicle,
)

REPEATED = "a list shorter than the train is repeated"
"""For descriptions: what `pattern` does."""


def pattern(rows: Sequence[Any], count: int) -> list[Any]:
    """As many rows as asked for: a table that is shorter is repeated, one that is longer is cut."""
    return [rows[k % len(rows)] for k in range(count)]


def added(terms: Iterable[Any]) -> Any:
    """Sum from first to last, as C adds: Python's own compensates rounding errors from 3.12 on."""
    result: Any = 0.0
    for term in terms:
        result = result + term
    return result


def distribute(force: Any, weights: Sequence[Any], allowed: Sequence[Any], cost: Sequence[Any]) -> list[Any]:
    """Forces F of the vehicles that minimise sum(q F^2)/2 subject to sum(mu F) = force over those allowed to act.

    For traction they are the motored ones, for braking all (Liu & Hou 2020, eqs. 52-55, solved over the allowed set:
    solving over all and dropping the trailers afterwards, as printed, loses almost half of the traction).

    Args:
        force: total in N, positive for traction.
        weights: mu of each vehicle.
        allowed: whether each may give traction.
        cost: q of each vehicle, positive.
    """
    terms = [
        where(force > 0.0, where(may, mu * mu / q, 0.0), mu * mu / q)
        for mu, may, q in zip(weights, allowed, cost, strict=True)
    ]
    norm = added(terms)
    rate = force / where(norm > 0.0, norm, 1.0)
    return [
        where(force > 0.0, where(may, rate * mu / q, 0.0), rate * mu / q)
        for mu, may, q in zip(weights, allowed, cost, strict=True)
    ]
