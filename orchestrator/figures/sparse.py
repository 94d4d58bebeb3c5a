"""Functions that look at every row of a signal, where it is recorded less often and has no value in some."""

from collections.abc import Callable, Collection, Iterator

from ..errors import ExpressionError
from ..evaluation import Call, Expression, Reference, Signals, valued, walk
from ..problems import Problem


def sparse_problems(
    expression: Expression, names: Collection[str], is_apart: Callable[[str], bool]
) -> Iterator[Problem]:
    """What is wrong with such functions in an expression.

    Args:
        expression: one whose names are known.
        names: signals and parameters.
        is_apart: whether one of them is a signal that is recorded less often.
    """
    for node in walk(expression.tree):
        if not isinstance(node, Call) or not (expression.functions[node.name].reduces or node.name == "at_sample"):
            continue
        parts = [Expression(part.text, part) for part in walk(node) if isinstance(part, Reference)]
        looked = (name for one in parts for index in one.instances(names) for name in one.resolve(names, index)[0])
        lacking = next(filter(is_apart, looked), "")
        if lacking:
            message = f"{node.name} looks at every row, and {lacking} is recorded less often"
            yield Problem(f"'{expression.text}'", message, "record it in every row (simulation.record_only)")


def check_sparse(expression: Expression, signals: Signals) -> None:
    """Refuse such functions of recorded signals, which would be NaN.

    Raises:
        ExpressionError: there is one.
    """
    known = signals.names()
    names = [*known, *signals.parameters]
    problems = sparse_problems(expression, names, lambda name: name in known and valued(signals[name]) is not None)
    for problem in problems:
        raise ExpressionError(problem)
