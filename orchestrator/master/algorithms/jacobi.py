"""All instances at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...fmi import Interface
from ...system import System
from ...wiring import Wiring
from .algorithm import Batch, Explicit, Fit, Operation


class Jacobi(Explicit):
    """All instances step in parallel; a feed-through output acts one step late."""

    name = "jacobi"
    is_sweeping = False
    takes_threads = True

    @classmethod
    def fit(cls, system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> Fit:
        """Any system can be stepped so."""
        return Fit(steps=("steps all instances in parallel; a feed-through output acts one step late",))

    def batches(self) -> Sequence[Batch]:
        """Nothing is read before all have stepped."""
        names = tuple(self.coupling.slaves)
        return Batch((Operation.SET, Operation.STEP), names), Batch((Operation.GET,), names)
