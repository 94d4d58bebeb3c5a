"""What a run leaves behind: recorded signals by name, in memory and on disk."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import world
from ..errors import ScenarioError, SignalError
from ..master import Rows
from ..times import digits
from .missing import missing_signal, shortened
from .rows import Writer, add_to_checksum, read_rows

_FLUSH_SECONDS = 1.0


class Results(Mapping[str, NDArray[Any]]):
    """Recorded points of a run: a mapping from signals, such as ``"train[1].speed"``, to arrays over ``results.time``.

    Its length is that of a mapping, the number of signals; ``len(results.time)`` is the number of points.

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
        try:
            return self._columns[name]
        except (KeyError, TypeError):
            raise SignalError(missing_signal(name, self._columns, self.parameters)) from None

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __eq__(self, other: object) -> bool:
        return self is other  # arrays are not equal or unequal as a whole

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        span = f" from {digits(float(self.time[0]))} to {digits(float(self.time[-1]))} s" if len(self.time) else ""
        return f"<Results of {len(self)} signals at {len(self.time)} points{span}: {shortened(self)}>"

    @classmethod
    def load(cls, directory: str | Path) -> Results:
        """Read a results directory back, complete or cut short.

        Raises:
            ScenarioError: the directory holds no readable run.
        """
        directory = Path(directory)
        try:
            record = json.loads(world.read_text(directory / "run.json", encoding="utf-8"))
            columns = read_rows(directory, record["texts"], record.get("run", ""))
            _check_rows(columns, record.get("rows"))
            _check_record(record)
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
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise ScenarioError(f"{directory} holds no run that can be read: {error}") from error


def _check_rows(columns: Mapping[str, NDArray[Any]], told: Mapping[str, Any] | None) -> None:
    """Refuse rows that are not those that the record of a run that has ended tells of.

    Raises:
        ValueError: they are of another run, or were changed.
    """
    if told is not None and (checksum_of(list(columns.values())) != told["crc32"]):
        raise ValueError("results.csv is not that of the run in run.json: it is of another run, or was changed")


def checksum_of(columns: Sequence[NDArray[Any]], count: int | None = None) -> int:
    """Of the first ``count`` rows, or all, as a `Recorder` has it."""
    return add_to_checksum(0, np.array([column[:count] for column in columns], dtype=np.result_type(*columns)).T)


def _check_record(record: Mapping[str, Any]) -> None:
    """Refuse a run.json in which somebody has written something else than we do.

    Raises:
        ValueError: with the key.
        KeyError: one is missing.
    """
    tables, figures = {"units": str, "parameters": str | int | float | None}, record["figures_wanted"]
    wrong = [
        key
        for key, kind in tables.items()
        if not isinstance(record[key], dict) or not all(isinstance(value, kind) for value in record[key].values())
    ]
    wrong += [key for key in ("step", "stop_time") if not isinstance(record[key], int | float)]
    if not isinstance(figures, list) or not all(isinstance(figure, dict) for figure in figures):
        wrong.append("figures_wanted")
    if wrong:
        raise ValueError(f"its {wrong[0]} in run.json is not what a run writes there")


@dataclass(frozen=True)
class Due:
    """Which communication points are recorded: every so many, and the last.

    Attributes:
        every: how many. last: the number of the last.
    """

    every: int
    last: int

    def of(self, steps: int, rows: Rows) -> Rows:
        """Those of the rows up to a number of steps; the very same rows where that is all of them."""
        if self.every == 1 or not len(rows):
            return rows
        first = steps - len(rows) + 1
        if not isinstance(rows, np.ndarray):
            return [row for k, row in enumerate(rows, first) if k % self.every == 0 or k == self.last]
        numbers = np.arange(-first % self.every, len(rows), self.every)
        if steps == self.last and steps % self.every:
            numbers = np.append(numbers, len(rows) - 1)
        return rows[numbers]  # a copy: the block may go


class Recorder:
    """Collects rows while a run goes, and writes them through to files if there is a directory.

    The file is flushed about every second, so that a run that is killed leaves all but its last second.

    Args:
        names: of the signals.
        kinds: their FMI types; whole numbers are written as such, texts quoted where needed.
        directory: where to write; None keeps everything in memory.
        past: rows to begin with, of a run that is resumed. there: how many rows of that run are on the disk; they stay
            until there are as many new ones.
        identity: of the run, for the files.
    """

    def __init__(
        self,
        names: Sequence[str],
        kinds: Sequence[str],
        directory: Path | None,
        past: NDArray[Any] | None = None,
        there: int = 0,
        *,
        identity: str = "",
    ) -> None:
        self.names = list(names)
        whole = [k + 1 for k, kind in enumerate(kinds) if kind not in ("Real", "String")]
        self._texts = [k + 1 for k, kind in enumerate(kinds) if kind == "String"]
        self._dtype: Any = object if self._texts else np.float64
        self._blocks: list[NDArray[Any]] = []
        self._rows: list[Sequence[Any]] = []
        self._written = 0
        self._flushed = world.monotonic()
        self._writer: Writer | None = None
        if directory is not None:
            self._writer = Writer(directory, ["time", *names], whole, self._texts, there, identity=identity)
        self.checksum = 0
        """Of the rows that were brought to the disk."""
        if past is not None:
            self.extend(past)
            self.flush()

    def extend(self, rows: Rows) -> None:
        """Append rows of time and values; an array is kept, not copied."""
        if isinstance(rows, np.ndarray):
            self._seal()
            if len(rows):
                self._blocks.append(rows)
        else:
            self._rows.extend(rows)
        if self._writer is not None and world.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    @property
    def count(self) -> int:
        """How many rows there are."""
        return sum(map(len, self._blocks)) + len(self._rows)

    def flush(self, *, sync: bool = False) -> None:
        """Bring everything recorded so far to the disk, and wait until it is there where ``sync`` asks for that."""
        self._seal()
        if self._writer is not None:
            self._writer.append(self._blocks[self._written :])
            self._written = len(self._blocks)
            self.checksum = self._writer.checksum
            self._flushed = world.monotonic()
            if sync:
                self._writer.sync()

    def close(self) -> None:
        """Complete the file; the rows stay in memory."""
        self.flush()
        if self._writer is not None:
            self._writer.close(self._blocks)
            self._writer = None

    def columns(self) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
        """Time and all signals as arrays; text columns as objects."""
        self._seal()
        table = np.empty((len(self.names) + 1, sum(map(len, self._blocks))), self._dtype)
        begin = 0
        for block in self._blocks:
            table[:, begin : begin + len(block)] = block.T
            begin += len(block)
        columns = {name: self._typed(k, table[k]) for k, name in enumerate(self.names, 1)}
        return self._typed(0, table[0]), columns

    def _typed(self, k: int, column: NDArray[Any]) -> NDArray[Any]:
        return column if k in self._texts else column.astype(np.float64, copy=False)

    def _seal(self) -> None:
        """Make one block of the single rows."""
        if self._rows:
            self._blocks.append(np.array(self._rows, dtype=self._dtype))
            self._rows = []
