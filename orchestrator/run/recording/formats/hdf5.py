"""HDF5 files: the time series format of the Modelica Association (MTSF), or plain datasets beside a time.

Source: Pfeiffer, Bausch-Gall, Otter: Proposal for a Standard Time Series File Format in HDF5, Modelica Conference 2012.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....evaluation import Signals
from .table import ROWS, TIME, Table, blocks_of, needing, numbers_among, refused, time_among

_VARIABLES = "ModelDescription/Variables"
_PARAMETER, _OUTPUT, _LOCAL, _FIXED, _CONTINUOUS = 1, 3, 4, 2, 5
"""Causalities and variabilities, as the proposal numbers them."""


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


def write_hdf5(path: Path, signals: Signals) -> None:
    """An MTSF: the signals as one series over time, the parameters as another of one row. Texts find no place in it.

    Args:
        path: of the file.
        signals: what it is to hold.

    Raises:
        RailcosimError: h5py is not installed.
    """
    with needing(path, "h5py"):
        import h5py
    names = numbers_among(signals)
    fixed = {name: float(value) for name, value in signals.parameters.items() if not isinstance(value, str)}
    with h5py.File(path, "w") as file:
        file.attrs["mtsfVersion"] = "0.3"
        file.create_group("ModelDescription").attrs["generationTool"] = "railcosim"
        shape = (signals.points, len(names))
        rows = file.create_dataset(
            "Results/Outputs/H5T_NATIVE_DOUBLE", shape, "f8", chunks=(min(ROWS // 16, signals.points), 1)
        )
        rows.parent.attrs.update({"interpolationMethod": "linear", "independentVariableRow": 0})
        done = 0
        for columns in blocks_of(signals, names):
            rows[done : done + len(columns[0])] = np.column_stack(columns)
            done += len(columns[0])
        kept = file.create_dataset("Results/Parameters/H5T_NATIVE_DOUBLE", data=np.array([[*fixed.values()]]))
        kept.parent.attrs.update({"interpolationMethod": "constant", "independentVariableRow": -1})
        units = {TIME: "s", **signals.units}
        known = list(dict.fromkeys(units.get(name, "") for name in [*names, *fixed]))
        told = [(name, rows.ref, k, _OUTPUT if k else _LOCAL, _CONTINUOUS) for k, name in enumerate(names)]
        told += [(name, kept.ref, k, _PARAMETER, _FIXED) for k, name in enumerate(fixed)]
        kinds = [
            ("name", f"S{max(len(name.encode()) for name, *_ in told)}"),
            *(("simpleTypeRow", "u4"), ("causality", "u1"), ("variability", "u1"), ("description", "S1")),
            *(("objectId", h5py.ref_dtype), ("column", "u4"), ("negated", "u1")),
        ]
        variables = [
            (name.encode(), known.index(units.get(name, "")), causality, variability, b"", of, column, 0)
            for name, of, column, causality, variability in told
        ]
        file[_VARIABLES] = np.array(variables, kinds).reshape(-1, 1)
        _write_units(file, known)


def _write_units(file: Any, known: Sequence[str]) -> None:
    """One simple type for each unit."""
    width = max(1, *(len(unit.encode()) for unit in known))
    kinds = [
        *(("name", f"S{width + 5}"), ("dataType", "u1"), ("quantity", "S1"), ("relativeQuantity", "u1")),
        *(("description", "S1"), ("unitOrEnumerationRow", "i4")),
    ]
    types = [(f"Real {unit}".encode(), 1, b"", 0, b"", k if unit else -1) for k, unit in enumerate(known)]
    file["ModelDescription/SimpleTypes"] = np.array(types, kinds).reshape(-1, 1)
    units = [(unit.encode(), 1.0, 0.0, 0) for unit in known]
    kinds = [("name", f"S{width}"), ("factor", "f8"), ("offset", "f8"), ("mode", "u1")]
    file["ModelDescription/Units"] = np.array(units, kinds).reshape(-1, 1)
