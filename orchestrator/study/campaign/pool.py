"""Where runs run: in this process, or on workers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

from ..rows import Row
from ..structure import Runner
from .cluster import Cluster
from .flight import Point
from .parcel import Parcel


class Pool(Protocol):
    """Takes runs and gives rows, while it is entered.

    Attributes:
        dashboard: the address at which to look at what workers do; empty where there is none.
    """

    dashboard: str

    def __enter__(self) -> Pool: ...

    def __exit__(self, *_: object) -> None: ...

    @property
    def workers(self) -> int:
        """How many there are now; 0 in this process."""

    def rows(
        self, points: Iterator[Point], count: int, is_over: Callable[[], bool] = lambda: False
    ) -> Iterator[tuple[Point, Row]]:
        """What comes out of runs, as it comes, in any order.

        Args:
            points: number and changes of each.
            count: how many they are.
            is_over: whether to leave it at that; asked several times a second.
        """


class Here:
    """This process."""

    dashboard = ""
    workers = 0

    def __init__(self, how: Mapping[str, Any]) -> None:
        self._runner = Runner(**how)

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *_: object) -> None:
        self._runner.close()

    def rows(
        self, points: Iterator[Point], count: int, is_over: Callable[[], bool] = lambda: False
    ) -> Iterator[tuple[Point, Row]]:
        """As `Pool` has it, in the order in which they are asked for."""
        for point in points:
            row = self._runner.run(point[1])
            if is_over():  # and so it was not run to its end
                return
            yield point, row


def pool_for(parcel: Parcel, scheduler: str | None = None, workers: int | None = None) -> Pool:
    """Where a study runs.

    Args:
        parcel: what is needed for it.
        scheduler: the address of one of Dask; without one workers are started on this machine.
        workers: how many of them; by default as many as there are processors. With 0 all runs in this process.
    """
    if workers == 0:
        return Here(parcel.how)
    return Cluster(parcel, scheduler, workers)
