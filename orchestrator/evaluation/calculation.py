"""The value of an expression: its names looked up in a scope, its nodes calculated.

Slices include both ends, and take the indices that there are: instances are numbered from 1, elements of other makers'
arrays from anywhere.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from ..errors import ExpressionError, WindowError
from ..names import INDEX, plainly
from ..problems import Problem, suggestion
from .folds import Fold
from .functions import ARITHMETIC, LOGIC, WINDOWS, Function, Value, call_problem, logical, where
from .signals import Part, Signals, parts_of
from .syntax import Call, Group, Name, Node, Number, Operation, Reference, Span, walk
from .time_windows import scalar, span_of, window_of


@dataclass(frozen=True)
class Scope:
    """What the names of one expression stand for during one evaluation."""

    text: str
    signals: Signals
    functions: Mapping[str, Function]
    constants: Mapping[str, Any]
    whole: "Scope | None" = None
    """The scope of the whole run, where this one is that of a part."""
    reduced: dict[int, Value] = field(default_factory=dict)
    """What calls of reducers gave, by the identity of the node."""

    def of(self, part: Part) -> "Scope":
        """The same for some points of the run."""
        whole, constants = self.whole or self, self.constants
        constants = {**constants, "time": part.time} if "time" in constants else constants
        return Scope(self.text, part, self.functions, constants, whole)

    def reduce(self, node: Call) -> Value:
        """The value of a call of a reducer, which always sees the whole run."""
        whole = self.whole or self
        if id(node) not in whole.reduced:
            whole.reduced[id(node)] = _reduce(node, whole)
        return whole.reduced[id(node)]

    def error(self, problem: str | Problem) -> ExpressionError:
        """An error that quotes the expression."""
        return ExpressionError(ExpressionError(problem).at(f"'{self.text}'"))

    @cached_property
    def names(self) -> frozenset[str]:
        """Recorded signals and parameters."""
        if self.whole is not None:
            return self.whole.names
        recorded, fixed = frozenset(self.signals.names()), self.signals.parameters
        return recorded | frozenset(fixed) if fixed else recorded

    def integer(self, node: Node) -> int:
        """The value of an index."""
        with np.errstate(all="ignore"):
            value = float(evaluate(node, self))
        if not value.is_integer():
            raise self.error(f"an index must be a whole number, not {value:g}")
        return int(value)

    def signal(self, name: str) -> Value:
        """A recorded signal (T,), else a parameter ()."""
        if name in self.signals.names():
            recorded = np.asarray(self.signals[name])
            if recorded.dtype.kind not in "bifu":
                raise self.error(f"'{name}' is a text; expressions work on numbers")
            return recorded
        value = self.signals.parameters[name]
        if isinstance(value, str):
            raise self.error(f"'{name}' is a text ('{value}'); expressions work on numbers")
        return np.asarray(value, dtype=np.float64)

    def reference(self, reference: Reference) -> Value:
        """One signal (T,), or the rows (n, T) of a slice; parameters alone make one column."""
        found = self.resolve(reference)
        if not found:
            raise self.error(unknown_signal(reference, self.names))
        values = [self.signal(name) for name in found]
        if not reference.stacked:
            return values[0]
        length = max(value.size for value in values)
        return np.stack([np.broadcast_to(value, (length,)) for value in values])

    def resolve(self, reference: Reference) -> list[str]:
        """The full names a reference stands for, in the order of their indices; empty when there are none."""
        full = ""
        spans: list[tuple[float, float]] = []
        for name, indices in reference.parts:
            texts = []
            for index in indices:
                if isinstance(index, Span):
                    first, last = (self.integer(end) if end else None for end in (index.first, index.last))
                    spans.append((-np.inf if first is None else first, np.inf if last is None else last))
                texts.append(":" if isinstance(index, Span) else str(self.integer(index)))
            full += ("." if full and name else "") + name + (f"[{','.join(texts)}]" if texts else "")
        if not spans:
            name = full if full in self.names else _otherwise_written(self.names).get(plainly(full), "")
            return [name] if name else []
        written = (
            re.escape(full).replace(",", ", *").replace(r"\[", r"\[ *").replace(r"\]", r" *\]")
        )  # blanks are no matter
        pattern = re.compile(written.replace(":", INDEX))
        found = [(tuple(map(int, match.groups())), match[0]) for match in map(pattern.fullmatch, self.names) if match]
        return [n for ks, n in sorted(found) if all(a <= k <= b for k, (a, b) in zip(ks, spans, strict=True))]


@lru_cache(maxsize=4)
def _otherwise_written(names: frozenset[str]) -> dict[str, str]:
    """Names of elements with blanks or with several pairs of brackets, by how else they may be written."""
    return {plainly(name): name for name in names if "[" in name and (" " in name or "][" in name)}


def unknown_signal(reference: Reference, names: Collection[str]) -> Problem:
    """What to say about a reference that stands for nothing."""
    family = re.escape(re.sub(r"\[[^\]]*\]", "[:]", reference.text)).replace(r":\]", r"[-\d, ]+\]")
    near = [name for name in names if re.fullmatch(family, name)]
    if near:
        near.sort(key=lambda name: [(len(k), k) for k in re.findall(r"-?\d+", name)])
        return Problem("", f"there is no '{reference.text}'", f"there are '{near[0]}' to '{near[-1]}'")
    written = re.findall(r"\[[^\]]*\]", reference.text)

    def as_written(name: str) -> str:
        indices = iter(written)
        return re.sub(r"\[[^\]]*\]", lambda _: next(indices, "[i]"), name)

    nearest = suggestion(reference.text, {as_written(name) for name in names}) or "'describe' lists an instance"
    return Problem("", f"there is no signal or parameter '{reference.text}'", nearest)


def evaluate(node: Node, scope: Scope) -> Value:  # noqa: PLR0911 (one a kind of node)
    """The value of one node: a number, or an array (T,) or (n, T)."""
    match node:
        case Number(value=value):
            return np.asarray(value)
        case Name(name=name):
            if name not in scope.constants:
                raise scope.error(Problem("", f"'{name}' is not known here", suggestion(name, scope.constants)))
            return np.asarray(scope.constants[name])
        case Reference():
            return scope.reference(node)
        case Call(name=name, arguments=arguments, keywords=keywords):
            if problem := call_problem(node, scope.functions):
                raise scope.error(problem)
            function = scope.functions[name]
            if function.reduces:
                return scope.reduce(node)
            values = [_argument(argument, scope) for argument in arguments]
            named = dict(zip(keywords, values[len(values) - len(keywords) :], strict=True))
            first = [scope.signals] if function.takes_signals else []
            return np.asarray(function.call(*first, *values[: len(values) - len(keywords)], **named))
        case Operation(operator="if", operands=(condition, then, otherwise)):
            return where(evaluate(condition, scope), evaluate(then, scope), evaluate(otherwise, scope))
        case Operation(operator=operator, operands=operands):
            values = [evaluate(operand, scope) for operand in operands]
            if operator in ARITHMETIC:  # on booleans NumPy's would be logical
                return np.asarray(ARITHMETIC[operator](*(np.asarray(value, dtype=np.float64) for value in values)))
            result = values[0] if len(values) > 1 else logical(LOGIC[operator], values[0])
            for value in values[1:]:
                result = logical(LOGIC[operator], result, value)
            return result
    raise scope.error("a list is only understood as an argument")


def reach(node: Node) -> int:
    """How many points ahead an expression looks at most."""
    return sum(isinstance(part, Call) and part.name == "at_sample" for part in walk(node))


def _reduce(node: Call, scope: Scope) -> Value:
    """Show a reducer the whole run, part by part."""
    function = scope.functions[node.name]
    plain = len(node.arguments) - len(node.keywords)
    signature = function.arguments
    named = dict(zip(node.keywords, node.arguments[plain:], strict=True))
    given = signature.bind(*node.arguments[:plain], **named).arguments
    fixed = {
        name: scalar(_argument(argument, scope), f"the {name} of {node.name}")
        for name, argument in given.items()
        if signature.parameters[name].annotation is float
    }
    bounds = {name: _argument(given[name], scope) if name in given else None for name in WINDOWS["span"]}
    span = span_of(scope.signals, **bounds, half_open=function.window == "phase")
    varying = {name: given[name] for name in given if name not in fixed and name not in bounds}
    fold: Fold | None = None
    for part in parts_of(scope.signals, reach(node)):
        inside = scope.of(part)
        rows, new = function.call(span, **fixed, **{name: _argument(x, inside) for name, x in varying.items()})
        fold = new if fold is None else fold
        fold.see(window_of(part, rows, span))
    if fold is None:
        raise WindowError(Problem("", "no recorded point lies in the window", "widen it, or record more often"))
    return np.asarray(fold.value())


def _argument(node: Node, scope: Scope) -> Any:
    if isinstance(node, Group):
        return [_argument(item, scope) for item in node.items]
    return np.asarray(evaluate(node, scope), dtype=np.float64)
