"""`Judge`: the metrics and requirements of a scenario, made ready once and applied to any number of runs."""

from collections.abc import Collection, Mapping
from functools import cached_property

from ..problems import Problem
from .metrics import Metric, check_metrics, evaluate_metrics, metric_indices
from .requirements import Verdict, check_requirements, judge_requirements, needed_signals
from .signals import Signals


class Judge:
    """What a run is judged by.

    Args:
        metrics: a [metrics] table: expressions by name.
        requirements: a [require] table.
        names: the signals that runs have and the parameters.
        parameters: which of the names are parameters; without it a forgotten reducer shows only after the run.
        steady: whether communication steps are of one length.
    """

    def __init__(
        self,
        metrics: Mapping[str, str],
        requirements: Mapping[str, str],
        names: Collection[str],
        parameters: Collection[str] | None = None,
        *,
        steady: bool = True,
    ) -> None:
        self._metrics, self._requirements = dict(metrics), dict(requirements)
        self._names, self._parameters, self._steady = names, parameters, steady

    @cached_property
    def metric_problems(self) -> list[Problem]:
        """Every problem of the metrics that can be found before a run."""
        return check_metrics(self._metrics, self._names, self._steady, self._parameters)

    @cached_property
    def requirement_problems(self) -> list[Problem]:
        """Every problem of the requirements that can be found before a run."""
        return check_requirements(self._requirements, self._names, self._steady, self._parameters)

    @cached_property
    def indices(self) -> dict[str, tuple[int | None, ...]]:
        """The values that each metric has: its i's, or (None,) for a single one. For tables without a problem."""
        return metric_indices(self._metrics, self._names)

    @cached_property
    def value_names(self) -> tuple[str, ...]:
        """Every value of the metrics by a name of its own, `settling` or `gap_min[2]`, in order."""
        return tuple(value_name(name, index) for name, indices in self.indices.items() for index in indices)

    @property
    def requirement_names(self) -> tuple[str, ...]:
        """The requirements, in order."""
        return tuple(self._requirements)

    @cached_property
    def needed_signals(self) -> frozenset[str]:
        """The signals and parameters that are looked at. For tables without a problem."""
        return frozenset(needed_signals(self._metrics, self._requirements, self._names))

    def metrics(self, signals: Signals) -> list[Metric]:
        """The metrics of a run. One that cannot be evaluated is NaN and says why: the others are still wanted."""
        return evaluate_metrics(self._metrics, signals)

    def verdicts(self, signals: Signals) -> list[Verdict]:
        """How a run keeps the requirements."""
        return judge_requirements(self._requirements, signals)

    def values(self, signals: Signals) -> dict[str, float]:
        """The values of the metrics of a run by `value_names`; NaN where one cannot be evaluated."""
        found = {
            value_name(metric.name, index): value
            for metric in self.metrics(signals)
            for index, value in metric.values.items()
        }
        return {name: found.get(name, float("nan")) for name in self.value_names}


def value_name(metric: str, index: int | None) -> str:
    """`gap_min[2]`, or `settling` for a metric with a single value."""
    return metric if index is None else f"{metric}[{index}]"
