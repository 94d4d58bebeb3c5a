"""Requirements: `always|eventually|finally CONDITION [from T] [until T] [outside [a, b]]...`, judged after a run.

A verdict is pass, fail or inconclusive, with a signed margin: the smallest slack over time and index, negative where
the condition is violated. Only recorded points are seen. What NaN touches fails, and an unfinished run never passes.
Numbers that differ by rounding are equal: their margin is 0. The grammar and its meaning stand in `docs/metrics.md`.
"""

import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, WindowError
from ..names import SignalName
from ..problems import Problem, suggestion
from ..times import digits, slack
from .calculation import Scope, names_of, reach
from .expressions import Expression, evaluate_constant, parse
from .functions import CONSTANTS
from .metrics import EVERY_STEP, FUNCTIONS
from .reducers import Span, ends_of, scalar, window_of
from .signals import Rehearsal, Signals, parts_of
from .slack import COMPARISONS, slack_of
from .syntax import Call, Name, Node, Number, Operation, Reference, walk

QUANTIFIERS = ("always", "eventually", "finally")
CLAUSES = ("from", "until", "outside")
_MISSING = "write always, eventually or finally, then a condition: always abs(train[i].acceleration) <= 1.0"


@dataclass(frozen=True)
class Verdict:
    """How one requirement came out.

    `margin` is the worst slack, in the unit of the compared quantities; None when there is none (nothing was judged,
    or a boolean decided). `time` [s] and `index` are where the worst was seen, `points` how many recorded points were
    judged, `reason` why it is inconclusive or what was NaN.
    """

    name: str
    text: str
    verdict: Literal["pass", "fail", "inconclusive"]
    margin: float | None = None
    time: float | None = None
    index: int | None = None
    points: int = 0
    reason: str = ""


@dataclass(frozen=True)
class _Worst:
    """The deciding point for one index."""

    holds: bool
    slack: float
    time: float
    index: int | None


class _Times(NamedTuple):
    """The window of a requirement in one run [s]."""

    start: float | None
    end: float | None
    outside: list[tuple[float, float]]


@dataclass(frozen=True)
class Requirement:
    """A parsed requirement; the times of its window [s] are expressions over numbers and parameters."""

    name: str
    text: str
    quantifier: str
    condition: Expression
    start: Expression | None = None
    end: Expression | None = None
    outside: tuple[tuple[Expression, Expression], ...] = ()

    @property
    def moments(self) -> list[Expression]:
        """The times of its window."""
        every = (self.start, self.end, *(end for pair in self.outside for end in pair))
        return [moment for moment in every if moment is not None]

    def times(self, signals: Signals) -> _Times:
        """The window in a run.

        Raises:
            ExpressionError: a time varies, or the window ends before it starts.
        """
        start, end = (None if x is None else _moment(x, signals) for x in (self.start, self.end))
        outside = [(_moment(first, signals), _moment(last, signals)) for first, last in self.outside]
        if start is not None and end is not None and start > end:
            raise ExpressionError(
                Problem("", f"'from {digits(start)} until {digits(end)}' ends before it starts", "swap the two")
            )
        for first, last in outside:
            if first > last:
                backwards = f"'outside [{digits(first)}, {digits(last)}]' ends before it starts"
                raise ExpressionError(Problem("", backwards, "swap the two"))
        return _Times(start, end, outside)

    @property
    def looks(self) -> list[Expression]:
        """Everything that looks at signals or parameters."""
        return [self.condition, *self.moments]

    def check(
        self, names: Collection[str], steady: bool = True, parameters: Collection[str] | None = None
    ) -> list[Problem]:
        """Every problem that can be found before a run, as `metrics.check_metric` does it."""
        problems = self._problems(names, parameters)
        if self.condition.calls("at_sample") and not steady:
            problems.append(EVERY_STEP)
        return problems

    def _problems(self, names: Collection[str], parameters: Collection[str] | None) -> list[Problem]:
        problems = self.condition.check(names)
        for moment in self.moments:
            found = moment.check(names)
            if moment.uses_index:
                found = [
                    Problem(
                        f"'{moment.text}'", "a time is one for all i", "write a number, or one instance's parameter"
                    )
                ]
            elif not found and parameters is not None and not _is_constant(moment, names, parameters):
                found = [Problem(f"'{moment.text}'", "a time is a number or a parameter, not a signal")]
            problems += found
        shapeless = [node for node in _conditions(self.condition.tree) if not _can_be_true(node)]
        if shapeless and not problems:
            number = f"'{self.condition.text}' is a number, not a condition"
            return [Problem("", number, "compare it, as in abs(x) <= 1")]
        return problems

    def evaluate(self, signals: Signals) -> Verdict:
        """Judge a run.

        Raises:
            ExpressionError: for what `check` would have told.
        """
        try:
            times = self.times(signals)
        except ExpressionError as error:
            return Verdict(self.name, self.text, "inconclusive", reason=str(error))
        first, last = ends_of(signals)
        span = Span(times.start, times.end, times.outside, forgiven=slack(signals.step, first, last))
        indices = self.condition.instances(names_of(signals))
        if not indices:
            return Verdict(self.name, self.text, "inconclusive", reason="no signal has such an index")
        try:
            seen = [self.condition.apply(partial(self._look, span, index), signals, index) for index in indices]
        except WindowError as error:
            return Verdict(self.name, self.text, "inconclusive", reason=str(error))
        judged = seen[0].points
        if not judged:
            return Verdict(self.name, self.text, "inconclusive", reason="no recorded point lies in its window")
        worst = min((look.decisive() for look in seen), key=_badness)
        verdict, reason = self._verdict(worst, signals, times.end, last)
        margin = None if np.isinf(worst.slack) else worst.slack
        judged = 1 if self.quantifier == "finally" else judged
        return Verdict(self.name, self.text, verdict, margin, worst.time, worst.index, judged, reason)

    def _verdict(
        self, worst: _Worst, signals: Signals, end: float | None, last: float
    ) -> tuple[Literal["pass", "fail", "inconclusive"], str]:
        """The verdict of a run that ends at the time `last`, and the reason for it, where it needs one."""
        reached = signals.completed if end is None else end <= last + slack(signals.step, last)
        # A number over the whole run (final, settling_time, ...) is not final before the run is.
        reducers = (isinstance(x, Call) and self.condition.functions[x.name].reduces for x in walk(self.condition.tree))
        provisional = not signals.completed and any(reducers)
        if not worst.holds and not provisional and (reached or self.quantifier == "always"):
            return "fail", "a value is not a number (NaN)" if np.isnan(worst.slack) else ""
        if not signals.completed:
            return (
                "inconclusive",
                f"the run ended at {digits(last)} s, before its stop time {digits(signals.stop_time)} s",
            )
        if end is not None and not reached:
            return "inconclusive", f"its window lasts until {digits(end)} s, the run only until {digits(last)} s"
        return "pass", ""

    def _look(self, span: Span, index: int | None, node: Node, scope: Scope) -> "_Look":
        """At the condition for one index over the whole run, part by part."""
        look = _Look(
            self.quantifier, lambda row, rows: index if index is not None else self._row_number(scope, row, rows)
        )
        for part in parts_of(scope.signals, reach(node)):
            met, slack = (window_of(part, x, span) for x in np.broadcast_arrays(*slack_of(node, scope.of(part))))
            look.see(slack.times, met.kept != 0.0, slack.kept)
        return look

    def _row_number(self, scope: Scope, row: int, rows: int) -> int | None:
        """The index a row of a slice stands for: 3 for the second row of `train[2:].speed`."""
        resolved = self.condition.resolve(scope.names)
        for reference, names in zip(self.condition.references, resolved, strict=True):
            if reference.stacked and len(names) == rows:
                return next(iter(SignalName.parse(names[row]).indices), None)
        return None


class _Look:
    """What decides a requirement, of what was seen so far.

    Args:
        quantifier: of the requirement. number: the index that a row stands for, of so many rows.
    """

    def __init__(self, quantifier: str, number: Callable[[int, int], int | None]) -> None:
        self._quantifier, self._number = quantifier, number
        self._worst: tuple[tuple[bool, bool, float, int], _Worst] | None = None
        self._best: tuple[tuple[bool, float], _Worst] | None = None
        self.points = 0

    def see(self, time: NDArray[np.float64], holds: NDArray[np.bool_], slack: NDArray[np.float64]) -> None:
        """Take in points that count: their times (T,), and the condition and its slack there (n, T)."""
        self.points += len(time)
        if not len(time):
            return
        if self._quantifier == "finally":
            self._worst, time, holds, slack = None, time[-1:], holds[:, -1:], slack[:, -1:]
        # The worst point: NaN before a violation before the smallest slack, before a row further ahead.
        known = ~np.isnan(slack)
        order = np.lexsort((slack.ravel(), holds.ravel(), known.ravel()))
        row, column = (int(k) for k in np.unravel_index(int(order[0]), slack.shape))
        key = (bool(known[row, column]), bool(holds[row, column]), float(slack[row, column]), row)
        if self._worst is None or key < self._worst[0]:
            self._worst = key, self._at(time, slack, bool(holds[row, column]), row, column)
        if self._quantifier == "eventually":
            every = np.asarray(holds.all(axis=0))  # the rows of a slice count together, at the best moment
            column = int(np.lexsort((-slack.min(axis=0), ~every))[0])
            best = (not every[column], -float(slack[:, column].min()))
            if self._best is None or best < self._best[0]:
                row = int(np.argmin(slack[:, column]))
                self._best = best, self._at(time, slack, bool(every[column]), row, column)

    def _at(self, time: NDArray[np.float64], slack: NDArray[np.float64], holds: bool, row: int, column: int) -> _Worst:
        return _Worst(holds, float(slack[row, column]), float(time[column]), self._number(row, len(slack)))

    def decisive(self) -> _Worst:
        """The point that decides."""
        assert self._worst is not None
        worst = self._worst[1]
        return worst if self._best is None or np.isnan(worst.slack) else self._best[1]


def _badness(worst: _Worst) -> tuple[bool, bool, float]:
    return not np.isnan(worst.slack), worst.holds, worst.slack


def _conditions(node: Node) -> Iterator[Node]:
    """The parts that have to be true or false: below and, or, not, and both branches of if."""
    match node:
        case (
            Operation(operator="and" | "or" | "not", operands=operands)
            | Operation(operator="if", operands=(_, *operands))
        ):
            for operand in operands:
                yield from _conditions(operand)
        case _:
            yield node


def _can_be_true(node: Node) -> bool:
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


def _clauses(text: str) -> list[tuple[str, str]]:
    """Split at from, until, outside where not in brackets or quotes: [("", condition), (word, argument), ...]."""
    parts = [("", "")]
    depth, quote, start = 0, "", 0
    for match in re.finditer(r"[\w.]+|\S", text):
        token = match[0]
        if quote or token in "\"'":
            quote = "" if token == quote else quote or token
        elif token in CLAUSES and depth == 0:
            parts[-1] = (parts[-1][0], text[start : match.start()].strip())
            parts.append((token, ""))
            start = match.end()
        else:
            depth += (token in "([{") - (token in ")]}")
    parts[-1] = (parts[-1][0], text[start:].strip())
    return parts


def _moment(expression: Expression, signals: Signals) -> float:
    return scalar(expression.evaluate(signals), f"'{expression.text}', a time of a window,")


def _is_constant(expression: Expression, names: Collection[str], parameters: Collection[str]) -> bool:
    return all(name in parameters for found in expression.resolve(names) for name in found)


def _time(word: str, text: str) -> Expression:
    if not text:
        raise ExpressionError(f"'{word}' needs a time in seconds, as in {word} 210")
    expression = parse(text)
    if not expression.references:
        evaluate_constant(text)
    return expression


def _window(text: str) -> tuple[Expression, Expression]:
    match = re.fullmatch(r"\[([^,]+),([^,]+)\]", text)
    if not match:
        raise ExpressionError(Problem("", f"'outside {text}' is not a time window", "write outside [210, 240]"))
    return _time("outside", match[1].strip()), _time("outside", match[2].strip())


def parse_requirement(name: str, text: str) -> Requirement:
    """Read a requirement such as `always abs(train[i].acceleration) <= 1.0 outside [210, 240]`.

    Raises:
        ExpressionError: with every problem of the text, which does not say the name.
    """
    text = re.sub(r"\s+", " ", text).strip()
    quantifier, _, rest = text.partition(" ")
    if quantifier not in QUANTIFIERS:
        nearest = suggestion(quantifier, QUANTIFIERS) or _MISSING
        raise ExpressionError(Problem("", f"'{text}' does not say when", nearest))
    (_, condition), *clauses = _clauses(rest)
    times: dict[str, Expression] = {}
    outside: list[tuple[Expression, Expression]] = []
    problems: list[Problem] = []
    for word, argument in clauses:
        try:
            if word == "outside":
                outside.append(_window(argument))
            elif word in times:
                problems.append(Problem("", f"'{word}' stands twice", "keep one"))
            else:
                times[word] = _time(word, argument)
        except ExpressionError as error:
            problems += error.problems
    try:
        expression = parse(condition, FUNCTIONS)
    except ExpressionError as error:
        problems += error.problems
    if problems:
        raise ExpressionError(problems)
    made = Requirement(name, text, quantifier, expression, times.get("from"), times.get("until"), tuple(outside))
    if not any(moment.references for moment in made.moments):
        made.times(Rehearsal(()))
    return made
