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
        """Set, step, get, instance by instance."""
        whole = (Operation.SET, Operation.STEP, Operation.GET)
        return [Batch(whole, (slave.name,)) for slave in self.coupling.sequence]
