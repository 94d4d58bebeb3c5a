"""Brake deceleration curves of ETCS: arcs of parabolas, in closed form, over speed-dependent brakes and gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import Any

from ..maths import clip, maximum, minimum, sqrt, where
from ..trains.etcs_brakes import Steps

GRAVITY = 9.81
"""m/s2: SUBSET-026 3.13.4.3.2."""


@dataclass(frozen=True)
class Chain:
    """A continuous function of one argument, linear between its knots and beyond them.

    Attributes:
        knots: rising arguments, one for each change of slope. value: at the first knot. slopes: one more than knots.
    """

    knots: tuple[float, ...]
    value: float
    slopes: tuple[float, ...]

    def at(self, x: Any) -> Any:
        """The value at ``x``: a line and a fold at each knot, which as C has no branches and few operations."""
        middle = 0.5 * (self.slopes[0] + self.slopes[-1])
        result = self.value + middle * (x - self.knots[0])
        for knot, before, after in zip(self.knots, self.slopes, self.slopes[1:], strict=False):
            fold = 0.5 * (after - before)
            result = result + fold * (abs(x - knot) - (knot - self.knots[0]))
        return result

    def values(self) -> tuple[float, ...]:
        """The values at the knots."""
        found = [self.value]
        for (begin, end), slope in zip(pairwise(self.knots), self.slopes[1:-1], strict=True):
            found.append(found[-1] + slope * (end - begin))
        return tuple(found)


@dataclass(frozen=True)
class Brake:
    """A brake over a line: what its curves are made of, one speed band after the other.

    Attributes:
        bands: lower and upper speed of each in m/s, the last without end.
        energy: of each band v^2/2 against position, up to a constant: its slope is the deceleration in m/s2.
        place: of each band the inverse, position against it.
    """

    bands: tuple[tuple[float, float], ...]
    energy: tuple[Chain, ...]
    place: tuple[Chain, ...]

    def curve(self, location: Any, speed: Any, foot_speed: Any) -> Curve:
        """The curve through a speed in m/s at a location in m, from its foot on, where it has the speed of the foot."""
        foot = location
        for (low, high), energy, place in reversed(list(zip(self.bands, self.energy, self.place, strict=True))):
            fall = maximum(_share(speed, low, high) - _share(foot_speed, low, high), 0.0)
            foot = where(fall > 0.0, place.at(energy.at(foot) + fall), foot)
        return self.rising(foot, foot_speed)

    def rising(self, foot: Any, foot_speed: Any) -> Curve:
        """The curve that ends at a foot in m with a speed in m/s, from there backwards."""
        knots, levels = [foot], []
        for (low, high), energy, place in zip(self.bands, self.energy, self.place, strict=True):
            levels.append(energy.at(knots[-1]))
            if high < inf:
                rise = 0.5 * high * high - _share(foot_speed, low, high)
                knots.append(where(rise > 0.0, place.at(levels[-1] - rise), knots[-1]))
        return Curve(self, foot_speed, knots, levels)


@dataclass(frozen=True)
class Curve:
    """A brake deceleration curve.

    Attributes:
        brake: what it is made of. foot_speed: m/s.
        knots: its foot, and where it leaves each speed band upwards, in m. levels: energy of each band at its begin.
    """

    brake: Brake
    foot_speed: Any
    knots: Sequence[Any]
    levels: Sequence[Any]

    def location(self, speed: Any) -> Any:
        """Where the curve has a speed in m/s; its foot for those below the foot's."""
        place = self.knots[0]
        for (low, high), inverse, level in zip(self.brake.bands, self.brake.place, self.levels, strict=True):
            rise = _share(speed, low, high) - _share(self.foot_speed, low, high)
            place = where(rise > 0.0, inverse.at(level - maximum(rise, 0.0)), place)
        return place

    def speed(self, location: Any) -> Any:
        """The speed in m/s that the curve has at a location in m; beyond its foot that of the foot."""
        energy = 0.5 * self.foot_speed * self.foot_speed
        rows = zip(self.brake.energy, self.levels, self.knots, (*self.knots[1:], None), strict=True)
        for chain, level, begin, end in rows:
            inside = minimum(location, begin)
            energy = energy + (level - chain.at(inside if end is None else maximum(inside, end)))
        return sqrt(2.0 * maximum(energy, 0.0))


def _share(speed: Any, low: float, high: float) -> Any:
    """v^2/2 in m2/s2, held inside a band."""
    bounded = maximum(speed, low) if high == inf else clip(speed, low, high)
    return 0.5 * bounded * bounded


@dataclass(frozen=True)
class FixedCurve:
    """A curve whose foot stands still, cut out of the line: v^2/2 is linear in the position between few knots.

    Attributes:
        foot_speed: m/s. place: position in m over v^2/2. energy: v^2/2 over position.
    """

    foot_speed: float
    place: Chain
    energy: Chain

    def location(self, speed: Any) -> Any:
        """Where the curve has a speed in m/s; its foot for those below the foot's."""
        return self.place.at(0.5 * speed * speed)

    def speed(self, location: Any) -> Any:
        """The speed in m/s that the curve has at a location in m; beyond its foot that of the foot."""
        return sqrt(2.0 * maximum(self.energy.at(location), 0.0))


def fixed(curve: Curve, positions: Sequence[float], top_speed: float) -> FixedCurve:
    """A curve over plain numbers as one that is quick to evaluate.

    Args:
        curve: with plain numbers for foot and speed.
        positions: where the gradient changes, m.
        top_speed: up to which it is exact; above it goes on as at this speed, m/s.
    """
    foot, top = curve.knots[0], curve.location(top_speed)
    places = sorted({foot, top, *(x for x in [*positions, *curve.knots] if top < x < foot)}, reverse=True)
    energies = [0.5 * curve.speed(x) ** 2 for x in places]
    slopes = [(b - a) / (f - e) for (a, b), (e, f) in zip(pairwise(places), pairwise(energies), strict=True)]
    inverse = [1.0 / slope for slope in reversed(slopes)]
    return FixedCurve(
        curve.foot_speed,
        Chain(tuple(energies), foot, (0.0, *slopes, slopes[-1])),
        Chain(tuple(reversed(places)), energies[-1], (inverse[0], *inverse, 0.0)),
    )


def chained(begins: Sequence[float], accelerations: Sequence[float], deceleration: float) -> tuple[Chain, Chain]:
    """v^2/2 against position on a curve with one deceleration of the brake, and its inverse.

    Args:
        begins: where each acceleration by the gradient begins, m; the first holds before it, too.
        accelerations: m/s2, uphill positive.
        deceleration: of the brake, m/s2.

    Raises:
        ValueError: the brake does not hold the train on a gradient.
    """
    slopes = [deceleration + a for a in accelerations]
    for begin, slope in zip(begins, slopes, strict=True):
        if slope <= 0.0:
            raise ValueError(
                f"a brake of {deceleration:g} m/s2 does not slow the train down on the slope at {begin:g} m"
            )
    knots = tuple(begins[1:]) or (begins[0],)
    slopes = slopes if len(begins) > 1 else slopes * 2
    energy = Chain(knots, 0.0, tuple(slopes))
    return energy, Chain(energy.values(), knots[0], tuple(1.0 / slope for slope in slopes))


def braking(steps: Steps, begins: Sequence[float], accelerations: Sequence[float]) -> Brake:
    """The curves of a brake over a line (3.13.8.1.3: interconnected arcs of parabolas).

    Args:
        steps: deceleration in m/s2 over speed.
        begins: where each acceleration by the gradient begins, m.
        accelerations: m/s2, uphill positive.

    Raises:
        ValueError: the brake does not hold the train on a gradient.
    """
    merged = [step for k, step in enumerate(steps) if k == 0 or step[1] != steps[k - 1][1]]
    tops = [begin for begin, _ in merged[1:]] + [inf]
    pairs = [chained(begins, accelerations, value) for _, value in merged]
    bands = tuple((begin, top) for (begin, _), top in zip(merged, tops, strict=True))
    return Brake(bands, tuple(energy for energy, _ in pairs), tuple(place for _, place in pairs))


def gradient_accelerations(
    begins: Sequence[float], gradients: Sequence[float], length: float, uphill: float, downhill: float
) -> tuple[list[float], list[float]]:
    """Begins in m and accelerations in m/s2 by the lowest gradient under a train (3.13.4.2.1, 3.13.4.3.2).

    Args:
        begins: of the gradients, m; the first holds before it, too.
        gradients: rise over run.
        length: of the train, m.
        uphill: inertia factor of a rising gradient.
        downhill: of a falling one.
    """
    changes = sorted({x + shift for x in begins[1:] for shift in (0.0, length)})
    ends = [*begins[1:], inf]
    found_begins: list[float] = []
    found: list[float] = []
    for left, right in zip([begins[0], *changes], [*changes, inf], strict=True):
        front = left + 1.0 if right == inf else 0.5 * (left + right)
        rows = zip([-inf, *begins[1:]], ends, gradients, strict=True)
        lowest = min(g for begin, end, g in rows if begin < front and end > front - length)
        acceleration = GRAVITY * lowest / (uphill if lowest > 0.0 else downhill)
        if not found or acceleration != found[-1]:
            found_begins.append(left)
            found.append(acceleration)
    return found_begins, found


def lower_envelope(
    begins: Sequence[float], accelerations: Sequence[float], most: int
) -> tuple[list[float], list[float]]:
    """At most so many sections that are nowhere above the given ones, as a trackside simplifies a gradient profile.

    Neighbours are merged where that costs least, the product of difference in m/s2 and length in m.

    Args:
        begins: where each acceleration by the gradient begins, m; the last one has no end, and is kept.
        accelerations: m/s2, uphill positive.
        most: sections, at least 2.
    """
    places, values = list(begins), list(accelerations)
    while len(places) > most:
        ends = [*places[1:], inf]
        costs = []
        for k in range(len(places) - 2):
            higher = k if values[k] > values[k + 1] else k + 1
            costs.append((abs(values[k] - values[k + 1]) * (ends[higher] - places[higher]), k))
        _, k = min(costs)
        values[k : k + 2] = [min(values[k], values[k + 1])]
        del places[k + 1]
    return places, values
