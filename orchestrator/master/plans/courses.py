"""Inputs that go on during a step, for the compiled loop: what `Extrapolator` remembers, as arrays."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...fmi.binding import LoadedSlave
from ...isolation import Ride
from ..exchange import Exchange
from ..extrapolation import Extrapolator
from .layout import AS_NOTED, AT_END, AT_STAMP, COURSE, POINTS

Called = LoadedSlave | Ride
"""What the kernel calls."""


class Courses:
    """The inputs of instances that are continued.

    Args:
        slaves: all that the kernel calls.
        extrapolator: what continues them; None where all are held.
        exchange: what values there are.
        in_every_way: whether there is a course for values of a step's begin, of its end, and for those that were noted;
            otherwise there is one alone.

    Attributes:
        courses, points, stamps: for the kernel.
        count: how many points there are beside those that are noted.
    """

    def __init__(
        self,
        slaves: Mapping[str, Called],
        extrapolator: Extrapolator | None,
        exchange: Exchange,
        *,
        in_every_way: bool = False,
    ) -> None:
        self._extrapolator, self._exchange = extrapolator, exchange
        of = {} if extrapolator is None else extrapolator.courses
        self._names = list(of)
        one = AT_END if extrapolator is not None and extrapolator.is_of_end else AT_STAMP
        ways = [AT_STAMP, AT_END, AS_NOTED] if in_every_way else [one]
        self._first = ways[0]
        self.count = sum(len(course.members) for course in of.values())
        self.courses = np.zeros(len(ways) * len(of), COURSE)
        self.points = np.zeros((1 + in_every_way) * self.count, POINTS)
        self.stamps = np.zeros(len(exchange.stamps))
        begin = 0
        for name, course in of.items():
            slave, end = slaves[name], begin + len(course.members)
            assert extrapolator is not None
            function = slave.add_slopes() if isinstance(slave, Ride) else slave.addresses(slave.INTERPOLATE)[0]
            for way in ways:
                own = begin + self.count * (way == AS_NOTED)
                row = function, -1, own, len(course.members), extrapolator.order, 0, way
                self.courses[self.number(name, way)] = row
                self.points["place"][own : own + end - begin] = course.members
                self.points["reference"][own : own + end - begin] = list(slave.references(course.names))
            begin = end

    def widen(self, cells: int) -> None:
        """There are so many numbers more behind the values."""
        if len(self.stamps):
            self.stamps = np.zeros(len(self.stamps) + cells)

    def number(self, name: str, way: int | None = None) -> int:
        """That of an instance whose inputs are continued, in one of several ways."""
        return self._names.index(name) + len(self._names) * ((self._first if way is None else way) - self._first)

    def load(self) -> None:
        """Take over what is remembered, and whether anybody has refused an order."""
        if self._extrapolator is None:
            return
        self.stamps[: len(self._exchange.stamps)] = self._exchange.stamps
        for n, name in enumerate(self._names):
            self.courses["order"][n :: len(self._names)] = self._extrapolator.orders.get(name, self._extrapolator.order)
            for own, points in zip(self._own(n), self._extrapolator.past[name], strict=True):
                own["count"] = len(points)
                for k, (time, value) in enumerate(points):
                    own["times"][k], own["values"][k] = time, value

    def store(self) -> None:
        """Give back what is remembered by now."""
        if self._extrapolator is None:
            return
        self._exchange.stamps[:] = self.stamps[: len(self._exchange.stamps)].tolist()
        for n, name in enumerate(self._names):
            self._extrapolator.past[name] = [
                list(zip(own["times"].tolist(), own["values"].tolist(), strict=True))[: own["count"]]
                for own in self._own(n)
            ]

    def _own(self, n: int) -> np.ndarray[tuple[int, ...], np.dtype[np.void]]:
        begin = self.courses["begin"][n]
        own: np.ndarray[tuple[int, ...], np.dtype[np.void]] = self.points[begin : begin + self.courses["count"][n]]
        return own
