"""Which format a result file has: its ending says it."""

from __future__ import annotations

import struct
from pathlib import Path

from .... import world
from ....errors import ScenarioError
from ....evaluation import Signals
from .delimited import read_delimited, write_delimited
from .dymola import read_dymola, write_dymola
from .hdf5 import read_hdf5, write_hdf5
from .parquet import read_parquet, write_parquet
from .table import TIME, Reader, Table, Writer, refused, texts_among, time_among

ENDINGS: dict[str, tuple[Reader, Writer]] = {
    ".csv": (read_delimited, write_delimited),
    ".parquet": (read_parquet, write_parquet),
    ".h5": (read_hdf5, write_hdf5),
    ".hdf5": (read_hdf5, write_hdf5),
    ".mtsf": (read_hdf5, write_hdf5),
    ".mat": (read_dymola, write_dymola),
}
"""Who reads and who writes a file."""
WITHOUT_TEXTS = (".h5", ".hdf5", ".mtsf", ".mat")


def read_file(path: Path) -> Table:
    """Read a result file of any tool; its time is called ``time`` in what comes out.

    Args:
        path: of the file.

    Raises:
        ScenarioError: it cannot be read, or has no points.
        RailcosimError: a library for it is missing.
    """
    reader, _ = _of_ending(path, "read")
    try:
        found = reader(path)
    except ScenarioError:
        raise
    except (OSError, ValueError, TypeError, LookupError, OverflowError, struct.error, MemoryError) as error:
        raise refused(path, getattr(error, "strerror", None) or error) from error
    time = time_among(found.columns) or next(iter(found.columns), None)
    if time is None or not len(found.columns[time]):
        raise refused(path, "it has no points")
    if found.columns[time].dtype.kind not in "fiu":
        raise refused(path, f"its first column, {time}, is no time, and none is called so")
    others = {name: column for name, column in found.columns.items() if name != time}
    return Table({TIME: found.columns[time].astype(float), **others}, found.units)


def check_ending(path: Path) -> None:
    """Refuse a file that could not be written before there is anything to write.

    Raises:
        ScenarioError: there is no format with its ending.
    """
    _of_ending(path, "written")


def write_file(path: Path, signals: Signals) -> list[str]:
    """Write a result file; it is there as a whole or not at all.

    Args:
        path: of the file.
        signals: what it is to hold.

    Returns:
        Signals that hold texts, for which the format has no place.

    Raises:
        ScenarioError: there is no such format, or nothing to write.
        RailcosimError: a library for it is missing.
        OSError: the file cannot be written.
    """
    _, writer = _of_ending(path, "written")
    if not signals.points:
        raise ScenarioError(f"{path} is not written: there are no points")
    part = path.with_name(f"{path.name}.part")
    try:
        writer(part, signals)
        world.replace(part, path)
    finally:
        world.unlink(part, missing_ok=True)
    return texts_among(signals) if path.suffix.lower() in WITHOUT_TEXTS else []


def _of_ending(path: Path, what: str) -> tuple[Reader, Writer]:
    found = ENDINGS.get(path.suffix.lower())
    if found is None:
        raise ScenarioError(f"{path} cannot be {what} as results: the endings are {', '.join(ENDINGS)}")
    return found
