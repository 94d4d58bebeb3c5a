"""What a run leaves behind: recorded signals by name, in memory and on disk."""

from __future__ import annotations

import csv
import json
import time as clock
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import ScenarioError

_FLUSH_SECONDS = 1.0


class Results:
    """Recorded points of a run; ``results["train[1].speed"]`` is an array over ``results.time``.

    Attributes:
        time: shape (T,), s.
        units: unit by signal name, where there is one.
        parameters: parameters and start values by full name, as the run used them.
        step: communication step in s. stop_time: planned end in s.
        completed: whether the run reached its end. figures: the figures the scenario asks for.
    """

    def __init__(
        self,
        columns: Mapping[str, NDArray[Any]],
        time: NDArray[np.float64],
        *,
        units: Mapping[str, str],
        parameters: Mapping[str, float | int | bool | str],
        step: float,
        stop_time: float,
        completed: bool,
        figures: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        self._columns = dict(columns)
        self.time = time
        self.units = units
        self.parameters = parameters
        self.step = step
        self.stop_time = stop_time
        self.completed = completed
        self.figures = figures

    def names(self) -> Collection[str]:
        """All recorded signals."""
        return self._columns.keys()

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._columns[name]

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def load(cls, directory: str | Path) -> Results:
        """Read a results directory back, complete or cut short.

        Raises:
            ScenarioError: the directory holds no readable run.
        """
        directory = Path(directory)
        try:
            record = json.loads((directory / "run.json").read_text(encoding="utf-8"))
            header, rows = _read_rows(directory / "results.csv")
            columns = {name: _column(rows, k, name in record["texts"]) for k, name in enumerate(header)}
            return cls(
                columns,
                columns.pop("time"),
                units=record["units"],
                parameters=record["parameters"],
                step=record["step"],
                stop_time=record["stop_time"],
                completed=record["status"] == "completed",
                figures=record["figures_wanted"],
            )
        except KeyError as error:
            raise ScenarioError(f"{directory} holds no run that can be read: it has no {error}") from error
        except (OSError, ValueError, TypeError) as error:
            raise ScenarioError(f"{directory} holds no run that can be read: {error}") from error


def _read_rows(path: Path) -> tuple[list[str], list[list[str]]]:
    """Header and complete rows; the line that a killed run had begun to write is left out."""
    with path.open(newline="", encoding="utf-8") as stream:
        header, *rows = list(csv.reader(line for line in stream if line.endswith("\n"))) or [[]]
    return header, [row for row in rows if len(row) == len(header)]


def _column(rows: Sequence[Sequence[str]], k: int, is_text: bool) -> NDArray[Any]:
    if is_text:
        return np.array([row[k] for row in rows], dtype=object)
    return np.array([float(row[k]) for row in rows], dtype=np.float64)


class Recorder:
    """Collects rows while a run goes, and writes them through to ``results.csv`` if there is a directory.

    Numbers are written in the shortest form that reads back to the same bits. The file is flushed about every second,
    so that a run that is killed leaves all but its last second.
    """

    def __init__(self, names: Sequence[str], directory: Path | None) -> None:
        self.names = list(names)
        self._rows: list[list[Any]] = []
        self._file = None
        self._written = 0
        self._flushed = clock.monotonic()
        if directory is not None:
            self._file = (directory / "results.csv").open("w", newline="", encoding="utf-8")
            csv.writer(self._file, lineterminator="\n").writerow(["time", *self.names])
            self._file.flush()

    def record(self, time: float, values: Sequence[Any]) -> None:
        """Append one point."""
        self._rows.append([time, *values])
        if self._file is not None and clock.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Bring everything recorded so far to the disk."""
        if self._file is None:
            return
        pending = self._rows[self._written :]
        if any(isinstance(value, str) for row in pending[:1] for value in row):
            csv.writer(self._file, lineterminator="\n").writerows([_texts(row) for row in pending])
        else:
            self._file.writelines(",".join(map(repr, row)) + "\n" for row in pending)
        self._file.flush()
        self._written = len(self._rows)
        self._flushed = clock.monotonic()

    def close(self) -> None:
        """Flush and close the file; the rows stay in memory."""
        if self._file is not None:
            self.flush()
            self._file.close()
            self._file = None

    def columns(self) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
        """Time and all signals as arrays; text columns as objects."""
        by_column = list(zip(*self._rows, strict=True)) or [()] * (len(self.names) + 1)
        columns = {}
        for name, cells in zip(self.names, by_column[1:], strict=True):
            is_text = bool(cells) and isinstance(cells[0], str)
            columns[name] = np.array(cells, dtype=object if is_text else np.float64)
        return np.array(by_column[0], dtype=np.float64), columns


def _texts(row: Sequence[Any]) -> list[str]:
    return [value if isinstance(value, str) else repr(value) for value in row]
