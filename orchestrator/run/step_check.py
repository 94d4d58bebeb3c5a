"""Whether a communication step is fine enough: what half of it changes, against what may change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..evaluation import compare_metrics
from .outcome import Run

RELATIVE = 0.01
"""What may change of a metric, of its own size; more where a known value's tolerance is wider."""
ABSOLUTE = 1e-3
"""And of the largest metric of its unit: a speed error of 1 mm/s need not be known to 1 % in a run at 80 m/s."""


@dataclass(frozen=True)
class StepChange:
    """What half the step changes of one value, and what may change; both in the value's unit."""

    metric: str
    index: int | None
    change: float
    allowed: float
    unit: str

    @property
    def share(self) -> float:
        """The change as a share of what may change."""
        return abs(self.change) / self.allowed if self.allowed else np.inf if self.change else 0.0

    @property
    def name(self) -> str:
        """`gap[3]`, `settling`."""
        return self.metric if self.index is None else f"{self.metric}[{self.index}]"


@dataclass(frozen=True)
class StepCheck:
    """The verdict on a step [s]: `too coarse` where a value changes by more than it may, or a verdict changes.

    It is `not judged` where there are neither metrics nor requirements.
    `changes` are those of all metrics, the worst first; `requirements` the names of those that come out differently.
    """

    verdict: Literal["fine", "too coarse", "not judged"]
    step: float
    changes: list[StepChange]
    requirements: list[str]

    @property
    def beyond(self) -> list[StepChange]:
        """The changes that are larger than they may be."""
        return [change for change in self.changes if not change.share <= 1.0]


def check_step(outcome: Run, half: Run) -> StepCheck:
    """Judge the step of a run by the same run at half of it.

    A value may change by `RELATIVE` of itself, by `ABSOLUTE` of the largest metric of its unit, a time by one recorded
    point, and what is known beforehand by its tolerance: by the largest of these.

    Args:
        outcome: the run.
        half: the same at half the step, recorded at the same points.
    """
    known: dict[tuple[str, int | None], float] = {}
    for row in (*outcome.published, *outcome.references):
        if row.tolerance is not None and not row.judges_truth:
            at = (row.metric.removesuffix(f"[{row.index}]"), row.index)
            known[at] = max(row.tolerance, known.get(at, 0.0))
    largest: dict[str, float] = {}
    for metric in outcome.metrics:
        sizes = [abs(value) for value in metric.values.values() if np.isfinite(value)]
        largest[metric.unit] = max([*sizes, largest.get(metric.unit, 0.0)])
    truths = {metric.name for metric in outcome.metrics if metric.truth}
    changes = []
    for found in compare_metrics(outcome.metrics, half.metrics):
        if np.isnan(found.value) and np.isnan(found.other):
            continue
        size = abs(found.value) if np.isfinite(found.value) else 0.0
        bounds = [RELATIVE * size, known.get((found.name, found.index), 0.0)]
        bounds += [ABSOLUTE * largest[found.unit]] if found.unit else []
        bounds += (
            [1.001 * (outcome.system.stepping.record or outcome.system.stepping.step)] if found.unit == "s" else []
        )
        allowed = 0.0 if found.name in truths else max(bounds)
        changes.append(StepChange(found.name, found.index, found.difference, allowed, found.unit))
    changes.sort(key=lambda change: -change.share if np.isfinite(change.share) else -np.inf)
    verdicts = {verdict.name: verdict.verdict for verdict in half.requirements}
    differ = [v.name for v in outcome.requirements if verdicts.get(v.name, v.verdict) != v.verdict]
    coarse = bool(differ) or any(not change.share <= 1.0 for change in changes)
    judged = bool(outcome.metrics or outcome.requirements)
    return StepCheck(
        "too coarse" if coarse else "fine" if judged else "not judged", outcome.system.stepping.step, changes, differ
    )
