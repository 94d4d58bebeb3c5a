"""Inputs that go on during a step: polynomials through former values, for FMUs that interpolate their inputs.

A held input makes any coupling of first order in the step. An FMU that takes time derivatives of its inputs is given
those of the polynomial of order 1 or 2 through the last values, each at the time that it belongs to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import FmuError, LostError
from ..wiring import Link
from .exchange import Exchange, Feed

_ROUNDING = 1e-6
"""Part of a step within which two times are one."""


Points = Sequence[tuple[float, float]]
"""Times in s and values."""


@dataclass(frozen=True)
class Course:
    """The inputs of one instance that are continued, all of one feed: its number, their places in it, their names."""

    instance: str
    feed: int
    members: tuple[int, ...]
    names: tuple[str, ...]


class Extrapolator:
    """Continues inputs over a step.

    Args:
        exchange: whose inputs they are.
        links: scalar connections that there may be. Delayed ones are held, and so is what a sampled component gives or
            what is discrete; what one of them holds is held always.
        order: of the polynomial: 1 or 2.
        ended: whether the values are always those of the end of the step, as in an iteration; what a source has not
            reached yet is a guess then.
    """

    def __init__(self, exchange: Exchange, links: Sequence[Link], order: int, *, ended: bool = False) -> None:
        self.order = order
        self._exchange = exchange
        self.is_of_end = ended
        exchange.stamps = [0.0] * len(exchange.values)
        smooth = {link.target for link in links} - {link.target for link in links if not _is_smooth(exchange, link)}
        self.courses: dict[str, Course] = {}
        for name, feeds in exchange.feeds.items():
            for n, feed in enumerate(feeds):
                members = tuple(k for k, target in enumerate(feed.targets) if (name, target) in smooth)
                if members:
                    self.courses[name] = Course(name, n, members, tuple(feed.targets[k] for k in members))
        self.orders: dict[str, int] = {}
        """Of instances that refused derivatives of the order wanted: the order they take."""
        self.said: dict[str, str] = {}
        """What they said."""
        self.past: dict[str, list[list[tuple[float, float]]]] = {}
        """For each continued input of an instance, the last values and the times they belong to, newest last."""

    def begin(self, time: float) -> None:
        """Note the values at the start, in s."""
        for name, course in self.courses.items():
            values = self._exchange.inputs(self._exchange.feeds[name][course.feed], time)
            self.past[name] = [[(time, values[k])] for k in course.members]

    def write(self, name: str, time: float, length: float, *, ended: bool = False) -> None:
        """Set the inputs of an instance for a step from ``time`` of ``length``, both in s, with their derivatives.

        ``ended``: the values are those of the end of the step.
        """
        course = self.courses.get(name)
        if course is None:
            self._exchange.write(name, time)
            return
        for n, feed in enumerate(self._exchange.feeds[name]):
            values = self._exchange.inputs(feed, time)
            if n != course.feed:
                feed.channel.set(values)
                continue
            for past, k in zip(self.past[name], course.members, strict=True):
                is_end = ended or self.is_of_end
                at = time + length if is_end else self._exchange.stamps[feed.sources[k]]
                former = [point for point in past if point[0] < at - _ROUNDING * length][-self.order :]
                past[:] = [*former, (at, values[k])]
            self._give(course, values, self.past[name], time)

    def _give(self, course: Course, values: list[float], past: Sequence[Points], time: float) -> None:
        """Set the inputs of a continued feed from a time in s on, by the polynomials through the past."""
        order, given, derivatives = self.orders.get(course.instance, self.order), list(values), list[float]()
        if order:
            for points, k in zip(past, course.members, strict=True):
                given[k], *slopes = polynomial(points[-order - 1 :], time, order)
                derivatives += slopes
        self._exchange.feeds[course.instance][course.feed].channel.set(given)
        if not order:
            return
        names = [n for n in course.names for _ in range(order)]
        orders = [*range(1, order + 1)] * len(course.names)
        try:
            self._exchange.slaves[course.instance].interpolate(names, orders, derivatives)
        except LostError:
            raise
        except FmuError as error:
            if error.status == "fatal":
                raise
            self._lower(course, error, values, past, time)

    def _lower(self, course: Course, error: FmuError, values: list[float], past: Sequence[Points], time: float) -> None:
        """An instance has refused derivatives of its order: give it those of the next lower one from now on."""
        self.orders[course.instance] = self.orders.get(course.instance, self.order) - 1
        self.said.setdefault(course.instance, str(error).partition("\n")[0])
        self._give(course, values, past, time)

    def refuse(self, name: str, error: FmuError, time: float) -> None:
        """An instance has refused in the compiled loop what its inputs' past gives for a step from a time in s."""
        course = self.courses[name]
        values = self._exchange.inputs(self._exchange.feeds[name][course.feed], time)
        self._lower(course, error, values, self.past[name], time)

    def report(self) -> dict[str, Any]:
        """Whose inputs are continued by less than was wanted, for the record of the run; empty where there are none."""
        if not self.orders:
            return {}
        each = (f"{name} {order} ({self.said[name]})" for name, order in self.orders.items())
        summary = f"derivatives of inputs were refused; the order of extrapolation is lower: {', '.join(each)}"
        return {"orders": dict(self.orders), "said": dict(self.said), "summary": summary}

    def continued(self, name: str, feed: Feed) -> list[list[tuple[float, float]]] | None:
        """What inputs of a feed are continued by now: the points of each; None where all of them are held."""
        course = self.courses.get(name)
        is_held = course is None or feed is not self._exchange.feeds[name][course.feed]
        return None if is_held else [list(points) for points in self.past[name]]

    def give_again(self, name: str, values: Sequence[float], past: Sequence[Points], time: float) -> None:
        """Set the inputs of an instance's continued feed from another time in s on, as `continued` had them."""
        self._give(self.courses[name], list(values), past, time)

    def restart(self) -> None:
        """Forget the past, after something has jumped: a polynomial through a jump would overshoot."""
        for past in self.past.values():
            for points in past:
                points.clear()

    def save(self) -> Any:
        """What it remembers."""
        past = {name: [list(points) for points in past] for name, past in self.past.items()}
        return {"past": past, "stamps": list(self._exchange.stamps)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Remember what was saved."""
        self._exchange.stamps[:] = saved["stamps"]
        self.past = {
            name: [[(float(t), float(v)) for t, v in points] for points in past] for name, past in saved["past"].items()
        }


def _is_smooth(exchange: Exchange, link: Link) -> bool:
    source, target = exchange.slaves[link.source[0]].interface, exchange.slaves[link.target[0]].interface
    output, given = source.variables[link.source[1]], target.variables[link.target[1]]
    return (
        target.interpolates_inputs
        and not link.delay
        and output.type == given.type == "Real"
        and "continuous" == output.variability == given.variability
        and not source.sampled
        and not target.sampled
    )


def polynomial(points: Sequence[tuple[float, float]], time: float, order: int) -> list[float]:
    """Value and the first ``order`` derivatives (at most 2) at ``time`` of the polynomial through 1 to 3 points.

    Newton's form: as many points as there are give as high an order as they can.
    """
    (t0, a), *rest = points
    if not rest:
        return [a] + [0.0] * order
    t1, b = rest[0]
    slope = (b - a) / (t1 - t0)
    if len(rest) == 1:
        return [a + slope * (time - t0), slope, 0.0][: order + 1]
    t2, c = rest[1]
    bend = ((c - b) / (t2 - t1) - slope) / (t2 - t0)
    value = a + slope * (time - t0) + bend * (time - t0) * (time - t1)
    return [value, slope + bend * ((time - t0) + (time - t1)), 2.0 * bend][: order + 1]
