"""Expressions over recorded signals, such as `abs(train[i].speed - target.value) <= 1`.

The syntax is a subset of Python's, read by Python's parser and rebuilt from a whitelist into the few node types below;
nothing is ever executed, so a scenario from a stranger cannot run code. Indices are 1-based and slices include both
ends. NaN survives comparisons and logic, so that it can never pass as "false".

Longer than the files around it: nodes and reader come first (up to `parse`), then their meaning (from `Scope`).
"""

import ast
import inspect
import re
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import ExpressionError, WindowError, did_you_mean

MAX_LENGTH = 1000  # characters: Python's own parser may exhaust the C stack on monstrous input
MAX_DEPTH = 100
CONSTANTS = {"pi": np.pi, "inf": np.inf, "nan": np.nan, "true": True, "false": False}
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


@dataclass(frozen=True)
class Number:
    """A number, `true` or `false`."""

    value: float | bool


@dataclass(frozen=True)
class Name:
    """A bare name: a constant, `i`, `count`, `time`."""

    name: str
    column: int


@dataclass(frozen=True)
class Span:
    """A slice of an index: both ends included, None where open."""

    first: "Node | None"
    last: "Node | None"


@dataclass(frozen=True)
class Reference:
    """A signal, or a family of signals: `parts` are its dotted names, each with the indices that follow it."""

    text: str
    column: int
    parts: tuple[tuple[str, tuple["Node | Span", ...]], ...]

    @property
    def indices(self) -> "tuple[Node | Span, ...]":
        """All its indices, left to right."""
        return tuple(index for _, indices in self.parts for index in indices)

    @property
    def stacked(self) -> bool:
        """Whether it stands for several signals, one a row."""
        return any(isinstance(index, Span) for index in self.indices)

    @property
    def uses_index(self) -> bool:
        """Whether the free index `i` occurs in an index."""
        nodes = [end for x in self.indices for end in ((x.first, x.last) if isinstance(x, Span) else (x,)) if end]
        return any(isinstance(n, Name) and n.name == "i" for node in nodes for n in walk(node))

    @property
    def array(self) -> str:
        """The name before its first index, or nothing: `train` of `train[i].speed`."""
        names = [name for name, _ in self.parts]
        return next((".".join(names[: k + 1]) for k, part in enumerate(self.parts) if part[1]), "")


@dataclass(frozen=True)
class Group:
    """A list; only as an argument, for time windows."""

    items: tuple["Node", ...]


@dataclass(frozen=True)
class Operation:
    """Arithmetic, `not`, one comparison, `and`, `or`, `if` (condition, then, else), with its operands."""

    operator: str
    operands: tuple["Node", ...]


@dataclass(frozen=True)
class Call:
    """A call; the last `len(keywords)` arguments were given by name."""

    name: str
    arguments: tuple["Node", ...]
    keywords: tuple[str, ...]
    column: int


Node: TypeAlias = Number | Name | Reference | Group | Operation | Call


def walk(node: Node) -> Iterator[Node]:
    """The node and everything below it in reading order, but not the indices of references."""
    yield node
    match node:
        case Group(items=children) | Operation(operands=children) | Call(arguments=children):
            for child in children:
                yield from walk(child)


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

_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**", ast.USub: "negative", ast.UAdd: "positive",
    ast.Not: "not", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.And: "and", ast.Or: "or",
}  # fmt: skip
_REMEDIES: dict[type[ast.AST], str] = {
    ast.BitAnd: "write 'and'", ast.BitOr: "write 'or'", ast.Invert: "write 'not'", ast.BitXor: "a power is '**'",
    ast.FloorDiv: "write floor(a / b)", ast.Mod: "write a - b * floor(a / b)",
}  # fmt: skip


class _Reader:
    """Rebuilds Python's syntax tree of one text as ours, refusing everything that is not on the list."""

    def __init__(self, text: str) -> None:
        self.text = text

    def column(self, node: ast.expr) -> int:
        return len(self.text.encode()[: node.col_offset].decode(errors="replace")) + 1

    def error(self, node: ast.expr, message: str) -> ExpressionError:
        return ExpressionError(f"'{self.text}', column {self.column(node)}: {message}")

    def operator(self, node: ast.expr, kind: ast.AST) -> str:
        if type(kind) not in _OPERATORS:
            remedy = _REMEDIES.get(type(kind), "there are + - * / ** < <= > >= == != and or not")
            raise self.error(node, f"this operator is not understood; {remedy}")
        return _OPERATORS[type(kind)]

    def read(self, node: ast.expr, depth: int = 0) -> Node:  # noqa: PLR0911 (one a kind of node)
        if depth > MAX_DEPTH:
            raise self.error(node, f"nested more than {MAX_DEPTH} levels deep; split the expression")
        deeper = depth + 1
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return Number(value if isinstance(value, bool) else float(value))
            case ast.Name(id=name):
                return Name(name, self.column(node))
            case ast.Attribute() | ast.Subscript():
                return self.reference(node, deeper)
            case ast.UnaryOp(op=kind, operand=operand):
                return Operation(self.operator(node, kind), (self.read(operand, deeper),))
            case ast.BinOp(left=left, op=kind, right=right):
                return Operation(self.operator(node, kind), (self.read(left, deeper), self.read(right, deeper)))
            case ast.BoolOp(op=kind, values=values):
                return Operation(self.operator(node, kind), tuple(self.read(value, deeper) for value in values))
            case ast.Compare(left=left, ops=kinds, comparators=others):
                ends = [self.read(end, deeper) for end in (left, *others)]
                signs = [self.operator(node, kind) for kind in kinds]
                links = [Operation(sign, (a, b)) for sign, a, b in zip(signs, ends, ends[1:], strict=False)]
                return links[0] if len(links) == 1 else Operation("and", tuple(links))
            case ast.IfExp(test=test, body=body, orelse=otherwise):
                return Operation("if", tuple(self.read(part, deeper) for part in (test, body, otherwise)))
            case ast.Call():
                return self.call(node, deeper)
            case ast.Constant(value=str()):
                raise self.error(node, 'text is only understood in signal("...")')
            case ast.List() | ast.Tuple():
                raise self.error(node, "a list is only understood as an argument, as in outside = [210, 240]")
        raise self.error(node, "write numbers, signals, + - * / **, comparisons, and/or/not, if/else and functions")

    def call(self, node: ast.Call, depth: int) -> Node:
        if not isinstance(node.func, ast.Name):
            raise self.error(node, "a function is called by its plain name, as in max(train[1].speed)")
        if node.func.id == "signal":
            match node.args:
                case [ast.Constant(value=str(name))] if not node.keywords:
                    return Reference(name, self.column(node), ((name, ()),))
            raise self.error(node, 'signal takes one name in quotes, exactly as recorded: signal("plant.der(x)")')
        keywords = tuple(keyword.arg for keyword in node.keywords if keyword.arg is not None)
        if len(keywords) < len(node.keywords) or any(isinstance(argument, ast.Starred) for argument in node.args):
            raise self.error(node, "* and ** arguments are not understood; write the arguments out")
        arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
        return Call(node.func.id, tuple(self.argument(x, depth) for x in arguments), keywords, self.column(node))

    def argument(self, node: ast.expr, depth: int) -> Node:
        if isinstance(node, ast.List | ast.Tuple) and depth <= MAX_DEPTH:
            return Group(tuple(self.argument(item, depth + 1) for item in node.elts))
        return self.read(node, depth)

    def reference(self, node: ast.expr, depth: int) -> Reference:
        parts: list[tuple[str, tuple[Node | Span, ...]]] = []
        text, indices, inner = "", tuple[Node | Span, ...](), node
        while True:  # from the last name to the first
            match inner:
                case ast.Subscript(value=value, slice=index) if not indices:
                    indices = self.indices(index, depth)
                    text, inner = f"[{ast.unparse(index).replace(' ', '')}]{text}", value
                case ast.Attribute(value=value, attr=name):
                    parts.insert(0, (name, indices))
                    text, indices, inner = f".{name}{text}", (), value
                case ast.Name(id=name):
                    return Reference(f"{name}{text}", self.column(node), ((name, indices), *parts))
                case _:
                    raise self.error(node, "a signal is written like train[i].speed or consist[1].force[2]")

    def indices(self, node: ast.expr, depth: int) -> tuple[Node | Span, ...]:
        items = node.elts if isinstance(node, ast.Tuple) and node.elts else [node]
        return tuple(self.span(x, depth) if isinstance(x, ast.Slice) else self.index(x, depth) for x in items)

    def span(self, node: ast.Slice, depth: int) -> Span:
        if node.step is not None:
            raise self.error(node.step, "a slice has no step; write train[2:] or train[1:3], both ends included")
        first, last = (self.index(end, depth) if end else None for end in (node.lower, node.upper))
        return Span(first, last)

    def index(self, node: ast.expr, depth: int) -> Node:
        index = self.read(node, depth)
        for part in walk(index):
            match part:
                case Number(value=value) if float(value).is_integer():
                    continue
                case Name(name="i" | "count") | Operation(operator="+" | "-" | "*" | "negative"):
                    continue
            raise self.error(node, "an index is a whole number, i, count or a sum of these, as in train[i-1].speed")
        return index


def parse(text: str, functions: Mapping[str, Function] = ELEMENTWISE) -> "Expression":
    """Read an expression. Names and functions are looked up later, by `Expression.check`.

    Raises:
        ExpressionError: for anything that is not an expression of this language, with the column and the remedy.
    """
    text = re.sub(r"\s", " ", text).strip()
    if not text:
        raise ExpressionError("an expression is empty; write a signal or a formula, such as train[1].speed")
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"'{text[:40]}...': longer than {MAX_LENGTH} characters; split the expression")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text, mode="eval")
        return Expression(text, _Reader(text).read(tree.body), functions)
    except ExpressionError:
        raise
    except SyntaxError as error:
        remedy = 'a name with other characters or a reserved word goes into signal("...")'
        raise ExpressionError(f"'{text}', column {error.offset or 1}: {error.msg}; {remedy}") from None
    except (RecursionError, MemoryError):
        raise ExpressionError(f"'{text}': nested too deeply; split the expression") from None
    except (ValueError, OverflowError) as error:
        raise ExpressionError(f"'{text}': {error}; write plain names and numbers") from None


@dataclass(frozen=True)
class Scope:
    """What the names of one expression stand for during one evaluation."""

    text: str
    signals: Signals
    functions: Mapping[str, Function]
    constants: Mapping[str, Any]

    def error(self, message: str) -> ExpressionError:
        """An error that quotes the expression."""
        return ExpressionError(f"'{self.text}': {message}")

    @cached_property
    def names(self) -> frozenset[str]:
        """Recorded signals and parameters."""
        recorded, fixed = frozenset(self.signals.names()), self.signals.parameters
        return recorded | frozenset(fixed) if fixed else recorded

    def integer(self, node: Node) -> int:
        """The value of an index."""
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
        return np.stack([np.broadcast_to(value, (max(value.size for value in values),)) for value in values])

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
        pattern = re.compile(re.escape(full).replace(":", r"(\d+)"))
        found = [(tuple(map(int, match.groups())), match[0]) for match in map(pattern.fullmatch, self.names) if match]
        return [n for ks, n in sorted(found) if all(a <= k <= b for k, (a, b) in zip(ks, spans, strict=True))]


def unknown_signal(reference: Reference, names: Collection[str]) -> str:
    """What to say about a reference that stands for nothing."""
    family = re.escape(re.sub(r"\[[^\]]*\]", "[:]", reference.text)).replace(":", r"[\d,]+")
    near = [name for name in names if re.fullmatch(family, name)]
    if near:
        near.sort(key=lambda name: [int(k) for k in re.findall(r"\d+", name)])
        return f"there is no '{reference.text}'; there are '{near[0]}' to '{near[-1]}'"
    written = re.findall(r"\[[^\]]*\]", reference.text)

    def as_written(name: str) -> str:
        indices = iter(written)
        return re.sub(r"\[[^\]]*\]", lambda _: next(indices, "[i]"), name)

    nearest = did_you_mean(reference.text, {as_written(name) for name in names}) or "; 'describe' lists an instance"
    return f"there is no signal or parameter '{reference.text}'{nearest}"


def call_problem(call: Call, functions: Mapping[str, Function]) -> str:
    """What is wrong with a call: an unknown function or argument, or too many or too few of them."""
    if call.name not in functions:
        nearest = did_you_mean(call.name, functions) or f"; there are {', '.join(sorted(functions))}"
        return f"unknown function '{call.name}'{nearest}"
    signature = functions[call.name].arguments
    for word in call.keywords:
        if word not in signature.parameters:
            return f"{call.name} has no argument '{word}'{did_you_mean(word, signature.parameters)}"
    try:
        signature.bind(*call.arguments[: len(call.arguments) - len(call.keywords)], **dict.fromkeys(call.keywords))
    except TypeError as error:
        return f"{call.name}({', '.join(signature.parameters)}): {error}"
    return ""


def evaluate(node: Node, scope: Scope) -> Value:  # noqa: PLR0911 (one a kind of node)
    """The value of one node: a number, or an array (T,) or (n, T)."""
    match node:
        case Number(value=value):
            return np.asarray(value)
        case Name(name=name):
            if name not in scope.constants:
                raise scope.error(f"'{name}' is not known here{did_you_mean(name, scope.constants)}")
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
        numbers = (re.match(re.escape(array) + r"\[(\d+)", name) for name in names)
        return max((int(match[1]) for match in numbers if match), default=0)

    def indices(self, names: Collection[str]) -> tuple[int, ...]:
        """Every i >= 1 for which all references exist; () when the expression has no free index."""
        if not self.uses_index or not any(reference.uses_index for reference in self.references):
            return ()
        largest = max((int(k) for name in names for k in re.findall(r"\[(\d+)", name)), default=0)
        rehearsal, count = _Rehearsal(names), self.count(names)
        scopes = ((i, self._scope(rehearsal, {"i": i, "count": count})) for i in range(1, 2 * largest + 2))
        return tuple(i for i, scope in scopes if all(scope.resolve(reference) for reference in self.references))

    def instances(self, names: Collection[str]) -> tuple[int | None, ...]:
        """The indices to evaluate it for: `indices`, or (None,) when it has no free index."""
        return self.indices(names) if self.uses_index else (None,)

    def resolve(self, names: Collection[str], index: int | None = None) -> list[list[str]]:
        """For each reference the full names it stands for."""
        scope = self._scope(_Rehearsal(names), {} if index is None else {"i": index})
        return [scope.resolve(reference) for reference in self.references]

    def check(self, names: Collection[str], constants: Collection[str] = ()) -> list[str]:
        """Every problem that can be found before a run, each with the column and the nearest valid name.

        `constants` are further bare names the expression may use, such as the variable of a function plot.
        """
        known = {*CONSTANTS, *constants, "time", "count", *(["i"] if self.references else [])}
        problems = [
            f"'{self.text}', column {node.column}: {problem}"
            for node in walk(self.tree)
            if not isinstance(node, Number | Group | Operation) and (problem := self._problem(node, names, known))
        ]
        if problems:
            return problems
        instances = (None,) if "i" in constants else self.instances(names)
        if not instances:
            return [f"'{self.text}': there is no i for which all of its signals exist; mend the indices"]
        try:
            self.evaluate(_Rehearsal(names), instances[0], **dict.fromkeys(constants, 1.0))
        except WindowError:
            pass  # the rehearsal is shorter than the run
        except ExpressionError as error:
            return error.problems
        return []

    def _problem(self, node: Name | Reference | Call, names: Collection[str], known: Collection[str]) -> str:
        match node:
            case Name(name=name) if name not in known:
                inside = next((full for full in names if re.match(re.escape(name) + r"[.\[]", full)), "")
                remedy = f"; '{name}' is an instance: name a variable, as in '{inside}'" if inside else ""
                remedy = "; an index stands in brackets, as in train[i].speed" if name == "i" else remedy
                return f"unknown name '{name}'{remedy or did_you_mean(name, known)}"
            case Call():
                return call_problem(node, self.functions)
            case Reference() if not self._exists(node, names):
                return unknown_signal(node, names)
        return ""

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
            located = [p if p.startswith(f"'{self.text}'") else f"'{self.text}': {p}" for p in error.problems]
            raise type(error)(located) from None
        except ValueError as error:
            reason = f"its parts differ in their number of rows ({error}); combine arrays of one size"
            raise scope.error(reason) from None

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
        raise ExpressionError(f"'{text}': a signal such as '{signal}' has no value before the run")
    names = {*CONSTANTS, *constants}
    for node in walk(expression.tree):
        if isinstance(node, Name) and node.name not in names:
            nearest = did_you_mean(node.name, names)
            raise ExpressionError(f"'{text}', column {node.column}: unknown name '{node.name}'{nearest}")
    problems = expression.check((), names)
    if problems:
        raise ExpressionError(problems)
    value = expression.evaluate(_Rehearsal(()), None, **constants)
    if isinstance(value, np.ndarray) or np.isnan(value):
        raise ExpressionError(f"'{text}' has no value here (0 / 0, or the root of a negative number)")
    return value
