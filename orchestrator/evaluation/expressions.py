"""Expressions over recorded signals, such as `abs(train[i].speed - target.value) <= 1`: what they mean.

Indices are 1-based and slices include both ends. NaN survives comparisons and logic, so that it can never pass as
"false". The syntax stands in `syntax`.
"""

import inspect
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, WindowError
from ..names import SignalName
from ..problems import Problem, suggestion
from .syntax import Call, Group, Name, Node, Number, Operation, Reference, Span, read, walk

CONSTANTS = {"pi": np.pi, "inf": np.inf, "nan": np.nan, "true": True, "false": False}
MAX_INDEX = 20_000
"""How far `i` is counted, beyond the number of names: a lone `x[999999999]` of somebody's FMU is not worth the time."""
_INDEX = r"(\d{1,9})(?!\d)"  # Python does not convert numbers of thousands of digits
Value: TypeAlias = NDArray[Any]
R = TypeVar("R")


class Signals(Protocol):
    """What a run leaves behind, as far as expressions care."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Recorded points [s], shape (T,)."""

    @property
    def step(self) -> float:
        """Communication step [s]."""

    @property
    def completed(self) -> bool:
        """False when the run ended before `stop_time`."""

    @property
    def stop_time(self) -> float:
        """The planned end [s]."""

    @property
    def units(self) -> Mapping[str, str]:
        """Unit by full name."""

    @property
    def parameters(self) -> Mapping[str, float | int | bool | str]:
        """Fixed values by full name."""

    def names(self) -> Collection[str]:
        """Recorded signals by full name: `train[1].position`, `consist[2].force[3]`."""

    def __getitem__(self, name: str, /) -> NDArray[Any]: ...


@dataclass(frozen=True)
class Function:
    """A function expressions may call. With `takes_signals` its first argument is the run, which the user omits."""

    call: Callable[..., Any]
    unit: str = ""  # of the result: a unit, "same" as the first argument, "per s" of it, or unknown
    takes_signals: bool = False
    reduces: bool = False  # over time, to one number

    @cached_property
    def arguments(self) -> inspect.Signature:
        """The arguments a user writes."""
        if isinstance(self.call, np.ufunc):  # these carry no signature of their own
            names = ("x",) if self.call.nin == 1 else ("a", "b")
            return inspect.Signature([inspect.Parameter(name, inspect.Parameter.POSITIONAL_ONLY) for name in names])
        signature = inspect.signature(self.call)
        return signature.replace(parameters=list(signature.parameters.values())[int(self.takes_signals) :])


def _logical(operation: Callable[..., Value], *operands: Value) -> Value:
    """A comparison or logical operation whose result is NaN wherever an operand is."""
    numbers = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in operands))
    unknown = np.logical_or.reduce([np.isnan(x) for x in numbers])
    result = operation(*numbers)
    return np.where(unknown, np.nan, result) if unknown.any() else np.asarray(result)


def where(condition: Value, then: Value, otherwise: Value) -> Value:
    """`then` where the condition holds, `otherwise` elsewhere, NaN where the condition is NaN."""
    unknown = np.isnan(np.asarray(condition, dtype=np.float64))
    result = np.where(condition, then, otherwise)
    return np.where(unknown, np.nan, result) if unknown.any() else result


ARITHMETIC: dict[str, Callable[..., Value]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.true_divide, "**": np.power,
    "negative": np.negative, "positive": np.positive,
}  # fmt: skip
LOGIC: dict[str, Callable[..., Value]] = {
    "<": np.less, "<=": np.less_equal, ">": np.greater, ">=": np.greater_equal, "==": np.equal, "!=": np.not_equal,
    "and": np.logical_and, "or": np.logical_or, "not": np.logical_not,
}  # fmt: skip
ELEMENTWISE: dict[str, Function] = {
    "abs": Function(np.abs, unit="same"),
    "sign": Function(np.sign),
    "floor": Function(np.floor),
    "sqrt": Function(np.sqrt),
    "exp": Function(np.exp),
    "log": Function(np.log),
    "sin": Function(np.sin),
    "cos": Function(np.cos),
    "tan": Function(np.tan),
    "tanh": Function(np.tanh),
    "minimum": Function(np.minimum, unit="same"),
    "maximum": Function(np.maximum, unit="same"),
    "clip": Function(lambda x, low, high: np.minimum(np.maximum(x, low), high), unit="same"),
    "where": Function(where),
}


def parse(text: str, functions: Mapping[str, Function] = ELEMENTWISE) -> "Expression":
    """Read an expression. Names and functions are looked up later, by `Expression.check`.

    Raises:
        ExpressionError: for anything that is not an expression of this language, with the column and the remedy.
    """
    return Expression(*read(text), functions)


@dataclass(frozen=True)
class Scope:
    """What the names of one expression stand for during one evaluation."""

    text: str
    signals: Signals
    functions: Mapping[str, Function]
    constants: Mapping[str, Any]

    def error(self, problem: str | Problem) -> ExpressionError:
        """An error that quotes the expression."""
        return ExpressionError(ExpressionError(problem).at(f"'{self.text}'"))

    @cached_property
    def names(self) -> frozenset[str]:
        """Recorded signals and parameters."""
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
        names: list[str] = []
        spans: list[tuple[float, float]] = []
        for name, indices in reference.parts:
            texts = []
            for index in indices:
                if isinstance(index, Span):
                    first, last = (self.integer(end) if end else None for end in (index.first, index.last))
                    spans.append((1 if first is None else first, np.inf if last is None else last))
                texts.append(":" if isinstance(index, Span) else str(self.integer(index)))
            names.append(name + (f"[{','.join(texts)}]" if texts else ""))
        full = ".".join(names)
        if not spans:
            return [full] if full in self.names else []
        pattern = re.compile(re.escape(full).replace(":", _INDEX))
        found = [(tuple(map(int, match.groups())), match[0]) for match in map(pattern.fullmatch, self.names) if match]
        return [n for ks, n in sorted(found) if all(a <= k <= b for k, (a, b) in zip(ks, spans, strict=True))]


def unknown_signal(reference: Reference, names: Collection[str]) -> Problem:
    """What to say about a reference that stands for nothing."""
    family = re.escape(re.sub(r"\[[^\]]*\]", "[:]", reference.text)).replace(r":\]", r"[\d,]+\]")
    near = [name for name in names if re.fullmatch(family, name)]
    if near:
        near.sort(key=lambda name: [(len(k), k) for k in re.findall(r"\d+", name)])
        return Problem("", f"there is no '{reference.text}'", f"there are '{near[0]}' to '{near[-1]}'")
    written = re.findall(r"\[[^\]]*\]", reference.text)

    def as_written(name: str) -> str:
        indices = iter(written)
        return re.sub(r"\[[^\]]*\]", lambda _: next(indices, "[i]"), name)

    nearest = suggestion(reference.text, {as_written(name) for name in names}) or "'describe' lists an instance"
    return Problem("", f"there is no signal or parameter '{reference.text}'", nearest)


def call_problem(call: Call, functions: Mapping[str, Function]) -> Problem | None:
    """What is wrong with a call: an unknown function or argument, too many or too few of them, or a list among them."""
    if call.name not in functions:
        nearest = suggestion(call.name, functions) or f"there are {', '.join(sorted(functions))}"
        return Problem("", f"unknown function '{call.name}'", nearest)
    signature = functions[call.name].arguments
    for word in call.keywords:
        if word not in signature.parameters:
            return Problem("", f"{call.name} has no argument '{word}'", suggestion(word, signature.parameters))
    plain = len(call.arguments) - len(call.keywords)
    named = dict(zip(call.keywords, call.arguments[plain:], strict=True))
    try:
        given = signature.bind(*call.arguments[:plain], **named).arguments
    except TypeError as error:
        return Problem(f"{call.name}({', '.join(signature.parameters)})", str(error))
    lists = [word for word, argument in given.items() if isinstance(argument, Group) and word != "outside"]
    return Problem(call.name, f"{lists[0]} takes a signal or a number, not a list") if lists else None


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
            result = values[0] if len(values) > 1 else _logical(LOGIC[operator], values[0])
            for value in values[1:]:
                result = _logical(LOGIC[operator], result, value)
            return result
    raise scope.error("a list is only understood as an argument")


def _argument(node: Node, scope: Scope) -> Any:
    if isinstance(node, Group):
        return [_argument(item, scope) for item in node.items]
    return np.asarray(evaluate(node, scope), dtype=np.float64)


class _Rehearsal:
    """Signals that have names but only made-up values: what can go wrong with shapes goes wrong before the run."""

    step, completed, stop_time = 1.0, True, 2.0
    time: NDArray[np.float64] = np.arange(3.0)

    def __init__(self, names: Collection[str]) -> None:
        self._names = frozenset(names)
        self.units: dict[str, str] = {}
        self.parameters: dict[str, float | int | bool | str] = {}

    def names(self) -> frozenset[str]:
        return self._names

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        return np.ones(3)


@dataclass(frozen=True)
class Expression:
    """A parsed expression. `names` of the methods are the recorded signals and the parameters together."""

    text: str
    tree: Node
    functions: Mapping[str, Function] = field(default_factory=lambda: ELEMENTWISE, repr=False, compare=False)

    @cached_property
    def references(self) -> tuple[Reference, ...]:
        """Every signal or family of signals it mentions, in reading order."""
        return tuple(node for node in walk(self.tree) if isinstance(node, Reference))

    @cached_property
    def uses_index(self) -> bool:
        """Whether the free index `i` occurs."""
        bare = any(isinstance(node, Name) and node.name == "i" for node in walk(self.tree))
        return bare or any(reference.uses_index for reference in self.references)

    def calls(self, name: str) -> bool:
        """Whether the function of this name is called somewhere."""
        return any(isinstance(node, Call) and node.name == name for node in walk(self.tree))

    def count(self, names: Collection[str]) -> int:
        """The number of instances of the first array it mentions: what `count` stands for."""
        array = next((reference.array for reference in self.references if reference.array), "")
        numbers = (re.match(rf"{re.escape(array)}\[{_INDEX}", name) for name in names)
        return max((int(match[1]) for match in numbers if match), default=0)

    def indices(self, names: Collection[str]) -> tuple[int, ...]:
        """Every i >= 1 for which all references exist; () when the expression has no free index."""
        if not self.uses_index or not any(reference.uses_index for reference in self.references):
            return ()
        largest = max((int(k) for name in names for k in re.findall(rf"\[{_INDEX}", name)), default=0)
        last = min(2 * largest + 1, MAX_INDEX + len(names))
        rehearsal, count = _Rehearsal(names), self.count(names)
        scopes = ((i, self._scope(rehearsal, {"i": i, "count": count})) for i in range(1, last + 1))
        return tuple(i for i, scope in scopes if all(scope.resolve(reference) for reference in self.references))

    def instances(self, names: Collection[str]) -> tuple[int | None, ...]:
        """The indices to evaluate it for: `indices`, or (None,) when it has no free index."""
        return self.indices(names) if self.uses_index else (None,)

    def resolve(self, names: Collection[str], index: int | None = None) -> list[list[str]]:
        """For each reference the full names it stands for."""
        scope = self._scope(_Rehearsal(names), {} if index is None else {"i": index})
        return [scope.resolve(reference) for reference in self.references]

    def check(self, names: Collection[str], constants: Collection[str] = ()) -> list[Problem]:
        """Every problem that can be found before a run, each with the column and the nearest valid name.

        `constants` are further bare names the expression may use, such as the variable of a function plot.
        """
        known = {*CONSTANTS, *constants, "time", "count", *(["i"] if self.references else [])}
        try:
            problems = [
                problem.at(f"'{self.text}', column {node.column}")
                for node in walk(self.tree)
                if not isinstance(node, Number | Group | Operation) and (problem := self._problem(node, names, known))
            ]
        except ExpressionError as error:  # an index beyond all numbers
            return error.problems
        if problems:
            return problems
        instances = (None,) if "i" in constants else self.instances(names)
        if not instances:
            return [Problem(f"'{self.text}'", "there is no i for which all of its signals exist", "mend the indices")]
        try:
            self.evaluate(_Rehearsal(names), instances[0], **dict.fromkeys(constants, 1.0))
        except WindowError:
            pass  # the rehearsal is shorter than the run
        except ExpressionError as error:
            return error.problems
        return []

    def _problem(self, node: Name | Reference | Call, names: Collection[str], known: Collection[str]) -> Problem | None:
        match node:
            case Name(name=name) if name not in known:
                inside = next((full for full in names if name == SignalName.parse(full).group), "")
                remedy = f"'{name}' is an instance: name a variable, as in '{inside}'" if inside else ""
                remedy = "an index stands in brackets, as in train[i].speed" if name == "i" else remedy
                return Problem("", f"unknown name '{name}'", remedy or suggestion(name, known))
            case Call():
                return call_problem(node, self.functions)
            case Reference() if not self._exists(node, names):
                return unknown_signal(node, names)
        return None

    def _exists(self, reference: Reference, names: Collection[str]) -> bool:
        """Whether it stands for something, for some i at least."""
        alone = Expression(reference.text, reference)
        return any(any(alone.resolve(names, index)) for index in alone.instances(names))

    def _scope(self, signals: Signals, constants: Mapping[str, Any]) -> Scope:
        every = {**CONSTANTS, "time": signals.time, **constants}
        if "count" in self.text and "count" not in every:
            every["count"] = self.count([*signals.names(), *signals.parameters])
        return Scope(self.text, signals, self.functions, every)

    def apply(
        self, rule: Callable[[Node, Scope], R], signals: Signals, index: int | None = None, **constants: Any
    ) -> R:
        """Evaluate under another rule than the usual one (a requirement asks for slack instead of truth)."""
        scope = self._scope(signals, constants if index is None else {**constants, "i": index})
        try:
            with np.errstate(all="ignore"):
                return rule(self.tree, scope)
        except ExpressionError as error:
            located = [problem if problem.place else problem.at(f"'{self.text}'") for problem in error.problems]
            raise type(error)(located) from None
        except ValueError as error:
            reason = f"its parts differ in their number of rows ({error})"
            raise scope.error(Problem("", reason, "combine arrays of one size")) from None

    def evaluate(self, signals: Signals, index: int | None = None, **constants: Any) -> float | Value:
        """The value: a number, or an array (T,), or (n, T) with one row per signal of a slice.

        Args:
            signals: the run.
            index: the value of the free index `i`.
            constants: further names with their numbers or arrays (T,), overriding `count`.

        Raises:
            ExpressionError: an unknown name, rows that do not match, a text parameter.
            WindowError: a reducer's window is not covered by the recorded points.
        """
        value = self.apply(evaluate, signals, index, **constants)
        return value.item() if value.ndim == 0 else value


def evaluate_constant(text: str, **constants: float | bool) -> float | bool:
    """The value of an expression without signals, such as the start value `"i < count"`; `constants` give `i` etc.

    Raises:
        ExpressionError: it cannot be read, mentions a signal or an unknown name, or has no value (0 / 0).
    """
    expression = parse(text)
    if expression.references:
        signal = expression.references[0].text
        raise ExpressionError(Problem(f"'{text}'", f"a signal such as '{signal}' has no value before the run"))
    names = {*CONSTANTS, *constants}
    for node in walk(expression.tree):
        if isinstance(node, Name) and node.name not in names:
            nearest = suggestion(node.name, names)
            raise ExpressionError(Problem(f"'{text}', column {node.column}", f"unknown name '{node.name}'", nearest))
    problems = expression.check((), names)
    if problems:
        raise ExpressionError(problems)
    value = expression.evaluate(_Rehearsal(()), None, **constants)
    if isinstance(value, np.ndarray) or np.isnan(value):
        raise ExpressionError(f"'{text}' has no value here (0 / 0, or the root of a negative number)")
    return value
