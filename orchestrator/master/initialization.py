"""Initialization mode: connected values are exchanged until they agree, and loops that do not settle are solved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..errors import FmuError, LostError, ScenarioError
from ..fmi import Slave
from .algebraic import LoopSolver
from .exchange import Exchange

_SWEEPS = 100
_SHRINKS = 0.8
"""How much smaller each sweep's change must be than the last: slower than that, Newton's method is the better way."""
_AGREE = 1e-12
"""Relative change below which a connected value counts as settled; acyclic systems settle exactly."""
_SOLVED = 1e-9
"""The same after Newton's method, which ends at a residual, not at a fixed point."""
_ATTEMPTS = 4
"""How often Newton's method is tried: what is no real number may change with each solution."""


def settle(exchange: Exchange, sequence: Sequence[Slave], time: float) -> list[int]:
    """Exchange until nothing changes; what is left after that is a loop, for Newton's method where it diverges.

    Args:
        exchange: whose values are to agree.
        sequence: the instances in the order of a sweep.
        time: in s.

    Returns:
        the places of the values that had to be solved for.

    Raises:
        ScenarioError: no consistent values were found; the signals involved and the residual are named.
        LostError: the process of an isolated FMU is gone.
    """
    values = exchange.values
    flushed = len(sequence) + 1  # sweeps after which every chain has settled, whatever the order
    begin, last = list(values), math.inf
    for count in range(max(_SWEEPS, flushed)):
        before = list(values)
        _sweep(exchange, sequence, time)
        change = _largest_change(before, values)
        if change <= _AGREE:
            return []
        if count >= flushed and not change < _SHRINKS * last:
            break
        last = change
    moving = [k for k, (a, b) in enumerate(zip(before, values, strict=True)) if _change(a, b) > 0.0]
    for k in moving:  # exchange that diverges leads away from the solution
        values[k] = begin[k]
    return _solve(exchange, sequence, time, moving)


def _sweep(exchange: Exchange, sequence: Sequence[Slave], time: float) -> None:
    for slave in sequence:
        if exchange.feeds[slave.name]:
            exchange.write(slave.name, time)
            exchange.read(slave, time)


def _solve(exchange: Exchange, sequence: Sequence[Slave], time: float, moving: Sequence[int]) -> list[int]:
    names = ", ".join(exchange.signals[k] for k in moving[:6]) + (", ..." if len(moving) > 6 else "")
    solver = LoopSolver(exchange, moving)
    worst = math.inf
    try:
        for _ in range(_ATTEMPTS):
            left = solver.solve(time)
            found = list(exchange.values)
            _sweep(exchange, sequence, time)
            worst = max(left, _largest_change(found, exchange.values))
            if worst <= _SOLVED:
                return solver.reals
    except LostError:
        raise
    except (FmuError, ValueError, OverflowError) as error:
        raise ScenarioError(f"the initial values of {names} do not settle: {error}") from error
    raise ScenarioError(
        f"the initial values of {names} do not settle: they form an algebraic loop for which no solution was found "
        f"(they still change by {worst:.3g} when exchanged); put a component with memory into the loop, or start "
        "the search elsewhere by other start values"
    )


def _largest_change(before: Sequence[Any], after: Sequence[Any]) -> float:
    return max(map(_change, before, after), default=0.0)


def _change(a: Any, b: Any) -> float:
    """How far a value has moved, relative to its size above 1; what stays NaN has not moved."""
    if a == b:
        return 0.0
    if isinstance(a, str) or isinstance(b, str):
        return 1.0
    if not math.isfinite(b - a):
        return 0.0 if math.isnan(a) and math.isnan(b) else math.inf
    return float(abs(b - a) / max(1.0, abs(a), abs(b)))
