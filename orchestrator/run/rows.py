"""The files that recorded rows live in: ``results.bin`` while a run goes, ``results.csv`` once it has ended.

``results.csv`` is for people and other programs. Its numbers are the shortest that read back to the same bits, and
finding those takes longer than many a step. While a run goes its rows are therefore appended to ``results.bin``: one
line of JSON with the ``columns`` and the places of those that hold ``whole`` numbers, then each row as 64-bit
little-endian floats. That file is removed when ``results.csv`` is complete: where it is still there, the run goes on
or was killed, and `recover` makes the text of what there is.

A run that is resumed writes beside what is there already, under a name that ends in ``.new``, and puts it in its place
as soon as it has as many rows: if it is killed before, nothing is lost.
"""

from __future__ import annotations

import csv
import io
import json
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .. import world

CSV_FILE, ROWS_FILE, _NEW = "results.csv", "results.bin", ".new"
_FLOAT = np.dtype("<f8")
_QUOTE = '"'
_TO_QUOTE = frozenset(f",{_QUOTE}\r\n")


class Writer:
    """Writes the rows of a run. Texts, which only a run in Python has, go to ``results.csv`` at once.

    Args:
        directory: where to write; what an earlier run left there goes.
        columns: the names, time first.
        whole: columns of whole numbers, by place; they are written as such.
        texts: columns of texts.
        there: how many rows there are of the same run, if it is resumed; they go when there are as many new ones.
        identity: of the run.
    """

    def __init__(
        self,
        directory: Path,
        columns: Sequence[str],
        whole: Sequence[int],
        texts: Sequence[int],
        there: int = 0,
        *,
        identity: str = "",
    ) -> None:
        self._directory = directory
        self._columns, self._whole, self._texts = columns, whole, texts
        self._left = there
        self.checksum = 0
        """Of the rows so far, as `add_to_checksum` has it."""
        self._file: IO[Any]
        for name in (CSV_FILE, ROWS_FILE):
            if not there:
                world.unlink(directory / name, missing_ok=True)
            world.unlink(directory / f"{name}{_NEW}", missing_ok=True)
        self._path = directory / f"{CSV_FILE if texts else ROWS_FILE}{_NEW if there else ''}"
        self._open("w")
        if texts:
            write_csv(self._file, columns, whole, ())
        else:
            head = {"run": identity, "columns": list(columns), "whole": list(whole)}
            self._file.write(json.dumps(head).encode() + b"\n")
        self._file.flush()

    def _open(self, mode: str) -> None:
        if self._texts:
            self._file = world.open(self._path, mode, newline="", encoding="utf-8")
        else:
            self._file = world.open(self._path, f"{mode}b")

    def append(self, blocks: Iterable[NDArray[Any]]) -> None:
        """Bring rows to the disk."""
        for block in blocks:
            if self._texts:
                _write_rows(self._file, self._whole, [block])
            else:
                self._file.write(np.ascontiguousarray(block, _FLOAT).data)
            self._left -= len(block)
            self.checksum = add_to_checksum(self.checksum, block)
        self._file.flush()
        if self._left <= 0 and self._path.suffix == _NEW:
            self._file.close()
            self._take_place()
            self._open("a")

    def sync(self) -> None:
        """See to it that what was written outlives the machine's power."""
        world.fsync(self._file.fileno())

    def _take_place(self) -> None:
        """Put the new file, which is closed, in the place of what is there."""
        whole = self._path.with_suffix("")
        world.replace(self._path, whole)
        self._path = whole
        if not self._texts:
            world.unlink(self._directory / CSV_FILE, missing_ok=True)

    def close(self, blocks: Iterable[NDArray[Any]]) -> None:
        """End the file; ``blocks`` are all rows once more."""
        self._file.close()
        if not self._texts:
            _write_text(self._directory, self._columns, self._whole, blocks)
            for path in {self._path, self._directory / ROWS_FILE}:
                world.unlink(path, missing_ok=True)
        elif self._path.suffix == _NEW:
            self._take_place()


def add_to_checksum(checksum: int, rows: NDArray[Any]) -> int:
    """A checksum that goes on with some rows: the same for numbers in memory, in a binary file and in text."""
    if rows.dtype != object:
        return zlib.crc32(np.ascontiguousarray(rows, _FLOAT).data, checksum)
    cells = (cell if isinstance(cell, str) else repr(float(cell)) for row in rows for cell in row)
    return zlib.crc32("".join(f"{cell}\0" for cell in cells).encode(errors="surrogatepass"), checksum)


def read_rows(directory: Path, texts: Iterable[str], identity: str = "") -> dict[str, NDArray[Any]]:
    """The columns of a run by name, those named in ``texts`` as objects; what was half written is left out.

    Args:
        directory: of the run.
        texts: the columns that hold texts.
        identity: of the run, if it is known.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read, or it is of another run.
    """
    if (directory / ROWS_FILE).exists():
        found, columns, _, table = _read_binary(directory / ROWS_FILE)
        if identity and found != identity:
            raise ValueError(f"{ROWS_FILE} and run.json are of different runs")
        return dict(zip(columns, np.ascontiguousarray(table.T), strict=True))
    with world.open(directory / CSV_FILE, newline="", encoding="utf-8") as stream:
        header, *rows = list(_lines(stream)) or [[]]
    rows = [row for row in rows if len(row) == len(header)]
    kinds: dict[str, Any] = dict.fromkeys(texts, object)
    return {name: _column([row[k] for row in rows], kinds.get(name, np.float64)) for k, name in enumerate(header)}


def _lines(stream: IO[str]) -> Iterator[list[str]]:
    """The lines that were written to their end. Texts may hold ends of lines of any kind."""
    text = stream.read()
    whole = io.StringIO(text[: text.rfind("\n") + 1], newline="")
    with suppress(csv.Error):  # in the middle of a text
        yield from csv.reader(whole, strict=True)


def _column(words: list[str], kind: Any) -> NDArray[Any]:
    return np.array(words if kind is object else [float(word) for word in words], dtype=kind)


def recover_rows(directory: Path) -> Path:
    """Make ``results.csv`` of what a run that was killed has left, or has written so far.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read.
    """
    _, columns, whole, table = _read_binary(directory / ROWS_FILE)
    return _write_text(directory, columns, whole, [table])


def _read_binary(path: Path) -> tuple[str, list[str], list[int], NDArray[np.float64]]:
    with world.open(path, "rb") as stream:
        header = json.loads(stream.readline())
        numbers = np.fromfile(stream, _FLOAT)
    columns = header["columns"]
    if not columns:
        raise ValueError(f"{path.name} has no columns")
    rows = numbers[: len(numbers) // len(columns) * len(columns)].reshape(-1, len(columns))
    return header.get("run", ""), columns, header["whole"], rows


def _write_text(directory: Path, columns: Sequence[str], whole: Sequence[int], blocks: Iterable[NDArray[Any]]) -> Path:
    """Write ``results.csv``, which is there as a whole or not at all."""
    path = directory / CSV_FILE
    part = path.with_name(CSV_FILE + ".part")
    with world.open(part, "w", newline="", encoding="utf-8") as stream:
        write_csv(stream, columns, whole, blocks)
    world.replace(part, path)
    return path


def write_csv(stream: IO[str], columns: Sequence[str], whole: Sequence[int], blocks: Iterable[NDArray[Any]]) -> None:
    """Header and rows as text."""
    stream.write(_line(columns))
    _write_rows(stream, whole, blocks)


def _line(cells: Sequence[str]) -> str:
    """A line of CSV. Python's own writer leaves a carriage return without quotes, which ends a line for its reader."""
    return ",".join(f'"{cell.replace(_QUOTE, 2 * _QUOTE)}"' if _TO_QUOTE & set(cell) else cell for cell in cells) + "\n"


def _write_rows(stream: IO[str], whole: Sequence[int], blocks: Iterable[NDArray[Any]]) -> None:
    for block in blocks:
        for row in block:
            cells = row.tolist()
            for k in whole:
                cells[k] = int(cells[k])
            if block.dtype == object:
                stream.write(_line([cell if isinstance(cell, str) else repr(cell) for cell in cells]))
            else:
                stream.write(",".join(map(repr, cells)) + "\n")
