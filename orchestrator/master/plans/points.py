"""What a plan does at a communication point: values are brought up to date without a step."""

from __future__ import annotations

from typing import Protocol

from ..algorithms import HEAD
from ..exchange import Exchange, Yield
from ..refresh import Refresher
from .ability import Called
from .layout import CIRCLE, NOBODY, Kind


class Growing(Protocol):
    """What is asked of a plan to which operations are added: see `Plan`."""

    exchange: Exchange
    slaves: dict[str, Called]
    loops: list[tuple[float, ...]]
    room: int
    width: int

    def add_operation(self, kind: int, index: int, culprit: tuple[Called | None, str], due: tuple[int, int]) -> None:
        """Add an operation."""

    def add_sets(self, slave: Called, rate: int, *, late: bool) -> None:
        """Set inputs."""

    def add_gets(self, slave: Called, rate: int, direct: bool | None, kind: Kind) -> None:
        """Read outputs."""

    def add_reads(self, kind: Kind, slave: Called, part: Yield, due: tuple[int, int]) -> None:
        """Read outputs of one type, or look at them."""


def add_refresh(plan: Growing, refresher: Refresher) -> None:
    """Add what brings feed-through up to date."""
    for stage, is_circle in refresher.stages:
        names = [name for name in stage if name not in refresher.refused]
        number = len(plan.loops)
        if is_circle:
            plan.loops.append((CIRCLE, len(stage) + 1, plan.room, *[0] * 5, 0.0))
            plan.room += HEAD + 2 * plan.width
            plan.add_operation(Kind.BEGIN, number, NOBODY, (1, 0))
            plan.add_operation(Kind.MARK, number, NOBODY, (1, 0))
        for name in names:
            plan.add_sets(plan.slaves[name], 1, late=True)
            plan.add_gets(plan.slaves[name], 1, None, kind=Kind.READ)
        if is_circle:
            plan.add_operation(Kind.END, number, NOBODY, (1, 0))
        for name in names:
            for part in plan.exchange.yields[name]:
                if part.is_real:
                    plan.add_reads(Kind.LOOK, plan.slaves[name], part, (1, 0))
