"""The runs of a study or a search as columns of a page: what was varied, what came out, what was recorded over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...study.campaign import Study, parts_of
from ..content import Columns

if TYPE_CHECKING:
    import pandas as pd

_MOST_NUMBERS, _MOST_POINTS = 4_000_000, 2_000_000
"""Numbers of the table, and points over time, that a page carries at most."""
_GROUPS = ("margin", "verdict", "metric")
_FIXED = ("run", "seed", "status", "error", "seconds", "steps")


def columns_of(
    frame: pd.DataFrame, varied: Iterable[str], labels: Mapping[str, str], columns: Columns
) -> list[dict[str, Any]]:
    """What the script of the page is given of each column: what it is of, and where it is packed.

    Args:
        frame: a row a run, columns as ``runs.parquet`` has them.
        varied: the keys of the changes.
        labels: of columns that are not called by their names.
        columns: to which they are added.
    """
    told = [_column(frame, "run", "run", columns), _column(frame, "status", "status", columns)]
    told += [_column(frame, name, "varied", columns) for name in varied if name in frame]
    for group in _GROUPS:
        told += [_column(frame, name, group, columns) for name in map(str, frame) if name.startswith(f"{group}.")]
    told.sort(key=lambda one: one["name"] not in labels and one["role"] == "metric")  # what is looked for comes first
    return [one | {"label": labels.get(one["name"], one["label"])} for one in told]


def _column(frame: pd.DataFrame, name: str, role: str, columns: Columns) -> dict[str, Any]:
    column = frame[name]
    numeric = column.dtype.kind in "fiub"
    values = column.astype("float64" if numeric else object)
    values = values if numeric else values.where(column.notna(), "")
    label = name.partition(".")[2] if role in _GROUPS else name
    return {"name": name, "label": label, "role": role, "column": columns.add(values.to_numpy())}


def first_rows(frame: pd.DataFrame) -> pd.DataFrame:
    """The runs that a page carries: all, or the first of very many."""
    return frame.head(max(1, _MOST_NUMBERS // max(1, len(frame.columns))))


def varied_in(frame: pd.DataFrame) -> list[str]:
    """The columns of changes in a table that does not say which they are."""
    groups = (*_GROUPS, "robustness")
    return [name for name in map(str, frame) if name not in _FIXED and name.partition(".")[0] not in groups]


def read_rows(directory: Path) -> pd.DataFrame:
    """All runs in a directory, a row each, by number."""
    import pandas as pd

    frames = [pd.read_parquet(part) for part in parts_of(directory)] or [pd.DataFrame({"run": [], "status": []})]
    return pd.concat(frames).sort_values("run", ignore_index=True)


def errors_of(frame: pd.DataFrame) -> dict[int, str]:
    """What is said of runs that failed, by number."""
    if "error" not in frame:
        return {}
    rows = frame[frame["error"].fillna("") != ""]
    return {int(run): str(error) for run, error in zip(rows["run"], rows["error"], strict=True)}


def series_of(study: Study, runs: Iterable[int], columns: Columns) -> dict[str, Any]:
    """What was recorded over time, of as many runs as there is room for.

    Args:
        study: of which it is.
        runs: the ones that are wanted most first.
        columns: to which they are added.

    Returns:
        ``signals``: their names. ``runs``: by number, the column of the points of time and those of the signals.
    """
    if not study.told["how"].get("record"):
        return {"signals": [], "runs": {}}
    found: dict[int, list[int]] = {}
    signals: list[str] = []
    room = _MOST_POINTS
    for run in runs:
        frame = study.series(run)
        signals = signals or [name for name in map(str, frame) if name not in ("run", "time")]
        room -= frame.size
        if room < 0:
            break
        if len(frame):
            own = [name for name in signals if name in frame]
            found[run] = [columns.add(frame[name].to_numpy()) for name in ("time", *own)]
    return {"signals": signals, "runs": found}
