"""Probes of FMUs of every version: they drive an FMU as our master does, through the face of an instance."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import world
from ..errors import FmuError
from ..fmi.binding import SLAVES, LoadedSlave, Watch, call_name, plain_interface, read_interface
from ..times import digits
from .agreement import Rows, compare, typical_deviation
from .record import Record

if TYPE_CHECKING:
    from ..fmi import Interface, Variable

STEPS = 20
HALF = STEPS // 2
_TIMES = 20
"""How often an FMU is instantiated where that is allowed."""
_FAR = 0.1
"""How far a run from a restored state may be, as a part of the range, from the one that was not interrupted: a solver
that begins anew there takes other steps inside."""
_PRINTED_DIGITS = 6
"""From so many digits on, a start value may be one that was rounded when it was printed."""
_LAST_BITS = 8


class DoubtfulError(Exception):
    """Something that works, though the standard says it should not."""


class NotedError(Exception):
    """Something that a user may want to know of, and that is no fault."""


@dataclass(frozen=True)
class Task:
    """What a probe has to know.

    Attributes:
        probe: which one. interface: the FMU's. folder: where the FMU was unpacked. step: in s.
        answer: the file for what is tried and found, a line each; what a process before found that was taken down.
    """

    probe: str
    interface: Interface
    folder: Path
    step: float
    answer: Path

    def write(self, path: Path) -> None:
        """Write it to a file as JSON, for `read`."""
        told = {"probe": self.probe, "interface": plain_interface(self.interface), "folder": str(self.folder)}
        world.write_text(path, json.dumps(told | {"step": self.step, "answer": str(self.answer)}), encoding="utf-8")

    @classmethod
    def read(cls, path: Path) -> Task:
        """Out of a file."""
        told = json.loads(world.read_text(path, encoding="utf-8"))
        interface = read_interface(told["interface"])
        return cls(told["probe"], interface, Path(told["folder"]), told["step"], Path(told["answer"]))

    @property
    def record(self) -> Record:
        """What is tried and found."""
        return Record(self.answer)

    def make(self, name: str) -> LoadedSlave:
        """An instance, with the event mode if it has one."""
        interface = self.interface
        return SLAVES[interface.version](name, interface, self.folder, events=interface.event_mode)


Probe = Callable[[Task], str]
"""It says what it found, after ``"skipped: "`` why it looked for nothing.

Raises FmuError if the FMU fails or gives what is wrong, DoubtfulError if it does what it should not, NotedError if that
is no fault.
"""


class Tried:
    """An instance, and the steps of one length that it takes from t = 0 s.

    Args:
        slave: the instance.
        task: what the probe knows.
        step: in s; the task's by default.
    """

    def __init__(self, slave: LoadedSlave, task: Task, step: float | None = None) -> None:
        self.slave = slave
        self.step = task.step if step is None else step
        self.taken = 0
        self.record = task.record
        self._end = STEPS * task.step
        names: dict[Any, list[str]] = {}
        for variable in slave.interface.of("output"):
            names.setdefault(variable.type, []).append(variable.name)
        self._outputs = [(each, slave.channel(kind, each)) for kind, each in names.items()]
        self.names = [name for each, _ in self._outputs for name in each]
        """The outputs, as they stand in a row."""

    def trying(self, call: str) -> None:
        """Say which call comes next."""
        self.record.trying(call_name(self.slave.interface, call, "Real", ()))

    def begin(self) -> Tried:
        """Instantiated -> initialization mode."""
        self.taken = 0
        self.trying("enter_initialization")
        self.slave.setup(0.0, self._end)  # with an end, which some demand
        self.slave.enter_initialization()
        return self

    def initialize(self) -> Tried:
        """Instantiated -> ready to step."""
        self.begin()
        self.trying("exit_initialization")
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
                    raise FmuError(f"output {name} is {value!r} at t = {digits(self.slave.time)} s", log=self.slave.log)
                values.append(value)
        return values

    def run(self, steps: int = STEPS) -> list[list[Any]]:
        """Take steps; all outputs after each."""
        rows = []
        self.trying("step")
        for _ in range(steps):
            self.slave.step(self.taken * self.step, self.step, final=False)
            self.taken += 1
            rows.append(self.read())
        return rows

    def free(self) -> None:
        """Give it back."""
        self.trying("free")
        self.slave.free()


@contextmanager
def instances(task: Task, count: int = 1) -> Iterator[list[Tried]]:
    """Some instances, freed at the end; not after a failure, when the process ends without that."""
    task.record.trying(call_name(task.interface, "instantiate", "Real", ()))
    found = [Tried(task.make(f"probe{k}"), task) for k in range(count)]
    yield found
    for it in found:
        it.free()


def instantiate(task: Task) -> str:
    """Load, instantiate and free, again and again where that is allowed."""
    times = 1 if task.interface.single_instance else _TIMES
    for _ in range(times):
        with instances(task):
            pass
    return f"instantiated and freed {times} time{'s' * (times > 1)}"


def simulate(task: Task) -> str:
    """Initialize with start values, step, read every output, terminate."""
    with instances(task) as (it,):
        it.initialize()
        it.read()
        rows = it.run()
        it.trying("terminate")
        it.slave.terminate()
    return f"{STEPS} steps of {digits(task.step)} s, {len(rows[0])} outputs finite"


def surroundings(task: Task) -> str:
    """What the FMU shares with its process is left as it was, and no thread outlives its instance."""
    with instances(task) as (it,):
        watch = Watch([it.slave])
        it.initialize()
        for _ in range(STEPS):
            it.run(1)
            watch.look(at_once=True)
        it.trying("terminate")
        it.slave.terminate()
    if it.slave.disturbed:
        raise NotedError(f"it {'; '.join(it.slave.disturbed)}; isolate it to keep that to itself")
    return "leaves the process that it shares with others as it was"


def starts(task: Task) -> str:
    """Parameters and inputs have the start values that the description says."""
    described = [v for v in task.interface.of("parameter", "input") if v.start is not None]
    rounded = 0
    with instances(task) as (it,):
        it.initialize()
        for variable in described:
            (found,) = it.slave.channel(variable.type, [variable.name]).get()
            held = _held(variable)
            if found != held and not (variable.type == "Real" and abs(found - held) <= _printing_error(held)):
                raise FmuError(f"{variable.name} starts at {found!r}, not at {variable.start!r} as described")
            rounded += found != held
    told = f"; {rounded} of them but for the digits that were not printed" if rounded else ""
    return f"{len(described)} parameters and inputs start as described{told}"


def _held(variable: Variable) -> Any:
    """A start value as the FMU can hold it."""
    if variable.fmi_type == "Float32":
        return struct.unpack("f", struct.pack("f", variable.start))[0]
    return variable.start


def _printing_error(value: float) -> float:
    """How far a number may be from the one that was printed: half a unit of a last digit, or a few bits."""
    last_bits = _LAST_BITS * math.ulp(value)
    shown = Decimal(repr(value)).normalize().as_tuple()
    if not isinstance(shown.exponent, int) or len(shown.digits) < _PRINTED_DIGITS or shown.exponent >= 0:
        return last_bits
    return max(last_bits, 0.5 * 10.0**shown.exponent)


def reset(task: Task) -> str:
    """Reset and run again: the same numbers."""
    with instances(task) as (it,):
        first = it.initialize().run()
        it.trying("reset")
        it.slave.reset()
        call = call_name(task.interface, "reset", "Real", ())
        off = compare(first, it.initialize().run(), f"after {call}")
    return f"a run after {call} repeats the first, {'but for rounding' if off else 'bit for bit'}"


def second_instance(task: Task) -> str:
    """Two instances, stepped in turn, do not disturb one another."""
    if task.interface.single_instance:
        return "skipped: can be instantiated only once per process"
    with instances(task) as (alone,):
        expected = alone.initialize().run()
    with instances(task, 2) as (a, b):
        a.initialize()
        b.initialize()
        rows: list[list[Any]] = []
        for _ in range(STEPS):
            rows += a.run(1)
            b.run(1)
        compare(expected, rows, "beside a second instance")
    return "two instances stepped in turn give what one gives alone"


def state(task: Task) -> str:
    """Save, restore, serialize and deserialize the state, where the description says that it can.

    Runs from a restored state are compared with one another. The standard does not ask for more: a solver may begin
    anew there, and then takes other steps inside than it did without.
    """
    interface = task.interface
    if not interface.can_save_state:
        return "skipped: does not say that it can get and set its state"
    with instances(task) as (it,):
        it.initialize().run(HALF)
        it.trying("save")
        saved = it.slave.save()
        first = it.run(HALF)
        expected = _restored(it, saved)
        restored = f"after {call_name(interface, 'restore', 'Real', ())}"
        compare(expected, _restored(it, saved), restored)
        away = _not_far(first, expected, restored)
        content = b""
        if interface.can_serialize_state:
            it.trying("serialize")
            content = it.slave.serialize(saved)
        it.trying("forget")
        it.slave.forget(saved)
    told = f"a run from a restored state repeats itself{away}"
    if not interface.can_serialize_state or interface.single_instance:
        return told
    with instances(task) as (it,):
        it.initialize()
        it.trying("deserialize")
        saved = it.slave.deserialize(content)
        compare(expected, _restored(it, saved), "from a serialized state")
        it.trying("forget")
        it.slave.forget(saved)
    return told.replace("restored", "restored or serialized")


def _restored(it: Tried, saved: Any) -> list[list[Any]]:
    it.trying("restore")
    it.slave.restore(saved)
    it.taken = HALF
    return it.run(HALF)


def _not_far(first: Rows, restored: Rows, where: str) -> str:
    """How the runs differ from the one that was not interrupted, to append; refuse what no solver explains."""
    if first == restored:
        return " and the first"
    away = typical_deviation(first, restored)
    if away > _FAR:
        compare(first, restored, where)
    return f"; it is not the first to the last bit (by {away:.1g} of its range): the solver begins anew there"


PROBES: dict[str, Probe] = {
    "instantiate": instantiate,
    "simulate": simulate,
    "surroundings": surroundings,
    "starts": starts,
    "reset": reset,
    "instances": second_instance,
    "state": state,
}
