"""What expressions are made of once their names are resolved: terms, each of which is calculated once for a run.

Expressions that are made ready together share their common parts, and reducers that look at a run in the same way look
at it together.
"""

from collections.abc import Callable, Collection, Hashable, Mapping
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, WindowError
from .functions import Function, Value
from .reducers import Fold, Selection, Span, Window, ends_of, nothing_in_window, scalar, span_of
from .signals import Part, Rehearsal, Signals, parts_of
from .vocabulary import Names


class Term:
    """A value that depends on a run.

    Args:
        calculate: makes it of the values of other terms. of: these.

    Attributes:
        level: how many reducers stand inside one another. reach: how many points ahead it looks.
        shared: whether it is wanted more than once.
    """

    __slots__ = ("calculate", "level", "reach", "shared")

    def __init__(self, calculate: "Callable[[Frame], Value]", *of: "Term") -> None:
        self.calculate = calculate
        self.level: int = max((term.level for term in of), default=0)
        self.reach: int = max((term.reach for term in of), default=0)
        self.shared = False


Argument: TypeAlias = "Term | list[Argument] | None"
"""Of a function: a list where it stands for windows in time, None where it is left out."""


class Reduction:
    """A number that a reducer makes of a whole run.

    Args:
        function: the reducer.
        fixed: its arguments that are one number. varying: those that vary over time.
        bounds: `after`, `until` and `outside`, or None.
        several: whether each row of what varies has a number of its own, (n, 1), or all have one together.
    """

    def __init__(
        self,
        name: str,
        function: Function,
        fixed: Mapping[str, Term],
        bounds: Mapping[str, Argument],
        varying: Mapping[str, Term],
        *,
        several: bool = False,
    ) -> None:
        self.name, self.function, self.fixed, self.bounds, self.varying = name, function, fixed, bounds, varying
        self.several = several
        self.half_open = function.window == "phase"
        self.reach = max((term.reach for term in varying.values()), default=0)
        of = [*fixed.values(), *varying.values(), *(term for bound in bounds.values() for term in _flat(bound))]
        self.level = max((term.level for term in of), default=0)
        self.window = (self.half_open, *map(_hashable, bounds.values()))
        self.key = (function.call, self.window, several, *fixed.items(), *varying.items())
        self.family = (function.call, self.window, *fixed.items(), *varying)
        """What it has in common with those that look at a run in the same way."""


class Plan:
    """The terms of all expressions that are made ready together.

    Args:
        names: of the signals and parameters that runs will have.
    """

    def __init__(self, names: Collection[str]) -> None:
        self.names = Names.of(names)
        self.bindings: dict[Hashable, Any] = {}
        """What was made ready, by what it is."""
        self.levels: dict[int, dict[Hashable, list[Reduction]]] = {}
        """All reductions by how many reducers stand inside them, and by what they have in common."""
        self._reductions: dict[Hashable, Reduction] = {}
        self._selected: tuple[NDArray[np.float64], int, dict[Hashable, Selection]] = np.empty(0), 0, {}
        self._terms: dict[Hashable, Term] = {}

    @classmethod
    def of(cls, names: Collection[str]) -> "Plan":
        """The one that goes with names which were made ready, else a new one."""
        names = Names.of(names)
        plan: Plan = names.known.setdefault("plan", cls(names))
        return plan

    @cached_property
    def rehearsal(self) -> "Prepared":
        """A run that is made up, to see what can go wrong in one."""
        return Prepared(Plan(self.names), Rehearsal(self.names))  # whose terms no run has to look at

    def selected(self, part: Part) -> tuple[NDArray[np.float64], int, dict[Hashable, Selection]]:
        """The times of a part of a run, its overlap, and which of its points count, by span, as far as that is known.

        It is from the part that was looked at before, if that had the same times: in a batch, that of another run.
        """
        time, overlap, _ = self._selected
        if overlap != part.overlap or not np.array_equal(time, part.own_time):
            self._selected = part.own_time.copy(), part.overlap, {}  # a view would keep all of the run
        return self._selected

    def term(self, key: Hashable, calculate: "Callable[[Frame], Value]", *of: Term) -> Term:
        """The one term with this key."""
        term = self._terms.get(key)
        if term is None:
            term = self._terms[key] = Term(calculate, *of)
        else:
            term.shared = True
        return term

    def reduction(self, reduction: Reduction) -> Term:
        """What a reducer gives."""
        known = self._reductions.setdefault(reduction.key, reduction)
        if known is reduction:
            level = self.levels.setdefault(reduction.level, {})
            level.setdefault(reduction.family, []).append(reduction)
        reduction = known
        term = self.term(("reduction", reduction.key), lambda frame: frame.run.reduced(reduction))
        term.level = reduction.level + 1
        return term


class Frame:
    """Points of a run, and the values of terms there."""

    def __init__(self, run: "Prepared", signals: Signals) -> None:
        self.run, self.signals = run, signals
        self._values: dict[Term, Value] = {}
        self._largest: dict[Term, float] = {}

    def __getitem__(self, term: Term) -> Value:
        value = self._values.get(term)
        if value is None:
            value = term.calculate(self)
            if term.shared:
                self._values[term] = value
        return value

    def column(self, name: str) -> Value:
        """A recorded signal (T,), else a parameter ()."""
        if name in self.run.recorded:
            recorded = np.asarray(self.signals[name])
            if recorded.dtype.kind not in "bifu":
                raise ExpressionError(f"'{name}' is a text; expressions work on numbers")
            return recorded
        if name not in self.signals.parameters:
            raise ExpressionError(f"the run has no '{name}'")
        value = self.signals.parameters[name]
        if isinstance(value, str):
            raise ExpressionError(f"'{name}' is a text ('{value}'); expressions work on numbers")
        return np.asarray(value, dtype=np.float64)

    def argument(self, argument: Argument) -> Any:
        """The value of an argument of a function, as numbers."""
        if isinstance(argument, Term):
            return np.asarray(self[argument], dtype=np.float64)
        return None if argument is None else [self.argument(item) for item in argument]

    def largest(self, term: Term) -> float:
        """The largest magnitude among the values of a term; NaN where one is."""
        found = self._largest.get(term)
        if found is None:
            values = self.argument(term)
            high, low = float(values.max(initial=0.0)), float(values.min(initial=0.0))
            found = self._largest[term] = high if high >= -low else -low
        return found

    def selection(self, span: Span) -> Selection:
        """Which points count, in a part of the run."""
        time, overlap, known = self._selected
        found = known.get(span.key)
        if found is None:
            found = known[span.key] = Selection.of(time, overlap, span)
        return found

    @cached_property
    def _selected(self) -> tuple[NDArray[np.float64], int, dict[Hashable, Selection]]:
        assert isinstance(self.signals, Part)
        return self.run.plan.selected(self.signals)


class Prepared:
    """A run that is looked at through a plan: as it is, and what is known of it.

    Args:
        plan: the terms. signals: the run.
    """

    def __init__(self, plan: Plan, signals: Signals) -> None:
        self.plan, self.signals = plan, signals
        self.recorded = signals.names()
        self.whole = Frame(self, signals)
        self._reduced: dict[Reduction, Value | ExpressionError | ValueError] = {}
        self._spans: dict[Hashable, Span] = {}
        self._last: tuple[Part, Frame] | None = None

    def frame(self, part: Part) -> Frame:
        """The values at some points; of the part that was looked at last they are kept."""
        if self._last is None or not (self._last[0] is part or self._last[0].is_as(part)):
            self._last = part, Frame(self, part)
        return self._last[1]

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The first and the last time in s, as `ends_of` has them."""
        return ends_of(self.signals)

    def span(self, reduction: Reduction) -> Span:
        """The points that count for a reducer."""
        span = self._spans.get(reduction.window)
        if span is None:
            bounds = {name: self.whole.argument(bound) for name, bound in reduction.bounds.items()}
            span = span_of(self.ends, self.signals.step, **bounds, half_open=reduction.half_open)
            self._spans[reduction.window] = span
        return span

    def reduced(self, reduction: Reduction) -> Value:
        """What a reducer gives; with it all that can be known in one look at the run are found.

        Raises:
            ExpressionError, ValueError: it gives nothing.
        """
        if reduction not in self._reduced:
            self._look(reduction.level)
        value = self._reduced[reduction]
        if isinstance(value, Exception):
            raise value
        return value

    def _look(self, level: int) -> None:
        """At the run, for all reducers of a level of which nothing is known yet."""
        pending = [[one for one in family if one not in self._reduced] for family in self.plan.levels[level].values()]
        looks = [_Look(self, family, self._reduced) for family in pending if family]
        beyond = max((reduction.reach for family in pending for reduction in family), default=0)
        for part in parts_of(self.signals, beyond):
            frame = self.frame(part)
            failed = [look for look in looks if not look.see(frame)]
            if failed and part.overlap:  # once more, without those that turned out to give nothing
                self._look(level)
                return
        for look in looks:
            look.finish()

    # What follows is the run as it is.

    @property
    def time(self) -> NDArray[np.float64]:
        """As `Signals` has it."""
        return self.signals.time

    @property
    def points(self) -> int:
        """As `Signals` has it."""
        return self.signals.points

    def part(self, first: int, last: int, /) -> Mapping[str, NDArray[Any]]:
        """As `Signals` has it."""
        return self.signals.part(first, last)

    @property
    def step(self) -> float:
        """As `Signals` has it."""
        return self.signals.step

    @property
    def completed(self) -> bool:
        """As `Signals` has it."""
        return self.signals.completed

    @property
    def stop_time(self) -> float:
        """As `Signals` has it."""
        return self.signals.stop_time

    @property
    def units(self) -> Mapping[str, str]:
        """As `Signals` has it."""
        return self.signals.units

    @property
    def parameters(self) -> Mapping[str, float | int | bool | str]:
        """As `Signals` has it."""
        return self.signals.parameters

    def names(self) -> Collection[str]:
        """As `Signals` has it."""
        return self.recorded

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        return self.signals[name]


class _Look:
    """Reductions of one family, which look at a run part by part.

    Args:
        run: that is looked at. members: of the family. found: where their values go, or why there are none.
    """

    def __init__(
        self, run: Prepared, members: list[Reduction], found: dict[Reduction, Value | ExpressionError | ValueError]
    ) -> None:
        self._members, self._found = members, found
        self._folds: dict[Hashable, tuple[Fold, list[Reduction], list[int]]] = {}
        one = members[0]
        try:
            self._fixed = {
                name: scalar(run.whole.argument(term), f"the {name} of {one.name}") for name, term in one.fixed.items()
            }
            self._span = run.span(one)
        except (ExpressionError, ValueError) as error:
            self._give_up(members, error)

    def _give_up(self, members: list[Reduction], error: ExpressionError | ValueError) -> None:
        self._members = [member for member in self._members if member not in members]
        self._found.update((member, error) for member in members)

    def see(self, frame: Frame) -> bool:
        """Take in a part of the run; False if some member cannot."""
        groups: dict[Hashable, tuple[Fold, list[Reduction], list[Value]]] = {}
        before, points = self._members, frame.signals.points
        for member in before:
            try:
                varying = {name: frame.argument(term) for name, term in member.varying.items()}
                rows, fold = member.function.call(self._span, **self._fixed, **varying)
                if rows.ndim and rows.shape[-1] not in (1, points):
                    raise ValueError(f"{rows.shape[-1]} points of {points}")
            except (ExpressionError, ValueError) as error:
                self._give_up([member], error)
                continue
            # A fold depends on how many rows there are, and of what.
            alike: Hashable = tuple(() if member.several else value.shape[:-1] for value in varying.values())
            group = groups.setdefault(alike, (fold, [], []))
            group[1].append(member)
            group[2].append(rows[:, np.newaxis] if member.several else np.atleast_2d(rows)[np.newaxis])
        for shapes, (new, members, values) in groups.items():
            counts = [len(value) for value in values]
            fold, *_ = self._folds.setdefault(shapes, (new, members, counts))
            fold.see(Window.of(frame.selection(self._span), values))
        return before is self._members

    def finish(self) -> None:
        """Find the values."""
        for fold, members, counts in self._folds.values():
            begin = 0
            for member, count in zip(members, counts, strict=True):
                try:
                    numbers = fold.numbers(slice(begin, begin + count))
                    self._found[member] = numbers[:, np.newaxis] if member.several else np.asarray(numbers[0])
                except WindowError as error:
                    self._found[member] = error
                begin += count
        for member in self._members:
            if member not in self._found:
                self._found[member] = WindowError(nothing_in_window())


def _flat(argument: Argument) -> list[Term]:
    if isinstance(argument, Term):
        return [argument]
    return [] if argument is None else [term for item in argument for term in _flat(item)]


def _hashable(argument: Argument) -> Hashable:
    return tuple(_hashable(item) for item in argument) if isinstance(argument, list) else argument
