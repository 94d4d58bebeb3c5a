"""A look, now and then while FMUs step, at what they share: a call of it for each of theirs would cost too much."""

from __future__ import annotations

from collections.abc import Iterable

from ... import world
from ..slave import Slave
from .loaded import LoadedSlave
from .surroundings import FLOATS, Surroundings, are_floats_changed, mend_floats

_EVERY = 0.05
"""How often it looks, in s."""


def is_watched(slave: Slave | None) -> bool:
    """Whether an instance may change what others share with it: one in this process that is not of our own make."""
    return isinstance(slave, LoadedSlave) and slave.interface.own_kind != "native"


class Watch:
    """Puts back what FMUs of other makers change while they step: see `surroundings`.

    How numbers are rounded need not wait for it: that is looked at after every call.

    Args:
        slaves: the instances; those in processes of their own, and those of our own make, are not looked at.
    """

    def __init__(self, slaves: Iterable[Slave]) -> None:
        self._watched = [slave for slave in slaves if isinstance(slave, LoadedSlave) and is_watched(slave)]
        self._before = Surroundings.now() if self._watched else None
        self._due = 0.0

    @property
    def is_needed(self) -> bool:
        """Whether there is any instance to be looked at."""
        return bool(self._watched)

    def look(self, *, at_once: bool = False) -> None:
        """Look, if the last look was some time ago or it is to be done at once."""
        now = world.perf_counter()
        if (now < self._due and not at_once) or self._before is None:
            return
        self._due = now + _EVERY
        changed = self._before.put_back()
        if are_floats_changed():
            mend_floats()
            changed.append(FLOATS)
        for what in changed:
            for slave in self._watched:
                slave.tell(what if len(self._watched) == 1 else f"{what} (this one or another)")
