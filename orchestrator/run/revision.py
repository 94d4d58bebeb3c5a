"""`Revision`: a checked system with other values, checked as a single run is, without doing all of it again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..fmi import Interface, Kind, Workspace
from ..master import check_events
from ..scenario import changed
from ..system import System
from ..wiring import Known, Wiring, find_starts
from .checking import Checked, check

_KEPT = 64
"""So many sets of changed keys are remembered."""


class Revision:
    """Checks changes of one system.

    The first time that some keys are changed, the changed system is checked as a whole. From then on only that is
    looked at which their values may alter: start values of the instances concerned, and events. Where more depends on a
    value (a flag that makes an input matter, a sample time), or something is wrong, the whole is checked again, so that
    what is said is what a single run says.

    Args:
        system: what is changed. kind: how components become models.
        workspace: where FMUs are unpacked.

    Attributes:
        checked: the system as it is.

    Raises:
        ScenarioError: the system cannot run.
    """

    def __init__(self, system: System, workspace: Workspace, kind: Kind) -> None:
        self._system, self._workspace, self._kind = system, workspace, kind
        self.checked = check(system, workspace, kind)
        self._known: dict[tuple[str, ...], Checked] = {(): self.checked}
        self._is_swapped = any(instance.swapped for instance in system.instances.values())

    def of(self, changes: Mapping[str, Any]) -> Checked:
        """The system with other values, found fit to run.

        Args:
            changes: as `changed` takes them.

        Raises:
            ScenarioError: it is not; what it says is what a single run says.
        """
        made, keys = changed(self._system, changes), tuple(changes)
        known = self._known.get(keys)
        found = None if known is None else self._revised(made, known)
        if found is None:
            found = check(made, self._workspace, self._kind)
            if len(self._known) >= _KEPT:
                self._known.pop(next(iter(self._known)))
            self._known[keys] = found
        return found

    def _revised(self, made: System, known: Checked) -> Checked | None:
        """What is known of other values of the same keys, with these; None where the whole has to be checked."""
        events = [*made.events, *known.system.events]
        if made.events != known.system.events and any(event.action == "connect" for event in events):
            return None  # when there are which connections
        events = made.events
        if self._is_swapped:  # what the new model lacks was left out
            if events != self._system.events:
                return None
            events = known.system.events
        interfaces = {name: model.interface for name, model in known.models.items()}
        scratch, starts = Wiring(), dict(known.wiring.starts)
        for name, instance in made.instances.items():
            is_reseeded = made.seed != known.system.seed and "seed" in starts[name]
            if instance is self._system.instances[name] is known.system.instances[name] and not is_reseeded:
                continue
            before = Known(known.system.instances[name].start, known.wiring.starts[name])
            starts[name] = find_starts(made, instance, interfaces[name], scratch, before)
            if _alters_more(interfaces[name], known.wiring.starts[name], starts[name]):
                return None
        wiring = replace(known.wiring, starts=starts, left=known.wiring.left | scratch.left)
        if events != known.system.events:
            scratch.problems += check_events(made, interfaces, wiring)
        if scratch.problems or wiring.left.keys() != known.wiring.left.keys():
            return None
        system = known.system.changed(instances=made.instances, events=events, seed=made.seed)
        return replace(known, system=system, wiring=wiring)


def _alters_more(interface: Interface, before: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether more of a check depends on what is altered than the values themselves."""
    deciding = {*interface.flags.values(), "sample_time"}
    return before.keys() != now.keys() or any(before.get(name) != now.get(name) for name in deciding)
