"""Parquet files, as pandas, Polars, Spark and pyarrow write them."""

from __future__ import annotations

from pathlib import Path

from .table import Table, needing


def read_parquet(path: Path) -> Table:
    """The columns of a Parquet file; a unit is what a field says of itself under ``unit``.

    Args:
        path: of the file.

    Raises:
        OSError, ValueError: it cannot be read.
        RailcosimError: pyarrow is not installed.
    """
    with needing(path, "pyarrow"):
        from pyarrow import parquet
    found = parquet.read_table(path)
    units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in found.schema}
    columns = {name: found[name].to_numpy() for name in found.column_names}
    return Table(columns, {name: unit for name, unit in units.items() if unit})
