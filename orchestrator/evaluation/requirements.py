"""Requirements: `always|eventually|finally CONDITION [from T] [until T] [outside [a, b]]...`, judged after a run.

The condition may be a formula of signal temporal logic, and a formula may stand alone. A verdict is pass, fail or
inconclusive, with a signed margin: the smallest slack over time and index, negative where the condition is violated,
and what decided it. Only the points that are seen count. What NaN touches fails, and an unfinished run never passes.
Numbers that differ by rounding are equal: their margin is 0. The grammar and its meaning stand in `docs/metrics.md`.
"""

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from ..errors import ExpressionError, WindowError
from ..names import SignalName
from ..problems import Problem, suggestion
from ..times import digits, slack
from . import signals as runs
from .calculation import Scope, prepared, reach
from .expressions import Expression, Index, evaluate_constant, parse
from .formulas import says_when, tokens_of
from .metrics import EVERY_STEP, FUNCTIONS
from .reducers import Span, scalar
from .signals import Rehearsal, Signals
from .slack import ZERO, can_be_true, conditions
from .syntax import Call, Node, Reference, Temporal, walk
from .temporal import (
    Culprit,
    Decision,
    Formula,
    Points,
    Word,
    common,
    horizon,
    rehearsed_interval,
    scales_of,
)
from .terms import Prepared

QUANTIFIERS: tuple[Word, ...] = ("always", "eventually", "finally")
_MOST_VALUES = 1 << 15
"""So many numbers are calculated at once for several indices."""
CLAUSES = ("from", "until", "outside")
_MISSING = "write always, eventually or finally, then a condition: always abs(train[i].acceleration) <= 1.0"


@dataclass(frozen=True)
class Verdict:
    """How one requirement came out.

    `margin` is the worst slack, in the unit of the compared quantities; None when there is none (nothing was judged,
    or a boolean decided). `time` [s] and `index` are where the worst was seen, `points` how many points were judged,
    `reason` why it is inconclusive or what was NaN. `robustness` is the margin where every comparison is
    divided by a size that counts in its unit, so that those of unlike signals compare; `blame` has the signals of the
    comparison that decided.
    """

    name: str
    text: str
    verdict: Literal["pass", "fail", "inconclusive"]
    margin: float | None = None
    time: float | None = None
    index: int | None = None
    points: int = 0
    reason: str = ""
    robustness: float | None = None
    blame: tuple[str, ...] = ()


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
    quantifier: Word
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
        problems = self.condition.check(names, rule=_rehearse)
        problems += self._bound_problems(names, parameters)
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
        shapeless = [node for node in conditions(self.condition.tree) if not can_be_true(node)]
        if shapeless and not problems:
            number = f"'{self.condition.text}' is a number, not a condition"
            return [Problem("", number, "compare it, as in abs(x) <= 1")]
        return problems

    def evaluate(self, signals: Signals, *, scaled: bool = False) -> Verdict:
        """Judge a run.

        Args:
            signals: the run.
            scaled: whether the margin, and what decides it, are those of robustness.

        Raises:
            ExpressionError: for what `check` would have told.
        """
        signals = prepared(signals)
        try:
            times = self.times(signals)
        except ExpressionError as error:
            return Verdict(self.name, self.text, "inconclusive", reason=str(error))
        indices = self.condition.instances(signals.plan.names)
        if not indices:
            return Verdict(self.name, self.text, "inconclusive", reason="no signal has such an index")
        points = Points(signals, self.condition.reaches)
        span = Span(times.start, times.end, times.outside, forgiven=points.forgiven)
        try:
            rows = self._together(indices, points.count)
            seen = {each: self._decision(points, span, each, scaled=scaled) for each in rows}
            if not next(iter(seen.values())).points:
                return Verdict(self.name, self.text, "inconclusive", reason="no recorded point lies in its window")
            which, worst = min(seen.items(), key=lambda found: found[1].badness)
            verdict, reason = self._verdict(worst, signals, times.end)
            robustness = _finite(worst.decisive.value) if scaled else self._scaled(points, span, seen)
        except WindowError as error:
            return Verdict(self.name, self.text, "inconclusive", reason=str(error))
        extreme, culprit = worst.decisive, worst.culprit()
        index = which[extreme.row] if isinstance(which, tuple) else which
        names, row = self._blamed(culprit, worst.formula.scope, index)
        if index is None:
            index = self._row_number(worst.formula.scope, extreme.row, extreme.rows) or row
        time = worst.formula.points.time(culprit.place)
        return Verdict(
            self.name, self.text, verdict, _finite(extreme.value), time, index, worst.points, reason, robustness, names
        )

    def _together(self, indices: Sequence[int | None], points: int) -> list[Index]:
        """The indices, several at once where they can be rows of one calculation, as far as that fits into a cache."""
        if self.quantifier not in ("always", "finally") or not self.condition.stands_in_rows:
            return list(indices)
        known = [index for index in indices if index is not None]
        size = max(1, _MOST_VALUES // max(1, min(points, runs.BLOCK)))
        return [tuple(known[k : k + size]) for k in range(0, len(known), size)]

    def _decision(self, points: Points, span: Span, index: Index, *, scaled: bool = False) -> Decision:
        """What decides for an index, or for several; `scaled`: every comparison is divided by the size of its unit."""

        def decide(node: Node, scope: Scope) -> Decision:
            formula = Formula(scope, points, scales_of(self.condition, scope, index) if scaled else None)
            return Decision(formula, node, self.quantifier, span)

        return self.condition.apply(decide, points.signals, index)

    def _scaled(self, points: Points, span: Span, seen: Mapping[Index, Decision]) -> float | None:
        """The worst value where every comparison is divided by the size of its unit."""
        found = []
        for index, decision in seen.items():
            scales = scales_of(self.condition, decision.formula.scope, index)
            scale = common(scales)
            if scale is None:
                value = self._decision(points, span, index, scaled=True).decisive.value
            else:
                value = decision.decisive.value / scale
            found.append((not decision.is_missing, value))
        return _finite(min(found, key=lambda pair: (pair[0], 0.0 if not pair[0] else pair[1]))[1])

    def _verdict(
        self, worst: Decision, signals: Prepared, end: float | None
    ) -> tuple[Literal["pass", "fail", "inconclusive"], str]:
        """The verdict, and the reason for it, where it needs one."""
        first, last = signals.ends
        reached = signals.completed if end is None else end <= last + slack(signals.step, last)
        # A number over the whole run (final, settling_time, ...) is not final before the run is.
        reducers = (isinstance(x, Call) and self.condition.functions[x.name].reduces for x in walk(self.condition.tree))
        provisional = not signals.completed and any(reducers)
        if worst.fails and not provisional and (reached or self.quantifier in ("always", "")):
            return "fail", "a value is not a number (NaN)" if worst.is_missing else ""
        if not signals.completed:
            return (
                "inconclusive",
                f"the run ended at {digits(last)} s, before its stop time {digits(signals.stop_time)} s",
            )
        if end is not None and not reached:
            return "inconclusive", f"its window lasts until {digits(end)} s, the run only until {digits(last)} s"
        if not worst.holds:
            return "inconclusive", self._unknown(worst.formula, first, last)
        return "pass", ""

    def _unknown(self, formula: Formula, first: float, last: float) -> str:
        """Why a completed run does not tell."""
        if formula.gaps:
            words = " and ".join(sorted(formula.gaps))
            return f"no point lies in some window of {words}; widen it, or take shorter steps"
        ahead = horizon(self.condition.tree, formula.interval)
        told = f"it looks {digits(ahead)} s ahead, and the run ends at {digits(last)} s"
        if self.quantifier == "" or last - ahead < first:
            return f"{told}; let the run last until {digits(first + ahead)} s"
        return f"{told}; write until {digits(last - ahead, last)} behind it, or let the run go on"

    def _blamed(self, culprit: Culprit, scope: Scope, index: int | None) -> tuple[tuple[str, ...], int | None]:
        """The signals of the comparison that decides, or its parameters if it has none; and the index of its row."""
        names: list[str] = []
        row: int | None = None
        binding = self.condition.bound(scope.binding.plan, index)
        for reference in binding.known(_references, culprit.node) if culprit.node else ():
            resolved = binding.found(reference)
            if reference.stacked and culprit.row < len(resolved) and culprit.rows == len(resolved):
                resolved = [resolved[culprit.row]]
                row = next(iter(SignalName.parse(resolved[0]).indices), None) if row is None else row
            names += resolved
        recorded = scope.signals.names()
        signals = [name for name in names if name in recorded]
        return tuple(dict.fromkeys(signals or names)), row

    def _row_number(self, scope: Scope, row: int, rows: int) -> int | None:
        """The index a row of a slice stands for: 3 for the second row of `train[2:].speed`."""
        resolved = self.condition.resolve(scope.names)
        for reference, names in zip(self.condition.references, resolved, strict=True):
            if reference.stacked and len(names) == rows:
                return next(iter(SignalName.parse(names[row]).indices), None)
        return None

    def _bound_problems(self, names: Collection[str], parameters: Collection[str] | None) -> Iterator[Problem]:
        """What is wrong with the bounds of intervals: they are numbers or parameters, with `i` or without."""
        for node in walk(self.condition.tree):
            if isinstance(node, Temporal) and node.interval is not None and parameters is not None:
                for reference in (x for bound in node.interval for x in walk(bound) if isinstance(x, Reference)):
                    alone = Expression(reference.text, reference)
                    every = {name for k in alone.instances(names) for name in alone.resolve(names, k)[0]}
                    if every and not every <= set(parameters):
                        message = "a bound of an interval is a number or a parameter, not a signal"
                        yield Problem(f"'{self.condition.text}', column {reference.column}", message)


def _references(node: Node) -> list[Reference]:
    """Those in a part of a condition."""
    return [part for part in walk(node) if isinstance(part, Reference)]


def _finite(value: float) -> float | None:
    """A value as it is told; None where it is no measure."""
    if math.isinf(value):
        return None
    return 0.0 if abs(value) <= ZERO else value


def _rehearse(node: Node, scope: Scope) -> None:
    """Calculate a condition in a rehearsal."""
    points = Points(scope.frame.run, reach(node))
    Formula(scope, points, interval=rehearsed_interval).values(node, 0, points.count)


def _clauses(text: str) -> list[tuple[str, str]]:
    """Split at from, until, outside where not in brackets or quotes: [("", condition), (word, argument), ...]."""
    parts = [("", "")]
    depth, start, tokens = 0, 0, tokens_of(text)
    for k, token in enumerate(tokens):
        interval = token.text == "until" and k + 1 < len(tokens) and tokens[k + 1].text == "["
        if token.text in CLAUSES and depth == 0 and not interval:
            parts[-1] = (parts[-1][0], text[start : token.start].strip())
            parts.append((token.text, ""))
            start = token.end
        else:
            depth += (token.text in "([{") - (token.text in ")]}")
    parts[-1] = (parts[-1][0], text[start:].strip())
    return parts


def _moment(expression: Expression, signals: Signals) -> float:
    with np.errstate(all="ignore"):
        return scalar(expression.value(prepared(signals)), f"'{expression.text}', a time of a window,")


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


def _quantifier(text: str) -> tuple[Word, str]:
    """The word in front, and what follows it; no word where a formula stands alone.

    Raises:
        ExpressionError: nothing says when.
    """
    word = re.split(r"\W", text, maxsplit=1)[0]
    for quantifier in QUANTIFIERS:
        if word == quantifier and not text[len(word) :].lstrip().startswith((".", "[", "=")):
            return quantifier, text[len(word) :].strip()
    if not says_when(text):
        first = text.split(" ", maxsplit=1)[0]
        nearest = suggestion(first, QUANTIFIERS) or _MISSING
        raise ExpressionError(Problem("", f"'{text}' does not say when", nearest))
    return "", text


def parse_requirement(name: str, text: str) -> Requirement:
    """Read a requirement such as `always abs(train[i].acceleration) <= 1.0 outside [210, 240]`.

    Raises:
        ExpressionError: with every problem of the text, which does not say the name.
    """
    text = re.sub(r"\s+", " ", text).strip()
    quantifier, rest = _quantifier(text)
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
    if not quantifier and clauses:
        remedy = f"write always ({condition}) {clauses[0][0]} ..., or keep to its intervals"
        problems.append(Problem("", f"'{clauses[0][0]}' stands behind a formula that says itself when", remedy))
    if problems:
        raise ExpressionError(problems)
    made = Requirement(name, text, quantifier, expression, times.get("from"), times.get("until"), tuple(outside))
    if not any(moment.references for moment in made.moments):
        made.times(Rehearsal(()))
    return made
