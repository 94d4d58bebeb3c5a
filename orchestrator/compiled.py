"""The bridge to the compiled step loop: a `Master`'s plan as flat arrays, and blocks of steps with it.

The kernel is an optional extension: without it, or for what it does not do (components as Python objects, text
signals), `Master` steps in Python with identical results.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .fmu import FmuChannel, FmuSlave, Slave

try:
    from . import kernel
except ImportError:  # installed without a C compiler
    kernel = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from .master import Feed, Master, Yield

_SET, _STEP, _GET = 0, 1, 2
_NOT_FINITE = -1
_BLOCK_SECONDS = 0.05
"""Wall time a block is meant to take: short enough for Ctrl-C and a progress bar, long enough to cost nothing."""
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
        self._owners: list[tuple[Slave, str]] = []
        slaves = list(master.slaves.values())
        sets = {slave.name: [self._set(slave, feed) for feed in master.feeds[slave.name]] for slave in slaves}
        gets = {slave.name: [self._get(slave, part) for part in master.yields[slave.name]] for slave in slaves}
        place = {slave.name: k for k, slave in enumerate(slaves)}
        operations: list[tuple[int, int]] = []
        if master.algorithm == "gauss-seidel":
            for slave in master.sequence:
                operations += [(_SET, c) for c in sets[slave.name]]
                operations.append((_STEP, place[slave.name]))
                operations += [(_GET, c) for c in gets[slave.name]]
        else:
            operations += [(_SET, c) for slave in slaves for c in sets[slave.name]]
            operations += [(_STEP, place[slave.name]) for slave in slaves]
            operations += [(_GET, c) for slave in slaves for c in gets[slave.name]]
        self._slaves = slaves
        self._operations = np.array(operations, dtype=_OPERATION)
        addresses = [slave.step_addresses for slave in slaves if isinstance(slave, FmuSlave)]
        self._plan = (
            self._operations,
            np.array(self._channels, dtype=_CHANNEL),
            np.array(addresses, dtype=_INSTANCE),
            np.array(self._entries, dtype=_ENTRY),
            np.array(self._references, dtype=np.uint32),
        )

    def _set(self, slave: Slave, feed: Feed) -> int:
        entries = [
            (place, -1 if age is None else age, scale if feed.is_real else 1.0, offset if feed.is_real else 0.0)
            for place, age, scale, offset in zip(feed.sources, feed.ages, feed.scales, feed.offsets, strict=True)
        ]
        return self._add(slave, feed.channel, entries, feed.is_real, 0)

    def _get(self, slave: Slave, part: Yield) -> int:
        entries = [(place, -1, 1.0, 0.0) for place in range(part.begin, part.end)]
        return self._add(slave, part.channel, entries, part.is_real, 1)

    def _add(
        self, slave: Slave, channel: Any, entries: list[tuple[int, int, float, float]], is_real: bool, direction: int
    ) -> int:
        assert isinstance(channel, FmuChannel)
        begin = len(self._entries)
        self._entries += entries
        self._references += channel.references
        function, component = channel.addresses[direction]
        self._channels.append((function, component, begin, len(entries), int(is_real)))
        self._owners.append((slave, channel.calls[direction]))
        return len(self._channels) - 1

    def run(self, start_time: float, step: float, count: int, every: int, observe: Callable[[int, NDArray[np.float64]], bool]) -> bool:
        """Take ``count`` communication steps in blocks; True unless the observer stopped the run.

        Raises:
            FmuError: a model failed, or a value is not finite.
        """
        master = self._master
        values = np.array(master.values, dtype=np.float64)
        history = np.tile(values, (master.depth, 1)) if master.depth > 1 else np.empty((0, len(values)))
        newest, done, block = max(0, len(history) - 1), 0, 1
        width = len(values) + 1
        while done < count:
            block = min(block, count - done)
            rows = np.empty((block // every + 2, width))
            begin = clock.perf_counter()
            taken, written, failed, status, newest = kernel.run(
                *self._plan, values, history, newest, rows, every, start_time, step, done, block, count
            )
            seconds = clock.perf_counter() - begin
            done += taken
            master.steps = done
            master.values[:] = values.tolist()
            if failed >= 0:
                observe(done, rows[:written])
                self._raise(failed, status, start_time + done * step, step)
            if not observe(done, rows[:written]):
                return False
            faster = _BLOCK_SECONDS / max(seconds, 1e-6)
            block = max(1, min(int(taken * min(faster, 16.0)), max(1, _MOST_VALUES // width) * every))
        return True

    def _raise(self, failed: int, status: int, time: float, step: float) -> None:
        kind, index = self._operations[failed]
        slave, call = (self._slaves[index], "fmi2DoStep") if kind == _STEP else self._owners[index]
        slave.time = time + step if kind == _GET else time
        if status == _NOT_FINITE:
            self._master.check_finite(slave)
        assert isinstance(slave, FmuSlave)
        slave.check(call, status)
