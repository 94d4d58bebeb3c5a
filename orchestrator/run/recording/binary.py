"""``results.bin``: recorded rows while a run goes, and while somebody reads them.

Finding the shortest digits of a number takes longer than many a step. While a run goes its rows are therefore appended
to a file of one line of JSON (the ``run``, the ``columns``, and by place those of ``whole`` numbers and of ``texts``)
and then each row as 64-bit little-endian floats. The texts themselves stand in a file beside it.
"""

from __future__ import annotations

import errno
import json
import os
import weakref
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import world
from ...errors import naming
from .words import Words

NEW = ".new"
"""Ends the name of a file that is to take the place of the one without."""
_FLOAT = np.dtype("<f8")
_PART = 1 << 22
"""Bytes that are read at a time."""


class RowsWriter:
    """Appends rows to a file.

    Args:
        path: of the file; what is there goes.
        columns: the names, time first.
        whole: columns of whole numbers, by place.
        words: the texts, which are added to from row to row.
        there: how many rows of the same run the file has, if it is resumed. They stay until there are as many new ones.
        identity: of the run.

    Attributes:
        rows: how many were written.

    Raises:
        OSError: here and in all methods: the file cannot be written. It holds whole rows all the same.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[str],
        whole: Collection[int],
        words: Words,
        *,
        there: int = 0,
        identity: str = "",
    ) -> None:
        self.path = path
        self._words, self._told, self._left = words, 0, there
        world.unlink(path.with_name(path.name + NEW), missing_ok=True)
        if not there:
            world.unlink(path, missing_ok=True)
            world.unlink(_words_beside(path), missing_ok=True)
        self._part = path.with_name(path.name + NEW) if there else path
        self._file = world.open(self._part, "wb", buffering=0)  # nothing is written that is not counted
        head = {"run": identity, "columns": list(columns), "whole": list(whole), "texts": words.columns}
        line = json.dumps(head).encode() + b"\n"
        self.rows, self._begin, self._row = 0, len(line), len(columns) * _FLOAT.itemsize
        try:
            self._write(memoryview(line))
        except OSError:
            self._file.close()
            raise
        if words.columns and not there:
            self._tell_words()

    def _tell_words(self) -> None:
        self._told = len(self._words)
        beside = _words_beside(self.path)
        part = beside.with_name(beside.name + NEW)
        world.write_text(part, json.dumps(self._words.known), encoding="utf-8")
        world.replace(part, beside)

    def append(self, block: NDArray[np.float64]) -> None:
        """Add rows, shape (n, columns)."""
        if len(self._words) > self._told:  # first: a row means nothing without its texts
            self._tell_words()
        try:
            self._write(np.ascontiguousarray(block, _FLOAT).data.cast("B"))
        except BaseException:  # half a row would shift all that follow, also after an interruption
            size = os.fstat(self._file.fileno()).st_size
            self.rows = max(0, size - self._begin) // self._row
            self._file.truncate(self._begin + self.rows * self._row)
            raise
        self.rows += len(block)
        self._left -= len(block)

    def _write(self, data: memoryview) -> None:
        while data:
            data = data[self._file.write(data) :]

    def flush(self, *, sync: bool = False) -> bool:
        """Bring rows to the file, and wait until they outlive the machine's power where ``sync`` asks for that.

        Returns:
            Whether the file is now what stands under its name, and was not before.
        """
        if sync:
            world.fsync(self._file.fileno())
        if self._left > 0 or self._part == self.path:
            return False
        self._file.close()
        self.take_place()
        self._file = world.open(self._part, "ab", buffering=0)
        return True

    @property
    def standing(self) -> int:
        """How many of the rows stand under its name: none until they take the place of those of before."""
        return self.rows if self._part == self.path else 0

    def close(self) -> None:
        """Give the file back; what was written stays."""
        self._file.close()

    def take_place(self) -> None:
        """Let the closed file be what stands under its name, although it has fewer rows."""
        if self._part == self.path:
            return
        world.replace(self._part, self.path)
        self._part = self.path


class RowsFile:
    """Reads rows from a file, of as many as there were when it was opened. A row that is half written is none.

    Attributes:
        columns, whole, words: as `RowsWriter` has them; identity: of the run.
        count: how many rows there are.
        close: gives the file back, which the end of this does as well.

    Raises:
        OSError, ValueError, LookupError, TypeError: it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        with world.open(path, "rb") as stream:
            line = stream.readline()
        self._file = world.open_descriptor(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        # A file object would complain where it is given back by nobody, as arrays are.
        self.close = weakref.finalize(self, world.close, self._file)
        try:
            header = json.loads(line)
            self.columns: list[str] = header["columns"]
            self.identity: str = header.get("run", "")
            self.whole: list[int] = header["whole"]
            if not self.columns:
                raise ValueError(f"{path.name} has no columns")
            texts = header.get("texts") or ()
            known = json.loads(world.read_text(_words_beside(path), encoding="utf-8")) if texts else {}
            self.words = Words(texts, {int(k): words for k, words in known.items()})
            self._begin = len(line)
            self._row = len(self.columns) * _FLOAT.itemsize
            self._path = path
            self.count = (os.fstat(self._file).st_size - self._begin) // self._row
        except BaseException:
            self.close()
            raise

    def part(self, first: int, last: int) -> NDArray[np.float64]:
        """Rows from a number up to another, which is not among them; shape (n, columns)."""
        count = max(0, min(last, self.count) - first)
        os.lseek(self._file, self._begin + first * self._row, os.SEEK_SET)
        wanted, pieces = count * self._row, []
        with naming(self._path):
            while wanted and (piece := world.read(self._file, wanted)):
                pieces.append(piece)
                wanted -= len(piece)
        if wanted:
            raise OSError(errno.EIO, "it has become shorter", str(self._path))
        numbers = np.frombuffer(b"".join(pieces) if len(pieces) != 1 else pieces[0], _FLOAT)
        return numbers.reshape(-1, len(self.columns))

    def blocks(self) -> Iterator[NDArray[np.float64]]:
        """All rows, some megabytes at a time."""
        every = max(1, _PART // self._row)
        for first in range(0, self.count, every):
            yield self.part(first, first + every)

    def column(self, place: int) -> NDArray[Any]:
        """One column, shape (rows,)."""
        values = np.empty(self.count)
        done = 0
        for block in self.blocks():
            values[done : done + len(block)] = block[:, place]
            done += len(block)
        return self.words.decode(place, values)

    def table(self) -> list[NDArray[Any]]:
        """All columns."""
        values = np.empty((len(self.columns), self.count))
        done = 0
        for block in self.blocks():
            values[:, done : done + len(block)] = block.T
            done += len(block)
        return self.words.table(values.T)


def _words_beside(path: Path) -> Path:
    return path.with_suffix(".words")


def remove_rows(path: Path) -> None:
    """Remove such a file and what stands beside it."""
    for each in (path, path.with_name(path.name + NEW), _words_beside(path)):
        world.unlink(each, missing_ok=True)
