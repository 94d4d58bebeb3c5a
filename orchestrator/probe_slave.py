"""One probe of one FMU of FMI 1.0 or 3.0, run by `validate` as a module in a process of its own, as `probe` is.

It drives the FMU as our master does, through the face of an instance.
"""

from __future__ import annotations

import math
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import probe
from .errors import FmuError
from .instances import SLAVES
from .interface import Variable
from .probe import STEPS, RefusedError, compare
from .reader import read
from .slave import Slave

_KEPT = 5


class Tried:
    """An instance, and the steps it has taken.

    Args:
        spec: what the FMU is: folder, step, start time.
        name: of the instance.
    """

    def __init__(self, spec: dict[str, Any], name: str) -> None:
        folder = Path(spec["folder"])
        interface = read(folder, folder.name)
        self.slave: Slave = SLAVES[interface.version](name, interface, folder)
        self.begin, self.step = float(spec["start_time"]), float(spec["step"])
        self.taken = 0
        kinds = dict.fromkeys(v.type for v in interface.of("output"))
        names = {kind: [v.name for v in interface.of("output") if v.type == kind] for kind in kinds}
        self._outputs = [(names[kind], self.slave.channel(kind, names[kind])) for kind in kinds]

    def initialize(self) -> Tried:
        """Instantiated -> ready to step."""
        self.slave.setup(self.begin, self.begin + 10 * STEPS * self.step)
        self.slave.enter_initialization()
        self.slave.exit_initialization()
        return self

    def read(self) -> list[Any]:
        """All outputs.

        Raises:
            RefusedError: one is not finite.
        """
        values = []
        for names, channel in self._outputs:
            for name, value in zip(names, channel.get(), strict=True):
                if isinstance(value, float) and not math.isfinite(value):
                    raise RefusedError(f"output {name} is {value!r} at t = {self.slave.time:g} s")
                values.append(value)
        return values

    def run(self, steps: int = STEPS) -> list[list[Any]]:
        """Take steps; all outputs after each."""
        rows = []
        for _ in range(steps):
            self.slave.step(self.begin + self.taken * self.step, self.step, final=False)
            self.taken += 1
            rows.append(self.read())
        return rows


@contextmanager
def _instances(spec: dict[str, Any], count: int = 1) -> Iterator[list[Tried]]:
    made = [Tried(spec, f"probe{k}") for k in range(count)]
    yield made
    for it in made:
        it.slave.free()


def instantiate(spec: dict[str, Any]) -> str:
    """Load, instantiate and free, again and again where that is allowed."""
    again = 1 if spec["single"] else 20
    for _ in range(again):
        with _instances(spec):
            pass
    return f"instantiated and freed {again} time{'s' * (again > 1)}"


def simulate(spec: dict[str, Any]) -> str:
    """Initialize with start values, step, read every output, terminate."""
    with _instances(spec) as (it,):
        it.initialize()
        it.read()
        rows = it.run()
        it.slave.terminate()
    return f"{STEPS} steps of {spec['step']:g} s, {len(rows[0])} outputs finite"


def starts(spec: dict[str, Any]) -> str:
    """Parameters and inputs have the start values that the description says."""
    count = 0
    with _instances(spec) as (it,):
        it.initialize()
        for variable in it.slave.interface.of("parameter", "input"):
            if variable.start is not None:
                (found,) = it.slave.channel(variable.type, [variable.name]).get()
                if found != _held(variable):
                    raise RefusedError(f"{variable.name} starts at {found!r}, not at {variable.start!r} as described")
                count += 1
    return f"{count} parameters and inputs start as described"


def _held(variable: Variable) -> Any:
    """A start value as the FMU can hold it."""
    if variable.fmi_type == "Float32":
        return struct.unpack("f", struct.pack("f", variable.start))[0]
    return variable.start


def second_instance(spec: dict[str, Any]) -> str:
    """Two instances, stepped in turn, do not disturb one another."""
    if spec["single"]:
        return "skipped: can be instantiated only once per process"
    with _instances(spec) as (alone,):
        expected = alone.initialize().run()
    with _instances(spec, 2) as (a, b):
        a.initialize()
        b.initialize()
        rows: list[list[Any]] = []
        for _ in range(STEPS):
            rows += a.run(1)
            b.run(1)
        compare(expected, rows, "beside a second instance")
    return "two instances stepped in turn give what one gives alone"


def state(spec: dict[str, Any]) -> str:
    """Save, restore, serialize and deserialize the state, where the description says that it can."""
    if not spec["can_save"]:
        return "skipped: does not say that it can get and set its state"
    with _instances(spec) as (it,):
        it.initialize().run(STEPS // 2)
        saved = it.slave.save()
        expected = it.run(STEPS // 2)
        it.slave.restore(saved)
        it.taken = STEPS // 2
        compare(expected, it.run(STEPS // 2), "from a restored state")
        content = it.slave.serialize(saved) if spec["can_serialize"] else b""
        it.slave.forget(saved)
    if not spec["can_serialize"] or spec["single"]:
        return "a run from a restored state repeats the first"
    with _instances(spec) as (it,):
        it.initialize()
        saved = it.slave.deserialize(content)
        it.slave.restore(saved)
        it.slave.forget(saved)
        it.taken = STEPS // 2
        compare(expected, it.run(STEPS // 2), "from a serialized state")
    return "a run from a restored or serialized state repeats the first"


def _plainly(tried: Callable[[dict[str, Any]], str]) -> Callable[[dict[str, Any]], str]:
    """A probe that tells an FMU's failure in a line."""

    def telling(spec: dict[str, Any]) -> str:
        try:
            return tried(spec)
        except FmuError as error:
            what, *said = str(error).split("\n")
            kept = [line.strip() for line in said][-_KEPT:]
            raise RefusedError(f"{what}; it said: {' / '.join(kept)}" if kept else what) from error

    return telling


PROBES = {
    "instantiate": _plainly(instantiate),
    "simulate": _plainly(simulate),
    "starts": _plainly(starts),
    "instances": _plainly(second_instance),
    "state": _plainly(state),
}

if __name__ == "__main__":
    probe.main(sys.argv[1], PROBES)
