"""One instance after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...fmi import Interface
from ...system import System
from ...wiring import Wiring
from .algorithm import Batch, Explicit, Fit, Operation


class GaussSeidel(Explicit):
    """Instances step one after the other, each with the newest values, in an order derived from feed-through."""

    name = "gauss-seidel"
    in_order = True

    @classmethod
    def fit(cls, system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Fit:
        """Any system can be stepped so."""
        return Fit()

    def batches(self) -> Sequence[Batch]:
        """Set, step, get, instance by instance; at once for isolated ones in a row that hand nothing on."""
        from ...isolation import IsolatedSlave  # noqa: PLC0415 (`list` loads this file, and no FMU)

        links = {(link.source.instance, link.target.instance) for link in self.coupling.exchange.every_link}
        groups: list[list[str]] = []
        are_apart = False
        for slave in self.coupling.sequence:
            was_apart, are_apart = are_apart, isinstance(slave, IsolatedSlave)
            if was_apart and are_apart and not any((before, slave.name) in links for before in groups[-1]):
                groups[-1].append(slave.name)
            else:
                groups.append([slave.name])
        return [Batch((Operation.SET, Operation.STEP, Operation.GET), tuple(group)) for group in groups]
