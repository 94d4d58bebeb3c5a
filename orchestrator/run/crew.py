"""`Crew`: the instances of a system, which stay loaded from run to run."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager

from ..errors import FmuError
from ..fmi import PlainSlave, Slave
from ..fmi.binding import LoadedSlave
from ..isolation import IsolatedSlave, instantiate
from ..master import Master, Settings
from ..names import SignalName
from .checking import Checked
from .ending import Interruption

_ANEW = "it is instantiated anew for every run"


class Crew:
    """Instances that are reset between runs; those for which that does not do are instantiated anew.

    What another run could have left behind is not taken for granted: after a run that did not come to its end, all are
    made anew; and so is an instance of another maker's that was once given a start value which it is not given now.

    Args:
        kept: the signals that runs keep.

    Attributes:
        kept: as given.
        interruption: hears signals while runs go on.
        notes: who is instantiated anew, and why.
        is_trial: whether all signals are kept of the present run, to be compared.
        untried: instances of other makers that have been reset, of which it is not known yet whether they are then as
            new ones are.
    """

    def __init__(self, kept: Collection[str]) -> None:
        self.kept = kept
        self.is_trial = False
        self.interruption = Interruption(lambda _: None)
        self.notes: dict[str, None] = {}
        self.untried: set[str] = set()
        self._slaves: dict[str, Slave] = {}
        self._master: Master | None = None
        self._given: dict[str, set[str]] = {}
        self._tried: set[str] = set()
        self._renewed: set[str] = set()
        self._is_fit = True

    @property
    def only(self) -> Collection[str] | None:
        """The signals that the present run keeps; None for all of them."""
        return None if self.is_trial else self.kept

    @property
    def is_doubtful(self) -> bool:
        """Whether an instance would be reset now of which it is not known yet whether it is then as a new one is."""
        known = self._tried | self._renewed
        return self._is_fit and any(not (_is_ours(x) or name in known) for name, x in self._slaves.items())

    @contextmanager
    def assembled(self, checked: Checked, restoring: Collection[str] = ()) -> Iterator[Master]:
        """A master of all instances, as they are at the begin of a run.

        Args:
            checked: the system, found fit to run; of one structure from run to run.
            restoring: instances that are restored after steps that they discard.

        Raises:
            FmuError: an instance cannot be loaded or instantiated.
        """
        if not self._is_fit:
            self.dismiss()
        self._is_fit = False
        given, models = _given(checked), checked.models
        kept = {name for name in models if name in self._slaves and self._reset(name, given[name])}
        fresh = {name: model for name, model in models.items() if name not in kept}
        for name, slave in instantiate(fresh, checked.system.instances, lambda: self.interruption.is_asked_for):
            self._slaves[name] = slave
        for name in models:
            self._given[name] = given[name] | (self._given[name] if name in kept else set())
        for name in restoring:
            slave = self._slaves[name]
            assert isinstance(slave, LoadedSlave | IsolatedSlave)  # no other discards a step
            slave.roll_back()
        slaves, starts = {name: self._slaves[name] for name in checked.models}, checked.wiring.starts
        settings, master = Settings.of(checked.system, checked.wiring), self._master
        if master is None or restoring or not master.begin_again(slaves, starts, settings):
            algorithm = checked.system.stepping.algorithm
            master = Master(slaves, checked.order.sequence, checked.wiring.links, starts, algorithm, settings=settings)
        self._master = None if restoring else master
        yield master

    def settle(self, *, fit: bool) -> None:
        """Say how a run ended: the instances are ``fit`` for another one where it came to its end."""
        self._is_fit = fit
        for name, slave in self._slaves.items():
            if slave.disturbed:
                told = f"{name} ({slave.interface.model}) {'; '.join(slave.disturbed)}"
                self.notes[f"{told}; isolate it to keep that to itself"] = None

    def find(self, tried: Collection[str], strange: Collection[str]) -> None:
        """Note which of those that were tried are not as new ones are after a reset; without any, all are trusted."""
        for name in strange:
            self._renew(name, "is not after a reset what a new instance is")
        if not strange:
            self._tried.update(tried)

    def dismiss(self) -> None:
        """Give all instances back."""
        slaves, self._slaves, self._master = self._slaves, {}, None
        self.untried.clear()
        for slave in slaves.values():
            slave.free()

    def _reset(self, name: str, given: set[str]) -> bool:
        """Reset an instance; one that has to be made anew is given back, and False."""
        slave = self._slaves[name]
        is_ours = _is_ours(slave)
        if name not in self._renewed and (is_ours or self._given[name] <= given):
            try:
                slave.reset()
            except FmuError as error:
                self._renew(name, f"cannot be reset ({str(error).splitlines()[0]})")
            else:
                if not is_ours and name not in self._tried:
                    self.untried.add(name)
                return True
        slave.free()
        return False

    def _renew(self, name: str, why: str) -> None:
        self._renewed.add(name)
        self.notes[f"{name} ({self._slaves[name].interface.model}) {why}: {_ANEW}"] = None


def _is_ours(slave: Slave) -> bool:
    """Whether it is of our own make, all of it: its reset is tested."""
    return isinstance(slave, PlainSlave) or slave.interface.own_kind == "native"


def _given(checked: Checked) -> Mapping[str, set[str]]:
    """What each instance is given: start values, and what events set."""
    given = {name: set(starts) for name, starts in checked.wiring.starts.items()}
    for event in checked.system.events:
        if event.action == "set":
            instance, variable = SignalName.parse(event.signal)
            given[instance].add(variable)
    return given
