"""Named figures of merit: expressions over reducers, which turn recorded signals into one number.

Every reducer is defined in `docs/metrics.md`. Over several rows (`train[:].speed`) it gives one number for the whole.
NaN in the window gives NaN; a window the run does not cover is an error (`WindowError`), never a number.
"""

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import ExpressionError
from ..problems import Problem
from .calculation import names_of
from .expressions import Expression
from .functions import ELEMENTWISE, Function
from .reducers import PLATOON, Fold, Span, folds
from .signals import Signals
from .syntax import Call, Node, Number, Operation, Reference
from .terms import Plan, Prepared, Term

Array = NDArray[np.float64]

COMFORT_TITLE = "quasi-static acceleration compared with the ISO 2631-1 reaction scale (as in the source)"
# Level, lowest and highest value [m/s2], wording. ISO 2631-1:1997 Annex C as quoted by Wang et al. 2020: the bands
# overlap on purpose. Levels 2 to 5 include both ends, 1 and 6 exclude theirs.
COMFORT_SCALE = (
    (1, 0.0, 0.315, "not uncomfortable"),
    (2, 0.315, 0.63, "a little uncomfortable"),
    (3, 0.5, 1.0, "fairly uncomfortable"),
    (4, 0.8, 1.6, "uncomfortable"),
    (5, 1.25, 2.5, "very uncomfortable"),
    (6, 2.0, np.inf, "extremely uncomfortable"),
)


def _plain(make: Callable[[], Fold]) -> Callable[..., tuple[Array, Fold]]:
    """The common form of a reducer: one signal."""
    return lambda _, x: (x, make())


def _traction_energy(_: Span, force: Array, speed: Array) -> tuple[Array, Fold]:
    return np.maximum(force * speed, 0.0), folds.integral()


def _braking_energy(_: Span, force: Array, speed: Array) -> tuple[Array, Fold]:
    return np.maximum(-force * speed, 0.0), folds.integral()


def _at(span: Span, x: Array, t: float) -> tuple[Array, Fold]:
    return x, folds.Value(t, span)


def _settling_time(_: Span, x: Array, band: float) -> tuple[Array, Fold]:
    return x, folds.settling(lambda rows: np.abs(rows) > band, tolerates_nan=False)


def _overshoot(_: Span, x: Array, reference: Array) -> tuple[Array, Fold]:
    return x - reference, folds.overshoot()


def _mean_jerk(span: Span, x: Array, window: float = 1.0) -> tuple[Array, Fold]:
    if not window > 0:
        raise ExpressionError("the window of mean_jerk must be longer than 0 s")
    return x, folds.MeanJerk(window, span)


def _at_sample(signals: Signals, x: Array) -> Array:
    # A sampled block's feed-through output is recorded at t_{k+1} but was computed from the state at t_k.
    if x.ndim == 0 or signals.time.size < 2:
        return x
    if not np.allclose(np.diff(signals.time), signals.step, rtol=1e-6, atol=0.0):
        raise ExpressionError(EVERY_STEP)
    return np.concatenate([x[..., 1:], x[..., -1:]], axis=-1)


EVERY_STEP = Problem("", "at_sample needs steps of one length", "take an algorithm that keeps the step")
_PLAIN: dict[str, tuple[str, Callable[[], Fold]]] = {  # name: unit, fold
    "min": ("same", folds.minimum),
    "max": ("same", folds.maximum),
    "peak": ("same", folds.peaks),
    "comfort": ("same", folds.peaks),
    "initial": ("same", folds.initial),
    "final": ("same", folds.final),
    "mean": ("same", lambda: folds.means(lambda means: means.mean(axis=-1))),
    "rms": ("same", lambda: folds.means(lambda means: np.sqrt(means.max(axis=-1)), squares=True)),
    "spread": ("same", folds.spread),
    "integral": ("", folds.integral),
    "duration": ("s", folds.duration),
    "first_time": ("s", folds.first_time),
    "last_time": ("s", folds.last_time),
    "jerk": ("per s", folds.jerk),
}
_OTHERS: dict[str, tuple[str, Callable[..., Any]]] = {
    "overshoot": ("same", _overshoot),
    "settling_time": ("s", _settling_time),
    "mean_jerk": ("per s", _mean_jerk),
    "traction_energy": ("J", _traction_energy),
    "braking_energy": ("J", _braking_energy),
}
REDUCERS: dict[str, Function] = {
    **{name: Function(_plain(make), unit, window="span") for name, (unit, make) in _PLAIN.items()},
    **{name: Function(call, unit, window="span") for name, (unit, call) in _OTHERS.items()},
    "at": Function(_at, "same", window="all"),
    **PLATOON,
}
FUNCTIONS: dict[str, Function] = {
    **ELEMENTWISE,
    **REDUCERS,
    "at_sample": Function(_at_sample, "same", takes_signals=True),
}


def comfort_levels(value: float) -> tuple[int, ...]:
    """Every level of the reaction scale whose band holds an acceleration [m/s2]; () for NaN. The bands overlap."""
    size = abs(value)
    return tuple(
        level
        for level, low, high, _ in COMFORT_SCALE
        if (size < high if level == 1 else size > low if level == 6 else low <= size <= high)
    )


def unit_of(expression: Expression, signals: Signals, index: int | None = None) -> str:
    """The unit of an expression where a simple rule tells it, else nothing.

    A signal has its own; sums and reducers keep a unit all their parts share (bare numbers go with any).
    """
    plan = signals.plan if isinstance(signals, Prepared) else Plan(names_of(signals))
    binding = expression.bound(plan, index)

    def visit(node: Node) -> str | None:  # None: a bare number
        match node:
            case Reference():
                return shared([signals.units.get(name, "") for name in binding.found(node)])
            case Number():
                return None
            case Operation(operator="+" | "-" | "negative" | "positive", operands=operands):
                return shared([visit(operand) for operand in operands])
            case Operation(operator="*", operands=operands):
                return _PRODUCTS.get(frozenset(visit(operand) or "" for operand in operands), "")
            case Call(name=name, arguments=arguments) if arguments:
                unit = expression.functions[name].unit
                first = visit(arguments[0]) or ""
                both = name in {"minimum", "maximum", "overshoot"}
                same = shared([visit(argument) for argument in arguments[:2]]) if both else first  # not of the window
                return {"same": same, "per s": _PER_SECOND.get(first, "")}.get(unit, unit)
        return ""

    def shared(units: Sequence[str | None]) -> str | None:
        known = {unit for unit in units if unit is not None}
        return known.pop() if len(known) == 1 else "" if known else None

    return visit(expression.tree) or ""


_PRODUCTS = {
    frozenset(units): product
    for *units, product in (("N", "m/s", "W"), ("N", "m", "J"), ("W", "s", "J"), ("kg", "m/s2", "N"), ("m/s", "s", "m"))
}
_PER_SECOND = {"m": "m/s", "m/s": "m/s2", "m/s2": "m/s3"}


@dataclass(frozen=True)
class Metric:
    """The value of a named figure of merit, or one value for every i. NaN with a `problem` when it has none."""

    name: str
    expression: str
    values: dict[int | None, float]
    unit: str = ""
    comfort: bool = False  # to be shown with the levels of the reaction scale, under COMFORT_TITLE
    problem: str = ""
    truth: bool = False  # a condition: 1 is true, 0 is false

    def text(self, index: int | None = None) -> str:
        """One value as it is printed: `138.5 s`, `never`, `1.000 m/s2 (levels 3, 4)`."""
        value = self.values[index]
        if value == np.inf and self.unit == "s":
            return "never"
        if self.truth and not np.isnan(value):
            return "true" if value else "false"
        if not self.comfort or not np.isfinite(value):
            return f"{value:.6g} {self.unit}".rstrip()
        levels = comfort_levels(value)
        return f"{value:.3f} {self.unit} (level{'s' * (len(levels) > 1)} {', '.join(map(str, levels))})"


@dataclass(frozen=True)
class MetricChange:
    """One value of a metric from two runs, such as at the step and at half of it."""

    name: str
    index: int | None
    value: float
    other: float
    unit: str

    @property
    def difference(self) -> float:
        """`other - value`; 0 when both are the same infinity."""
        return 0.0 if self.other == self.value else self.other - self.value


def check_metric(
    expression: Expression, names: Collection[str], steady: bool = True, parameters: Collection[str] | None = None
) -> list[Problem]:
    """Every problem of a metric that can be found before a run.

    Args:
        expression: the metric.
        names: the signals to be recorded and the parameters.
        steady: whether communication steps are of one length.
        parameters: which of the names are parameters; without it a forgotten reducer shows only after the run.
    """
    problems = expression.check(names)
    if not problems and parameters is not None and _varies(expression, expression.tree, names, parameters):
        problems = [_not_reduced(expression.text)]
    if expression.calls("at_sample") and not steady:
        problems.append(EVERY_STEP.at(f"'{expression.text}'"))
    return problems


def _varies(expression: Expression, node: Node, names: Collection[str], parameters: Collection[str]) -> bool:
    """Whether a signal stands outside every reducer."""
    if isinstance(node, Call) and expression.functions[node.name].reduces:
        return False
    if isinstance(node, Reference):
        alone = Expression(node.text, node)
        return any(name not in parameters for k in alone.instances(names) for name in alone.resolve(names, k)[0])
    children = node.operands if isinstance(node, Operation) else node.arguments if isinstance(node, Call) else ()
    return any(_varies(expression, child, names, parameters) for child in children)


def _not_reduced(text: str) -> Problem:
    return Problem("", f"'{text}' is a signal, not a number", f"reduce it, as in max({text})")


class Numbers(NamedTuple):
    """The values of a metric for each i, as far as there are any; whether they are true or false; what is wrong."""

    values: dict[int | None, float]
    truth: bool = False
    problem: str = ""


def numbers_of(text: str, expression: Expression, run: Prepared) -> Numbers:
    """The values of a metric of a run, which is written as the text. One that cannot be evaluated is NaN."""
    values: dict[int | None, float] = {}
    truth = False
    try:
        indices, several = _ready(expression, run.plan)
        rows = None if several is None else _rows(several, run, len(indices))
        if rows is not None:
            return Numbers(dict(zip(indices, map(float, rows.tolist()), strict=True)), rows.dtype == np.bool_)
        for index in indices:
            values[index] = np.nan
            value = expression.value(run, index)
            if value.ndim:
                raise ExpressionError(_not_reduced(text))
            values[index], truth = float(value), value.dtype == np.bool_
    except ExpressionError as error:
        return Numbers(values, problem=str(error))
    return Numbers(values, truth)


def measure(name: str, text: str, expression: Expression, run: Prepared) -> Metric:
    """A metric of a run, which is written as the text. One that cannot be evaluated is NaN and says why."""
    values, truth, problem = numbers_of(text, expression, run)
    known = list(values)[: len(values) - bool(problem)]
    unit = _unit(expression, run, known[-1]) if known else ""
    comfort = isinstance(expression.tree, Call) and expression.tree.name == "comfort"
    return Metric(name, text, values or {None: np.nan}, unit, comfort, problem, truth)


def _ready(expression: Expression, plan: Plan) -> tuple[tuple[int | None, ...], Term | None]:
    """The indices of a metric, and what gives its values at once where that can be."""
    key = "ready", expression.text, id(expression.functions)
    if key not in plan.bindings:
        indices = expression.instances(plan.names)
        several = tuple(index for index in indices if index is not None)
        together = None
        if len(several) > 1 and expression.stands_in_rows:
            with suppress(ExpressionError):  # it says so for each
                together = expression.bound(plan, several).term(expression.tree)
        plan.bindings[key] = expression.functions, indices, together  # the first, lest another gets its id
    _, indices, together = plan.bindings[key]
    return indices, together


def _rows(together: Term, run: Prepared, count: int) -> Array | None:
    """All values of a metric at once; None where one of them has to say why it is none."""
    try:
        values = run.whole[together]
    except (ExpressionError, ValueError):
        return None
    return None if values.shape != (count, 1) or np.count_nonzero(np.isnan(values)) else values[:, 0]


def _unit(expression: Expression, run: Prepared, index: int | None) -> str:
    """As `unit_of` has it, found once for runs with the same units."""
    kept, key = run.plan.bindings, ("unit", expression.text, index)
    if key not in kept or kept[key][0] is not run.units:
        kept[key] = run.units, unit_of(expression, run, index)
    return str(kept[key][1])


def compare_metrics(metrics: Sequence[Metric], others: Sequence[Metric]) -> list[MetricChange]:
    """The values of two runs side by side, for those both have."""
    second = {other.name: other for other in others}
    return [
        MetricChange(metric.name, index, value, second[metric.name].values[index], metric.unit)
        for metric in metrics
        if metric.name in second
        for index, value in metric.values.items()
        if index in second[metric.name].values
    ]
