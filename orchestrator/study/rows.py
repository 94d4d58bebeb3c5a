"""What comes back from a batch: a row for each run, and the rows of many as arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..evaluation import Verdict


@dataclass(frozen=True, slots=True)
class Row:
    """One run of a batch.

    Attributes:
        status: ``"completed"``, ``"terminated"`` (an FMU asked for the end), ``"failed"``, or ``"refused"``: there
            is no run with such changes.
        error: why it failed, ended early or was refused, and the remedy; empty otherwise.
        metrics: by flat name (``"settling"``, ``"gap_min[2]"``); NaN where one has no value.
        verdicts: ``"pass"``, ``"fail"`` or ``"inconclusive"`` by requirement.
        margins: the worst slack by requirement, in the unit of what is compared; NaN where there is none.
        scaled: margins in sizes of what is compared, which compare across requirements; NaN where there is none.
        series: ``"time"`` in s and the signals that were asked for, shape (points,); None where none were.
        steps: communication steps taken. seconds: wall time.
    """

    status: str
    error: str = ""
    metrics: dict[str, float] = field(default_factory=dict)
    verdicts: dict[str, str] = field(default_factory=dict)
    margins: dict[str, float] = field(default_factory=dict)
    scaled: dict[str, float] = field(default_factory=dict)
    series: Mapping[str, NDArray[Any]] | None = None
    steps: int = 0
    seconds: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether it is complete and every requirement holds."""
        return self.status == "completed" and all(verdict == "pass" for verdict in self.verdicts.values())


@dataclass(frozen=True, slots=True)
class Outcomes:
    """Many runs, each attribute over all of them: shape (runs,).

    Attributes:
        status, error: as `Row` has them.
        metrics, margins: by name; NaN where a run has none.
        verdicts: by requirement; empty where a run was not judged.
        rows: the runs one by one.
    """

    status: NDArray[np.str_]
    error: list[str]
    metrics: dict[str, NDArray[np.float64]]
    verdicts: dict[str, NDArray[np.str_]]
    margins: dict[str, NDArray[np.float64]]
    rows: list[Row]

    @classmethod
    def of(cls, rows: Iterable[Row], metrics: Sequence[str], requirements: Sequence[str]) -> Outcomes:
        """The arrays of some rows, for metrics and requirements by name."""
        rows = list(rows)
        return cls(
            np.array([row.status for row in rows], dtype=np.str_),
            [row.error for row in rows],
            {name: np.array([row.metrics.get(name, np.nan) for row in rows], dtype=float) for name in metrics},
            {name: np.array([row.verdicts.get(name, "") for row in rows], dtype=np.str_) for name in requirements},
            {name: np.array([row.margins.get(name, np.nan) for row in rows], dtype=float) for name in requirements},
            rows,
        )

    def __len__(self) -> int:
        return len(self.rows)


def margins(verdicts: Iterable[Verdict]) -> dict[str, float]:
    """Margins by requirement; NaN where there is none."""
    return {verdict.name: np.nan if verdict.margin is None else verdict.margin for verdict in verdicts}


def scaled(verdicts: Iterable[Verdict]) -> dict[str, float]:
    """Margins in sizes of what is compared, by requirement; NaN where there is none."""
    return {verdict.name: np.nan if verdict.robustness is None else verdict.robustness for verdict in verdicts}
