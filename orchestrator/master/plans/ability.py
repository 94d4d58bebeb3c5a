"""What the compiled loop can do: which instances it calls, whose states it saves, what they exchange."""

from __future__ import annotations

from collections.abc import Iterable

from ...fmi import Slave
from ...fmi.binding import LoadedSlave, call_name
from ...isolation import IsolatedSlave, may_ride
from ..coupling import Coupling
from .courses import Called
from .flattening import can_exchange


def is_able(coupling: Coupling, repeated: Iterable[str]) -> bool:
    """Whether the kernel can do all that is asked for, with instances of which states are saved."""
    exchange, slaves, refresher = coupling.exchange, coupling.slaves, coupling.refresher
    able = all(_can_be_called(x) for x in slaves.values())
    able = able and not any(link.mapping is not None for link in exchange.every_link)
    able = able and all(can_be_restored(slaves[name]) for name in repeated)
    continued = coupling.extrapolator.courses if coupling.extrapolator else ()
    able = able and all(_has(slaves[name], "interpolate") for name in continued)
    able = able and (refresher is None or refresher.is_decided)
    return able and can_exchange(exchange)


def _can_be_called(slave: Slave) -> bool:
    """Whether the kernel can call an instance."""
    if isinstance(slave, IsolatedSlave):
        return may_ride(slave)
    return isinstance(slave, LoadedSlave) and not slave.rolls_back


def called(slave: Slave) -> Called:
    """What the kernel calls."""
    if isinstance(slave, IsolatedSlave):
        return slave.ride()
    assert isinstance(slave, LoadedSlave)
    return slave


def can_be_restored(slave: Slave) -> bool:
    """Whether the kernel can save an instance's state and come back to it."""
    return all(_has(slave, call) for call in ("save", "restore", "forget")) and slave.interface.can_save_state


def _has(slave: Slave, call: str) -> bool:
    """Whether an instance's library has the function behind one of its methods."""
    if not isinstance(slave, LoadedSlave | IsolatedSlave):
        return False
    return call_name(slave.interface, call, "Real", ()) in slave.functions
