"""Which format a result file has: its ending says it."""

from __future__ import annotations

import struct
from pathlib import Path

from ....errors import ScenarioError
from .delimited import read_delimited
from .dymola import read_dymola
from .hdf5 import read_hdf5
from .parquet import read_parquet
from .table import TIME, Reader, Table, refused, time_among

ENDINGS: dict[str, Reader] = {
    ".csv": read_delimited,
    ".parquet": read_parquet,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".mtsf": read_hdf5,
    ".mat": read_dymola,
}
"""The readers."""


def read_file(path: Path) -> Table:
    """Read a result file of any tool; its time is called ``time`` in what comes out.

    Args:
        path: of the file.

    Raises:
        ScenarioError: it cannot be read, or has no points.
        RailcosimError: a library for it is missing.
    """
    reader = ENDINGS.get(path.suffix.lower())
    if reader is None:
        raise refused(path, f"the endings are {', '.join(ENDINGS)}")
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
