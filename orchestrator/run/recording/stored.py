"""What a directory of results holds, whether its run goes on, was killed or has ended."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import world
from .binary import RowsFile, remove_rows
from .columns import Columns, InMemory
from .recorder import ROWS_FILE, checksum_of, columns_of
from .text import CSV_FILE, read_csv, write_csv
from .words import Words

Telling = Callable[[int, int], None]
"""Called now and then with how many rows are written, and how many there are."""


@dataclass(frozen=True)
class Stored:
    """Rows in a file.

    Attributes:
        columns: the names, time first.
        words: the texts; of text they are known as far as blocks were taken.
        blocks: of the rows, shape (n, columns).
    """

    columns: list[str]
    words: Words
    blocks: Iterator[NDArray[np.float64]]


def open_stored(directory: Path, record: Mapping[str, Any], name: str = ROWS_FILE) -> Stored:
    """The rows of a run.

    Args:
        directory: of the run.
        record: its run.json.
        name: of the file, of which results.csv takes the place in the end if it is that of the results.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read, or it is of another run.
    """
    if name != ROWS_FILE or (directory / name).exists():
        rows = _rows_of(directory / name, record)
        return Stored(rows.columns, rows.words, _all_of(rows))
    return Stored(*read_csv(directory / CSV_FILE, record["texts"]))


def read_stored(directory: Path, record: Mapping[str, Any]) -> Columns:
    """The columns of a run by name, the time among them.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read, or it is of another run.
    """
    if (directory / ROWS_FILE).exists():
        return columns_of(_rows_of(directory / ROWS_FILE, record))
    stored = open_stored(directory, record)
    blocks = list(stored.blocks)
    told = record.get("rows")
    if told is not None and checksum_of(blocks, told["count"]) != (told["crc32"], told["count"]):
        raise ValueError(f"{CSV_FILE} is not that of the run in run.json: it is of another run, or was changed")
    table = np.concatenate([np.empty((0, len(stored.columns))), *blocks])
    return InMemory(zip(stored.columns, stored.words.table(table), strict=True))


def _all_of(rows: RowsFile) -> Iterator[NDArray[np.float64]]:
    try:
        yield from rows.blocks()
    finally:
        rows.close()


def _rows_of(path: Path, record: Mapping[str, Any]) -> RowsFile:
    rows = RowsFile(path)
    if record.get("run", "") not in ("", rows.identity):
        rows.close()
        raise ValueError(f"{path.name} and run.json are of different runs")
    return rows


def recover_rows(directory: Path, told: Telling | None = None) -> Path:
    """Make ``results.csv`` of what a run has left, or has written so far; it is there as a whole or not at all.

    Args:
        directory: of the run.
        told: of how far it has got.

    Raises:
        OSError, ValueError, KeyError, TypeError: there is nothing that can be read, or no room.
    """
    rows, path = RowsFile(directory / ROWS_FILE), directory / CSV_FILE

    def counted() -> Iterator[NDArray[np.float64]]:
        done = 0
        for block in rows.blocks():
            yield block
            done += len(block)
            if told is not None:
                told(done, rows.count)

    part = path.with_name(CSV_FILE + ".part")
    try:
        with world.open(part, "wb") as stream:
            write_csv(stream, rows.columns, rows.whole, rows.words, counted())
        world.replace(part, path)
    except OSError as error:
        size = world.stat(part).st_size if part.exists() else 0
        world.unlink(part, missing_ok=True)
        reason = error.strerror or error
        raise OSError(
            error.errno,
            f"{reason}, after {size / 1e6:.3g} MB; all rows are in {ROWS_FILE} beside it: make room, then "
            f"'orchestrate plot {directory}' writes the text",
            str(path),
        ) from error
    finally:
        rows.close()
    return path


def finish_rows(directory: Path, told: Telling | None = None) -> None:
    """Put ``results.csv`` in the place of the binary rows. Who has these open reads on.

    Raises:
        OSError: there is no room for it; nothing is lost.
    """
    recover_rows(directory, told)
    remove_rows(directory / ROWS_FILE)
