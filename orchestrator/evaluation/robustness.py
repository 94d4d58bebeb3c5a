"""The robustness of a requirement at every instant of a run, for figures, notebooks and searches."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .calculation import Scope, prepared, reach
from .expressions import parse
from .formulas import says_when
from .metrics import FUNCTIONS
from .reducers import Span
from .requirements import Requirement, parse_requirement
from .slack import decoded
from .syntax import Node
from .temporal import Formula, Points, scales_of

Array = NDArray[np.float64]


def robustness(text: str, run: Any, *, index: int | None = None, scaled: bool = True) -> Array:
    """By how much a requirement, a formula or a condition is kept, seen from every point of a run; negative: broken.

    Args:
        text: such as ``always[0, 70] eventually[0, 30] (train[1].speed >= 15)``.
        run: a run, or its results.
        index: of `i`; without it, the worst of all.
        scaled: whether every comparison is divided by the size of its unit, as in `Verdict.robustness`; if not, values
            are those of `Verdict.margin`.

    Returns:
        Shape (T,). NaN where the run does not tell, because what decides would lie behind its end, and where a value
        is no number; infinite where a boolean decides.

    Raises:
        ExpressionError: the text cannot be read, or names what is not there.
    """
    signals = prepared(getattr(run, "results", run))
    if says_when(text) or text.split()[:1] == ["finally"]:
        requirement = parse_requirement("", text)
    else:
        requirement = Requirement("", text, "", parse(text, FUNCTIONS))
    condition, times = requirement.condition, requirement.times(signals)

    def values(node: Node, scope: Scope) -> tuple[Array, Array]:
        points = Points(signals, reach(node))
        formula = Formula(scope, points, scales_of(condition, scope, at) if scaled else None)
        low, high = formula.values(node, 0, points.count).together()
        span = Span(times.start, times.end, times.outside, forgiven=points.forgiven)
        chosen = span.points(points.times(0, points.count))
        return _from_then_on(requirement.quantifier, low, chosen), _from_then_on(requirement.quantifier, high, chosen)

    every = condition.instances(signals.plan.names) if index is None else (index,)
    found = []
    for at in every:
        low, high = condition.apply(values, signals, at)
        found.append(np.where(low == high, decoded(low), np.nan))
    return np.asarray(np.minimum.reduce(found))


def _from_then_on(word: str, values: Array, chosen: NDArray[np.bool_]) -> Array:
    """What the word of a requirement makes of the values of its condition, seen from every point."""
    if word == "":
        return values
    if word == "finally":
        return np.full(values.shape, values[chosen][-1])
    neutral, merge = (np.inf, np.minimum) if word == "always" else (-np.inf, np.maximum)
    return np.asarray(merge.accumulate(np.where(chosen, values, neutral)[::-1])[::-1])
