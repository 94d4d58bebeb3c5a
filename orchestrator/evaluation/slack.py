"""The slack of a condition: whether it holds, and by how much.

Numbers that differ by rounding are equal: their slack is 0.
"""

from collections.abc import Iterator, Mapping
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .calculation import Scope, evaluate
from .functions import CONSTANTS
from .syntax import Call, Name, Node, Number, Operation, Reference, Temporal

COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
ROUNDING = 4 * float(np.finfo(np.float64).eps)
"""Numbers that differ by less than this share of what they are made of are equal: a start on a bound is on it."""


class Slack(NamedTuple):
    """Whether a condition holds, and by how much (negative: missed by; infinite: no measure), of one shape."""

    holds: NDArray[np.bool_]
    slack: NDArray[np.float64]


def slack_of(node: Node, scope: Scope, scales: Mapping[int, float] | None = None) -> Slack:
    """The slack of a condition: b - a for a < b, the least for `and`, the most for `or`, negated for `not`.

    A bare signal is a boolean: it holds where it is not zero and has no measure. NaN never holds.

    Args:
        node: the condition.
        scope: what its names stand for.
        scales: what the slack of a comparison is divided by, by the identity of its node.
    """
    match node:
        case Operation(operator="not", operands=(operand,)):
            holds, slack = slack_of(operand, scope, scales)
            return Slack(~holds & ~np.isnan(slack), -slack)
        case Operation(operator="and" | "or" as operator, operands=operands):
            parts = [slack_of(operand, scope, scales) for operand in operands]
            smaller = operator == "and"
            slack = (np.minimum if smaller else np.maximum).reduce(np.broadcast_arrays(*(part.slack for part in parts)))
            every = np.broadcast_arrays(*(part.holds for part in parts))
            holds = (np.logical_and if smaller else np.logical_or).reduce(every)
            return Slack(np.asarray(holds & ~np.isnan(slack)), np.asarray(slack))
        case Operation(operator="if", operands=(condition, then, otherwise)):
            choice = np.asarray(evaluate(condition, scope), dtype=np.float64)
            yes, no = slack_of(then, scope, scales), slack_of(otherwise, scope, scales)
            slack = np.where(np.isnan(choice), np.nan, np.where(choice, yes.slack, no.slack))
            return Slack(np.where(choice, yes.holds, no.holds) & ~np.isnan(slack), slack)
        case Operation(operator=operator, operands=(left, right)) if operator in COMPARISONS:
            rounding = ROUNDING * np.maximum(_size(left, scope), _size(right, scope))
            holds, slack = _compare(operator, evaluate(left, scope), evaluate(right, scope), rounding)
            return Slack(holds, slack if scales is None else slack / scales[id(node)])
    value = np.asarray(evaluate(node, scope), dtype=np.float64)
    slack = np.where(np.isnan(value), np.nan, np.where(value, np.inf, -np.inf))
    return Slack(slack > 0, slack)


def _size(node: Node, scope: Scope) -> NDArray[np.float64]:
    """How large the numbers are that a value is made of: the rounding of a gap is that of the two positions."""
    match node:
        case Operation(operator="+" | "-" | "negative" | "positive", operands=operands):
            parts = [_size(operand, scope) for operand in operands]
        case Call(name="abs" | "minimum" | "maximum", arguments=arguments):
            parts = [_size(argument, scope) for argument in arguments]
        case _:
            return np.abs(np.asarray(evaluate(node, scope), dtype=np.float64))
    return np.asarray(reduce(np.maximum, parts))


def _compare(operator: str, left: NDArray[Any], right: NDArray[Any], rounding: NDArray[np.float64]) -> Slack:
    a, b = np.asarray(left, dtype=np.float64), np.asarray(right, dtype=np.float64)
    gap = b - a
    equal = (a == b) | (np.abs(gap) <= np.where(np.isfinite(rounding), rounding, 0.0))
    difference = np.where(equal, 0.0, gap)  # inf - inf would be NaN
    if operator in ("==", "!="):
        size = np.abs(difference)
        return Slack(equal, -size) if operator == "==" else Slack(~equal & ~np.isnan(size), size)
    slack = difference if operator in ("<", "<=") else -difference
    return Slack(slack > 0.0 if operator in ("<", ">") else slack >= 0.0, slack)


def conditions(node: Node) -> Iterator[Node]:
    """The parts that have to be true or false: below and, or, not, and both branches of if."""
    match node:
        case (
            Operation(operator="and" | "or" | "not", operands=operands)
            | Operation(operator="if", operands=(_, *operands))
        ):
            for operand in operands:
                yield from conditions(operand)
        case Temporal(operands=operands):
            for operand in operands:
                yield from conditions(operand)
        case _:
            yield node


def can_be_true(node: Node) -> bool:
    """Whether a part is more than a number."""
    match node:
        case Operation(operator=operator):
            return operator in COMPARISONS
        case Call(name=name):
            return name in {"where", "at_sample"}
        case Number(value=value):
            return isinstance(value, bool)
        case Name(name=name):
            return isinstance(CONSTANTS.get(name), bool)
    return isinstance(node, Reference)
