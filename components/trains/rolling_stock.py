"""The format of a train: masses, running resistance, drive and brakes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..environment.track import ABOUT
from ..tables import FASTEST, Column, Table
from .etcs_brakes import BRAKES, EtcsBrakes

_MOST = 1e7
"""N: more than any train pulls or brakes with."""
_STRONGEST = 1e8
"""W: more than any train has."""
_HARDEST = 5.0
"""m/s2: harder than any train brakes on rails."""


class Effort(NamedTuple):
    """What a drive gives at the wheels: largest force in N, power in W, and how much of the energy arrives."""

    force: float
    power: float
    efficiency: float


class Davis(NamedTuple):
    """Running resistance a + b v + c v^2 of the whole train: N, N.s/m, N.s2/m2."""

    a: float
    b: float
    c: float


_NO_RESISTANCE = Davis(0.0, 0.0, 0.0)
_UNLIMITED = Effort(_MOST, _STRONGEST, 1.0)
_NONE = Effort(0.0, 0.0, 1.0)

EFFORT = Table(
    "drive",
    [
        Column("force", "N", within=(0.0, _MOST)),
        Column("power", "W", within=(0.0, _STRONGEST)),
        Column("efficiency", default=1.0, within=(0.01, 1.0), note="share that arrives"),
    ],
    make=Effort,
    single=True,
)
RESISTANCE = Table(
    "resistance",
    [
        Column("a", "N", within=(0.0, 1e6)),
        Column("b", "N.s/m", within=(0.0, 1e5)),
        Column("c", "N.s2/m2", within=(0.0, 1e3)),
    ],
    make=Davis,
    single=True,
)
TUNNELS = Table(
    "tunnel",
    [Column("area", "m2", after="area", within=(1.0, 500.0)), Column("c", "N.s2/m2", within=(0.0, 1e3))],
    by_place=True,
    may_be_empty=True,
)


@dataclass(frozen=True, eq=False)
class RollingStock:
    """A train as equations read it, in SI units.

    Attributes:
        mass: without the rotating parts' share, in kg. rotating_mass: that share of the mass.
        length: in m; 0 where it is not known. max_speed: in m/s.
        resistance: running resistance in the open. tunnels: its further c by cross-section of a tunnel, rising.
        traction, regeneration: electric drive and brake. friction_brake: its largest force in N.
        max_acceleration, max_deceleration: for comfort, in m/s2; 0 where none is set.
        etcs: its brakes for ETCS, if they are known.
    """

    mass: float
    rotating_mass: float = 0.0
    length: float = 0.0
    max_speed: float = FASTEST
    resistance: Davis = _NO_RESISTANCE
    tunnels: tuple[tuple[float, float], ...] = ()
    traction: Effort = _UNLIMITED
    regeneration: Effort = _NONE
    friction_brake: float = _MOST
    max_acceleration: float = 0.0
    max_deceleration: float = 0.0
    etcs: EtcsBrakes | None = None

    def tunnel_drag(self, area: float) -> float:
        """Further c in N.s2/m2 in a tunnel of a cross-section in m2: linear between those known, 0 without any."""
        if not area or not self.tunnels:
            return 0.0
        before = self.tunnels[0]
        for after in self.tunnels:
            if area <= after[0]:
                share = (area - before[0]) / (after[0] - before[0]) if after[0] > before[0] else 1.0
                return before[1] + min(max(share, 0.0), 1.0) * (after[1] - before[1])
            before = after
        return before[1]

    def tunnel_drags(self, areas: Sequence[float]) -> list[float]:
        """The same for the sections of a line."""
        return [self.tunnel_drag(area) for area in areas]


TRAIN = Table(
    "train",
    [
        Column("mass", "kg", within=(1e3, 1e8)),
        Column("rotating_mass", default=0.0, within=(0.0, 0.5), note="share of the mass"),
        Column("length", "m", default=0.0, within=(0.0, 5e3)),
        Column("max_speed", "m/s", default=FASTEST, within=(1.0, FASTEST)),
        Column("resistance", type=RESISTANCE, default=_NO_RESISTANCE),
        Column("tunnel_resistance", type=TUNNELS, default=()),
        Column("traction", type=EFFORT, default=_UNLIMITED),
        Column("regenerative_brake", type=EFFORT, default=_NONE),
        Column("friction_brake", "N", default=_MOST, within=(0.0, _MOST)),
        Column("max_acceleration", "m/s2", default=0.0, within=(0.0, _HARDEST)),
        Column("max_deceleration", "m/s2", default=0.0, within=(0.0, _HARDEST)),
        Column("etcs", type=BRAKES, default=None),
        *ABOUT,
    ],
    make=lambda *values: RollingStock(*values[: -len(ABOUT)]),
    single=True,
)
TRAIN_DESCRIPTION = (
    "a train: a table of 'mass' (kg), 'rotating_mass' (share), 'length' (m), 'resistance', 'traction', "
    "'regenerative_brake', 'friction_brake' (N) and more"
)
