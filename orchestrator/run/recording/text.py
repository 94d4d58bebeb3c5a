"""``results.csv``: recorded rows for people and other programs.

Its numbers are the shortest that read back to the same bits. A whole number is written as one, a text stands in quotes
where it needs them.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import groupby
from pathlib import Path
from typing import IO, Any

import numpy as np
import orjson
from numpy.typing import NDArray

from ... import world
from .words import Words

CSV_FILE = "results.csv"
_SLAB = 1 << 22
"""Characters that are read at a time."""
_LARGEST = 2.0**63
_QUOTE = '"'
_TO_QUOTE = frozenset(f",{_QUOTE}\r\n")


def write_csv(
    stream: IO[bytes], columns: Sequence[str], whole: Collection[int], words: Words, blocks: Iterable[NDArray[Any]]
) -> None:
    """Header and rows as text.

    Args:
        stream: where to.
        columns: the names, time first.
        whole: columns of whole numbers, by place.
        words: what the numbers in columns of texts stand for.
        blocks: of rows, shape (n, columns).
    """
    stream.write(_line(columns).encode())
    kinds = ["text" if k in words.columns else "whole" if k in whole else "real" for k in range(len(columns))]
    groups = [(kind, [k for k, _ in found]) for kind, found in groupby(enumerate(kinds), lambda pair: pair[1])]
    for block in blocks:
        if len(block):
            parts = [_cells(kind, places, block, words) for kind, places in groups]
            lines = [b"\n".join(parts[0])] if len(parts) == 1 else map(b",".join, zip(*parts, strict=True))
            stream.write(b"\n".join(lines) + b"\n")


def _cells(kind: str, places: Sequence[int], block: NDArray[Any], words: Words) -> list[bytes]:
    """Of each row the text of some neighbouring columns of one kind."""
    part = np.ascontiguousarray(block[:, places[0] : places[-1] + 1])
    if kind == "text":
        texts = [words.decode(k, part[:, n]).tolist() for n, k in enumerate(places)]
        return [_line(row)[:-1].encode(errors="surrogatepass") for row in zip(*texts, strict=True)]
    if not np.isfinite(part).all() or (kind == "whole" and np.abs(part).max() >= _LARGEST):
        rule = repr if kind == "real" else _whole
        return [",".join(map(rule, row)).encode() for row in part.tolist()]
    numbers = part if kind == "real" else part.astype(np.int64)
    return orjson.dumps(numbers, option=orjson.OPT_SERIALIZE_NUMPY)[2:-2].split(b"],[")


def _whole(number: float) -> str:
    return str(int(number)) if np.isfinite(number) else repr(number)


def _line(cells: Iterable[str]) -> str:
    """A line of CSV. Python's own writer leaves a carriage return without quotes, which ends a line for its reader."""
    return ",".join(f'"{cell.replace(_QUOTE, 2 * _QUOTE)}"' if _TO_QUOTE & set(cell) else cell for cell in cells) + "\n"


def read_csv(path: Path, texts: Collection[str]) -> tuple[list[str], Words, Iterator[NDArray[np.float64]]]:
    """The names of the columns, the texts, and the rows in blocks; a line that was not written to its end is left out.

    Args:
        path: of the file.
        texts: the columns that hold texts. The texts are known as far as blocks were taken.

    Raises:
        OSError, ValueError: it cannot be read, here or while blocks are taken.
    """
    with world.open(path, newline="", encoding="utf-8", errors="surrogatepass") as stream:
        header = next(_records(stream), [])
    words = Words(k for k, name in enumerate(header) if name in texts)
    return header, words, _texts(path, words, len(header)) if words.columns else _numbers(path, len(header))


def _records(stream: IO[str]) -> Iterator[list[str]]:
    """The records that were written to their end. Texts may hold ends of lines of any kind."""
    held = ""
    for line in stream:  # a record is a line, unless a quote goes on beyond it
        held += line
        if held.count(_QUOTE) % 2 or not line.endswith("\n"):
            continue
        with suppress(csv.Error):
            yield from csv.reader(io.StringIO(held, newline=""), strict=True)
        held = ""


def _texts(path: Path, words: Words, width: int) -> Iterator[NDArray[np.float64]]:
    with world.open(path, newline="", encoding="utf-8", errors="surrogatepass") as stream:
        records = _records(stream)
        next(records, None)
        for row in records:
            if len(row) == width:
                cells: list[Any] = [cell if k in words.columns else float(cell) for k, cell in enumerate(row)]
                yield words.encode([cells])


def _numbers(path: Path, width: int) -> Iterator[NDArray[np.float64]]:
    with world.open(path, newline="", encoding="utf-8") as stream:
        next(_records(stream), None)
        held = ""
        while slab := stream.read(_SLAB):
            held += slab
            end = held.rfind("\n") + 1
            if end:
                rows = np.loadtxt(io.StringIO(held[:end]), delimiter=",", comments=None, ndmin=2)
                if rows.shape[1] != width:
                    raise ValueError(f"its rows have {rows.shape[1]} columns, its header has {width}")
                yield rows
                held = held[end:]
