"""Parquet files, as pandas, Polars, Spark and pyarrow write them."""

from __future__ import annotations

from pathlib import Path

from ....evaluation import Signals
from .table import TIME, Table, blocks_of, needing, texts_among


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


def write_parquet(path: Path, signals: Signals) -> None:
    """A Parquet file; units stand with their fields.

    Args:
        path: of the file.
        signals: what it is to hold.

    Raises:
        RailcosimError: pyarrow is not installed.
    """
    with needing(path, "pyarrow"):
        import pyarrow
        from pyarrow import parquet
    names, texts = [TIME, *signals.names()], set(texts_among(signals))
    units = {TIME: "s", **signals.units}
    fields = [
        pyarrow.field(
            name,
            pyarrow.string() if name in texts else pyarrow.float64(),
            metadata={"unit": units[name]} if name in units else None,
        )
        for name in names
    ]
    schema = pyarrow.schema(fields)
    with parquet.ParquetWriter(path, schema) as writer:
        for columns in blocks_of(signals, names):
            arrays = [pyarrow.array(column, field.type) for column, field in zip(columns, schema, strict=True)]
            writer.write_table(pyarrow.Table.from_arrays(arrays, schema=schema))
