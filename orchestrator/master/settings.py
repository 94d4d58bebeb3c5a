"""How a master couples, out of what a system says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..system import Acceleration, Event, Loops, System


@dataclass(frozen=True)
class Settings:
    """How a master couples, as `System` describes it.

    Attributes:
        rates: how many communication steps an instance takes at once, by name, where that is not one.
        threads: how many threads step instances in parallel (``jacobi`` in the compiled loop).
    """

    extrapolation: int = 0
    algebraic_loops: Loops = "delay"
    tolerance: float | None = None
    tolerances: Mapping[str, Sequence[float]] = field(default_factory=dict)
    max_iterations: int = 50
    relaxation: float = 1.0
    acceleration: Acceleration = "anderson"
    min_step: float | None = None
    rates: Mapping[str, int] = field(default_factory=dict)
    events: Sequence[Event] = ()
    threads: int = 1

    @classmethod
    def of(cls, system: System, threads: int = 1) -> Settings:
        """Those of a system."""
        own = {name: round(x.step / system.step) for name, x in system.instances.items() if x.step is not None}
        return cls(
            extrapolation=system.extrapolation,
            algebraic_loops=system.algebraic_loops,
            tolerance=system.tolerance,
            tolerances=system.tolerances,
            max_iterations=system.max_iterations,
            relaxation=system.relaxation,
            acceleration=system.acceleration,
            min_step=system.min_step,
            rates={name: rate for name, rate in own.items() if rate > 1},
            events=system.events,
            threads=threads,
        )


DEFAULT = Settings()
"""Values are held over a step that all instances take at once, and nothing happens on the way."""
