from .calculation import Scope, evaluate
from .expressions import Expression, evaluate_constant, parse
from .judge import Judge, value_name
from .metrics import (
    COMFORT_TITLE,
    FUNCTIONS,
    Metric,
    MetricChange,
    comfort_levels,
    compare_metrics,
    unit_of,
)
from .published import (
    BAD,
    ORIGINS,
    PUBLISHED_KEYS,
    REFERENCE,
    REFERENCE_KEYS,
    UNJUDGED_RUN,
    ComparedValue,
    check_entry,
    check_values,
    count_values,
    judge_values,
    split_metric,
)
from .requirements import Verdict, parse_requirement
from .robustness import robustness
from .signals import Part, Signals, filled, parts_of, valued, without_blanks
from .syntax import Call, Name, Node, Number, Operation, Reference, walk
from .vocabulary import Names

__all__ = [
    "BAD",
    "COMFORT_TITLE",
    "FUNCTIONS",
    "ORIGINS",
    "PUBLISHED_KEYS",
    "REFERENCE",
    "REFERENCE_KEYS",
    "UNJUDGED_RUN",
    "Call",
    "ComparedValue",
    "Expression",
    "Judge",
    "Metric",
    "MetricChange",
    "Name",
    "Names",
    "Node",
    "Number",
    "Operation",
    "Part",
    "Reference",
    "Scope",
    "Signals",
    "Verdict",
    "check_entry",
    "check_values",
    "comfort_levels",
    "compare_metrics",
    "count_values",
    "evaluate",
    "evaluate_constant",
    "filled",
    "judge_values",
    "parse",
    "parse_requirement",
    "parts_of",
    "robustness",
    "split_metric",
    "unit_of",
    "value_name",
    "valued",
    "walk",
    "without_blanks",
]
