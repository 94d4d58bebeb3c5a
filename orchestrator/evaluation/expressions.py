"""Expressions over recorded signals, such as `abs(train[i].speed - target.value) <= 1`.

The syntax stands in `syntax`, what the parts mean in `functions` and `calculation`.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, TypeAlias, TypeVar

import numpy as np

from ..errors import ExpressionError, WindowError
from ..names import SignalName
from ..problems import Problem, suggestion
from .calculation import Binding, Scope, evaluate, prepared, reach
from .formulas import read
from .functions import CONSTANTS, ELEMENTWISE, Function, Value, call_problem
from .signals import Rehearsal, Signals
from .syntax import Call, Name, Node, Operation, Reference, Temporal, uses_index, walk
from .terms import Plan, Prepared
from .vocabulary import Names, numbers_of, unknown_signal

_MAX_INDEX = 20_000
"""How far `i` is counted, beyond the number of names: a lone `x[999999999]` of somebody's FMU is not worth the time."""
R = TypeVar("R")
Index: TypeAlias = int | tuple[int, ...] | None
"""A value of the free index, several that have a row each, or none."""


def parse(text: str, functions: Mapping[str, Function] = ELEMENTWISE) -> "Expression":
    """Read an expression. Names and functions are looked up later, by `Expression.check`.

    Raises:
        ExpressionError: for anything that is not an expression of this language, with the column and the remedy.
    """
    return Expression(*_read(text), functions)


_read = lru_cache(maxsize=1024)(read)
"""Texts are read again and again: by the scenario, the check, the run and the figures."""


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
        return uses_index(self.tree)

    @cached_property
    def reaches(self) -> int:
        """How many points ahead it looks at most."""
        return reach(self.tree)

    @cached_property
    def stands_in_rows(self) -> bool:
        """Whether its values for several i can be rows of one: no part compares rows, or has rows itself."""
        return self.uses_index and self._stands_in_rows(self.tree)

    def _stands_in_rows(self, node: Node) -> bool:
        function = self.functions.get(node.name) if isinstance(node, Call) else None
        if function is not None and function.reduces:
            assert isinstance(node, Call)
            if not uses_index(node):
                return True  # one number for all
            if function.compares or call_problem(node, self.functions):
                return False
            return all(
                self._stands_in_rows(argument) if name in function.varying else not uses_index(argument)
                for name, argument in function.given(node).items()
            )
        if isinstance(node, Temporal) or (isinstance(node, Reference) and node.stacked):
            return False
        children = node.operands if isinstance(node, Operation) else node.arguments if isinstance(node, Call) else ()
        return all(map(self._stands_in_rows, children))

    def calls(self, name: str) -> bool:
        """Whether the function of this name is called somewhere."""
        return any(isinstance(node, Call) and node.name == name for node in walk(self.tree))

    def count(self, names: Collection[str]) -> int:
        """The number of the last instance, or element, of the first array it mentions: what `count` stands for."""
        array = next((reference.array for reference in self.references if reference.array), "")
        return Names.of(names).count(array)

    def indices(self, names: Collection[str]) -> tuple[int, ...]:
        """Every i for which all references exist; () when the expression has no free index.

        Instances are numbered from 1; where `i` stands in elements alone, it begins where they do.
        """
        if not self.uses_index or not any(reference.uses_index for reference in self.references):
            return ()
        names, key = Names.of(names), ("indices", self.text)
        if key not in names.known:
            names.known[key] = self._indices(names)
        found: tuple[int, ...] = names.known[key]
        return found

    def _indices(self, names: Names) -> tuple[int, ...]:
        first = 1
        if not any(reference.counts_instances for reference in self.references):
            begins = tuple(f"{reference.array}[" for reference in self.references if reference.uses_index)
            first = max(min(numbers_of(name for name in names if name.startswith(begins)), default=1), -_MAX_INDEX)
        found = [self._places(reference, names, min(first, 1)) for reference in self.references]
        return tuple(sorted(found[0].intersection(*found[1:])))

    def _places(self, reference: Reference, names: Names, first: int) -> frozenset[int]:
        """Every i, from the first one on, for which a reference exists."""
        count = self.count(names)
        key = ("i", reference.key, first, count)
        if key not in names.known:
            plan, last = Plan.of(names), min(2 * names.largest + 1, _MAX_INDEX + len(names))
            bindings = ((i, self._bound(plan, {"i": i, "count": count})) for i in range(first, last + 1))
            names.known[key] = frozenset(i for i, binding in bindings if binding.found(reference))
        found: frozenset[int] = names.known[key]
        return found

    def instances(self, names: Collection[str]) -> tuple[int | None, ...]:
        """The indices to evaluate it for: `indices`, or (None,) when it has no free index."""
        return self.indices(names) if self.uses_index else (None,)

    def resolve(self, names: Collection[str], index: int | None = None) -> list[list[str]]:
        """For each reference the full names it stands for."""
        binding = self.bound(Plan.of(names), index)
        return [binding.found(reference) for reference in self.references]

    def check(
        self,
        names: Collection[str],
        constants: Collection[str] = (),
        rule: Callable[[Node, Scope], Any] = evaluate,
    ) -> list[Problem]:
        """Every problem that can be found before a run, each with the column and the nearest valid name.

        `constants` are further bare names the expression may use, such as the variable of a function plot; `rule` is
        how it will be evaluated.
        """
        names = Names.of(names)
        known = {*CONSTANTS, *constants, "time", "count", *(["i"] if self.references else [])}
        try:
            problems = [
                problem.at(f"'{self.text}', column {node.column}")
                for node in walk(self.tree)
                if isinstance(node, Name | Reference | Call) and (problem := self._problem(node, names, known))
            ]
        except ExpressionError as error:  # an index beyond all numbers
            return error.problems
        if problems:
            return problems
        instances = (None,) if "i" in constants else self.instances(names)
        if not instances:
            return [Problem(f"'{self.text}'", "there is no i for which all of its signals exist", "mend the indices")]
        try:
            self.apply(rule, Plan.of(names).rehearsal, instances[0], **dict.fromkeys(constants, 1.0))
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
        return bool(alone.indices(names)) if reference.uses_index else any(alone.resolve(names))

    def _bound(self, plan: Plan, constants: Mapping[str, Any], rows: Sequence[Binding] = ()) -> Binding:
        every = {**CONSTANTS, **constants}
        if "count" in self.text and "count" not in every:
            every["count"] = self.count(plan.names)
        return Binding(self.text, self.functions, every, plan, rows)

    def bound(self, plan: Plan, index: Index = None) -> Binding:
        """What it stands for among the names of a plan, which keeps it."""
        bindings, key = plan.bindings, (self.text, id(self.functions), index)
        if key not in bindings and isinstance(index, tuple):
            rows = [self.bound(plan, one) for one in index]
            bindings[key] = self._bound(plan, {"i": np.array(index)[:, np.newaxis]}, rows)
        elif key not in bindings:
            bindings[key] = self._bound(plan, {} if index is None else {"i": index})
        binding: Binding = bindings[key]
        return binding

    def apply(self, rule: Callable[[Node, Scope], R], signals: Signals, index: Index = None, **constants: Any) -> R:
        """Evaluate under another rule than the usual one (a requirement asks for slack instead of truth)."""
        run = prepared(signals)
        constants = constants if index is None or not constants else {**constants, "i": index}
        scope = Scope(self._bound(run.plan, constants) if constants else self.bound(run.plan, index), run.whole)
        try:
            with np.errstate(all="ignore"):
                return rule(self.tree, scope)
        except ExpressionError as error:
            located = [problem if problem.place else problem.at(f"'{self.text}'") for problem in error.problems]
            raise type(error)(located) from None
        except ValueError as error:
            reason = f"its parts differ in their number of rows ({error})"
            raise scope.error(Problem("", reason, "combine arrays of one size")) from None

    def value(self, run: Prepared, index: Index = None) -> Value:
        """As `evaluate` has it, where numbers may overflow without a word."""
        try:
            return run.whole[self.bound(run.plan, index).term(self.tree)]
        except (ExpressionError, ValueError):  # said by what it stands in
            return self.apply(evaluate, run, index)

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
    value = expression.evaluate(Rehearsal(()), None, **constants)
    if isinstance(value, np.ndarray) or np.isnan(value):
        raise ExpressionError(f"'{text}' has no value here (0 / 0, or the root of a negative number)")
    return value
