"""What the compiled loop can do: which instances it calls, whose states it saves, what they exchange."""

from __future__ import annotations

from collections.abc import Iterable

from ...fmi import Slave
from ...fmi.binding import LoadedSlave
from ...isolation import IsolatedSlave, Ride, may_ride
from ..coupling import Coupling
from ..exchange import Exchange
from .courses import Courses
from .flattening import can_exchange

Called = LoadedSlave | Ride
"""What the kernel calls."""


def is_able(coupling: Coupling, repeated: Iterable[str]) -> bool:
    """Whether the kernel can do all that is asked for, with instances of which states are saved."""
    exchange, slaves, refresher = coupling.exchange, coupling.slaves, coupling.refresher
    able = all(_can_be_called(x, exchange) for x in slaves.values())
    able = able and not any(link.mapping is not None for link in exchange.every_link)
    able = able and all(can_be_restored(slaves[name]) for name in repeated)
    able = able and Courses.are_able(coupling.extrapolator, exchange)
    here = not any(isinstance(slave, IsolatedSlave) for slave in slaves.values())
    able = able and (refresher is None or (here and refresher.is_decided))
    return able and (here or coupling.loops is None) and can_exchange(exchange)


def _can_be_called(slave: Slave, exchange: Exchange) -> bool:
    """Whether the kernel can call an instance, and set and read what is exchanged."""
    if isinstance(slave, IsolatedSlave):
        given = [part.channel for part in exchange.yields[slave.name]]
        return may_ride(slave, [*(feed.channel for feed in exchange.feeds[slave.name]), *given])
    return isinstance(slave, LoadedSlave) and not slave.rolls_back


def called(slave: Slave) -> Called:
    """What the kernel calls."""
    if isinstance(slave, IsolatedSlave):
        return slave.ride()
    assert isinstance(slave, LoadedSlave)
    return slave


def slopes_call(slave: Called) -> str:
    """The function that takes the slopes of an instance's inputs."""
    assert isinstance(slave, LoadedSlave)
    return slave.INTERPOLATE


def can_be_restored(slave: Slave) -> bool:
    """Whether the kernel can save an instance's state and come back to it."""
    if not isinstance(slave, LoadedSlave) or not slave.interface.can_save_state:
        return False
    return all(call in slave.functions for call in slave.STATE[:3])
