"""Inputs that go on during a step, for the compiled loop: what `Extrapolator` remembers, as arrays."""

from __future__ import annotations

import numpy as np

from ...fmi.binding import FmuSlave
from ..exchange import Exchange
from ..extrapolation import Extrapolator
from .layout import COURSE, POINTS


class Courses:
    """The inputs of instances that are continued.

    Args:
        extrapolator: what continues them; None where all are held.
        exchange: what values there are.

    Attributes:
        courses, points, stamps: for the kernel.
    """

    def __init__(self, extrapolator: Extrapolator | None, exchange: Exchange) -> None:
        self._extrapolator, self._exchange = extrapolator, exchange
        of = {} if extrapolator is None else extrapolator.courses
        self._names = list(of)
        self.courses = np.zeros(len(of), COURSE)
        self.points = np.zeros(sum(len(course.members) for course in of.values()), POINTS)
        self.stamps = np.zeros(len(exchange.stamps))
        begin = 0
        for n, (name, course) in enumerate(of.items()):
            slave, end = exchange.slaves[name], begin + len(course.members)
            assert extrapolator is not None
            assert isinstance(slave, FmuSlave)
            function = slave.addresses(slave.INTERPOLATE)[0]
            fixed = extrapolator.order, 0, extrapolator.is_of_end
            self.courses[n] = function, -1, begin, len(course.members), *fixed
            self.points["place"][begin:end] = course.members
            self.points["reference"][begin:end] = list(slave.references(course.names))
            begin = end

    @staticmethod
    def are_able(extrapolator: Extrapolator | None, exchange: Exchange) -> bool:
        """Whether the kernel can call for them all."""
        slaves = [exchange.slaves[name] for name in (extrapolator.courses if extrapolator else ())]
        return all(isinstance(slave, FmuSlave) and slave.INTERPOLATE in slave.functions for slave in slaves)

    def number(self, name: str) -> int:
        """That of an instance whose inputs are continued."""
        return self._names.index(name)

    def load(self) -> None:
        """Take over what is remembered, and whether anybody has refused an order."""
        if self._extrapolator is None:
            return
        self.stamps[:] = self._exchange.stamps
        for n, name in enumerate(self._names):
            self.courses["order"][n] = self._extrapolator.orders.get(name, self._extrapolator.order)
            for own, points in zip(self._own(n), self._extrapolator.past[name], strict=True):
                own["count"] = len(points)
                for k, (time, value) in enumerate(points):
                    own["times"][k], own["values"][k] = time, value

    def store(self) -> None:
        """Give back what is remembered by now."""
        if self._extrapolator is None:
            return
        self._exchange.stamps[:] = self.stamps.tolist()
        for n, name in enumerate(self._names):
            self._extrapolator.past[name] = [
                list(zip(own["times"].tolist(), own["values"].tolist(), strict=True))[: own["count"]]
                for own in self._own(n)
            ]

    def _own(self, n: int) -> np.ndarray[tuple[int, ...], np.dtype[np.void]]:
        begin = self.courses["begin"][n]
        own: np.ndarray[tuple[int, ...], np.dtype[np.void]] = self.points[begin : begin + self.courses["count"][n]]
        return own
