"""HDF5 files: the time series format of the Modelica Association (MTSF), or plain datasets beside a time.

Source: Pfeiffer, Bausch-Gall, Otter: Proposal for a Standard Time Series File Format in HDF5, Modelica Conference 2012.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .table import Table, needing, refused, time_among

_VARIABLES = "ModelDescription/Variables"


def read_hdf5(path: Path) -> Table:
    """The columns of an HDF5 file.

    Args:
        path: of the file. Where it is no MTSF, each dataset of one dimension that is as long as the time is a signal,
            and its path with dots its name.

    Raises:
        OSError, ValueError, LookupError: it cannot be read.
        RailcosimError: h5py is not installed.
    """
    with needing(path, "h5py"):
        import h5py
    with h5py.File(path, "r") as file:
        return _mtsf(file, path) if _VARIABLES in file else _plain(file, path)


def _mtsf(file: Any, path: Path) -> Table:
    variables = file[_VARIABLES][()].ravel()
    names = [name.decode(errors="replace") for name in variables["name"]]
    time = time_among(names)
    if time is None:
        raise refused(path, "no variable is its time")
    series = file[variables["objectId"][names.index(time)]].parent
    units = _units(file, variables)
    tables: dict[str, Any] = {}
    found: dict[str, Any] = {}
    for name, row in zip(names, variables, strict=True):
        data = file[row["objectId"]]
        if data.parent != series and len(data) != 1:
            continue  # over another time
        table = tables.setdefault(data.name, data[()].T)
        column = -table[row["column"]] if row["negated"] else table[row["column"]]
        found[name] = column
    count = len(found[time])
    columns = {name: column if len(column) == count else np.full(count, column[0]) for name, column in found.items()}
    return Table(columns, dict(zip(names, units, strict=True)))


def _units(file: Any, variables: Any) -> list[str]:
    """The unit of each variable: that of its simple type."""
    if "ModelDescription/SimpleTypes" not in file or "ModelDescription/Units" not in file:
        return [""] * len(variables)
    of_types = file["ModelDescription/SimpleTypes"][()].ravel()["unitOrEnumerationRow"]
    units = [unit.decode(errors="replace") for unit in file["ModelDescription/Units"][()].ravel()["name"]]
    rows = (of_types[row] if row < len(of_types) else -1 for row in variables["simpleTypeRow"])
    return [units[row] if 0 <= row < len(units) else "" for row in rows]


def _plain(file: Any, path: Path) -> Table:
    import h5py

    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.ndim == 1 and item.dtype.kind in "fiub":
            found[name.replace("/", ".")] = item[()]

    file.visititems(visit)
    time = time_among(found)
    if time is None:
        raise refused(path, "it is no MTSF, and none of its datasets is called time")
    return Table({name: column for name, column in found.items() if len(column) == len(found[time])})
