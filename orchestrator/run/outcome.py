"""`Run`: what came out of a run."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..evaluation import BAD, ComparedValue, Metric, Verdict
from ..system import System
from .checking import Checked
from .results import Results
from .watching import Finding

Status = Literal["completed", "terminated", "interrupted", "failed"]


@dataclass
class Run:
    """What came out of a run; ``run["train[1].speed"]`` is a recorded signal over ``run.time``.

    Attributes:
        results: recorded signals. metrics, requirements: evaluated tables.
        published: what a source printed, beside what was measured. references: the same for values of one's own.
        status: ``"completed"``, ``"terminated"`` (an FMU asked for the end), ``"interrupted"`` or ``"failed"``; error:
            why it failed or ended early.
        checked: models, wiring, order, and the notes a user should read.
        directory: where the files are, if there are any. figures: those that were drawn.
        coupling: how the master's iterations, step sizes, loops and events went, where there were any.
        findings: what no train can do, and what controllers said of themselves, the gravest first.
        notes: what a user should know of how it went.
        seconds: wall time of ``setup`` and ``stepping``, and the number of communication ``steps``.
    """

    system: System
    results: Results
    status: Status
    checked: Checked
    metrics: list[Metric] = field(default_factory=list)
    requirements: list[Verdict] = field(default_factory=list)
    published: list[ComparedValue] = field(default_factory=list)
    references: list[ComparedValue] = field(default_factory=list)
    figures: list[Path] = field(default_factory=list)
    error: RunError | None = None
    coupling: dict[str, Any] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    directory: Path | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def time(self) -> NDArray[np.float64]:
        """Recorded points in s."""
        return self.results.time

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.results[name]

    def names(self) -> Collection[str]:
        """All recorded signals."""
        return self.results.names()

    @property
    def failed(self) -> bool:
        """Whether a requirement failed, a known value was missed, or one that departs has come to hold."""
        values = [*self.published, *self.references]
        return any(v.verdict == "fail" for v in self.requirements) or any(row.verdict in BAD for row in values)
