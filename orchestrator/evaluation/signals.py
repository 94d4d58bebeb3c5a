"""What recorded signals are to an expression: a run, or the rehearsal of one."""

from collections.abc import Collection, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


class Signals(Protocol):
    """What a run leaves behind, as far as expressions care."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Recorded points [s], shape (T,)."""

    @property
    def step(self) -> float:
        """Communication step [s]."""

    @property
    def completed(self) -> bool:
        """False when the run ended before `stop_time`."""

    @property
    def stop_time(self) -> float:
        """The planned end [s]."""

    @property
    def units(self) -> Mapping[str, str]:
        """Unit by full name."""

    @property
    def parameters(self) -> Mapping[str, float | int | bool | str]:
        """Fixed values by full name."""

    def names(self) -> Collection[str]:
        """Recorded signals by full name: `train[1].position`, `consist[2].force[3]`."""

    def __getitem__(self, name: str, /) -> NDArray[Any]: ...


class Rehearsal:
    """Signals that have names but only made-up values: what can go wrong with shapes goes wrong before the run."""

    step, completed, stop_time = 1.0, True, 2.0
    time: NDArray[np.float64] = np.arange(3.0)

    def __init__(self, names: Collection[str]) -> None:
        self._names = frozenset(names)
        self.units: dict[str, str] = {}
        self.parameters: dict[str, float | int | bool | str] = {}

    def names(self) -> frozenset[str]:
        """As given."""
        return self._names

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        return np.ones(3)
