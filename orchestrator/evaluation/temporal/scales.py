"""What a margin is compared with, so that those of unlike signals compare: a size that counts in its unit."""

from ..calculation import Scope
from ..expressions import Expression
from ..metrics import unit_of
from ..slack import COMPARISONS
from ..syntax import Node, Operation, walk
from .values import Scales

SCALES = {
    "m": 10.0, "km": 0.01, "m/s": 1.0, "km/h": 3.6, "m/s2": 0.1, "m/s3": 0.1, "N/kg": 0.1,
    "kg": 1e3, "t": 1.0, "N": 1e4, "kN": 10.0, "W": 1e5, "kW": 100.0, "J": 1e6, "MJ": 1.0,
    "s": 1.0, "min": 1.0 / 60.0, "h": 1.0 / 3600.0, "rad": 0.1, "deg": 5.0, "rad/s": 0.1, "K": 1.0, "degC": 1.0,
    "V": 10.0, "A": 10.0, "Pa": 1e4, "bar": 0.1,
}  # fmt: skip
"""A clear margin for a train, by unit; 1 for all others, and for what has no unit."""


def comparisons(node: Node) -> list[Node]:
    """All that a condition compares."""
    return [part for part in walk(node) if isinstance(part, Operation) and part.operator in COMPARISONS]


def scales_of(condition: Expression, scope: Scope, index: int | None) -> Scales:
    """What the slack of each comparison of a condition is divided by, for one value of its index."""
    units, kept, key = scope.signals.units, scope.binding.plan.bindings, ("scales", id(condition.tree), index)
    if key not in kept or kept[key][0] is not units:
        kept[key] = (
            units,
            _scales_of(condition, scope, index),
            condition.tree,
        )  # which stays, so that no other tree has its identity
    scales: Scales = kept[key][1]
    return scales


def _scales_of(condition: Expression, scope: Scope, index: int | None) -> Scales:
    """Anew."""
    found: dict[int, float] = {}
    for node in comparisons(condition.tree):
        assert isinstance(node, Operation)
        difference = Operation("-", node.operands)  # whose unit both sides share
        unit = unit_of(Expression(condition.text, difference, condition.functions), scope.signals, index)
        found[id(node)] = SCALES.get(unit, 1.0)
    return found
