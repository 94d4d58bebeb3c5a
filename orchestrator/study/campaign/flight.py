"""Chunks under way: sent, come back, and sent again where their worker died."""

from __future__ import annotations

import itertools
import logging
import queue
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from typing import Any, NamedTuple, Protocol

from ... import world
from ..rows import Row
from .pace import Pace

Future = Any
"""One of Dask, which has no types."""
_LOG = logging.getLogger(__name__)
Point = tuple[int, Mapping[str, Any]]
"""A run to be: its number, and its changes."""
_PER_WORKER = 2
"""Chunks that each worker has or is about to have."""
_PARTS = 8
"""Into how many parts a chunk is divided whose worker died, to find the run that did it."""
_DEADLY = 3
"""So many workers a run ends before it is a row that says so."""
_TICK = 0.2
"""How often, in s, it is asked whether to go on."""
_FETCH = 60.0
"""How long, in s, a result may take to come from who has it: Dask's client does not recover from one cut short."""


class Sender(Protocol):
    """Where chunks are sent to."""

    @property
    def workers(self) -> int:
        """How many there are now."""

    def submit(self, changes: Sequence[Mapping[str, Any]], *, with_files: bool) -> Future:
        """Send runs away, with all files for a worker that has not had them yet."""

    def wait_for_scheduler(self) -> None:
        """Wait for one that has lost everything to be there again."""


class _Chunk(NamedTuple):
    """Runs that travel together; is_alone: with nothing else under way that could end their worker."""

    points: Sequence[Point]
    is_alone: bool = False


class Flight:
    """Runs on their way through workers.

    A worker that dies loses its chunk, which is divided and sent again; a run that is left over by that is sent alone,
    and is a failed row once it has ended its worker three times.

    Args:
        sender: where chunks are sent to.
        points: the runs.
        count: how many they are.
    """

    def __init__(self, sender: Sender, points: Iterator[Point], count: int) -> None:
        self._sender, self._points, self._left = sender, points, count
        self._again: deque[_Chunk] = deque()
        self._suspects: deque[Point] = deque()
        self._deaths: Counter[int] = Counter()
        self._flying: dict[str, tuple[Future, _Chunk]] = {}
        self._landed: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._pace = Pace()
        self._has_told = False

    def rows(self, is_over: Callable[[], bool]) -> Iterator[tuple[Point, Row]]:
        """What comes out, as it comes, until there is no more or `is_over` says so."""
        while not is_over():
            self._send()
            if not self._flying:
                return
            try:
                future = self._landed.get(timeout=_TICK)
            except queue.Empty:
                continue
            yield from self._taken(future)

    def end(self) -> None:
        """What is under way is wanted no more."""
        for future, _ in self._flying.values():
            future.cancel(force=True)
        self._flying.clear()

    def _send(self) -> None:
        room = _PER_WORKER * max(self._sender.workers, 1)
        while len(self._flying) < room and (chunk := self._next_chunk()):
            self._submit(chunk)
        if not self._flying and self._suspects:
            self._submit(_Chunk([self._suspects.popleft()], is_alone=True))

    def _next_chunk(self) -> _Chunk | None:
        if self._again:
            return self._again.popleft()
        points = list(itertools.islice(self._points, self._pace.size(self._left, max(self._sender.workers, 1))))
        self._left -= len(points)
        return _Chunk(points) if points else None

    def _submit(self, chunk: _Chunk, *, with_files: bool = False) -> None:
        future = self._sender.submit([changes for _, changes in chunk.points], with_files=with_files)
        self._await(future, chunk)

    def _await(self, future: Future, chunk: _Chunk) -> None:
        self._flying[future.key] = future, chunk
        future.add_done_callback(self._landed.put)

    def _taken(self, future: Future) -> Iterator[tuple[Point, Row]]:
        from distributed import KilledWorker

        _, chunk = self._flying.pop(future.key)
        if future.status in ("pending", "lost"):  # its worker died before the result was fetched: it is had again
            world.sleep(_TICK)  # of one that is lost it is told at once
            self._await(future, chunk)
            return
        try:
            answer = future.result(timeout=_FETCH)
        except TimeoutError:  # as above, meanwhile
            self._await(future, chunk)
        except KilledWorker as error:
            yield from self._died(chunk, error.allowed_failures + 1)
        except (CancelledError, OSError):  # what goes wrong on a worker is no OSError
            self._again.append(chunk)
            self._sender.wait_for_scheduler()
        else:
            if answer is None:  # a worker that has not had the files yet
                self._submit(chunk, with_files=True)
                return
            rows, seconds = answer
            self._pace.took(len(rows), seconds)
            yield from zip(chunk.points, rows, strict=True)

    def _died(self, chunk: _Chunk, times: int) -> Iterator[tuple[Point, Row]]:
        """Divide a chunk, or blame the only run in it; neighbours that waited behind it are sent again alike."""
        if not self._has_told:
            _LOG.warning(
                "a worker died, and what it had is run again; an FMU that crashes is kept to its own run by --isolate"
            )
            self._has_told = True
        points = chunk.points
        if len(points) > 1:
            size = -(-len(points) // _PARTS)
            self._again.extend(_Chunk(points[k : k + size]) for k in range(0, len(points), size))
            return
        point = points[0]
        self._deaths[point[0]] += times
        if chunk.is_alone and self._deaths[point[0]] >= _DEADLY:
            yield point, lost(self._deaths.pop(point[0]))
        else:
            self._suspects.append(point)


def lost(times: int) -> Row:
    """The row of a run that ended the process of its worker each time."""
    return Row(
        status="failed",
        error=f"it ended the process of its worker {times} times, most likely by an FMU; isolate what crashes",
    )
