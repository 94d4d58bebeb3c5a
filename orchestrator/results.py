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

    Args:
        names: of the signals.
        kinds: their FMI types; whole numbers are written as such, texts quoted where needed.
        directory: where to write; None keeps everything in memory.
    """

    def __init__(self, names: Sequence[str], kinds: Sequence[str], directory: Path | None) -> None:
        self.names = list(names)
        self._whole = [k + 1 for k, kind in enumerate(kinds) if kind not in ("Real", "String")]
        self._texts = [k + 1 for k, kind in enumerate(kinds) if kind == "String"]
        self._dtype: Any = object if self._texts else np.float64
        self._blocks: list[NDArray[Any]] = []
        self._rows: list[Sequence[Any]] = []
        self._written = 0
        self._file = None
        self._flushed = clock.monotonic()
        if directory is not None:
            self._file = (directory / "results.csv").open("w", newline="", encoding="utf-8")
            csv.writer(self._file, lineterminator="\n").writerow(["time", *self.names])
            self._file.flush()

    def extend(self, rows: Sequence[Sequence[Any]] | NDArray[np.float64]) -> None:
        """Append rows of time and values."""
        if isinstance(rows, np.ndarray):
            self._seal()
            self._blocks.append(rows)
        else:
            self._rows.extend(rows)
        if self._file is not None and clock.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Bring everything recorded so far to the disk."""
        self._seal()
        if self._file is None:
            return
        writer = csv.writer(self._file, lineterminator="\n")
        for block in self._blocks[self._written :]:
            rows = block.tolist()
            for row in rows:
                for k in self._whole:
                    row[k] = int(row[k])
            if self._texts:
                writer.writerows([[x if isinstance(x, str) else repr(x) for x in row] for row in rows])
            else:
                self._file.writelines(",".join(map(repr, row)) + "\n" for row in rows)
        self._file.flush()
        self._written = len(self._blocks)
        self._flushed = clock.monotonic()

    def close(self) -> None:
        """Flush and close the file; the rows stay in memory."""
        if self._file is not None:
            self.flush()
            self._file.close()
            self._file = None

    def columns(self) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
        """Time and all signals as arrays; text columns as objects."""
        self._seal()
        table = np.concatenate(self._blocks) if self._blocks else np.empty((0, len(self.names) + 1), self._dtype)
        columns = {
            name: table[:, k] if k in self._texts else table[:, k].astype(np.float64)
            for k, name in enumerate(self.names, 1)
        }
        return table[:, 0].astype(np.float64), columns

    def _seal(self) -> None:
        """Make one block of the single rows."""
        if self._rows:
            self._blocks.append(np.array(self._rows, dtype=self._dtype))
            self._rows = []
