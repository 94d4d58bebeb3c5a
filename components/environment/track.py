"""The format of a line: sections, speed limits, stops, neutral sections; and what a train meets on it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from ..lookup.cells import Cells, is_plain, just_above
from ..maths import clip, logical_and, maximum, where
from ..supervision.speed_limit import STEPS, SpeedLimit
from ..tables import Column, Table
from .curve import GRAVITY, LAWS, Transition, arc, transitions
from .under import changes, under

_TUNNEL = 0.00013
"""1/m: a tunnel of length L resists with 0.00013 L newtons per kilonewton of weight (TB/T 1407)."""
_STEEPEST = 0.15
"""Steeper than any adhesion railway (Lisbon's trams: 0.135); 5 is 500 %, and meant as per mille."""
_TIGHTEST = 10.0
"""m: tighter than any tram's curve; less is meant as km, or as a curvature."""
_LONGEST = 1e5
"""m: longer than any tunnel (Gotthard: 57 km)."""
NO_LIMIT = 1000.0
"""m/s: the limit of a line that has none."""
_NEVER = 1e9
"""m: beyond all lines."""


class Section(NamedTuple):
    """A stretch of one gradient, of one radius or one transition curve, in the open or in one tunnel; SI units."""

    position: float
    gradient: float
    radius: float
    end_radius: float | None
    tunnel: float
    area: float
    resistance: float


class Stop(NamedTuple):
    """Where the front of a train stops, in m, and its name."""

    position: float
    name: str


def _section(*values: Any) -> Section:
    section = Section(*values)
    for radius in (section.radius, section.end_radius or 0.0):
        if 0.0 < radius < _TIGHTEST:
            raise ValueError(
                f"'radius' is in m, 0 for straight track: {radius:g} is tighter than any curve, {_TIGHTEST:g}"
            )
    return section


SECTIONS = Table(
    "section",
    [
        Column("position", "m", after="position", note="its begin"),
        Column("gradient", default=0.0, within=(-_STEEPEST, _STEEPEST), note="rise over run"),
        Column("radius", "m", default=0.0, sign="non-negative"),
        Column("end_radius", "m", default=None, sign="non-negative", note="of a transition curve"),
        Column("tunnel", "m", default=0.0, within=(0.0, _LONGEST), note="its length"),
        Column("area", "m2", default=0.0, within=(0.0, 500.0), note="cross-section of the tunnel"),
        Column("resistance", "N/kg", default=0.0, within=(0.0, 1.5), note="further resistance to motion"),
    ],
    make=_section,
)
STOPS = Table(
    "stop",
    [Column("position", "m", after="position"), Column("name", type=str, default="")],
    make=Stop,
    may_be_empty=True,
)
NEUTRAL = Table(
    "neutral section",
    [Column("begin", "m", after="begin"), Column("end", "m", after="begin")],
    by_place=True,
    may_be_empty=True,
)
NATIONAL = Table(
    "national values",
    [
        Column("M_NVAVADH", within=(0.0, 1.0), note="weight of the available adhesion"),
        Column("Kt_int", within=(0.0, 2.0), note="integrated correction factor of gamma trains"),
    ],
    make=lambda *values: dict(zip(("M_NVAVADH", "Kt_int"), values, strict=True)),
    single=True,
)
_TEXTS = ("name", "source", "licence", "note", "units")
ABOUT = [Column(name, type=str, default="") for name in _TEXTS]
"""What a data file says of itself, read by people."""


@dataclass(frozen=True, eq=False)
class Track:
    """A line as equations read it; all lists go by section.

    Attributes:
        positions: begins of the sections in m, rising.
        gradients: rise over run.
        resistances: N/kg of slope, curve, tunnel and what is further, at the begin of the section.
        opposing: what of it opposes motion either way.
        areas: cross-section of the tunnel in m2, 0 in the open.
        transitions: the transition curves, whose resistance at their begin ``opposing`` does not hold.
        limits: of speed. stops: in order. neutral: begins and ends of neutral sections in m.
        altitude: in m, at the begin of the first section. national: ETCS national values, if they are known.
    """

    positions: list[float]
    gradients: list[float]
    resistances: list[float]
    opposing: list[float]
    areas: list[float]
    transitions: list[Transition]
    limits: SpeedLimit
    stops: tuple[Stop, ...] = ()
    neutral: tuple[tuple[float, float], ...] = ()
    altitude: float = 0.0
    national: Mapping[str, float] | None = None

    def resistance(self, position: Any) -> tuple[Any, Any]:
        """Of a train that is a point, in N/kg: all of it for a train that runs forwards, and what opposes motion."""
        whole, opposing = self._by_section.find(position)
        for curve in self.transitions:
            inside = logical_and(position >= curve.begin, position < curve.end)
            further = where(inside, curve.at(clip(position, curve.begin, curve.end)), 0.0)
            whole, opposing = whole + further, opposing + further
        return whole, opposing

    def mean_resistance(self, position: Any, length: Any) -> tuple[Any, Any]:
        """The same of a train whose mass is spread evenly over its length in m, positive: the exact integral of it."""
        whole = self.mean(self.resistances, position, length)
        opposing = self.mean(self.opposing, position, length)
        for curve in self.transitions:
            front, rear = (clip(x - curve.begin, 0.0, curve.end - curve.begin) for x in (position, position - length))
            further = (curve.until(front) - curve.until(rear)) / length
            whole, opposing = whole + further, opposing + further
        return whole, opposing

    def mean(self, values: Sequence[float], position: Any, length: Any) -> Any:
        """Mean of a value by section over the train, whose front is at the position: each begin counts by its share."""
        result: Any = values[0]
        if is_plain(length):
            result, steps = under(tuple(self.positions), tuple(values), length).at(position)
        else:
            steps = changes(self.positions, values)
        for begin, change in steps:
            result = result + change * clip((position - begin) / length, 0.0, 1.0)
        return result

    def mean_altitude(self, position: Any, length: Any) -> Any:
        """Of the train's mass in m: the second integral of the gradient."""
        result = self.altitude + self.gradients[0] * (position - 0.5 * length - self.positions[0])
        for begin, (before, value) in zip(self.positions[1:], itertools.pairwise(self.gradients), strict=True):
            front, rear = maximum(position - begin, 0.0), maximum(position - length - begin, 0.0)
            result = result + (value - before) * (front - rear) * (front + rear) / (2.0 * length)
        return result

    def speed_limit(self, position: Any, length: Any) -> Any:
        """The lowest limit under any part of the train, in m/s."""
        return self.limits.lowest(position - length, position)

    def next_stop(self, position: Any) -> Any:
        """Where the first stop is that the front has not passed, in m; far away after the last."""
        return self._by_stop.find(position)[0]

    def is_neutral(self, position: Any, length: Any) -> Any:
        """Whether any part of the train is in a neutral section."""
        return position - length < self._by_neutral.find(position)[0]

    @cached_property
    def _by_section(self) -> Cells:
        return Cells([self.positions], list(zip(self.resistances, self.opposing, strict=True)))

    @cached_property
    def _by_stop(self) -> Cells:
        stops = [stop.position for stop in self.stops]
        return Cells([[-math.inf, *map(just_above, stops)]], [[stop] for stop in (*stops, _NEVER)])

    @cached_property
    def _by_neutral(self) -> Cells:
        """The end of the neutral sections that have begun."""
        begins, ends = zip((-math.inf, -math.inf), *self.neutral, strict=True)
        return Cells([begins], [[end] for end in itertools.accumulate(ends, max)])


def _line(  # noqa: PLR0917, as many as a line has keys
    sections: Sequence[Section],
    speed_limits: SpeedLimit | None = None,
    stops: tuple[Stop, ...] = (),
    neutral: tuple[tuple[float, float], ...] = (),
    curve_law: str = "600/R",
    altitude: float = 0.0,
    way_back: bool = False,
    national: Mapping[str, float] | None = None,
    *_about: str,
) -> Track:
    limits = speed_limits or SpeedLimit([(sections[0].position, NO_LIMIT)])
    if way_back:
        if len(stops) < 2:
            raise ValueError("'way_back' takes a line with at least two stops: it begins at the last one")
        sections, limits, stops, neutral = _there_and_back(sections, limits, stops, neutral)
    resistances, opposing, curves = [], [], []
    for number, (section, after) in enumerate(itertools.zip_longest(sections, sections[1:]), 1):
        try:
            turning = section.end_radius is not None and section.end_radius != section.radius
            if turning:
                end = after.position if after else stops[-1].position if stops else section.position
                if not end > section.position:
                    raise ValueError("a transition curve ends at the next section or the last stop: there is none")
                curves += transitions(section.position, end, section.radius, section.end_radius or 0.0, curve_law)
            curve = 0.0 if turning else arc(section.radius, curve_law)
        except ValueError as error:
            raise ValueError(f"section {number}: {error}") from None
        inside = 0.0 if section.area else _TUNNEL * section.tunnel / 1000.0
        resistances.append(GRAVITY * (section.gradient + curve + inside) + section.resistance)
        opposing.append(GRAVITY * (curve + inside) + section.resistance)
    return Track(
        [section.position for section in sections],
        [section.gradient for section in sections],
        resistances,
        opposing,
        [section.area for section in sections],
        curves,
        limits,
        stops,
        neutral,
        altitude,
        national,
    )


def _there_and_back(
    sections: Sequence[Section],
    limits: SpeedLimit,
    stops: tuple[Stop, ...],
    neutral: tuple[tuple[float, float], ...],
) -> tuple[list[Section], SpeedLimit, tuple[Stop, ...], tuple[tuple[float, float], ...]]:
    """The line, and after its last stop the way back: position x beyond the last stop at E is at 2 E - x."""
    end = stops[-1].position
    there = [section for section in sections if section.position < end]
    ends = [*(section.position for section in there[1:]), end]
    back = [
        section._replace(
            position=2.0 * end - until,
            gradient=-section.gradient,
            radius=section.radius if section.end_radius is None else section.end_radius,
            end_radius=None if section.end_radius is None else section.radius,
        )
        for section, until in zip(reversed(there), reversed(ends), strict=True)
    ]
    steps = [step for step in limits.steps if step[0] < end]
    until = [*(begin for begin, _ in steps[1:]), end]
    returning = [(2.0 * end - b, speed) for (_, speed), b in zip(reversed(steps), reversed(until), strict=True)]
    return (
        [*there, *back],
        SpeedLimit([*steps, *returning]),
        (*stops, *(Stop(2.0 * end - stop.position, stop.name) for stop in reversed(stops[:-1]))),
        (*neutral, *((2.0 * end - b, 2.0 * end - a) for a, b in reversed(neutral))),
    )


LINE = Table(
    "line",
    [
        Column("sections", type=SECTIONS),
        Column("speed_limits", type=STEPS, default=None),
        Column("stops", type=STOPS, default=()),
        Column("neutral_sections", type=NEUTRAL, default=()),
        Column("curve_law", type=str, default="600/R", choices=tuple(LAWS)),
        Column("altitude", "m", default=0.0, within=(-1e4, 1e4)),
        Column("way_back", type=bool, default=False),
        Column("national", type=NATIONAL, default=None),
        *ABOUT,
    ],
    make=_line,
    single=True,
)
DESCRIPTION = (
    f"{SECTIONS.description}; or a table of these 'sections' and of 'speed_limits', 'stops', 'neutral_sections', "
    "'curve_law', 'altitude', 'way_back' and more"
)


def read_line(data: Any) -> Track:
    """A line of what a data file holds, or of its sections alone.

    Raises:
        ValueError: unusable data; the message names key, row and what is wanted.
    """
    if isinstance(data, Mapping):
        track: Track = LINE.record(data)
        return track
    return _line(SECTIONS.read(data))
