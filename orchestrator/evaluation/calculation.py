"""The value of an expression: its names looked up, its nodes made terms, these calculated.

Slices include both ends, and take the indices that there are: instances are numbered from 1, elements of other makers'
arrays from anywhere.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..errors import ExpressionError
from ..problems import Problem, suggestion
from .functions import ARITHMETIC, LOGIC, WINDOWS, Function, Value, call_problem, logical, where
from .signals import Part, Signals
from .syntax import Call, Group, Name, Node, Number, Operation, Reference, Span, Temporal, uses_index, walk
from .terms import Argument, Frame, Plan, Prepared, Reduction, Term
from .vocabulary import Names, unknown_signal

N = TypeVar("N", bound=Node)
R = TypeVar("R")


class Binding:
    """What the parts of one expression stand for, for one value of its index, or for several, a row each.

    Args:
        text: the expression. functions: those it may call.
        constants: what bare names stand for. plan: where its terms are.
        rows: what they stand for in each row.
    """

    def __init__(
        self,
        text: str,
        functions: Mapping[str, Function],
        constants: Mapping[str, Any],
        plan: Plan,
        rows: "Sequence[Binding]" = (),
    ) -> None:
        self.text, self.functions, self.constants, self.plan, self._rows = text, functions, constants, plan, rows
        self._terms: dict[int, tuple[Node, Term]] = {}  # by the identity of the node, which is kept for that
        self._known: dict[Hashable, tuple[Node, Any]] = {}

    def term(self, node: Node) -> Term:
        """What gives the value of a node.

        Raises:
            ExpressionError: a name is unknown, or something stands where it cannot.
        """
        if id(node) in self._terms:
            term = self._terms[id(node)][1]
            term.shared = True
            return term
        term = self._made(node)
        self._terms[id(node)] = node, term
        return term

    def known(self, find: Callable[[N], R], node: N) -> R:
        """What is found of a node, which is looked for once."""
        key = find, id(node)
        if key not in self._known:
            self._known[key] = node, find(node)
        found: R = self._known[key][1]
        return found

    def error(self, problem: str | Problem) -> ExpressionError:
        """An error that quotes the expression."""
        return ExpressionError(ExpressionError(problem).at(f"'{self.text}'"))

    def found(self, reference: Reference) -> list[str]:
        """The full names a reference stands for, in the order of their indices; empty when there are none."""
        return self.known(self._found, reference)

    def _found(self, reference: Reference) -> list[str]:
        if self._rows and reference.uses_index:
            return [name for row in self._rows for name in row.found(reference)]
        return self.plan.names.find([(name, [self._index(x) for x in indices]) for name, indices in reference.parts])

    def _index(self, index: Node | Span) -> int | tuple[float, float]:
        if not isinstance(index, Span):
            return self._integer(index)
        first, last = index.first, index.last
        return (-np.inf if first is None else self._integer(first), np.inf if last is None else self._integer(last))

    def _integer(self, node: Node) -> int:
        value = self._number(node)
        if not value.is_integer():
            raise self.error(f"an index must be a whole number, not {value:g}")
        return int(value)

    def _number(self, node: Node) -> float:
        """The value of an index, or of a part of it."""
        match node:
            case Name(name=name):
                return float(self._constant(name))
            case Operation(operator=operator, operands=operands):
                return float(_INDEX_ARITHMETIC[operator](*map(self._number, operands)))
        assert isinstance(node, Number)
        return float(node.value)

    def _constant(self, name: str) -> Any:
        if name not in self.constants:
            raise self.error(Problem("", f"'{name}' is not known here", suggestion(name, self.constants)))
        return self.constants[name]

    def _made(self, node: Node) -> Term:
        match node:
            case Number(value=value):
                return self._fixed(value)
            case Name(name=name):
                return self._named(name)
            case Reference():
                return self._referred(node)
            case Call():
                return self._called(node)
            case Operation(operator="if", operands=operands):
                condition, then, otherwise = terms = [self.term(operand) for operand in operands]
                return self.plan.term(
                    ("if", *terms), lambda frame: where(frame[condition], frame[then], frame[otherwise]), *terms
                )
            case Operation(operator=operator, operands=operands):
                return _operation(self.plan, operator, [self.term(operand) for operand in operands])
            case Temporal(word=word):
                message = f"'{word}' stands where a number is wanted"
                remedy = "it makes conditions of requirements, joined by and, or, not and implies"
                raise self.error(Problem("", message, remedy))
        raise self.error("a list is only understood as an argument")

    def _fixed(self, value: Any) -> Term:
        fixed = np.asarray(value)
        key = ("number", type(value), repr(value)) if isinstance(value, float | int | bool) else ("array", id(fixed))
        return self.plan.term(key, lambda _: fixed)

    def _named(self, name: str) -> Term:
        if name == "time" and name not in self.constants:
            return self.plan.term(("time",), lambda frame: frame.signals.time)
        return self._fixed(self._constant(name))

    def _referred(self, reference: Reference) -> Term:
        names = self.found(reference)
        if not names:
            raise self.error(unknown_signal(reference, self.plan.names))
        columns = [self._column(name) for name in names]
        if not (reference.stacked or (self._rows and reference.uses_index)):
            return columns[0]
        return self.plan.term(("rows", *columns), lambda frame: _stacked([frame[x] for x in columns]), *columns)

    def _column(self, name: str) -> Term:
        return self.plan.term(("column", name), lambda frame: frame.column(name))

    def _called(self, node: Call) -> Term:
        if problem := call_problem(node, self.functions):
            raise self.error(problem)
        function = self.functions[node.name]
        if function.reduces:
            return self._reduced(node, function)
        terms = [self.term(argument) for argument in node.arguments]
        plain, call = len(terms) - len(node.keywords), function.call

        def calculate(frame: Frame) -> Value:
            values = [frame.argument(term) for term in terms]
            first = [frame.signals] if function.takes_signals else []
            return np.asarray(call(*first, *values[:plain], **dict(zip(node.keywords, values[plain:], strict=True))))

        made = self.plan.term(("call", call, node.keywords, *terms), calculate, *terms)
        if function.takes_signals:
            made.reach = 1 + max((term.reach for term in terms), default=0)
        return made

    def _reduced(self, node: Call, function: Function) -> Term:
        given = function.given(node)
        bounds = {name: self._argument(given.pop(name)) if name in given else None for name in WINDOWS["span"]}
        terms = {name: self.term(argument) for name, argument in given.items()}
        fixed = {name: term for name, term in terms.items() if name not in function.varying}
        varying = {name: term for name, term in terms.items() if name in function.varying}
        several = bool(self._rows) and any(uses_index(given[name]) for name in varying)
        return self.plan.reduction(Reduction(node.name, function, fixed, bounds, varying, several=several))

    def _argument(self, node: Node) -> Argument:
        if isinstance(node, Group):
            return [self._argument(item) for item in node.items]
        return self.term(node)


_INDEX_ARITHMETIC: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "negative": lambda a: -a,
}  # fmt: skip


def _operation(plan: Plan, operator: str, terms: list[Term]) -> Term:
    """Of arithmetic or logic."""
    if operator in ARITHMETIC:  # on booleans NumPy's would be logical
        arithmetic = ARITHMETIC[operator]
        return plan.term(
            (operator, *terms), lambda frame: np.asarray(arithmetic(*(frame.argument(term) for term in terms))), *terms
        )
    logic = LOGIC[operator]

    def calculate(frame: Frame) -> Value:
        values = [frame[term] for term in terms]
        result = values[0] if len(values) > 1 else logical(logic, values[0])
        for value in values[1:]:
            result = logical(logic, result, value)
        return result

    return plan.term((operator, *terms), calculate, *terms)


def _stacked(values: list[Value]) -> Value:
    """The rows of a slice, (n, T); parameters alone make one column."""
    if all(value.ndim for value in values):
        return np.concatenate(values).reshape(len(values), -1)
    rows = np.empty((len(values), max(value.size for value in values)), np.result_type(*values))
    for row, value in zip(rows, values, strict=True):
        row[...] = value
    return rows


@dataclass(frozen=True)
class Scope:
    """What one expression stands for, in a run or at some points of it."""

    binding: Binding
    frame: Frame

    @property
    def signals(self) -> Signals:
        """The run, or the part of it."""
        return self.frame.run if self.frame is self.frame.run.whole else self.frame.signals

    @property
    def names(self) -> Names:
        """Recorded signals and parameters."""
        return self.binding.plan.names

    def of(self, part: Part) -> "Scope":
        """The same for some points of the run."""
        return Scope(self.binding, self.frame.run.frame(part))

    def error(self, problem: str | Problem) -> ExpressionError:
        """An error that quotes the expression."""
        return self.binding.error(problem)


def names_of(signals: Signals) -> Names:
    """The signals and parameters of a run."""
    return signals.plan.names if isinstance(signals, Prepared) else Names([*signals.names(), *signals.parameters])


def prepared(signals: Signals) -> Prepared:
    """A run to be looked at through a plan, if it is not yet."""
    return signals if isinstance(signals, Prepared) else Prepared(Plan(names_of(signals)), signals)


def evaluate(node: Node, scope: Scope) -> Value:
    """The value of one node: a number, or an array (T,) or (n, T)."""
    return scope.frame[scope.binding.term(node)]


def reach(node: Node) -> int:
    """How many points ahead an expression looks at most."""
    return sum(isinstance(part, Call) and part.name == "at_sample" for part in walk(node))
