"""What a master is told of a system beside its instances and connections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..system import Event, Stepping, System
from ..wiring import Link, Wiring


@dataclass(frozen=True)
class Settings:
    """How a master couples.

    Attributes:
        stepping: as the system says it.
        rates: how many communication steps an instance takes at once, by name, where that is not one.
        events: what happens on the way. routes: the connections that each of them makes; none for most.
        threads: how many threads step instances in parallel, where the algorithm and the compiled loop can.
    """

    stepping: Stepping = field(default_factory=Stepping)
    rates: Mapping[str, int] = field(default_factory=dict)
    events: Sequence[Event] = ()
    routes: Sequence[Sequence[Link]] = ()
    threads: int = 1

    @classmethod
    def of(cls, system: System, wiring: Wiring, threads: int = 1) -> Settings:
        """Those of a system that is wired so."""
        step = system.stepping.step
        own = {name: round(x.step / step) for name, x in system.instances.items() if x.step is not None}
        rates = {name: rate for name, rate in own.items() if rate > 1}
        made = [next((x.links for x in wiring.routes if x.event == event), ()) for event in system.events]
        return cls(system.stepping, rates, system.events, made if any(made) else (), threads)


DEFAULT = Settings()
"""Values are held over a step that all instances take at once, and nothing happens on the way."""
