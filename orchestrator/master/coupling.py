"""`Coupling`: what an algorithm works with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..fmi import Slave
from ..wiring import Link
from .algebraic import SOLVED, LoopSolver
from .exchange import Exchange
from .extrapolation import Extrapolator
from .refresh import Refresher
from .settings import Settings


class Coupling:
    """The instances of a system, the values they exchange, what happens to these on the way, and how far it has got.

    Args:
        slaves: the instances by name, in the sequence in which they are recorded.
        sequence: their names in the order of a sweep.
        links: scalar connections, as they are in the beginning.
        settings: how values are continued over a step, and loops treated.
        is_sweeping: whether an instance is given what others have computed in the same step.
        is_of_end: whether the inputs of a step are those of its end; sampled components act on those of its begin, so
            that their outputs with direct feed-through are read apart from the others.

    Attributes:
        refresher: brings feed-through up to date at each communication point; None where that is not wanted.
        loops: solves algebraic loops at each communication point; None where there is none, or none is to be solved.
        steps: communication steps taken. time: the communication point that has been reached, in s.
    """

    def __init__(
        self,
        slaves: Mapping[str, Slave],
        sequence: Sequence[str],
        links: Sequence[Link],
        settings: Settings,
        *,
        is_sweeping: bool,
        is_of_end: bool,
    ) -> None:
        self.slaves = slaves
        self.sequence = [slaves[name] for name in sequence]
        self.settings = settings
        self.interfaces = {name: slave.interface for name, slave in slaves.items()}
        parted = set(settings.rates)
        others = [link for made in settings.routes for link in made]
        if is_of_end:
            parted |= {name for name, interface in self.interfaces.items() if interface.sampled}
        self.exchange = Exchange(
            slaves, links, others, sweeping=is_sweeping, parted=parted, refreshing=settings.stepping.refresh
        )
        links = self.exchange.every_link
        order = settings.stepping.extrapolation
        self.extrapolator = Extrapolator(self.exchange, links, order, ended=is_of_end) if order else None
        self.loops: LoopSolver | None = None
        self.refresher = Refresher(self.exchange, self.interfaces, links) if settings.stepping.refresh else None
        self.steps = 0
        self.time = 0.0

    def write(self, name: str, time: float, length: float, *, ended: bool = False) -> None:
        """Set the inputs of an instance for a step.

        Args:
            name: the instance's.
            time: where the step begins, in s.
            length: of the step, in s.
            ended: whether the present values are those of its end.
        """
        if self.extrapolator is None:
            self.exchange.write(name, time)
        else:
            self.extrapolator.write(name, time, length, ended=ended)

    def settle(self, time: float) -> None:
        """Bring values at a time in s up to date, where feed-through is to be refreshed or loops are to be solved.

        The point is not recorded yet.

        Raises:
            FmuError: an FMU failed.
            CouplingError: a loop has no solution near the present values.
        """
        if self.refresher is None and self.loops is None:
            return
        self.exchange.is_at_point = True
        try:
            if self.refresher is not None:
                self.refresher.refresh(time)
            if self.loops is not None:
                if not self.loops.solve(time) <= SOLVED:
                    raise self.loops.failure(time)
                if self.refresher is not None:  # what follows from the loops
                    self.refresher.refresh(time)
        finally:
            self.exchange.is_at_point = False

    def tolerances(self, default: float, own: Mapping[str, float] | None = None) -> list[tuple[float, float]]:
        """Relative and absolute tolerance of each value.

        Args:
            default: relative, for a system that gives none.
            own: the same for what single instances give, by their names.
        """
        given = self.settings.stepping.tolerance
        found = []
        for (instance, name), signal in zip(self.exchange.places, self.exchange.signals, strict=True):
            tolerance = (own or {}).get(instance, default) if given is None else given
            nominal = self.interfaces[instance].variables[name].nominal
            ways = self.settings.stepping.tolerances
            array = f"{instance}.{name.rpartition('[')[0]}"
            pair = ways.get(signal) or ways.get(array) or (tolerance, tolerance * abs(nominal or 1.0))
            found.append((float(pair[0]), float(pair[1])))
        return found
