"""The runs of a study on disk: parts as they come, and one table of all when they are complete."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ... import world
from ...errors import RailcosimError, RecordError, naming
from .columns import Entry, fitted, tabulated, tabulated_series, unified

if TYPE_CHECKING:
    import pyarrow as pa

RUNS, SERIES = "runs.parquet", "series.parquet"
METADATA = b"railcosim"
"""The key of the schema's metadata that tells the study, in JSON."""
_PARTS, _NEW = "runs.parts", ".new.parquet"
_MOST_ROWS, _LONGEST = 5000, 5.0
"""A part is written when so many runs wait, or the one before is so many s old: long runs are written as they come."""
_GROUP = 50_000
"""Runs that the whole table is written of at a time."""


class Dataset:
    """The tables of a study in its directory: ``runs.parquet``, and ``series.parquet`` where something is recorded.

    While runs are missing, ``runs.parquet`` is a folder of parts, each of them whole and on disk before it has its
    name; then it is one file, sorted by run. ``series.parquet`` stays a folder.

    Args:
        directory: of the study, which the caller owns.
        dimensions: the keys of the changes that are columns.
        order: metrics and requirements as the scenario has them.
        seed: that of the scenario.

    Raises:
        RecordError: from `add`, `flush` and `complete`: no room, or the like. What is on disk stays, and what is not
            yet is not lost for another `flush`.
    """

    def __init__(self, directory: Path, dimensions: Sequence[str], order: Sequence[str], seed: int) -> None:
        self.directory = directory
        self._dimensions, self._order, self._seed = list(dimensions), list(order), seed
        self._waiting: list[Entry] = []
        self._written = world.monotonic()
        self._number = 0

    @property
    def is_complete(self) -> bool:
        """Whether all runs stand in one file."""
        return (self.directory / RUNS).is_file()

    def clear(self) -> None:
        """Remove what a study before has left."""
        for name in (RUNS, SERIES, _PARTS, _NEW):
            _remove(self.directory / name)

    def recover(self, count: int) -> NDArray[np.bool_]:
        """Which of so many runs are there; what a study that was killed has left half done is put right."""
        whole, parts = self.directory / RUNS, self.directory / _PARTS
        _remove(self.directory / _NEW)
        if whole.is_file():
            _remove(parts)
            return np.ones(count, np.bool_)
        if parts.is_dir() and not whole.exists():
            world.replace(parts, whole)
        there = np.zeros(count, np.bool_)
        for part in self.parts():
            there[_runs_in(part)] = True
            self._number = max(self._number, int(part.stem))
        for part in sorted(world.glob(self.directory / SERIES, "*.parquet")):
            if not there[_runs_in(part)].all():
                world.unlink(part)
        return there

    def parts(self) -> list[Path]:
        """The files of the runs, the oldest first."""
        return parts_of(self.directory)

    def add(self, entry: Entry) -> None:
        """Take a run; it is written together with others."""
        self._waiting.append(entry)
        if len(self._waiting) >= _MOST_ROWS or world.monotonic() - self._written > _LONGEST:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        if not self._waiting:
            return
        name = f"{self._number + 1:06d}.parquet"
        series = tabulated_series(self._waiting)
        if series is not None:  # first: a run that is there has all that belongs to it
            self._write(self.directory / SERIES / name, series)
        self._write(self.directory / RUNS / name, tabulated(self._waiting, self._dimensions, self._seed))
        self._waiting = []
        self._number += 1
        self._written = world.monotonic()

    def complete(self, told: Any) -> None:
        """Make one file of all parts, sorted by run, and of as little memory as one of them takes.

        Args:
            told: what the metadata says of the study.
        """
        import pyarrow.parquet as pq

        parts = self.parts()
        schema = unified([pq.read_schema(part) for part in parts], self._dimensions, self._order)
        schema = schema.with_metadata({METADATA: json.dumps(told).encode()})
        target = self.directory / RUNS

        def write(stream: Any) -> None:
            with pq.ParquetWriter(stream, schema) as writer:
                for table in sorted_tables(parts, schema):
                    writer.write_table(table)

        new = self.directory / _NEW
        write_whole(new, target, write)
        with told_of_disk(target):
            world.replace(target, self.directory / _PARTS)
            world.replace(new, target)
            _remove(self.directory / _PARTS)

    def _write(self, path: Path, table: pa.Table) -> None:
        import pyarrow.parquet as pq

        new = self.directory / _NEW  # elsewhere: readers take every file in the folder
        write_whole(new, path, lambda stream: pq.write_table(table, stream))
        with told_of_disk(path):
            world.mkdir(path.parent, exist_ok=True)
            world.replace(new, path)


def parts_of(directory: Path) -> list[Path]:
    """The files of the runs of a study, the oldest first, whether it is complete or not."""
    whole, parts = directory / RUNS, directory / _PARTS
    if whole.is_file():
        return [whole]
    return sorted(world.glob(whole if whole.is_dir() else parts, "*.parquet"))


def sorted_tables(parts: Sequence[Path], schema: pa.Schema) -> Iterator[pa.Table]:
    """The rows of all parts sorted by run, so many at a time, with the columns of a schema."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    spans = [(int(runs.min()), int(runs.max())) for runs in map(_runs_in, parts)]
    last = max((high for _, high in spans), default=-1)
    for first in range(0, last + 1, _GROUP):
        until = first + _GROUP
        wanted = [part for part, (low, high) in zip(parts, spans, strict=True) if low < until and high >= first]
        which = [("run", ">=", first), ("run", "<", until)]
        tables = [fitted(pq.read_table(part, filters=which), schema) for part in wanted]
        if any(map(len, tables)):
            yield pa.concat_tables(tables).unify_dictionaries().sort_by("run")


def _runs_in(part: Path) -> NDArray[np.int64]:
    import pyarrow.parquet as pq

    try:
        return np.asarray(pq.read_table(part, columns=["run"])["run"].to_numpy(), np.int64)
    except (OSError, ValueError) as error:
        raise RailcosimError(f"{part} cannot be read ({error}); remove it, and its runs are run again") from error


def write_whole(new: Path, target: Path, write: Callable[[Any], None]) -> None:
    """Write a file so that it is on disk, whole, before it takes the place of another."""
    with told_of_disk(target):
        try:
            with naming(new), world.open(new, "wb") as stream:
                write(stream)
                stream.flush()
                world.fsync(stream.fileno())
        except BaseException:
            with suppress(OSError):
                world.unlink(new, missing_ok=True)
            raise


def rewrite(path: Path, content: bytes) -> None:
    """Write a file that is, whatever happens, as it was or whole.

    Raises:
        RecordError: no room, or the like.
    """
    new = path.with_name(f"{path.name}.part")
    write_whole(new, path, lambda stream: stream.write(content))
    with told_of_disk(path):
        world.replace(new, path)


@contextmanager
def told_of_disk(path: Path) -> Iterator[None]:
    """Let an error of the system's be told with the remedy."""
    try:
        yield
    except OSError as error:
        why = error.strerror or error
        raise RecordError(f"{path} cannot be written: {why}; make room, and go on by --resume") from error


def _remove(path: Path) -> None:
    if path.is_dir():
        world.rmtree(path)
    else:
        world.unlink(path, missing_ok=True)
