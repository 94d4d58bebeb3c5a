"""From a checked system to a master of its instances: the one way to set up whatever steps them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager

from ..fmi import Slave
from ..fmi.binding import LoadedSlave
from ..isolation import IsolatedSlave, instantiate
from ..master import Master, Settings
from .checking import Checked


@contextmanager
def assembled(
    checked: Checked,
    *,
    threads: int = 1,
    restoring: Collection[str] = (),
    stopped: Callable[[], bool] | None = None,
) -> Iterator[Master]:
    """A master of all instances, each in a process of its own if it asks for that; they are freed at the end.

    Args:
        checked: the system, found fit to run.
        threads: how many step instances in parallel.
        restoring: instances that are restored after steps that they discard.
        stopped: whether the run is to stop: isolated instances are not waited for long then.

    Raises:
        FmuError: an instance cannot be loaded or instantiated.
    """
    system, wiring = checked.system, checked.wiring
    slaves: dict[str, Slave] = {}
    with ExitStack() as given_back:  # each of them, also when another interruption comes meanwhile
        for name, slave in instantiate(checked.models, system.instances, stopped):
            slaves[name] = slave
            given_back.callback(slave.free)
        for name in restoring:
            slave = slaves[name]
            assert isinstance(slave, LoadedSlave | IsolatedSlave)  # no other discards a step
            slave.roll_back()
        yield Master(
            {name: slaves[name] for name in checked.models},
            checked.order.sequence,
            wiring.links,
            wiring.starts,
            system.stepping.algorithm,
            settings=Settings.of(system, wiring, threads),
        )
