"""What recorded signals mean: expressions, metrics, requirements, reference values."""

from .expressions import Expression, evaluate_constant, parse
from .metrics import (
    COMFORT_TITLE,
    FUNCTIONS,
    Metric,
    MetricChange,
    check_metrics,
    comfort_levels,
    compare_metrics,
    evaluate_metrics,
    metric_indices,
    unit_of,
)
from .published import PUBLISHED_KEYS, PublishedRow, check_entry, check_published, judge_published, split_metric
from .requirements import Verdict, check_requirements, judge_requirements, parse_requirement
from .signals import Signals
from .syntax import Call, Node, Number, Operation, Reference

__all__ = [
    "COMFORT_TITLE",
    "FUNCTIONS",
    "PUBLISHED_KEYS",
    "Call",
    "Expression",
    "Metric",
    "MetricChange",
    "Node",
    "Number",
    "Operation",
    "PublishedRow",
    "Reference",
    "Signals",
    "Verdict",
    "check_entry",
    "check_metrics",
    "check_published",
    "check_requirements",
    "comfort_levels",
    "compare_metrics",
    "evaluate_constant",
    "evaluate_metrics",
    "judge_published",
    "judge_requirements",
    "metric_indices",
    "parse",
    "parse_requirement",
    "split_metric",
    "unit_of",
]
