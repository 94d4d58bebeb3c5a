"""`Finding`: one thing that no train can do, or that a controller says of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

Kind = Literal["collision", "reversing", "runaway", "refused", "left its domain", "diverging", "degraded"]
"""The gravest first."""


@dataclass(frozen=True)
class Finding:
    """What was found in a run. As text: ``"collision: train[2] runs into train[1] ..."``.

    Attributes:
        kind: ``"collision"`` (a train of a platoon reaches or passes the one ahead), ``"reversing"``, ``"runaway"`` (a
            train faster than any), ``"refused"`` (a controller does not drive), ``"left its domain"`` (it says that its
            law does not hold), ``"diverging"`` (signals grow without bound), ``"degraded"`` (it took its fallback,
            which is what that is for).
        instances: that it is about.
        signal: that shows it.
        since: first time at which it was seen, in s.
        worst: the value farthest off, in the signal's unit; of a flag whether it was raised.
        worst_time: when, in s.
        message: one sentence.
    """

    kind: Kind
    instances: tuple[str, ...]
    signal: str
    since: float
    worst: float
    worst_time: float
    message: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.message}"

    @property
    def rank(self) -> int:
        """How grave it is: 0 is the gravest."""
        return get_args(Kind).index(self.kind)

    @property
    def spoils(self) -> bool:
        """Whether the run is no example of what is wanted, so that it wins no comparison."""
        return self.kind != "degraded"
