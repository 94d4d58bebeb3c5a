"""The syntax of expressions: a subset of Python's, rebuilt from a whitelist into a few node types.

Python's parser reads the text and nothing is ever executed, so a scenario from a stranger cannot run code. What the
nodes mean stands in `expressions`.
"""

import ast
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from ..errors import ExpressionError
from ..problems import Problem

MAX_LENGTH = 1000  # characters: Python's own parser may exhaust the C stack on monstrous input
MAX_DEPTH = 100


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
    """A signal, or a family of signals: `parts` are its dotted names, each with the indices that follow it.

    A second pair of brackets (`n[1][2]`) is a part without a name.
    """

    text: str
    column: int
    parts: tuple[tuple[str, tuple["Node | Span", ...]], ...]

    @cached_property
    def key(self) -> tuple[str, bool]:
        """The same for references that stand for the same."""
        return self.text, bool(self.indices)

    @property
    def indices(self) -> "tuple[Node | Span, ...]":
        """All its indices, left to right."""
        return tuple(index for _, indices in self.parts for index in indices)

    @cached_property
    def stacked(self) -> bool:
        """Whether it stands for several signals, one a row."""
        return any(isinstance(index, Span) for index in self.indices)

    @cached_property
    def uses_index(self) -> bool:
        """Whether the free index `i` occurs in an index."""
        return _says_i(self.indices)

    @cached_property
    def counts_instances(self) -> bool:
        """Whether `i` occurs in the index of the instance."""
        return _says_i(self.parts[0][1])

    @cached_property
    def array(self) -> str:
        """The name before its first index, or nothing: `train` of `train[i].speed`."""
        names = [name for name, _ in self.parts]
        return next((".".join(names[: k + 1]) for k, part in enumerate(self.parts) if part[1]), "")


def _says_i(indices: "tuple[Node | Span, ...]") -> bool:
    nodes = [end for x in indices for end in ((x.first, x.last) if isinstance(x, Span) else (x,)) if end]
    return any(isinstance(n, Name) and n.name == "i" for node in nodes for n in walk(node))


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


@dataclass(frozen=True)
class Temporal:
    """A word of temporal logic with its operands, such as `eventually[0, 30] (gap >= 15)`.

    `interval` has the first and the last time that it looks at, counted from now in s; None is all the time there is.
    """

    word: str
    operands: tuple["Node", ...]
    interval: tuple["Node", "Node"] | None
    column: int


Node: TypeAlias = Number | Name | Reference | Group | Operation | Call | Temporal


def walk(node: Node) -> Iterator[Node]:
    """The node and everything below it in reading order, but not the indices of references."""
    yield node
    match node:
        case Group(items=children) | Operation(operands=children) | Call(arguments=children):
            for child in children:
                yield from walk(child)
        case Temporal(operands=operands, interval=interval):
            for child in (*(interval or ()), *operands):
                yield from walk(child)


def uses_index(node: Node) -> bool:
    """Whether the free index `i` occurs."""
    return any(
        part.name == "i" if isinstance(part, Name) else isinstance(part, Reference) and part.uses_index
        for part in walk(node)
    )


_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**", ast.USub: "negative", ast.UAdd: "positive",
    ast.Not: "not", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.And: "and", ast.Or: "or",
}  # fmt: skip
_REMEDIES: dict[type[ast.AST], str] = {
    ast.BitAnd: "write 'and'", ast.BitOr: "write 'or'", ast.Invert: "write 'not'", ast.BitXor: "a power is '**'",
    ast.FloorDiv: "write floor(a / b)", ast.Mod: "write a - b * floor(a / b)",
}  # fmt: skip


HOLE = "_"
"""What stands in a text in place of a formula that was read before."""
CHANGES = ("rise", "fall")


class Reader:
    """Rebuilds Python's syntax tree of one text as ours, refusing everything that is not on the list.

    Args:
        text: what is shown where something is wrong.
        source: what is read of it, which begins at the character `start`.
        holes: the formulas of which only a `HOLE` is left, by their columns in the text.
    """

    def __init__(self, text: str, source: str, start: int = 0, holes: Mapping[int, Node] | None = None) -> None:
        self.text, self.source, self.start, self.holes = text, source, start, holes or {}

    def tree(self) -> ast.expr:
        """Python's.

        Raises:
            ExpressionError: it is none, with the column and the remedy.
        """
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return ast.parse(self.source, mode="eval").body
        except SyntaxError as error:
            remedy = 'a name with other characters or a reserved word goes into signal("...")'
            place = f"'{self.text}', column {(error.offset or 1) + self.start}"
            raise ExpressionError(Problem(place, error.msg, remedy)) from None

    def column(self, node: ast.expr) -> int:
        """Where a node stands in the text, from 1 on."""
        return len(self.source.encode()[: node.col_offset].decode(errors="replace")) + 1 + self.start

    def error(self, node: ast.expr, message: str, remedy: str = "") -> ExpressionError:
        """An error that quotes the text."""
        return ExpressionError(Problem(f"'{self.text}', column {self.column(node)}", message, remedy))

    def operator(self, node: ast.expr, kind: ast.AST) -> str:
        """How an operator is written."""
        if type(kind) not in _OPERATORS:
            remedy = _REMEDIES.get(type(kind), "there are + - * / ** < <= > >= == != and or not")
            raise self.error(node, "this operator is not understood", remedy)
        return _OPERATORS[type(kind)]

    def read(self, node: ast.expr, depth: int = 0) -> Node:  # noqa: PLR0911 (one a kind of node)
        """A node and all below it."""
        if depth > MAX_DEPTH:
            raise self.error(node, f"nested more than {MAX_DEPTH} levels deep", "split the expression")
        deeper = depth + 1
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return Number(value if isinstance(value, bool) else float(value))
            case ast.Name(id=name):
                return self.holes.get(self.column(node)) or Name(name, self.column(node))
            case ast.Attribute() | ast.Subscript():
                return self.reference(node, deeper)
            case ast.UnaryOp(op=kind, operand=operand):
                return Operation(self.operator(node, kind), (self.read(operand, deeper),))
            case ast.BinOp(left=left, op=kind, right=right):
                return Operation(self.operator(node, kind), (self.read(left, deeper), self.read(right, deeper)))
            case ast.BoolOp(op=kind, values=values):
                return Operation(self.operator(node, kind), tuple(self.read(value, deeper) for value in values))
            case ast.Compare():
                return self.comparison(node, deeper)
            case ast.IfExp(test=test, body=body, orelse=otherwise):
                return Operation("if", tuple(self.read(part, deeper) for part in (test, body, otherwise)))
            case ast.Call():
                return self.call(node, deeper)
            case ast.Constant(value=str()):
                raise self.error(node, 'text is only understood in signal("...")')
            case ast.List() | ast.Tuple():
                raise self.error(node, "a list is only understood as an argument, as in outside = [210, 240]")
        raise self.error(node, "write numbers, signals, + - * / **, comparisons, and/or/not, if/else and functions")

    def comparison(self, node: ast.Compare, depth: int) -> Node:
        """One comparison, or a chain as `and`: that evaluates what is inside twice, so no chain may stand there."""
        inner = [part for end in node.comparators[:-1] for part in ast.walk(end)]
        if any(isinstance(part, ast.Compare) and len(part.ops) > 1 for part in inner):
            raise self.error(node, "a chain of comparisons stands inside another", "part them with 'and'")
        ends = [self.read(end, depth) for end in (node.left, *node.comparators)]
        signs = [self.operator(node, kind) for kind in node.ops]
        links = [Operation(sign, (a, b)) for sign, a, b in zip(signs, ends, ends[1:], strict=False)]
        return links[0] if len(links) == 1 else Operation("and", tuple(links))

    def call(self, node: ast.Call, depth: int) -> Node:
        """A call, a signal by its full name, or a change."""
        if not isinstance(node.func, ast.Name):
            raise self.error(node, "a function is called by its plain name, as in max(train[1].speed)")
        if node.func.id == "signal":
            match node.args:
                case [ast.Constant(value=str(name))] if not node.keywords:
                    return Reference(name, self.column(node), ((name, ()),))
            raise self.error(node, 'signal takes one name in quotes, exactly as recorded: signal("plant.der(x)")')
        if node.func.id in CHANGES:
            if len(node.args) != 1 or node.keywords:
                raise self.error(node, f"{node.func.id} takes one condition", "as in rise(train[1].speed > 20)")
            return Temporal(node.func.id, (self.read(node.args[0], depth),), None, self.column(node))
        keywords = tuple(keyword.arg for keyword in node.keywords if keyword.arg is not None)
        if len(keywords) < len(node.keywords) or any(isinstance(argument, ast.Starred) for argument in node.args):
            raise self.error(node, "* and ** arguments are not understood", "write the arguments out")
        if len(set(keywords)) < len(keywords):
            raise self.error(node, "an argument stands twice", "keep one")
        arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
        return Call(node.func.id, tuple(self.argument(x, depth) for x in arguments), keywords, self.column(node))

    def argument(self, node: ast.expr, depth: int) -> Node:
        """An argument of a call, which may be a list."""
        if isinstance(node, ast.List | ast.Tuple) and depth <= MAX_DEPTH:
            return Group(tuple(self.argument(item, depth + 1) for item in node.elts))
        return self.read(node, depth)

    def reference(self, node: ast.expr, depth: int) -> Reference:
        """A signal, or a family of signals."""
        parts: list[tuple[str, tuple[Node | Span, ...]]] = []
        text, indices, inner = "", tuple[Node | Span, ...](), node
        while True:  # from the last name to the first
            match inner:
                case ast.Subscript(value=value, slice=index):
                    if indices:
                        parts.insert(0, ("", indices))
                    indices = self.indices(index, depth)
                    text, inner = f"[{ast.unparse(index).replace(' ', '')}]{text}", value
                case ast.Attribute(value=value, attr=name):
                    parts.insert(0, (name, indices))
                    text, indices, inner = f".{name}{text}", (), value
                case ast.Name(id=name) if not (parts and not parts[0][0]):  # an instance has one index
                    return Reference(f"{name}{text}", self.column(node), ((name, indices), *parts))
                case _:
                    raise self.error(node, "a signal is written like train[i].speed or consist[1].force[2]")

    def indices(self, node: ast.expr, depth: int) -> tuple[Node | Span, ...]:
        """What stands in one pair of brackets."""
        items = node.elts if isinstance(node, ast.Tuple) and node.elts else [node]
        return tuple(self.span(x, depth) if isinstance(x, ast.Slice) else self.index(x, depth) for x in items)

    def span(self, node: ast.Slice, depth: int) -> Span:
        """A slice."""
        if node.step is not None:
            raise self.error(node.step, "a slice has no step", "write train[2:] or train[1:3], both ends included")
        first, last = (self.index(end, depth) if end else None for end in (node.lower, node.upper))
        return Span(first, last)

    def index(self, node: ast.expr, depth: int) -> Node:
        """An index."""
        index = self.read(node, depth)
        for part in walk(index):
            match part:
                case Number(value=value) if float(value).is_integer():
                    continue
                case Name(name="i" | "count") | Operation(operator="+" | "-" | "*" | "negative"):
                    continue
            raise self.error(node, "an index is a whole number, i, count or a sum of these, as in train[i-1].speed")
        return index
