"""The virtual leader: a train without mass that runs a prescribed speed profile."""

from __future__ import annotations

from collections.abc import Sequence

from ..component import Component, Values
from ..declarations import Data, Output, Parameter
from ..tables import FASTEST, Column, Table
from .profile import Profile, speed_change

_DEFAULT = {
    "speed": 50.0,
    "jerk": 0.1,
    "changes": [
        {"time": 30.0, "change": 18.0, "acceleration": 0.30},
        {"time": 190.0, "change": 12.0, "acceleration": 0.20},
        {"time": 400.0, "change": -18.0, "acceleration": 0.30},
        {"time": 560.0, "change": 12.0, "acceleration": 0.25},
        {"time": 720.0, "change": -10.0, "acceleration": 0.20},
    ],
}
"""Speeds 50, 68, 80, 62, 74, 64 m/s."""


def _profile(speed: float, jerk: float, changes: Sequence[tuple[float, float, float]]) -> Profile:
    return Profile(speed, [phase for change in changes for phase in speed_change(*change, jerk)])


CHANGES = Table(
    "change",
    [
        Column("time", "s"),
        Column("change", "m/s", within=(-FASTEST, FASTEST)),
        Column("acceleration", "m/s2", sign="positive"),
    ],
    may_be_empty=True,
)
PROFILE = Table(
    "profile",
    [
        Column("speed", "m/s", within=(0.0, FASTEST)),
        Column("jerk", "m/s3"),
        Column("changes", type=CHANGES, default=()),
    ],
    make=_profile,
)


class ReferenceProfile(Component):
    """The virtual leader of a cooperative cruise (re-derived after Zhang & Chen 2022, eq. 7).

    It accelerates, cruises and decelerates in several periods; every speed change has an acceleration that is a
    trapezoid over time, so that the jerk is bounded. Positions are exact cubic pieces, not integrated.
    Re-derived: the source describes the profile in words; the default's numbers are chosen here.
    """

    source = "Zhang & Chen 2022 (arXiv 2211.02242), eq. 7; profile chosen"
    equations = (
        r"$\dot x = v, \qquad \dot v = a, \qquad \dot a = j$, with $j$ constant between breakpoints: each change of"
        r" speed $\Delta v$ has jerk $\pm j, 0, \mp j$,",
        r"ramps of $|a| / j$ and a constant part of $|\Delta v| / |a| - |a| / j$, in exact cubic pieces.",
    )
    note = "Re-derived: the source gives the kind of profile in words; the default profile's numbers are ours."

    profile = Data(
        _DEFAULT,
        convert=PROFILE.record,
        description="initial 'speed' (m/s), 'jerk' (m/s3) and 'changes', each with 'time' (s), 'change' (m/s) and "
        "'acceleration' (m/s2)",
    )

    start_position = Parameter("m", 0.0, description="position at time 0")
    virtual_distance = Parameter(
        "m", 3200.0, description="how far ahead of the reference the virtual carriage runs that the first head follows"
    )

    position = Output("m", description="position x_r, which the first head is to reach")
    speed = Output("m/s", description="speed v_r")
    acceleration = Output("m/s2", description="acceleration a_r")
    jerk = Output("m/s3", description="jerk u_r")
    virtual_position = Output("m", description="position of the virtual carriage ahead of the first head")

    def outputs(self) -> Values:
        motion = self.profile.at(self.time)
        position = self.start_position + motion.position
        return {
            "position": position,
            "speed": motion.speed,
            "acceleration": motion.acceleration,
            "jerk": motion.jerk,
            "virtual_position": position + self.virtual_distance,
        }
