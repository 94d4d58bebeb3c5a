"""Whether less or more of a metric is better: read off its expression, so that a comparison can name a winner."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import Literal

import numpy as np

from ..errors import ExpressionError, ScenarioError
from ..evaluation import FUNCTIONS, Call, Node, Number, Operation, Reference, parse
from ..problems import Problem, suggestion

Better = Literal["smaller", "larger", "none"]
DIRECTIONS: tuple[Better, ...] = ("smaller", "larger", "none")

_SMALLER = {
    "settling_time", "overshoot", "peak", "comfort", "rms", "jerk", "mean_jerk", "duration", "traction_energy",
    "convergence_time", "speed_overshoot", "gap_overshoot", "peak_acceleration", "amplification", "string_ratio",
}  # fmt: skip
_LARGER = {"time_to_collision", "braking_margin", "headway_capacity"}
_OF_SIZES = {"max", "mean", "final", "at", "integral"}
_OPPOSITE: dict[Better, Better] = {"smaller": "larger", "larger": "smaller", "none": "none"}
_EQUAL = 1e-9
"""Relative difference within which two values are a tie: rounding, not merit."""


def better(expression: str) -> Better:
    """The direction of a metric by its outermost reducer; see `docs/compare.md`.

    A reducer plus or minus a number, or times a positive one, keeps its direction; a difference of two has none.
    """
    try:
        return _of(parse(expression, FUNCTIONS).tree)
    except ExpressionError:
        return "none"


def _of(node: Node) -> Better:  # noqa: PLR0911 (one a rule)
    match node:
        case Operation(operator="+" | "-" | "*" | "/", operands=(inner, Number(value=value))):
            if node.operator in "*/" and value <= 0:
                return _OPPOSITE[_of(inner)] if value < 0 else "none"
            return _of(inner)
        case Operation(operator="negative", operands=(inner,)):
            return _OPPOSITE[_of(inner)]
        case Call(name=name) if name in _SMALLER:
            return "smaller"
        case Call(name=name) if name in _LARGER:
            return "larger"
        case Call(name=name, arguments=(what, *_)) if name in _OF_SIZES and _is_error(what):
            return "smaller"
        case Call(name="min", arguments=(what, *_)) if _is_distance(what):
            return "larger"
    return "none"


def _is_error(node: Node) -> bool:
    """A size of something, or a signal that is called an error."""
    if isinstance(node, Call):
        return node.name == "abs"
    return isinstance(node, Reference) and node.parts[-1][0].endswith("error")


def _is_distance(node: Node) -> bool:
    """A difference of two positions, or a signal that is called a gap or a margin."""
    match node:
        case Operation(operator="-", operands=(Reference() as ahead, Reference() as behind)):
            return ahead.parts[-1][0] == behind.parts[-1][0] == "position"
        case Operation(operator="-", operands=(inner, Number())):
            return _is_distance(inner)
        case Reference():
            return re.search(r"(gap|margin)$", node.parts[-1][0]) is not None
    return False


def winners(values: Sequence[float], direction: Better, barred: Collection[int] = ()) -> tuple[int, ...]:
    """Which of the values are best; none where there is no direction, or all that have a value are equal.

    Args:
        values: one for each variant, NaN where it has none.
        direction: what is better.
        barred: places that win nothing, whatever their values.
    """
    known = {k: value for k, value in enumerate(values) if not np.isnan(value)}
    able = {k: value for k, value in known.items() if k not in barred}
    if direction == "none" or len(known) < 2 or not able:
        return ()
    best = (min if direction == "smaller" else max)(able.values())
    first = tuple(k for k, value in able.items() if _equal(value, best))
    return () if len(first) == len(known) else first


def _equal(a: float, b: float) -> bool:
    return a == b or bool(np.isfinite([a, b]).all() and abs(a - b) <= _EQUAL * max(abs(a), abs(b)))


def read_directions(texts: Sequence[str], metrics: Mapping[str, str]) -> dict[str, Better]:
    """``settling=smaller`` by metric.

    Raises:
        ScenarioError: no such metric, or no such direction.
    """
    found: dict[str, Better] = {}
    problems = []
    for text in texts:
        name, _, given = text.partition("=")
        direction = next((d for d in DIRECTIONS if d == given.strip()), None)
        if direction is None:
            problems.append(Problem(f"--better {text}", "write METRIC=smaller, METRIC=larger or METRIC=none"))
        elif name.strip() not in metrics:
            unknown = f"there is no metric '{name.strip()}'"
            problems.append(Problem(f"--better {text}", unknown, suggestion(name, metrics)))
        else:
            found[name.strip()] = direction
    if problems:
        raise ScenarioError(problems)
    return found
