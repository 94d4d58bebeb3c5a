"""What ETCS knows of a train's brakes: decelerations over speed and times, or a brake percentage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from ..tables import FASTEST, Column, Table

Steps = tuple[tuple[float, float], ...]
"""Values over speed: speed in m/s from which each holds, and the value; the first from 0 on."""

_KMH = 1.0 / 3.6
_SERVICE_MOST = 135.0
"""%: the brake percentage that counts for the service brake at most, A.3.7.1."""
_BASIC = (
    (100.0, (-6.30e-07, 6.10e-05, 4.72e-03, 0.0663)),
    (120.0, (2.73e-07, -4.54e-06, 5.14e-03, 0.1300)),
    (150.0, (5.58e-08, -6.76e-06, 5.81e-03, 0.0479)),
    (180.0, (3.00e-08, -3.85e-06, 5.52e-03, 0.0480)),
    (inf, (3.23e-09, 1.66e-06, 5.06e-03, 0.0559)),
)
"""End of each step in km/h and coefficients of the third to the zeroth power of the brake percentage, A.3.7.5-6."""
_HARDEST = 3.0
"""m/s2: harder than any train brakes."""


@dataclass(frozen=True)
class EtcsBrakes:
    """A train's brakes for speed and distance monitoring.

    Attributes:
        emergency: A_brake_emergency in m/s2. service: A_brake_service in m/s2.
        dry: Kdry_rst, with a brake percentage Kv_int Kr_int. wet: Kwet_rst, with a brake percentage 1.
        emergency_time: T_brake_emergency in s. service_time: T_brake_service in s; of a brake percentage by `times`.
        cutoff_time: T_traction_cut_off in s.
        speed_uncertainty: share of the speed by which it may be measured too low; 0: as SUBSET-041 has it.
        slippery: A_MAXREDADH in m/s2 where all of the line is slippery, else 0.
        percentage: brake percentage, or 0. freight: whether its position is a freight train's. g: whether it is G.
        kt: Kt_int.
    """

    emergency: Steps
    service: Steps
    dry: Steps
    wet: float
    emergency_time: float
    service_time: float
    cutoff_time: float
    speed_uncertainty: float
    slippery: float
    percentage: float
    freight: bool
    g: bool
    kt: float

    def safe(self, available_adhesion: float) -> Steps:
        """A_brake_safe in m/s2 over speed for M_NVAVADH: SUBSET-026 3.13.6.2.1.3 and 3.13.6.2.1.4."""
        wet = self.wet + available_adhesion * (1.0 - self.wet)
        safe = product(self.dry, ((0.0, wet),), self.emergency)
        return tuple((begin, min(a, self.slippery)) for begin, a in safe) if self.slippery else safe

    def times(
        self, length: float, max_speed: float, kt: float | None = None
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """T_be and T_bs in s, each for a target speed of zero and for others: 3.13.6.2.2.3 and 3.13.6.3.2.4.

        Args:
            length: of the train, m.
            max_speed: m/s.
            kt: Kt_int where the line tells it, instead of the train's data.

        Raises:
            ValueError: the conversion model does not hold for this train.
        """
        if not self.percentage:
            return (self.emergency_time,) * 2, (self.service_time,) * 2
        longest = 1500.0 if self.freight else 900.0
        if not (self.percentage >= 30.0 and max_speed <= 200.0 * _KMH + 1e-6 and 0.0 < length <= longest):
            raise ValueError(
                "the conversion model holds for brake percentages of 30 to 250, up to 200 km/h and"
                f" {longest:g} m (SUBSET-026 3.13.3.2.1), not for {self.percentage:g}, {max_speed * 3.6:g} km/h and"
                f" {length:g} m"
            )
        emergency, service, kto = build_up_times(length, self.freight, self.g)
        kt = self.kt if kt is None else kt
        return (kt * emergency, kt * kto * emergency), (service, kto * service)


def basic_deceleration(percentage: float) -> Steps:
    """A_basic in m/s2 over speed for a brake percentage: SUBSET-026 A.3.7.3 to A.3.7.6."""
    limit = 16.85 * percentage**0.428
    steps = [(0.0, 0.0075 * percentage + 0.076)]
    begin = limit
    for end, (a3, a2, a1, a0) in _BASIC:
        if limit < end:
            value = ((a3 * percentage + a2) * percentage + a1) * percentage + a0
            steps.append((begin * _KMH, value))
        begin = max(limit, end)
    return tuple(steps)


def build_up_times(length: float, freight: bool, g_position: bool) -> tuple[float, float, float]:
    """T_brake_basic_eb and T_brake_basic_sb in s, and k_to: SUBSET-026 A.3.8 and A.3.9."""
    hectometres = length / 100.0
    longer = max(hectometres, 4.0)
    if length > 900.0:
        emergency = -0.40 + 1.60 * hectometres + 0.03 * hectometres**2
    elif g_position:
        emergency = 12.00 + 0.05 * hectometres**2
    else:
        emergency = 2.30 + 0.17 * longer**2
    if not freight:
        service = 3.00 + 1.50 * hectometres + 0.10 * hectometres**2
    elif length > 900.0:
        service = 10.50 + 0.32 * hectometres + 0.18 * hectometres**2
    else:
        service = 3.00 + 2.77 * (longer if g_position else hectometres)
    return emergency, service, 1.16 if g_position else 1.20


def product(*factors: Steps) -> Steps:
    """The product of step functions."""
    begins = sorted({begin for steps in factors for begin, _ in steps})
    values = []
    for begin in begins:
        value = 1.0
        for steps in factors:
            value *= [v for b, v in steps if b <= begin][-1]
        values.append((begin, value))
    return tuple(values)


def _steps(rows: Sequence[tuple[float, float]]) -> Steps:
    if rows[0][0] != 0.0:
        raise ValueError(f"the first step begins at 0 m/s, not at {rows[0][0]:g}")
    return tuple(rows)


def _table(what: str, unit: str, most: float) -> Table:
    columns = [
        Column("speed", "m/s", after="speed", sign="non-negative", within=(0.0, FASTEST)),
        Column(what, unit, sign="positive", within=(0.0, most)),
    ]
    return Table(what, columns, whole=_steps, by_place=True)


_DECELERATIONS, _FACTORS = _table("deceleration", "m/s2", _HARDEST), _table("factor", "1", 1.5)
_POSITIONS = {"passenger": (False, False), "freight P": (True, False), "freight G": (True, True)}
"""Brake positions: whether it is a freight train's, and whether it is G."""


def _brakes(*values: Any) -> EtcsBrakes:
    given: dict[str, Any] = dict(zip((column.name for column in _COLUMNS), values, strict=True))
    emergency, service = given["A_brake_emergency"], given["A_brake_service"]
    percentage = given["brake_percentage"]
    if bool(percentage) != (emergency is None) or (emergency is None) != (service is None):
        raise ValueError("give 'A_brake_emergency' and 'A_brake_service', or 'brake_percentage' alone")
    dry: Steps = ((0.0, given["K_dry_rst"]),)
    wet = given["K_wet_rst"]
    if percentage:
        emergency, service = (basic_deceleration(x) for x in (percentage, min(percentage, _SERVICE_MOST)))
        dry, wet = product(given["Kv_int"], ((0.0, given["Kr_int"]),)), 1.0
    freight, g = _POSITIONS[given["brake_position"]]
    return EtcsBrakes(
        emergency=emergency,
        service=service,
        dry=dry,
        wet=wet,
        emergency_time=given["T_be"],
        service_time=given["T_bs"],
        cutoff_time=given["T_traction_cut_off"],
        speed_uncertainty=given["speed_uncertainty"],
        slippery=given["A_MAXREDADH"],
        percentage=percentage,
        freight=freight,
        g=g,
        kt=given["Kt_int"],
    )


_COLUMNS = (
    Column("A_brake_emergency", type=_DECELERATIONS, default=None, note="from each speed on"),
    Column("A_brake_service", type=_DECELERATIONS, default=None, note="from each speed on"),
    Column("K_dry_rst", default=1.0, sign="positive", within=(0.0, 1.0)),
    Column("K_wet_rst", default=1.0, sign="positive", within=(0.0, 1.0)),
    Column("T_traction_cut_off", "s", default=0.0, within=(0.0, 30.0)),
    Column("T_be", "s", default=0.0, within=(0.0, 60.0)),
    Column("T_bs", "s", default=0.0, within=(0.0, 60.0)),
    Column("speed_uncertainty", default=0.0, within=(0.0, 0.3), note="share of the speed; 0: of SUBSET-041"),
    Column("brake_percentage", "%", default=0.0, within=(10.0, 250.0), note="instead of decelerations and times"),
    Column("brake_position", type=str, default="passenger", choices=tuple(_POSITIONS)),
    Column("Kv_int", type=_FACTORS, default=((0.0, 0.7),), note="from each speed on"),
    Column("Kr_int", default=0.9, sign="positive", within=(0.0, 1.5), note="for the train's length"),
    Column("Kt_int", default=1.1, within=(0.0, 5.0)),
    Column("A_MAXREDADH", "m/s2", default=0.0, within=(0.1, _HARDEST), note="where the driver selects slippery"),
)
BRAKES = Table("ETCS braking data", _COLUMNS, make=_brakes, single=True)
"""Braking data by the names of SUBSET-026; national values left out have the defaults of its A.3.2."""

FLIRT = {
    "mass": 122e3,
    "rotating_mass": 0.10,
    "length": 58.6,
    "max_speed": 44.44444444444444,
    "etcs": {
        "A_brake_emergency": [[0.0, 0.9], [20.0, 0.85], [40.0, 0.8], [60.0, 0.75]],
        "A_brake_service": [[0.0, 0.55], [20.0, 0.5], [40.0, 0.45], [60.0, 0.4]],
        "K_dry_rst": 0.8,
        "K_wet_rst": 0.9,
        "T_traction_cut_off": 1.0,
        "T_be": 4.0,
        "T_bs": 3.0,
    },
}
"""Stadler FLIRT of the Transports publics fribourgeois: Kouzoupis et al. 2023, TTOBench v1.5 (BSD-2).

The file of the project's own, `rolling_stock/flirt.json`, has its speed uncertainty, too."""
