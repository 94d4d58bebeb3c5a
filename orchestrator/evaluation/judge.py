"""`Judge`: the metrics and requirements of a scenario, made ready once and applied to any number of runs."""

from collections.abc import Callable, Collection, Mapping
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ..errors import ExpressionError
from ..problems import Problem
from .expressions import parse
from .metrics import FUNCTIONS, Metric, check_metric, measure, numbers_of
from .requirements import Verdict, parse_requirement
from .signals import Signals
from .terms import Plan, Prepared
from .vocabulary import Names


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
        self._names, self._parameters, self._steady = Names(names), parameters, steady
        self._plan = Plan.of(self._names)
        self._texts = dict(metrics)
        self._metrics = {name: _read(parse, text, FUNCTIONS) for name, text in metrics.items()}
        self._requirements = {name: _read(parse_requirement, name, text) for name, text in requirements.items()}

    @cached_property
    def metric_faults(self) -> dict[str, list[Problem]]:
        """What can be found to be wrong with each metric before a run."""
        return {
            name: metric.at(f"metric '{name}'")
            if isinstance(metric, ExpressionError)
            else _at(f"metric '{name}'", check_metric(metric, self._names, self._steady, self._parameters))
            for name, metric in self._metrics.items()
        }

    @cached_property
    def requirement_faults(self) -> dict[str, list[Problem]]:
        """What can be found to be wrong with each requirement before a run."""
        return {
            name: requirement.at(f"requirement '{name}'")
            if isinstance(requirement, ExpressionError)
            else _at(f"requirement '{name}'", requirement.check(self._names, self._steady, self._parameters))
            for name, requirement in self._requirements.items()
        }

    @property
    def metric_problems(self) -> list[Problem]:
        """Every problem of the metrics that can be found before a run."""
        return [problem for problems in self.metric_faults.values() for problem in problems]

    @property
    def requirement_problems(self) -> list[Problem]:
        """Every problem of the requirements that can be found before a run."""
        return [problem for problems in self.requirement_faults.values() for problem in problems]

    @cached_property
    def indices(self) -> dict[str, tuple[int | None, ...]]:
        """The values that each metric has: its i's, or (None,) for a single one. For tables without a problem."""
        return {name: _known(metric).instances(self._names) for name, metric in self._metrics.items()}

    @cached_property
    def value_names(self) -> tuple[str, ...]:
        """Every value of the metrics by a name of its own, `settling` or `gap_min[2]`, in order."""
        return tuple(flat for names in self._value_names.values() for flat in names.values())

    @cached_property
    def _value_names(self) -> dict[str, dict[int | None, str]]:
        """The same by metric and i."""
        return {name: {index: value_name(name, index) for index in indices} for name, indices in self.indices.items()}

    @property
    def requirement_names(self) -> tuple[str, ...]:
        """The requirements, in order."""
        return tuple(self._requirements)

    @cached_property
    def needed_signals(self) -> frozenset[str]:
        """The signals and parameters that are looked at. For tables without a problem."""
        looks = [_known(metric) for metric in self._metrics.values()]
        looks += [look for requirement in self._requirements.values() for look in _known(requirement).looks]
        bindings = ((look, look.bound(self._plan, index)) for look in looks for index in look.instances(self._names))
        found = (binding.found(reference) for look, binding in bindings for reference in look.references)
        return frozenset(name for names in found for name in names)

    def prepared(self, signals: Signals) -> Prepared:
        """A run to be looked at by metrics and requirements alike: what they share is calculated once."""
        if isinstance(signals, Prepared) and signals.plan is self._plan:
            return signals
        return Prepared(self._plan, signals)

    def metrics(self, signals: Signals) -> list[Metric]:
        """The metrics of a run. One that cannot be evaluated is NaN and says why: the others are still wanted."""
        run = self.prepared(signals)
        with np.errstate(all="ignore"):
            return [
                Metric(name, self._texts[name], {None: np.nan}, problem=str(metric))
                if isinstance(metric, ExpressionError)
                else measure(name, self._texts[name], metric, run)
                for name, metric in self._metrics.items()
            ]

    def verdicts(self, signals: Signals, *, scaled: bool = False) -> list[Verdict]:
        """How a run keeps the requirements.

        Args:
            signals: the run.
            scaled: whether margins, and what decides them, are those of robustness.

        Raises:
            ExpressionError: for what was told before the run.
        """
        run = self.prepared(signals)
        with np.errstate(all="ignore"):
            return [_known(requirement).evaluate(run, scaled=scaled) for requirement in self._requirements.values()]

    def values(self, signals: Signals) -> dict[str, float]:
        """The values of the metrics of a run by `value_names`; NaN where one cannot be evaluated."""
        run, found = self.prepared(signals), dict.fromkeys(self.value_names, float("nan"))
        with np.errstate(all="ignore"):
            for name, names in self._value_names.items():
                numbers = numbers_of(self._texts[name], _known(self._metrics[name]), run)
                for index, value in numbers.values.items():
                    found[names[index]] = value
        return found


def value_name(metric: str, index: int | None) -> str:
    """`gap_min[2]`, or `settling` for a metric with a single value."""
    return metric if index is None else f"{metric}[{index}]"


R = TypeVar("R")


def _read(read: Callable[..., R], *text: Any) -> R | ExpressionError:
    """What was read, or why it cannot be."""
    try:
        return read(*text)
    except ExpressionError as error:
        return error


def _at(place: str, problems: list[Problem]) -> list[Problem]:
    return [problem.at(place) for problem in problems]


def _known(read: R | ExpressionError) -> R:
    if isinstance(read, ExpressionError):
        raise read
    return read
