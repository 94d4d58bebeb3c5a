"""The files that recorded rows live in: ``results.bin`` while a run goes, ``results.csv`` once it has ended.

``results.csv`` is for people and other programs. Its numbers are the shortest that read back to the same bits, and
finding those takes longer than many a step. While a run goes its rows are therefore appended to ``results.bin``: one
line of JSON with the ``columns`` and the places of those that hold ``whole`` numbers, then each row as 64-bit
little-endian floats. That file is removed when ``results.csv`` is complete: where it is still there, the run was
killed, and `recover` makes the text of it.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

CSV, BINARY = "results.csv", "results.bin"
_FLOAT = np.dtype("<f8")


class Writer:
    """Writes the rows of a run. Texts, which only a run in Python has, go to ``results.csv`` at once.

    Args:
        directory: where to write; what an earlier run left there goes.
        columns: the names, time first.
        whole: columns of whole numbers, by place; they are written as such.
        texts: columns of texts.
    """

    def __init__(self, directory: Path, columns: Sequence[str], whole: Sequence[int], texts: Sequence[int]) -> None:
        self._directory = directory
        self._columns, self._whole, self._texts = columns, whole, texts
        for name in (CSV, BINARY):
            (directory / name).unlink(missing_ok=True)
        if texts:
            self._text = (directory / CSV).open("w", newline="", encoding="utf-8")
            write_csv(self._text, columns, whole, ())
            self._text.flush()
        else:
            self._binary = (directory / BINARY).open("wb")
            self._binary.write(json.dumps({"columns": list(columns), "whole": list(whole)}).encode() + b"\n")
            self._binary.flush()

    def append(self, blocks: Iterable[NDArray[Any]]) -> None:
        """Bring rows to the disk."""
        if self._texts:
            _write_rows(self._text, self._whole, blocks)
            self._text.flush()
        else:
            for block in blocks:
                self._binary.write(np.ascontiguousarray(block, _FLOAT).data)
            self._binary.flush()

    def close(self, blocks: Iterable[NDArray[Any]]) -> None:
        """End the file; ``blocks`` are all rows once more."""
        if self._texts:
            self._text.close()
        else:
            self._binary.close()
            _finish(self._directory, self._columns, self._whole, blocks)


def read_rows(directory: Path, texts: Iterable[str]) -> dict[str, NDArray[Any]]:
    """The columns of a run by name, those named in ``texts`` as objects; what was half written is left out.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read.
    """
    if (directory / BINARY).exists():
        columns, _, table = _read_binary(directory / BINARY)
        return dict(zip(columns, np.ascontiguousarray(table.T), strict=True))
    with (directory / CSV).open(newline="", encoding="utf-8") as stream:
        header, *rows = list(csv.reader(line for line in stream if line.endswith("\n"))) or [[]]
    rows = [row for row in rows if len(row) == len(header)]
    kinds: dict[str, Any] = dict.fromkeys(texts, object)
    return {name: _column([row[k] for row in rows], kinds.get(name, np.float64)) for k, name in enumerate(header)}


def _column(words: list[str], kind: Any) -> NDArray[Any]:
    return np.array(words if kind is object else [float(word) for word in words], dtype=kind)


def recover(directory: Path) -> Path:
    """Make ``results.csv`` of what a run that was killed has left.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read.
    """
    columns, whole, table = _read_binary(directory / BINARY)
    return _finish(directory, columns, whole, [table])


def _read_binary(path: Path) -> tuple[list[str], list[int], NDArray[np.float64]]:
    with path.open("rb") as stream:
        header = json.loads(stream.readline())
        numbers = np.fromfile(stream, _FLOAT)
    columns = header["columns"]
    if not columns:
        raise ValueError(f"{path.name} has no columns")
    return columns, header["whole"], numbers[: len(numbers) // len(columns) * len(columns)].reshape(-1, len(columns))


def _finish(directory: Path, columns: Sequence[str], whole: Sequence[int], blocks: Iterable[NDArray[Any]]) -> Path:
    """From ``results.bin`` to ``results.csv``: at every moment one of the two is complete."""
    path = directory / CSV
    part = path.with_name(CSV + ".part")
    with part.open("w", newline="", encoding="utf-8") as stream:
        write_csv(stream, columns, whole, blocks)
    os.replace(part, path)
    (directory / BINARY).unlink()
    return path


def write_csv(stream: TextIO, columns: Sequence[str], whole: Sequence[int], blocks: Iterable[NDArray[Any]]) -> None:
    """Header and rows as text."""
    csv.writer(stream, lineterminator="\n").writerow(columns)
    _write_rows(stream, whole, blocks)


def _write_rows(stream: TextIO, whole: Sequence[int], blocks: Iterable[NDArray[Any]]) -> None:
    for block in blocks:
        for row in block:
            cells = row.tolist()
            for k in whole:
                cells[k] = int(cells[k])
            if block.dtype == object:
                csv.writer(stream, lineterminator="\n").writerow(
                    [cell if isinstance(cell, str) else repr(cell) for cell in cells]
                )
            else:
                stream.write(",".join(map(repr, cells)) + "\n")
