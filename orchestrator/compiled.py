"""The bridge to the compiled step loop: a `Master`'s plan as flat arrays, and blocks of steps with it.

The kernel is an optional extension: without it, or for what it does not do (components as Python objects, text
signals), `Master` steps in Python with identical results.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from .fmu import FmuChannel, FmuSlave

try:
    from . import kernel
except ImportError:  # installed without a C compiler
    kernel = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from .master import Feed, Master, Observer, Yield

_SET, _STEP, _GET = 0, 1, 2
_BLOCK_SECONDS = 0.05
"""Wall time a block is meant to take: short enough for Ctrl-C and a progress bar, long enough to cost nothing."""
_GROWTH = 256
"""How many times longer than the last a block may be: the first is a single step, of which nothing is known."""
_MOST_VALUES = 4_000_000
"""Numbers a block may record, so that its buffer stays small."""

_CHANNEL = np.dtype([("function", "u8"), ("component", "u8"), ("begin", "i8"), ("count", "i8"), ("is_real", "i8")])
_INSTANCE = np.dtype([("function", "u8"), ("component", "u8")])
_ENTRY = np.dtype([("place", "i8"), ("age", "i8"), ("scale", "f8"), ("offset", "f8")])
_OPERATION = np.dtype([("kind", "i4"), ("index", "i4")])


def can_run(master: Master) -> bool:
    """Whether the kernel is there and can do what this master's plan asks for."""
    if kernel is None or not all(isinstance(slave, FmuSlave) for slave in master.slaves.values()):
        return False
    return all(part.kind != "String" for parts in master.yields.values() for part in parts)


class CompiledLoop:
    """A master's plan for the kernel."""

    def __init__(self, master: Master) -> None:
        self._master = master
        self._channels: list[tuple[int, int, int, int, int]] = []
        self._entries: list[tuple[int, int, float, float]] = []
        self._references: list[int] = []
        self._operations: list[tuple[int, int]] = []
        self._culprits: list[tuple[FmuSlave, str]] = []
        self._instances: list[tuple[int, int]] = []
        slaves = {name: slave for name, slave in master.slaves.items() if isinstance(slave, FmuSlave)}
        sweep = [slave.name for slave in master.sequence]
        # Instance by instance, or all of one operation before the first of the next.
        parts = [[name] for name in sweep] if master.algorithm == "gauss-seidel" else [list(slaves)]
        for names in parts:
            for name in names:
                self._add_sets(slaves[name], master.feeds[name])
            for name in names:
                self._add_step(slaves[name])
            for name in names:
                self._add_gets(slaves[name], master.yields[name])
        self._plan = (
            np.array(self._operations, dtype=_OPERATION),
            np.array(self._channels, dtype=_CHANNEL),
            np.array(self._instances, dtype=_INSTANCE),
            np.array(self._entries, dtype=_ENTRY),
            np.array(self._references, dtype=np.uint32),
        )

    def _add_sets(self, slave: FmuSlave, feeds: Iterable[Feed]) -> None:
        for feed in feeds:
            ages = (-1 if age is None else age for age in feed.ages)
            # What is no real number is never scaled.
            changes = zip(feed.scales, feed.offsets, strict=True) if feed.is_real else ((1.0, 0.0) for _ in feed.ages)
            entries = [(k, age, *change) for k, age, change in zip(feed.sources, ages, changes, strict=True)]
            assert isinstance(feed.channel, FmuChannel)
            self._add_channel(_SET, slave, feed.channel, entries, feed.is_real)

    def _add_gets(self, slave: FmuSlave, parts: Iterable[Yield]) -> None:
        for part in parts:
            entries = [(place, -1, 1.0, 0.0) for place in range(part.begin, part.end)]
            assert isinstance(part.channel, FmuChannel)
            self._add_channel(_GET, slave, part.channel, entries, part.is_real)

    def _add_channel(
        self,
        kind: int,
        slave: FmuSlave,
        channel: FmuChannel,
        entries: list[tuple[int, int, float, float]],
        is_real: bool,
    ) -> None:
        call = channel.calls[kind == _GET]
        self._operations.append((kind, len(self._channels)))
        self._culprits.append((slave, call))
        self._channels.append((*slave.addresses(call), len(self._entries), len(entries), int(is_real)))
        self._entries += entries
        self._references += channel.references

    def _add_step(self, slave: FmuSlave) -> None:
        self._operations.append((_STEP, len(self._instances)))
        self._culprits.append((slave, "fmi2DoStep"))
        self._instances.append(slave.addresses("fmi2DoStep"))

    def run(self, start_time: float, step: float, count: int, every: int, observe: Observer) -> bool:
        """Take ``count`` communication steps in blocks; True unless the observer stopped the run.

        Raises:
            FmuError: a model failed, or a value is not finite.
        """
        master = self._master
        values = np.array(master.values, dtype=np.float64)
        history = np.broadcast_to(values, (master.depth, len(values))).copy()
        newest, done, block = max(0, master.depth - 1), 0, 1
        width, goes_on = len(values) + 1, True
        while done < count and goes_on:
            block = min(block, count - done, max(1, _MOST_VALUES // width) * every)
            rows = np.empty((_rows_due(done, block, every, count), width))
            begin = clock.perf_counter()
            taken, written, failed, status, newest = kernel.run(
                *self._plan, values, history, newest, rows, every, start_time, step, done, block, count
            )
            seconds = clock.perf_counter() - begin
            done += taken
            master.steps = done
            master.values[:] = values.tolist()
            if taken:
                goes_on = observe(done, rows[:written])
            if failed >= 0:
                self._raise(failed, status, start_time + done * step, step)
            block = max(1, int(taken * min(_BLOCK_SECONDS / max(seconds, 1e-9), _GROWTH)))
        for slave in master.slaves.values():
            slave.time = start_time + done * step
        return goes_on

    def _raise(self, failed: int, status: int, time: float, step: float) -> None:
        """Raise what `Master` does; with a status that is no failure, a value is not finite."""
        slave, call = self._culprits[failed]
        slave.time = time + step if call.startswith("fmi2Get") else time
        slave.check(call, status)
        self._master.check_finite(slave)


def _rows_due(done: int, block: int, every: int, count: int) -> int:
    """How many of the next steps are recorded: every so many, and the last."""
    end = done + block
    return end // every - done // every + int(end == count and count % every != 0)
