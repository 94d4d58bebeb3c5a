"""What recorded signals are to an expression: a run, some of its points, or the rehearsal of one."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

BLOCK = 8192
"""Points that are looked at together. Sums are made of those of blocks, so that it does not matter where these come
from: memory, a file, or a run that still goes on."""


class Signals(Protocol):
    """What a run leaves behind, as far as expressions care."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Recorded points [s], shape (T,)."""

    @property
    def points(self) -> int:
        """How many there are: T."""

    def part(self, first: int, last: int, /) -> Mapping[str, NDArray[Any]]:
        """The signals, and `time`, at the points from a number up to another, which is not among them."""

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


@dataclass(frozen=True)
class Part:
    """A run at some of its points.

    Attributes:
        whole: all of it. columns: the signals, and `time`, at these points. first: the number of the first point.
        overlap: how many of the first points are those of the part before. beyond: how many of the last are those of
            the next one.
    """

    whole: Signals
    columns: Mapping[str, NDArray[Any]]
    first: int
    overlap: int = 0
    beyond: int = 0

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """As `Signals` has it."""
        return self.columns["time"]

    @property
    def own_time(self) -> NDArray[np.float64]:
        """The times without those of the next part."""
        return self.time[: self.points - self.beyond]

    def is_as(self, other: "Part") -> bool:
        """Whether it has the same points of a run as another part."""
        own = self.first, self.overlap, self.beyond, self.points
        return own == (other.first, other.overlap, other.beyond, other.points)

    @property
    def points(self) -> int:
        """As `Signals` has it."""
        return len(self.time)

    def part(self, first: int, last: int, /) -> Mapping[str, NDArray[Any]]:
        """As `Signals` has it."""
        raise NotImplementedError("parts have no parts")  # pragma: no cover: what reduces sees the whole

    @property
    def step(self) -> float:
        """As `Signals` has it."""
        return self.whole.step

    @property
    def completed(self) -> bool:
        """As `Signals` has it."""
        return self.whole.completed

    @property
    def stop_time(self) -> float:
        """As `Signals` has it."""
        return self.whole.stop_time

    @property
    def units(self) -> Mapping[str, str]:
        """As `Signals` has it."""
        return self.whole.units

    @property
    def parameters(self) -> Mapping[str, float | int | bool | str]:
        """As `Signals` has it."""
        return self.whole.parameters

    def names(self) -> Collection[str]:
        """As `Signals` has it."""
        return self.whole.names()

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        return self.columns[name]


def parts_of(signals: Signals, beyond: int = 0) -> Iterator[Part]:
    """A run in parts that overlap by a point, so that every interval is in one of them.

    Args:
        signals: the run.
        beyond: how many points of the next part each has as well.
    """
    count = signals.points
    for first in range(0, count, BLOCK):
        last, overlap = min(first + BLOCK, count), int(first > 0)
        end = min(last + beyond, count)
        yield Part(signals, signals.part(first - overlap, end), first - overlap, overlap, end - last)


class Rehearsal:
    """Signals that have names but only made-up values: what can go wrong with shapes goes wrong before the run."""

    step, completed, stop_time, points = 1.0, True, 2.0, 3
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

    def part(self, first: int, last: int, /) -> Mapping[str, NDArray[Any]]:
        """As `Signals` has it."""
        return _Ones(self.time[first:last])


class _Ones(dict[str, NDArray[Any]]):
    def __init__(self, time: NDArray[np.float64]) -> None:
        super().__init__(time=time)

    def __missing__(self, name: str) -> NDArray[Any]:
        return np.ones(len(self["time"]))


def valued(values: NDArray[Any]) -> NDArray[np.bool_] | None:
    """At which points a signal has a value that is recorded less often than others; None where at every one.

    Values are then at the first point, at every so many from there on, and at the last, and NaN at all between. Any
    other NaN is what somebody has calculated.
    """
    there = ~np.isnan(values) if values.dtype.kind == "f" else np.ones(len(values), dtype=bool)
    places = np.flatnonzero(there)
    if len(places) in (len(values), 1) or not there[:1].any():
        return None
    every = places[1]
    due = np.arange(len(values)) % every == 0
    kept = every > 1 and (due[:-1] == there[:-1]).all() and (there[-1] or not due[-1])
    return there if kept else None


def without_blanks(time: NDArray[np.float64], values: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[Any]]:
    """The points at which a signal has a value, and its values; the very same arrays where that is all of them."""
    there = valued(values)
    return (time, values) if there is None else (time[there], values[there])


def filled(time: NDArray[np.float64], values: NDArray[Any], *, held: bool) -> NDArray[Any]:
    """What is between the values of such a signal: the line that a figure draws, or the last value where it is held."""
    there = valued(values)
    if there is None:
        return values
    if held:
        return np.asarray(values[np.maximum.accumulate(np.where(there, np.arange(len(values)), 0))])
    return np.asarray(np.interp(time, time[there], values[there]))
