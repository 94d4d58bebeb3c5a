"""`Watching`: is shown every communication point of a run in blocks, and tells what it found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ScenarioError
from ...evaluation import Part, Signals
from ...fmi import Interface
from ...master import Rows
from ...system import System
from ...wiring import Wiring
from .crossings import Crossings
from .divergence import Points, Suspicion, explain_divergence, sources_in_cycles
from .finding import Finding
from .rules import rules_of
from .tail import POINTS, Tail

_BLOCK = 512
"""Single points that are looked at together."""
_LAST = 1 << 18
"""Results in which a slow divergence is seen."""


class Watching:
    """Watches one run.

    Args:
        system: what runs. interfaces: of its instances. wiring: its connections.
        signals: names of the values in a row, behind the time. Those that are watched are taken out of it here.
    """

    def __init__(
        self, system: System, interfaces: Mapping[str, Interface], wiring: Wiring, signals: Sequence[str]
    ) -> None:
        self._system, self._interfaces, self._links = system, interfaces, wiring.links
        rules = rules_of(interfaces, wiring)
        ruled = dict.fromkeys(str(signal) for rule in rules for signal, _ in rule.quantity.terms)
        sources = dict.fromkeys(sources_in_cycles(system, interfaces, self._links))
        coupled = [str(source) for source in sources]
        places = {name: k for k, name in enumerate(signals, 1)}
        self._ruled, self._coupled = (np.array([places[x] for x in names], np.intp) for names in (ruled, coupled))
        self._crossings = Crossings(rules, {name: k for k, name in enumerate(ruled)})
        stepping = system.stepping
        self._everything = stepping.record in (None, stepping.step) and not stepping.record_only
        self._tail = Tail(coupled, system.stepping.step)
        self._suspicion = Suspicion(sources, interfaces) if self._everything else None
        self._pick = itemgetter(0, *self._ruled.tolist(), *self._coupled.tolist())
        self._single: list[Sequence[Any]] = []

    def see(self, rows: Rows) -> None:
        """Take points in: each the time in s, and all values."""
        if not len(self._ruled) + len(self._coupled):
            return
        if isinstance(rows, np.ndarray):
            self._look()
            self._take(rows[:, 0], rows, self._ruled, self._coupled)
            return
        self._single += map(self._pick, rows)
        if len(self._single) >= _BLOCK:
            self._look()

    def _look(self) -> None:
        """At single points, together."""
        if self._single:
            table = np.array(self._single, dtype=np.float64)
            self._single = []
            places = np.arange(1, table.shape[1])
            self._take(table[:, 0], table, *np.split(places, [len(self._ruled)]))

    def _take(
        self, time: NDArray[np.float64], rows: NDArray[np.float64], ruled: NDArray[np.intp], coupled: NDArray[np.intp]
    ) -> None:
        """Look at a block, whose columns these are."""
        columns = rows.T
        if len(ruled):
            self._crossings.see(time, columns[ruled].T)
        if self._suspicion is not None:
            for number, place in enumerate(coupled.tolist()):
                self._suspicion.see(number, columns[place])
        else:
            last = rows[-POINTS:]
            self._tail.see(last[:, 0].copy(), last.take(coupled, axis=1))

    def findings(self, recorded: Signals, error: object = None) -> list[Finding]:
        """What was found, the gravest kind first, then by time.

        Args:
            recorded: the run's results.
            error: what it failed of, if it did.
        """
        self._look()
        found = list(self._crossings.findings())
        count = recorded.points
        first = max(0, count - _LAST)
        last = Part(recorded, recorded.part(first, count), first)
        seen: tuple[Points, ...] = (last,) if self._everything else (last, self._tail)
        suspects = None if self._suspicion is None else self._suspicion.suspects()
        diverging = explain_divergence(self._system, self._interfaces, self._links, seen, error, suspects=suspects)
        found += [] if diverging is None else [diverging]
        return sorted(found, key=lambda finding: (finding.rank, finding.since))

    def save(self) -> Any:
        """What was seen, as JSON-ready values; the end of a run is seen anew."""
        self._look()
        return self._crossings.save()

    def restore(self, saved: Any) -> None:
        """Go on where `save` was called.

        Raises:
            ScenarioError: that is of another system.
        """
        self._suspicion = None  # what came before is not seen again
        try:
            self._crossings.restore(saved)
        except (LookupError, TypeError, ValueError) as error:
            raise ScenarioError(
                f"what the checkpoint says of findings does not fit its system ({error}); run it from the start"
            ) from error
