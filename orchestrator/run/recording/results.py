"""What a run leaves behind: recorded signals by name, in memory and on disk."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...errors import RailcosimError, ScenarioError, SignalError
from ...figures import plot
from ...markup import escaped, number, table
from ...times import digits
from .columns import Columns, InMemory
from .formats import ENDINGS, read_file, write_file
from .missing import missing_signal, shortened
from .stored import read_stored
from .told import read_json

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

_TIME = "time"
_LISTED = 20
"""Signals that a notebook shows of results."""


class Results(Mapping[str, NDArray[Any]]):
    """Recorded points of a run: a mapping from signals, such as ``"train[1].speed"``, to arrays over ``results.time``.

    Its length is that of a mapping, the number of signals; ``points`` is the number of points. Where there are many,
    they stay in their file, and an array is read from there when it is asked for.

    Args:
        columns: the signals, or all columns of a file. time: shape (T,), s; None where it is among them.

    Attributes:
        units: unit by signal name, where there is one.
        parameters: parameters and start values by full name, as the run used them.
        step: communication step in s. stop_time: planned end in s.
        completed: whether the run reached its end. figures: the figures the scenario asks for.
    """

    def __init__(
        self,
        columns: Mapping[str, NDArray[Any]],
        time: NDArray[np.float64] | None,
        *,
        units: Mapping[str, str],
        parameters: Mapping[str, float | int | bool | str],
        step: float,
        stop_time: float,
        completed: bool,
        figures: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        if isinstance(columns, Columns):
            self._columns = columns
        else:
            self._columns = InMemory(columns if time is None else {_TIME: time, **columns})
        self.units = units
        self.parameters = parameters
        self.step = step
        self.stop_time = stop_time
        self.completed = completed
        self.figures = figures

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """Recorded points in s, shape (T,)."""
        return self._columns[_TIME]

    @property
    def points(self) -> int:
        """How many points were recorded."""
        return self._columns.points

    def part(self, first: int, last: int) -> Mapping[str, NDArray[Any]]:
        """All columns, and ``time``, at the points from a number up to another, which is not among them."""
        return self._columns.part(first, last)

    @cached_property
    def _names(self) -> dict[str, None]:
        return dict.fromkeys(name for name in self._columns if name != _TIME)

    def names(self) -> Collection[str]:
        """All recorded signals."""
        return self._names.keys()

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self:
            raise SignalError(missing_signal(name, self._names, self.parameters))
        return self._columns[name]

    def __contains__(self, name: object) -> bool:
        try:
            return name in self._names
        except TypeError:  # no name at all
            return False

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __eq__(self, other: object) -> bool:
        return self is other  # arrays are not equal or unequal as a whole

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        return f"<Results of {len(self)} signals at {self.points} points{self._span}: {shortened(self)}>"

    @property
    def _span(self) -> str:
        """Of time, in words."""
        if not self.points:
            return ""
        first, last = (self.part(k, k + 1)[_TIME][0] for k in (0, self.points - 1))
        return f" from {digits(float(first))} to {digits(float(last))} s"

    def _repr_html_(self) -> str:
        """What a notebook shows: each signal with its unit, its end and its extremes."""
        rows = [
            [f"<code>{escaped(name)}</code>", escaped(self.units.get(name, "")), *_extremes(self[name])]
            for name in itertools.islice(self, _LISTED)
        ]
        more = f", of which {_LISTED} are listed" if len(self) > _LISTED else ""
        caption = f"Results of {len(self)} signals at {self.points} points{self._span}{more}"
        return table(["signal", "unit", "last", "least", "greatest"], rows, caption)

    def plot(self, *expressions: str, ax: Axes | None = None) -> Axes:
        """Draw signals over time, or expressions of them.

        Args:
            expressions: such as ``"train[:].speed"`` or ``"train[i-1].position - train[i].position"``.
            ax: to draw into; those of a new figure by default.

        Raises:
            ScenarioError: an expression speaks of what is not there.
        """
        return plot(expressions, self, ax)

    def frame(self) -> pandas.DataFrame:
        """All signals as a pandas DataFrame over time in s; their units stand in ``attrs["units"]``.

        Raises:
            RailcosimError: pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise RailcosimError("a frame is of pandas, which is not installed: pip install pandas") from error
        made = pandas.DataFrame({name: self[name] for name in self}, index=pandas.Index(self.time, name=_TIME))
        made.attrs["units"] = {name: self.units[name] for name in self if name in self.units}
        return made

    def save(self, path: str | Path) -> list[str]:
        """Write a file that other tools read, in the format of its ending: CSV, Parquet, HDF5 (MTSF) or MAT (Dymola).

        Args:
            path: of the file, ``run.csv``, ``run.parquet``, ``run.h5`` or ``run.mat``.

        Returns:
            Signals that were left out because they hold texts, for which HDF5 and MAT have no place.

        Raises:
            ScenarioError: another ending, or no points. RailcosimError: a library is missing. OSError: it cannot be
                written.
        """
        return write_file(Path(path), self)

    @classmethod
    def load(cls, directory: str | Path) -> Results:
        """Read a results directory back, complete or cut short, or a result file of any tool.

        Args:
            directory: of a run; or a file, by its ending CSV, Parquet, HDF5 or MAT, which knows no parameters and whose
                step is the median of those between its points.

        Raises:
            ScenarioError: the directory holds no readable run, or the file no results.
            RailcosimError: a library for the file is missing.
        """
        directory = Path(directory)
        if directory.suffix.lower() in ENDINGS and not directory.is_dir():
            return cls._of_file(directory)
        try:
            record = read_json(directory / "run.json")
            columns = read_stored(directory, record)
            if _TIME not in columns:
                raise KeyError(_TIME)
            _check_record(record)
            return cls(
                columns,
                None,
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

    @classmethod
    def _of_file(cls, path: Path) -> Results:
        found = read_file(path)
        time = found.columns[_TIME]
        steps = np.diff(time)
        step, stop = float(np.median(steps)) if len(steps) else 0.0, float(time[-1])
        return cls(found.columns, None, units=found.units, parameters={}, step=step, stop_time=stop, completed=True)


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


def _extremes(values: NDArray[Any]) -> list[str]:
    """The last, the least and the greatest of a signal, as cells; of texts the last."""
    if not len(values):
        return ["–"] * 3
    if values.dtype.kind not in "fiub":
        return [escaped(values[-1]), "–", "–"]
    return [number(float(value)) for value in (values[-1], np.nanmin(values), np.nanmax(values))]
