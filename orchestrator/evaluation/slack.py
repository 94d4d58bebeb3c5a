"""The slack of a condition at every point: by how much it holds, or is missed.

Numbers that differ by rounding are equal: their slack is 0. What stands for that says whether the condition holds.
"""

from collections.abc import Iterator, Mapping
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from .calculation import Scope, evaluate
from .functions import CONSTANTS
from .syntax import Call, Name, Node, Number, Operation, Reference, Temporal

Array = NDArray[np.float64]
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
Scales = Mapping[int, float | Array]
"""What the slack of each comparison is divided by, in all rows or in each (n, 1), by the identity of its node."""
ROUNDING = 4 * float(np.finfo(np.float64).eps)
"""Numbers that differ by less than this share of what they are made of are equal: a start on a bound is on it."""
ZERO = float(np.finfo(np.float64).tiny)
"""What stands for 0 where a condition holds; where it does not, its negative does: so a value says both."""


def decoded(values: Array) -> Array:
    """Values with a plain 0 where they are 0."""
    return np.where(np.abs(values) <= ZERO, 0.0, values)


def slack_of(node: Node, scope: Scope, scales: Scales | None = None) -> Array:
    """The slack of a condition that is made of no others: b - a for a < b. What words make of them, `Formula` knows.

    It is positive where the condition holds and negative where it does not (missed by), never 0, as `decoded` has it;
    infinite where there is no measure. A bare signal is a boolean: it holds where it is not zero and has no measure.
    NaN never holds.

    Args:
        node: the condition.
        scope: what its names stand for.
        scales: what the slack of a comparison is divided by; 1 by default.
    """
    if isinstance(node, Operation) and node.operator in COMPARISONS:
        left, right = node.operands
        return _compared(node.operator, left, right, scope, None if scales is None else scales[id(node)])
    value = _number(node, scope)
    return np.where(np.isnan(value), np.nan, np.where(value, np.inf, -np.inf))


def _number(node: Node, scope: Scope) -> Array:
    return np.asarray(evaluate(node, scope), dtype=np.float64)


def _made_of(node: Node) -> list[Node]:
    """The numbers that a value is made of, whose size is that of its rounding: of a gap the two positions."""
    match node:
        case (
            Operation(operator="+" | "-" | "negative" | "positive", operands=parts)
            | Call(name="abs" | "minimum" | "maximum", arguments=parts)
        ):
            return [number for part in parts for number in _made_of(part)]
    return [node]


def _compared(operator: str, left: Node, right: Node, scope: Scope, scale: float | Array | None) -> Array:
    a, b = _number(left, scope), _number(right, scope)
    gap, numbers = np.asarray(b - a), [part for side in (left, right) for part in scope.binding.known(_made_of, side)]
    nearest = float(np.abs(gap).min(initial=np.inf))
    is_near = not all(nearest > ROUNDING * scope.frame.largest(scope.binding.term(part)) for part in numbers)
    if is_near:  # somewhere, perhaps
        close = ROUNDING * reduce(np.maximum, [np.abs(_number(part, scope)) for part in numbers])
        equal = (a == b) | (np.abs(gap) <= np.where(np.isfinite(close), close, 0.0))
        gap = np.where(equal, 0.0, gap)  # inf - inf would be NaN
    slack = np.abs(gap) if operator in ("==", "!=") else gap
    slack = slack if operator in ("<", "<=", "!=") else -slack
    slack = slack if scale is None else slack / scale
    if is_near:
        slack = np.where(slack == 0.0, ZERO if operator in ("<=", ">=", "==") else -ZERO, slack)
    return np.asarray(slack)


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
