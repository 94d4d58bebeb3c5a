"""What a margin is compared with, so that those of unlike signals compare: a size that counts in its unit."""

import numpy as np
from numpy.typing import NDArray

from ..calculation import Scope
from ..expressions import Expression, Index
from ..metrics import unit_of
from ..slack import COMPARISONS, Scales
from ..syntax import Node, Operation, walk

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


def scales_of(condition: Expression, scope: Scope, index: Index) -> Scales:
    """What the slack of each comparison of a condition is divided by, for one value of its index or several."""
    units, kept, key = scope.signals.units, scope.binding.plan.bindings, ("scales", id(condition.tree), index)
    if key not in kept or kept[key][0] is not units:
        if isinstance(index, tuple):
            rows = [_scales_of(condition, scope, one) for one in index]
            found: Scales = {node: _together([row[node] for row in rows]) for node in rows[0]}
        else:
            found = _scales_of(condition, scope, index)
        kept[key] = units, found, condition.tree  # which stays, so that no other tree has its identity
    scales: Scales = kept[key][1]
    return scales


def common(scales: Scales) -> float | None:
    """What all comparisons are divided by, in all rows; None where they differ."""
    same = {scale if isinstance(scale, float) else None for scale in scales.values()} or {1.0}
    return same.pop() if len(same) == 1 else None


def _together(scales: list[float]) -> float | NDArray[np.float64]:
    return scales[0] if len(set(scales)) == 1 else np.array(scales)[:, np.newaxis]


def _scales_of(condition: Expression, scope: Scope, index: int | None) -> dict[int, float]:
    """Anew."""
    found: dict[int, float] = {}
    for node in comparisons(condition.tree):
        assert isinstance(node, Operation)
        difference = Operation("-", node.operands)  # whose unit both sides share
        unit = unit_of(Expression(condition.text, difference, condition.functions), scope.signals, index)
        found[id(node)] = SCALES.get(unit, 1.0)
    return found
