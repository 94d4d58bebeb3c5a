"""How large a run's results will be, told before it fills a memory or a disk."""

from __future__ import annotations

from dataclasses import dataclass

from ..system import System

_VALUE = 8
"""Bytes of a number in ``results.bin``, or in memory where no directory is given."""
_TEXT = 14
"""Bytes of a number in ``results.csv``, as the shipped scenarios have them on average."""
_SMALL = 1e7
"""Bytes of results that are worth no word on any machine, nor the question how much memory it has."""
_LARGE = 1e9
"""Bytes of results that are worth a word on any machine."""
_SHARE = 0.25
"""Of the memory that is free: at its end a run without a directory holds its results twice."""
_UNITS = ((1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB"))


@dataclass(frozen=True)
class Size:
    """Rows and columns of results, the time among the columns."""

    rows: float
    columns: int

    @property
    def memory(self) -> float:
        """Bytes while it runs: in its file, or in memory."""
        return self.rows * self.columns * _VALUE

    @property
    def text(self) -> float:
        """Bytes of ``results.csv``, about."""
        return self.rows * self.columns * _TEXT


def size_of(system: System, signals: int) -> Size:
    """The size of a run's results; with steps of varying length, which may be shorter, the least.

    Args:
        system: what runs.
        signals: how many are recorded.
    """
    stepping = system.stepping
    every = stepping.step if stepping.record is None else stepping.record
    return Size((stepping.stop_time - stepping.start_time) / every + 1.0, signals + 1)


def tell_size(system: System, signals: int) -> str:
    """One sentence where results will be large for any machine, or for this one; nothing otherwise."""
    size = size_of(system, signals)
    if size.memory <= _SMALL:
        return ""
    import psutil

    free = float(psutil.virtual_memory().available)
    if size.memory <= min(_LARGE, _SHARE * free):
        return ""
    stepping = system.stepping
    record = 10.0 * (stepping.step if stepping.record is None else stepping.record)
    return (
        f"results will be large: {size.rows:.3g} rows of {size.columns} columns are {_bytes(size.memory)} in "
        f"results.bin, or in memory without -o ({_bytes(free)} are free), and about {_bytes(size.text)} in "
        f"results.csv; record less often (simulation.record = {record:g} is a tenth of it) or end sooner"
    )


def _bytes(count: float) -> str:
    size, unit = next(((size, unit) for size, unit in _UNITS if count >= size), (1e3, "kB"))
    return f"{count / size:.3g} {unit}"
