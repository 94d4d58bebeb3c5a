"""`Run`: what came out of a run."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from ..evaluation import BAD, ComparedValue, Metric, Verdict
from ..markup import MOST_ROWS, escaped, number, table
from ..system import System
from .checking import Checked
from .recording import Results
from .watching import Finding

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

_SHOWN, _LONGEST = 3, 1500
"""Findings, and characters of what is said of a run, that its representation has."""
Status = Literal["completed", "terminated", "interrupted", "failed"]


@dataclass(eq=False, repr=False)
class Run(Mapping[str, NDArray[Any]]):
    """What came out of a run: a mapping from signals, such as ``"train[1].speed"``, to arrays over ``run.time``.

    Attributes:
        results: recorded signals. metrics, requirements: evaluated tables.
        published: what a source printed, beside what was measured. references: the same for values of one's own.
        status: ``"completed"``, ``"terminated"`` (an FMU asked for the end), ``"interrupted"`` or ``"failed"``; error:
            why it failed or ended early.
        signal: the number of the signal that interrupted it; 0 where none did.
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
    signal: int = 0
    coupling: dict[str, Any] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    directory: Path | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def time(self) -> NDArray[np.float64]:
        """Recorded points in s."""
        return self.results.time

    @property
    def time_reached(self) -> float | None:
        """The last recorded point in s, if there is one."""
        points = self.results.points
        return float(self.results.part(points - 1, points)["time"][0]) if points else None

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.results[name]

    def __contains__(self, name: object) -> bool:
        return name in self.results

    def __iter__(self) -> Iterator[str]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    def __bool__(self) -> bool:
        return True  # a run is there, whatever it recorded

    def __eq__(self, other: object) -> bool:
        return self is other

    __hash__ = object.__hash__

    def __repr__(self) -> str:
        name = " ".join(filter(None, (self.system.provenance.name, self.system.provenance.preset)))
        facts = [f"{self.status}{f': {self.error}' if self.error else ''}", f"{len(self.metrics)} metrics"]
        passed = sum(verdict.verdict == "pass" for verdict in self.requirements)
        facts += [f"{passed} of {len(self.requirements)} requirements pass"] if self.requirements else []
        facts += [str(finding) for finding in self.findings[:_SHOWN]]
        facts += [f"{len(self.findings) - _SHOWN} more findings"] if len(self.findings) > _SHOWN else []
        facts += [f"files in {self.directory}"] if self.directory else []
        text = "; ".join(facts)
        return f"<Run of {name}: {text if len(text) <= _LONGEST else text[:_LONGEST] + '...'}; {self.results!r}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: how it ended, what was found, requirements, metrics."""
        name = " ".join(filter(None, (self.system.provenance.name, self.system.provenance.preset)))
        said = [escaped(text) for text in (*([self.error] if self.error else []), *self.findings[:MOST_ROWS])]
        verdicts = [
            [escaped(v.verdict), escaped(v.name), number(v.margin), number(v.time), f"<code>{escaped(v.text)}</code>"]
            for v in self.requirements
        ]
        values = [
            [escaped(m.name if k is None else f"{m.name}[{k}]"), number(value), escaped(m.unit)]
            for m in self.metrics
            for k, value in m.values.items()
        ]
        parts = [f"<p><b>{escaped(name)}</b>: {escaped(self.status)}</p>"]
        parts += [f"<ul>{''.join(f'<li>{text}</li>' for text in said)}</ul>"] if said else []
        heads = ["verdict", "name", "margin", "at t [s]", "requirement"]
        parts += [table(heads, verdicts, "Requirements", most=MOST_ROWS)] if verdicts else []
        parts += [table(["metric", "value", "unit"], values, "Metrics", most=MOST_ROWS)] if values else []
        return "".join(parts)

    def frame(self) -> pandas.DataFrame:
        """All signals as `Results.frame` gives them."""
        return self.results.frame()

    def plot(self, *expressions: str, ax: Axes | None = None) -> Axes:
        """Draw signals or expressions over time, as `Results.plot` does."""
        return self.results.plot(*expressions, ax=ax)

    def names(self) -> Collection[str]:
        """All recorded signals."""
        return self.results.names()

    @property
    def failed(self) -> bool:
        """Whether a requirement failed, a known value was missed, or one that departs has come to hold."""
        values = [*self.published, *self.references]
        return any(v.verdict == "fail" for v in self.requirements) or any(row.verdict in BAD for row in values)
