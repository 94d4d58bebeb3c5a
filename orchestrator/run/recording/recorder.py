"""`Recorder`: takes the rows of a run, and keeps them in memory or in a file."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ... import world
from ...errors import RecordError
from ...master import Rows, Table
from .binary import RowsFile, RowsWriter
from .columns import Columns, InFile, InMemory
from .words import Words

ROWS_FILE, SEEN_FILE = "results.bin", "seen.bin"
"""Of what is recorded, and of what is judged at points that are not."""
_FLUSH_SECONDS, _FLUSH_BYTES = 1.0, 1 << 22
"""How long, and how many, rows are held back."""
_SMALL = 1 << 24
"""Bytes of results that are read from their file into memory when it is complete."""
_FLOAT = np.dtype("<f8")
_SINGLE = 512
"""Rows that are held back as they came: as Python's objects they are four times as large."""


@dataclass(frozen=True)
class Due:
    """Which communication points are recorded: every so many, and the last.

    Attributes:
        every: how many. last: the number of the last.
    """

    every: int
    last: int

    def of(self, steps: int, rows: Rows) -> Rows:
        """Those of the rows up to a number of steps; the very same rows where that is all of them."""
        if self.every == 1 or not len(rows):
            return rows
        first = steps - len(rows) + 1
        if not isinstance(rows, np.ndarray):
            return [row for k, row in enumerate(rows, first) if k % self.every == 0 or k == self.last]
        numbers = np.arange(-first % self.every, len(rows), self.every)
        if steps == self.last and steps % self.every:
            numbers = np.append(numbers, len(rows) - 1)
        return rows[numbers]  # a copy: the block may go


class Recorder:
    """Takes rows of time and values while a run goes.

    With a file they go there, about every second, so that a run that is killed leaves all but its last second and
    memory does not grow with the number of steps. Without one they stay in memory.

    Args:
        names: of the signals.
        kinds: their FMI types.
        path: of the file, if there is one.
        places: of the signals among the values of the master.
        expected: how many rows there will be, as far as that is known.
        there: how many rows of this run the file has, if the run goes on; they stay until there are as many new ones.
        identity: of the run.

    Attributes:
        count: how many rows there are. checksum: of those that were brought to the file.
        table: where rows are kept in memory; None with a file.

    Raises:
        RecordError: here and in all methods: the file cannot be written.
    """

    def __init__(
        self,
        names: Sequence[str],
        kinds: Sequence[str],
        path: Path | None,
        *,
        places: Sequence[int] | None = None,
        expected: int = 0,
        there: int = 0,
        identity: str = "",
    ) -> None:
        self._columns = ["time", *names]
        self._whole = [k for k, kind in enumerate(kinds, 1) if kind not in ("Real", "String")]
        self._words = Words(k for k, kind in enumerate(kinds, 1) if kind == "String")
        self._blocks: list[NDArray[np.float64]] = []
        self._rows: list[Sequence[object]] = []
        self._flushed, self._held = world.monotonic(), 0
        self._path = path
        kept = range(len(names)) if places is None else places
        self.table = Table(kept, expected) if path is None else None
        self._writer: RowsWriter | None = None
        self.count = self.checksum = 0
        if path is not None:
            with self._telling():
                self._writer = RowsWriter(path, self._columns, self._whole, self._words, there=there, identity=identity)

    def extend(self, rows: Rows) -> None:
        """Append rows of time and values; with a file, an array is kept until it is there."""
        self.count += len(rows)
        if not isinstance(rows, np.ndarray):
            self._rows.extend(rows)
            if self.table is not None and len(self._rows) > _SINGLE:
                self._seal()
        elif len(rows):
            self._seal()
            self._keep(rows)
        if self._writer is not None:
            self._held += len(rows) * len(self._columns) * _FLOAT.itemsize
            if self._held > _FLUSH_BYTES or world.monotonic() - self._flushed > _FLUSH_SECONDS:
                self.flush()

    def lend(self) -> Table | None:
        """The table, for somebody who writes rows there and says so by `grown`."""
        self._seal()
        return self.table

    def grown(self, rows: int) -> None:
        """So many rows were written into the table."""
        self.count += rows

    def go_on(self, blocks: Iterable[NDArray[np.float64]], words: Words, rows: int) -> None:
        """Begin with rows of the same run that were recorded before.

        Args:
            blocks: of them.
            words: their texts.
            rows: how many of them to take.
        """
        for block in blocks:
            taken = block[: rows - self.count]
            self.extend(list(zip(*words.table(taken), strict=True)) if words.columns else taken)
            if self.count == rows:
                break
        self.flush()

    def flush(self, *, sync: bool = False) -> bool:
        """Bring everything to the file, if there is one, and wait until it is there where ``sync`` asks for that.

        Returns:
            Whether the file has taken the place of one that was there.
        """
        self._seal()
        if self._writer is None:
            return False
        blocks, self._blocks, self._held = self._blocks, [], 0
        self._flushed = world.monotonic()
        with self._telling():
            for block in map(np.ascontiguousarray, blocks):
                before = self._writer.rows
                try:
                    self._writer.append(block)
                finally:
                    self.checksum = add_to_checksum(self.checksum, block[: self._writer.rows - before])
            return self._writer.flush(sync=sync)

    def close(self) -> None:
        """End the file. What was recorded can be read from then on."""
        if self._writer is None:
            return
        self.flush()
        with self._telling():
            self._writer.close()
            self._writer.take_place()
        self._writer = None

    def give_back(self) -> None:
        """Let go of the file, whatever it holds."""
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):  # what is there of before has more rows, and stays
                writer.close()

    def columns(self) -> Columns:
        """What was recorded, the time among it: out of memory, or of the closed file."""
        if self._path is not None and self.count:  # else in its place may be rows of before
            return columns_of(RowsFile(self._path))
        self._seal()
        table = np.empty((len(self._columns), 0)) if self.table is None else self.table.columns()
        return InMemory((name, self._words.decode(k, table[k])) for k, name in enumerate(self._columns))

    def _seal(self) -> None:
        """Make one block of the single rows."""
        if self._rows:
            block, self._rows = self._words.encode(self._rows), []
            self._keep(block)

    def _keep(self, block: NDArray[np.float64]) -> None:
        if self.table is None:
            self._blocks.append(block)
        else:
            self.table.append(block)

    @contextmanager
    def _telling(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            assert self._path is not None
            if self._writer is not None:  # what comes now would leave a gap
                self.count = self._writer.standing
                self.give_back()
            size = world.stat(self._path).st_size if self._path.exists() else 0
            raise RecordError(
                f"{self._path.name} in {self._path.parent} cannot be written beyond {size / 1e6:.3g} MB: "
                f"{error.strerror or error}; make room there or name another directory, or record less"
            ) from error


def columns_of(rows: RowsFile) -> Columns:
    """What such a file holds: in memory if it is small, else read when it is asked for."""
    if rows.count * len(rows.columns) * _FLOAT.itemsize > _SMALL:
        return InFile(rows)
    try:
        return InMemory(zip(rows.columns, rows.table(), strict=True))
    finally:
        rows.close()


def add_to_checksum(checksum: int, rows: NDArray[np.float64]) -> int:
    """A checksum that goes on with some rows, as they stand in a file; texts count by their numbers."""
    return zlib.crc32(np.ascontiguousarray(rows, _FLOAT).data, checksum)


def checksum_of(blocks: Iterable[NDArray[np.float64]], rows: int) -> tuple[int, int]:
    """The checksum of the first rows, and how many rows there are in all."""
    checksum = count = 0
    for block in blocks:
        checksum = add_to_checksum(checksum, block[: max(0, rows - count)]) if count < rows else checksum
        count += len(block)
    return checksum, count
