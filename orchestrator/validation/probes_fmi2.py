"""Probes of FMI 2.0 FMUs alone, of what the face of an instance does not have: fmi2Reset, and wrong calls."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import c_double, c_uint
from typing import Any

from ..errors import FmuError
from ..fmi.binding import FmuSlave
from .agreement import compare
from .probes import DoubtfulError, Probe, Task, Tried

_UNKNOWN_REFERENCE = 4_000_000_000


def _accepts(slave: FmuSlave, name: str, *arguments: Any) -> bool:
    """Whether a call gets no error; a discard is one, too."""
    status = slave.function(name)(slave.pointer, *arguments)
    try:
        slave.check(name, status)
    except FmuError:
        return False
    return True


@contextmanager
def _instance(task: Task) -> Iterator[FmuSlave]:
    slave = FmuSlave("probe", task.interface, task.folder)
    yield slave
    slave.free()


def reset(task: Task) -> str:
    """Reset and run again: the same numbers."""
    with _instance(task) as slave:
        it = Tried(slave, task)
        first = it.initialize().run()
        task.record.trying("fmi2Reset")
        slave.call("fmi2Reset")
        off = compare(first, it.initialize().run(), "after fmi2Reset")
    return f"a run after fmi2Reset repeats the first, {'but for rounding' if off else 'bit for bit'}"


def order(task: Task) -> str:
    """Calls in a wrong order or with wrong arguments get an error.

    The standard forbids an importer to make them, and does not say what an FMU does then; it may also end. What was
    tried by a process before is not tried again.
    """
    unknown, value = (c_uint * 1)(_UNKNOWN_REFERENCE), (c_double * 1)()
    wrong: list[tuple[str, bool, str, tuple[Any, ...]]] = [
        ("fmi2DoStep before initialization", False, "fmi2DoStep", (0.0, task.step, True)),
        ("fmi2ExitInitializationMode out of turn", False, "fmi2ExitInitializationMode", ()),
        ("fmi2EnterInitializationMode while running", True, "fmi2EnterInitializationMode", ()),
        ("fmi2DoStep with a negative step", True, "fmi2DoStep", (0.0, -task.step, True)),
        ("fmi2GetReal of a value reference that is not there", True, "fmi2GetReal", (unknown, 1, value)),
        ("fmi2SetReal of a value reference that is not there", True, "fmi2SetReal", (unknown, 1, value)),
    ]
    tried = {entry["trying"] for entry in task.record.entries() if "trying" in entry}
    for what, initialized, name, arguments in wrong:
        if what in tried:
            continue
        with _instance(task) as slave:
            if initialized:
                slave.setup(0.0, 20 * task.step)
                slave.enter_initialization()
                slave.exit_initialization()
            task.record.trying(what)
            task.record.add(call=what, accepted=_accepts(slave, name, *arguments))
    accepted = [entry["call"] for entry in task.record.entries() if entry.get("accepted")]
    deaths = [f"{what} ({how})" for what, how in task.record.deaths().items()]
    told = [f"accepted without an error: {', '.join(accepted)}"] if accepted else []
    told += [f"took the process down: {', '.join(deaths)}"] if deaths else []
    if told:
        raise DoubtfulError("\n".join([*told, "the standard forbids importers to make these calls"]))
    return f"{len(wrong)} wrong calls got an error"


PROBES: dict[str, Probe] = {"reset": reset, "order": order}
