"""Requirements: `always|eventually|finally CONDITION [from T] [until T] [outside [a, b]]...`, judged after a run.

A verdict is pass, fail or inconclusive, with a signed margin: the smallest slack over time and index, negative where
the condition is violated. Only recorded points are seen. What NaN touches fails, and an unfinished run never passes.
Numbers that differ by rounding are equal: their margin is 0. The grammar and its meaning stand in `docs/metrics.md`.
"""

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError, WindowError
from ..names import SignalName
from ..problems import Problem, suggestion
from ..times import digits, slack
from .calculation import Scope, evaluate
from .expressions import Expression, evaluate_constant, parse
from .functions import CONSTANTS
from .metrics import EVERY_STEP, FUNCTIONS
from .signals import Rehearsal, Signals
from .syntax import Call, Name, Node, Number, Operation, Reference, walk
from .time_windows import scalar, select

QUANTIFIERS = ("always", "eventually", "finally")
CLAUSES = ("from", "until", "outside")
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
ROUNDING = 4 * float(np.finfo(np.float64).eps)
"""Numbers that differ by less than this share of what they are made of are equal: a start on a bound is on it."""
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


class Slack(NamedTuple):
    """Whether a condition holds, and by how much (negative: missed by; infinite: no measure), of one shape."""

    holds: NDArray[np.bool_]
    slack: NDArray[np.float64]


@dataclass(frozen=True)
class _Worst:
    """The deciding point for one index."""

    holds: bool
    slack: float
    time: float
    index: int | None


def slack_of(node: Node, scope: Scope) -> Slack:
    """The slack of a condition: b - a for a < b, the least for `and`, the most for `or`, negated for `not`.

    A bare signal is a boolean: it holds where it is not zero and has no measure. NaN never holds.
    """
    match node:
        case Operation(operator="not", operands=(operand,)):
            holds, slack = slack_of(operand, scope)
            return Slack(~holds & ~np.isnan(slack), -slack)
        case Operation(operator="and" | "or" as operator, operands=operands):
            parts = [slack_of(operand, scope) for operand in operands]
            smaller = operator == "and"
            slack = (np.minimum if smaller else np.maximum).reduce(np.broadcast_arrays(*(part.slack for part in parts)))
            every = np.broadcast_arrays(*(part.holds for part in parts))
            holds = (np.logical_and if smaller else np.logical_or).reduce(every)
            return Slack(np.asarray(holds & ~np.isnan(slack)), np.asarray(slack))
        case Operation(operator="if", operands=(condition, then, otherwise)):
            choice = np.asarray(evaluate(condition, scope), dtype=np.float64)
            yes, no = slack_of(then, scope), slack_of(otherwise, scope)
            slack = np.where(np.isnan(choice), np.nan, np.where(choice, yes.slack, no.slack))
            return Slack(np.where(choice, yes.holds, no.holds) & ~np.isnan(slack), slack)
        case Operation(operator=operator, operands=(left, right)) if operator in COMPARISONS:
            rounding = ROUNDING * np.maximum(_size(left, scope), _size(right, scope))
            return _compare(operator, evaluate(left, scope), evaluate(right, scope), rounding)
    value = np.asarray(evaluate(node, scope), dtype=np.float64)
    slack = np.where(np.isnan(value), np.nan, np.where(value, np.inf, -np.inf))
    return Slack(slack > 0, slack)


def _size(node: Node, scope: Scope) -> NDArray[np.float64]:
    """How large the numbers are that a value is made of: the rounding of a gap is that of the two positions."""
    match node:
        case Operation(operator="+" | "-" | "negative" | "positive", operands=operands):
            parts = [_size(operand, scope) for operand in operands]
        case Call(name="abs" | "minimum" | "maximum", arguments=arguments):
            parts = [_size(argument, scope) for argument in arguments]
        case _:
            return np.abs(np.asarray(evaluate(node, scope), dtype=np.float64))
    return np.asarray(np.maximum.reduce(np.broadcast_arrays(*parts)))


def _compare(operator: str, left: NDArray[Any], right: NDArray[Any], rounding: NDArray[np.float64]) -> Slack:
    a, b = np.asarray(left, dtype=np.float64), np.asarray(right, dtype=np.float64)
    equal = (a == b) | (np.abs(b - a) <= np.where(np.isfinite(rounding), rounding, 0.0))
    difference = np.where(equal, 0.0, b - a)  # inf - inf would be NaN
    slack, holds = {
        "<": (difference, (a < b) & ~equal),
        "<=": (difference, (a <= b) | equal),
        ">": (-difference, (a > b) & ~equal),
        ">=": (-difference, (a >= b) | equal),
        "==": (-np.abs(difference), equal),
        "!=": (np.abs(difference), ~equal & ~np.isnan(difference)),
    }[operator]
    return Slack(np.asarray(holds), np.asarray(slack))


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

    def check(self, names: Collection[str], parameters: Collection[str] | None = None) -> list[Problem]:
        """Every problem that can be found before a run; `names` are the signals to be recorded and the parameters."""
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
        points = select(signals, times.start, times.end, times.outside)
        indices = self.condition.instances([*signals.names(), *signals.parameters])
        if not points.any() or not indices:
            reason = "no signal has such an index" if points.any() else "no recorded point lies in its window"
            return Verdict(self.name, self.text, "inconclusive", reason=reason)
        try:
            worst = min((self._worst(signals, points, index) for index in indices), key=_badness)
        except WindowError as error:
            return Verdict(self.name, self.text, "inconclusive", reason=str(error))
        verdict, reason = self._verdict(worst, signals, times.end)
        margin = None if np.isinf(worst.slack) else worst.slack
        judged = 1 if self.quantifier == "finally" else int(points.sum())
        return Verdict(self.name, self.text, verdict, margin, worst.time, worst.index, judged, reason)

    def _verdict(
        self, worst: _Worst, signals: Signals, end: float | None
    ) -> tuple[Literal["pass", "fail", "inconclusive"], str]:
        """The verdict and the reason for it, where it needs one."""
        last = float(signals.time[-1])
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

    def _worst(self, signals: Signals, points: NDArray[np.bool_], index: int | None) -> _Worst:
        """The point that decides for one index."""
        holds, slack = self.condition.apply(slack_of, signals, index)
        shape = np.broadcast_shapes(np.atleast_2d(slack).shape, (1, signals.time.size))
        holds = np.broadcast_to(np.atleast_2d(holds), shape)[:, points]
        slack = np.broadcast_to(np.atleast_2d(slack), shape)[:, points]
        times = signals.time[points]
        if self.quantifier == "finally":
            holds, slack, times = holds[:, -1:], slack[:, -1:], times[-1:]
        # The worst point: NaN before a violation before the smallest slack.
        unknown = np.isnan(slack)
        row, column = np.unravel_index(
            int(np.lexsort((slack.ravel(), holds.ravel(), ~unknown.ravel()))[0]), slack.shape
        )
        met = bool(holds[row, column])
        if self.quantifier == "eventually" and not unknown.any():
            every = np.atleast_1d(holds.all(axis=0))  # the rows of a slice count together, at the best moment
            column = np.lexsort((-slack.min(axis=0), ~every))[0]
            row, met = np.argmin(slack[:, column]), bool(every[column])
        number = index if index is not None else self._row_number(signals, int(row), slack.shape[0])
        return _Worst(met, float(slack[row, column]), float(times[column]), number)

    def _row_number(self, signals: Signals, row: int, rows: int) -> int | None:
        """The index a row of a slice stands for: 3 for the second row of `train[2:].speed`."""
        resolved = self.condition.resolve([*signals.names(), *signals.parameters])
        for reference, names in zip(self.condition.references, resolved, strict=True):
            if reference.stacked and len(names) == rows:
                return next(iter(SignalName.parse(names[row]).indices), None)
        return None


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


def check_requirements(
    table: Mapping[str, str], names: Collection[str], every_step: bool = True, parameters: Collection[str] | None = None
) -> list[Problem]:
    """Every problem of a [require] table that can be found before a run, as `metrics.check_metrics` does it."""
    problems: list[Problem] = []
    for name, text in table.items():
        place = f"requirement '{name}'"
        try:
            requirement = parse_requirement(name, text)
        except ExpressionError as error:
            problems += error.at(place)
            continue
        problems += [problem.at(place) for problem in requirement.check(names, parameters)]
        if requirement.condition.calls("at_sample") and not every_step:
            problems.append(EVERY_STEP.at(place))
    return problems


def judge_requirements(table: Mapping[str, str], signals: Signals) -> list[Verdict]:
    """The verdicts of a [require] table that passed its check, in its order."""
    return [parse_requirement(name, text).evaluate(signals) for name, text in table.items()]
