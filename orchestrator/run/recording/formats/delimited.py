"""CSV of any tool: parted by commas, semicolons or tabs, names with quotes or without."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .... import world
from ....evaluation import Signals
from ..text import write_csv
from ..words import Words
from .table import TIME, Table, blocks_of, refused, texts_among

_TRUTH = {"true": 1.0, "false": 0.0}


def read_delimited(path: Path) -> Table:
    """The columns of a CSV file; ``true`` and ``false`` are 1 and 0, and a column with other words is one of texts.

    Args:
        path: of the file. Its last line is left out if it was not written to its end.

    Raises:
        OSError, ValueError: it cannot be read.
    """
    with world.open(path, newline="", encoding="utf-8-sig", errors="surrogateescape") as stream:
        text = stream.read()
    head = text[: text.find("\n") + 1]
    plain = re.sub(r'"[^"]*"', "", head)  # names may have commas, as in "a[1,2]"
    delimiter = max(",;\t", key=plain.count)
    names = next(csv.reader([head.rstrip("\r\n")], delimiter=delimiter), [])
    if not any(names):
        raise refused(path, "its first line has no names")
    columns = _numbers(text, head, len(names), delimiter)
    if columns is None:
        columns = _cells(text, names, delimiter)
    found: dict[str, NDArray[Any]] = {}
    for name, column in zip(names, columns, strict=True):
        if name in found:
            raise refused(path, f"two of its columns are called {name}")
        if name:  # some tools end each line with a delimiter
            found[name.strip()] = column
    return Table(found)


def write_delimited(path: Path, signals: Signals) -> None:
    """A CSV file as a run leaves it: the shortest digits that give the same numbers, parted by commas.

    Args:
        path: of the file.
        signals: what it is to hold.
    """
    names = [TIME, *signals.names()]
    words = Words(names.index(name) for name in texts_among(signals))

    def rows() -> Iterator[NDArray[np.float64]]:
        for columns in blocks_of(signals, names):
            yield words.encode(list(zip(*columns, strict=True))) if words.columns else np.column_stack(columns)

    with world.open(path, "wb") as stream:
        write_csv(stream, names, (), words, rows())


def _numbers(text: str, head: str, width: int, delimiter: str) -> list[NDArray[np.float64]] | None:
    """All columns where they are plain numbers, which is fast; else nothing."""
    whole = text[len(head) : text.rfind("\n") + 1]
    if not whole.strip() or (delimiter == ";" and "," in whole):
        return None
    try:
        table = np.loadtxt(io.StringIO(whole), delimiter=delimiter, comments=None, ndmin=2)
    except ValueError:
        return None
    return list(table.T.copy()) if table.shape[1] == width else None


def _cells(text: str, names: Sequence[str], delimiter: str) -> list[NDArray[Any]]:
    """All columns, cell by cell."""
    records = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    rows = [row for row in list(records)[1:] if len(row) == len(names)]
    return [_column([row[k] for row in rows], delimiter) for k in range(len(names))]


def _column(cells: Sequence[str], delimiter: str) -> NDArray[Any]:
    """Numbers if all are some, with the decimal comma that goes with semicolons; else texts."""
    try:
        return np.array([_number(cell, delimiter) for cell in cells], dtype=float)
    except ValueError:
        return np.array(cells)


def _number(cell: str, delimiter: str) -> float:
    word = cell.strip().lower()
    if not word:  # as pandas writes what is no number
        return math.nan
    if word in _TRUTH:
        return _TRUTH[word]
    return float(word.replace(",", ".") if delimiter == ";" else word)
