"""The columns of a study's table: rows as they come, made one Arrow table."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ...evaluation import split_metric

if TYPE_CHECKING:
    import pyarrow as pa

    from ..rows import Row

SEED = "simulation.seed"
"""The change that gives a run its noise; the column of it is ``seed``."""
_FIRST = ("run",)
_THEN = ("seed", "status", "error", "seconds", "steps")
_GROUPS = ("metric", "verdict", "margin", "robustness")
"""How the names of columns begin that hold what was evaluated."""


class Entry(NamedTuple):
    """One run of a study: its number, how it differs from the scenario, and what came out."""

    run: int
    changes: Mapping[str, Any]
    row: Row


def tabulated(entries: Sequence[Entry], dimensions: Sequence[str], seed: int) -> pa.Table:
    """Runs as a table, sorted by number.

    Args:
        entries: the runs.
        dimensions: the keys of the changes that are columns.
        seed: that of the scenario, which a run has that changes none.
    """
    import pyarrow as pa

    entries = sorted(entries, key=lambda entry: entry.run)
    rows = [entry.row for entry in entries]
    columns: dict[str, pa.Array] = {"run": pa.array([entry.run for entry in entries], pa.int64())}
    for name in dimensions:
        columns[name] = _values([entry.changes.get(name) for entry in entries])
    columns["seed"] = pa.array([entry.changes.get(SEED, seed) for entry in entries], pa.int64())
    columns["status"] = pa.array([row.status for row in rows], pa.string())
    columns["error"] = pa.array([row.error for row in rows], pa.string())
    columns["seconds"] = pa.array([row.seconds for row in rows], pa.float64())
    columns["steps"] = pa.array([row.steps for row in rows], pa.int64())
    for name in _names(row.metrics for row in rows):
        columns[f"metric.{name}"] = _numbers(row.metrics.get(name) for row in rows)
    for name in _names(row.verdicts for row in rows):
        verdicts = pa.array([row.verdicts.get(name) for row in rows], pa.string())
        columns[f"verdict.{name}"] = verdicts.dictionary_encode()
    for name in _names(row.margins for row in rows):
        columns[f"margin.{name}"] = _numbers(row.margins.get(name) for row in rows)
    for name in _names(row.scaled for row in rows):
        columns[f"robustness.{name}"] = _numbers(row.scaled.get(name) for row in rows)
    return pa.table(columns)


def tabulated_series(entries: Sequence[Entry]) -> pa.Table | None:
    """What was recorded of runs, a row each point; None where nothing was."""
    import pyarrow as pa

    found = [(entry.run, entry.row.series) for entry in sorted(entries, key=lambda entry: entry.run)]
    tables = [
        pa.table({"run": pa.array([run] * len(series["time"]), pa.int64()), **series})
        for run, series in found
        if series is not None
    ]
    return pa.concat_tables(tables, promote_options="permissive") if tables else None


def unified(schemas: Sequence[pa.Schema], dimensions: Sequence[str], order: Sequence[str]) -> pa.Schema:
    """The schema of the whole table: columns in the order of `tabulated`, of types that hold the parts' own.

    Args:
        schemas: of the parts.
        dimensions: the keys of the changes that are columns.
        order: metrics and requirements as the scenario has them; runs of other structures may have more of each.
    """
    import pyarrow as pa

    texts, numbers = (
        dict.fromkeys(("status", "error"), pa.string()),
        dict.fromkeys(("run", "seed", "steps"), pa.int64()),
    )
    types: dict[str, pa.DataType] = {
        **dict.fromkeys(dimensions, pa.null()),
        **texts,
        **numbers,
        "seconds": pa.float64(),
    }
    for schema in schemas:
        for field in schema:
            types[field.name] = _common(types.get(field.name, pa.null()), field.type)
    places = {name: place for place, name in enumerate(order)}

    def place(column: str) -> tuple[int, int, int]:
        group, _, name = column.partition(".")
        metric, index = split_metric(name)
        return _GROUPS.index(group), places.get(metric, len(places)), index or 0

    fixed = [*_FIRST, *dimensions, *_THEN]
    evaluated = [name for name in types if name not in fixed]
    return pa.schema([(name, types[name]) for name in [*fixed, *sorted(evaluated, key=place)]])


def fitted(table: pa.Table, schema: pa.Schema) -> pa.Table:
    """A part of the table with the columns of the whole."""
    import pyarrow as pa

    columns = []
    for field in schema:
        if field.name not in table.column_names:
            columns.append(pa.nulls(table.num_rows, field.type))
            continue
        column = table[field.name]
        if column.type != field.type and pa.types.is_string(field.type):
            column = pa.chunked_array([pa.array([_text(value) for value in column.to_pylist()], pa.string())])
        columns.append(column.cast(field.type))
    return pa.table(columns, schema=schema)


def _common(one: pa.DataType, other: pa.DataType) -> pa.DataType:
    import pyarrow as pa

    if one == other or pa.types.is_null(other):
        return one
    if pa.types.is_null(one):
        return other
    return pa.float64() if {one, other} == {pa.int64(), pa.float64()} else pa.string()


def _names(groups: Iterable[Mapping[str, Any]]) -> list[str]:
    found: dict[str, None] = {}
    for group in groups:
        found.update(dict.fromkeys(group))
    return list(found)


def _numbers(values: Iterable[float | None]) -> pa.Array:
    import pyarrow as pa

    return pa.array([math.nan if value is None else value for value in values], pa.float64())


def _values(values: Sequence[Any]) -> pa.Array:
    """Values of a dimension: numbers, truth values or texts; of several kinds, or lists, as text."""
    import pyarrow as pa

    given = {type(value) for value in values if value is not None}
    kinds: dict[type, Callable[[], pa.DataType]] = {bool: pa.bool_, int: pa.int64, float: pa.float64, str: pa.string}
    if not given:
        return pa.nulls(len(values))
    if given == {int, float}:
        return pa.array([None if value is None else float(value) for value in values], pa.float64())
    if len(given) == 1 and (kind := kinds.get(next(iter(given)))):
        return pa.array(values, kind())
    return pa.array([_text(value) for value in values], pa.string())


def _text(value: Any) -> str | None:
    return value if value is None or isinstance(value, str) else json.dumps(value)
