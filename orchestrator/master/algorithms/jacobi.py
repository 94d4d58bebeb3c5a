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
        through = "is refreshed at each communication point" if system.stepping.refresh else "acts one step late"
        return Fit(steps=(f"steps all instances in parallel; a feed-through output {through}",))

    def batches(self) -> Sequence[Batch]:
        """Nothing is read before all have stepped."""
        names = tuple(self.coupling.slaves)
        return Batch((Operation.SET, Operation.STEP), names), Batch((Operation.GET,), names)
