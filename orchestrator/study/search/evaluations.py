"""`Evaluations`: the runs of a search, each written down, and none run twice."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..campaign import Dataset, Entry, Point, parts_of
from ..rows import Row

Changes = Mapping[str, Any]
Evaluate = Callable[[Sequence[Point]], Iterator[tuple[Point, Row]]]
"""Runs points and gives each with its row, in any order; what is not asked for need not be run."""


@dataclass(frozen=True)
class Evaluation:
    """What came out of one run of a search.

    Attributes:
        run: its number. changes: how it differs from the scenario. status, error: as of the run.
        margins, robustness, verdicts, metrics: by name; NaN where there is none.
    """

    run: int
    changes: Changes
    status: str
    error: str = ""
    margins: Mapping[str, float] = field(default_factory=dict)
    robustness: Mapping[str, float] = field(default_factory=dict)
    verdicts: Mapping[str, str] = field(default_factory=dict)
    metrics: Mapping[str, float] = field(default_factory=dict)

    @property
    def failed(self) -> bool:
        """Whether the run could not be judged."""
        return self.status in ("failed", "refused")

    def breaks(self, requirement: str) -> bool:
        """Whether a requirement failed in it."""
        return self.verdicts.get(requirement) == "fail"

    def score(self, requirement: str) -> float:
        """How far a requirement is from being broken: scaled where that is known, else its margin; NaN of no run."""
        if self.failed:
            return math.nan
        scaled, margin = (group.get(requirement, math.nan) for group in (self.robustness, self.margins))
        found = margin if math.isnan(scaled) else scaled
        if math.isfinite(found):
            return found
        return -1.0 if self.breaks(requirement) else 1.0


class Evaluations:
    """The runs of a search, in the order in which they were asked for, whatever the order in which they come.

    Args:
        evaluate: runs the scenario with changes.
        dataset: where rows go.
        resumed: whether what is there already counts.
    """

    def __init__(self, evaluate: Evaluate, dataset: Dataset, *, resumed: bool = False) -> None:
        self._evaluate, self._dataset = evaluate, dataset
        self._done: dict[str, Evaluation] = {}
        self._known: dict[str, Evaluation] = {}
        self._taken: set[int] = set()
        self._next = 0
        if resumed:
            for evaluation in _read(dataset.directory):
                self._known.setdefault(_text(evaluation.changes), evaluation)
                self._taken.add(evaluation.run)
            dataset.recover(max(self._taken, default=-1) + 1)
        else:
            dataset.clear()

    @property
    def done(self) -> list[Evaluation]:
        """What was asked for, each once."""
        return list(self._done.values())

    def run(self, many: Sequence[Changes]) -> Iterator[Evaluation]:
        """The runs with given changes, one after another; those that were run before are known.

        Where the caller wants no more, those that came before their turn are forgotten, so that what is written does
        not depend on how many run at a time; where they are cut short, they are kept for a search that goes on.

        Raises:
            KeyboardInterrupt: not all were run.
        """
        fresh = {text: changes for changes in many if (text := _text(changes)) not in self._known}
        free = itertools.filterfalse(self._taken.__contains__, itertools.count(self._next))
        points = {text: (next(free), changes) for text, changes in fresh.items()}
        early: dict[int, tuple[Point, Row]] = {}
        rows = self._evaluate([*points.values()])
        for changes in many:
            text = _text(changes)
            if text not in self._known:
                number = points[text][0]
                try:
                    while number not in early:
                        came = _next(rows)
                        early[came[0][0]] = came
                except BaseException:
                    for point, row in early.values():
                        self._keep(point, row)
                    raise
                self._keep(*early.pop(number))
            known = self._done.setdefault(text, self._known[text])
            yield known

    def flush(self) -> None:
        """Write down those that were run, before what can fail.

        Raises:
            RecordError: there is no room.
        """
        self._dataset.flush()

    def _keep(self, point: Point, row: Row) -> None:
        number, changes = point
        self._known[_text(changes)] = Evaluation(
            number, changes, row.status, row.error, row.margins, row.scaled, row.verdicts, row.metrics
        )
        self._taken.add(number)
        while self._next in self._taken:
            self._next += 1
        self._dataset.add(Entry(number, changes, row))


def _next(rows: Iterator[tuple[Point, Row]]) -> tuple[Point, Row]:
    for came in rows:
        return came
    raise KeyboardInterrupt  # they end before their time where a user wants no more


def _text(changes: Changes) -> str:
    """What tells changes apart: their numbers to the last bit, whole or not."""
    return json.dumps({key: float(x) if isinstance(x, int) else x for key, x in sorted(changes.items())})


def _read(directory: Path) -> Iterator[Evaluation]:
    """What a search before has written down."""
    import pyarrow.parquet as pq

    kinds = ("margin", "robustness", "verdict", "metric")
    fixed = {"run", "seed", "status", "error", "seconds", "steps"}
    for part in parts_of(directory):
        for row in pq.read_table(part).to_pylist():
            groups: dict[str, dict[str, Any]] = {kind: {} for kind in kinds}
            changes: dict[str, Any] = {}
            for column, value in row.items():
                kind, _, name = column.partition(".")
                if value is None or column in fixed:
                    continue
                if kind in groups:
                    groups[kind][name] = value
                else:
                    changes[column] = value
            yield Evaluation(row["run"], changes, row["status"], row["error"], *(groups[kind] for kind in kinds))
