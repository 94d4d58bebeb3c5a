"""Probes of FMUs of every version: they drive an FMU as our master does, through the face of an instance."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FmuError
from ..fmi.binding import SLAVES, LoadedSlave, call_name

if TYPE_CHECKING:
    from ..fmi import Interface, Variable

STEPS = 20
_HALF = STEPS // 2
_TIMES = 20
"""How often an FMU is instantiated where that is allowed."""


class DoubtfulError(Exception):
    """Something that works, though the standard says it should not."""


@dataclass(frozen=True)
class Task:
    """What a probe has to know.

    Attributes:
        probe: which one. interface: the FMU's. folder: where the FMU was unpacked. step: in s.
        answer: the file for the verdict. trying: the file that says what is being tried, in case it is the last thing.
    """

    probe: str
    interface: Interface
    folder: Path
    step: float
    answer: Path
    trying: Path


Probe = Callable[[Task], str]
"""It says what it found, after ``"skipped: "`` why it looked for nothing.

Raises FmuError if the FMU fails or gives what is wrong, DoubtfulError if it does what it should not.
"""


class Tried:
    """An instance, and the steps of one length that it takes from t = 0 s.

    Args:
        slave: the instance.
        step: in s.
    """

    def __init__(self, slave: LoadedSlave, step: float) -> None:
        self.slave = slave
        self.step = step
        self.taken = 0
        names: dict[Any, list[str]] = {}
        for variable in slave.interface.of("output"):
            names.setdefault(variable.type, []).append(variable.name)
        self._outputs = [(each, slave.channel(kind, each)) for kind, each in names.items()]

    def initialize(self) -> Tried:
        """Instantiated -> ready to step."""
        self.taken = 0
        self.slave.setup(0.0, STEPS * self.step)  # with an end, which some demand
        self.slave.enter_initialization()
        self.slave.exit_initialization()
        return self

    def read(self) -> list[Any]:
        """All outputs.

        Raises:
            FmuError: one is not finite.
        """
        values = []
        for names, channel in self._outputs:
            for name, value in zip(names, channel.get(), strict=True):
                if isinstance(value, float) and not math.isfinite(value):
                    raise FmuError(f"output {name} is {value!r} at t = {self.slave.time:g} s", log=self.slave.log)
                values.append(value)
        return values

    def run(self, steps: int = STEPS) -> list[list[Any]]:
        """Take steps; all outputs after each."""
        rows = []
        for _ in range(steps):
            self.slave.step(self.taken * self.step, self.step, final=False)
            self.taken += 1
            rows.append(self.read())
        return rows


@contextmanager
def _instances(task: Task, count: int = 1) -> Iterator[list[Tried]]:
    """Some instances, freed at the end; not after a failure, when the process ends without that."""
    interface = task.interface
    slaves = [SLAVES[interface.version](f"probe{k}", interface, task.folder) for k in range(count)]
    yield [Tried(slave, task.step) for slave in slaves]
    for slave in slaves:
        slave.free()


def compare(expected: list[list[Any]], found: list[list[Any]], where: str) -> None:
    """Refuse rows of outputs that are not as expected."""
    for k, (a, b) in enumerate(zip(expected, found, strict=True)):
        if a != b:
            raise FmuError(f"other outputs {where}: at step {k + 1}, {a!r} became {b!r}")


def instantiate(task: Task) -> str:
    """Load, instantiate and free, again and again where that is allowed."""
    times = 1 if task.interface.single_instance else _TIMES
    for _ in range(times):
        with _instances(task):
            pass
    return f"instantiated and freed {times} time{'s' * (times > 1)}"


def simulate(task: Task) -> str:
    """Initialize with start values, step, read every output, terminate."""
    with _instances(task) as (it,):
        it.initialize()
        it.read()
        rows = it.run()
        it.slave.terminate()
    return f"{STEPS} steps of {task.step:g} s, {len(rows[0])} outputs finite"


def starts(task: Task) -> str:
    """Parameters and inputs have the start values that the description says."""
    described = [v for v in task.interface.of("parameter", "input") if v.start is not None]
    with _instances(task) as (it,):
        it.initialize()
        for variable in described:
            (found,) = it.slave.channel(variable.type, [variable.name]).get()
            if found != _held(variable):
                raise FmuError(f"{variable.name} starts at {found!r}, not at {variable.start!r} as described")
    return f"{len(described)} parameters and inputs start as described"


def _held(variable: Variable) -> Any:
    """A start value as the FMU can hold it."""
    if variable.fmi_type == "Float32":
        return struct.unpack("f", struct.pack("f", variable.start))[0]
    return variable.start


def second_instance(task: Task) -> str:
    """Two instances, stepped in turn, do not disturb one another."""
    if task.interface.single_instance:
        return "skipped: can be instantiated only once per process"
    with _instances(task) as (alone,):
        expected = alone.initialize().run()
    with _instances(task, 2) as (a, b):
        a.initialize()
        b.initialize()
        rows: list[list[Any]] = []
        for _ in range(STEPS):
            rows += a.run(1)
            b.run(1)
        compare(expected, rows, "beside a second instance")
    return "two instances stepped in turn give what one gives alone"


def state(task: Task) -> str:
    """Save, restore, serialize and deserialize the state, where the description says that it can."""
    interface = task.interface
    if not interface.can_save_state:
        return "skipped: does not say that it can get and set its state"
    with _instances(task) as (it,):
        it.initialize().run(_HALF)
        saved = it.slave.save()
        expected = it.run(_HALF)
        it.slave.restore(saved)
        it.taken = _HALF
        compare(expected, it.run(_HALF), f"after {call_name(interface, 'restore', 'Real', ())}")
        content = it.slave.serialize(saved) if interface.can_serialize_state else b""
        it.slave.forget(saved)
    if not interface.can_serialize_state or interface.single_instance:
        return "a run from a restored state repeats the first"
    with _instances(task) as (it,):
        it.initialize()
        saved = it.slave.deserialize(content)
        it.slave.restore(saved)
        it.slave.forget(saved)
        it.taken = _HALF
        compare(expected, it.run(_HALF), "from a serialized state")
    return "a run from a restored or serialized state repeats the first"


PROBES: dict[str, Probe] = {
    "instantiate": instantiate,
    "simulate": simulate,
    "starts": starts,
    "instances": second_instance,
    "state": state,
}
