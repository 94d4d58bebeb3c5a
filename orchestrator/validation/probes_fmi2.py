"""Probes of FMI 2.0 FMUs alone, of what the face of an instance does not have: fmi2Reset, and wrong calls."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import c_double, c_uint
from typing import Any

from ..errors import FmuError
from ..fmi.binding import FmuSlave
from .probes import DoubtfulError, Probe, Task, Tried, compare

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
        it = Tried(slave, task.step)
        first = it.initialize().run()
        slave.call("fmi2Reset")
        compare(first, it.initialize().run(), "after fmi2Reset")
    return "a run after fmi2Reset repeats the first, bit for bit"


def order(task: Task) -> str:
    """Calls in a wrong order or with wrong arguments get an error."""
    accepted = []
    unknown, value = (c_uint * 1)(_UNKNOWN_REFERENCE), (c_double * 1)()
    wrong: list[tuple[str, bool, str, tuple[Any, ...]]] = [
        ("fmi2DoStep before initialization", False, "fmi2DoStep", (0.0, task.step, True)),
        ("fmi2ExitInitializationMode out of turn", False, "fmi2ExitInitializationMode", ()),
        ("fmi2EnterInitializationMode while running", True, "fmi2EnterInitializationMode", ()),
        ("fmi2GetReal of a value reference that is not there", True, "fmi2GetReal", (unknown, 1, value)),
        ("fmi2SetReal of a value reference that is not there", True, "fmi2SetReal", (unknown, 1, value)),
        ("fmi2DoStep with a negative step", True, "fmi2DoStep", (0.0, -task.step, True)),
    ]
    for what, initialized, name, arguments in wrong:
        task.trying.write_text(what, encoding="utf-8")
        with _instance(task) as slave:
            if initialized:
                Tried(slave, task.step).initialize()
            if _accepts(slave, name, *arguments):
                accepted.append(what)
    if accepted:
        raise DoubtfulError(f"accepted without an error: {', '.join(accepted)}")
    return f"{len(wrong)} wrong calls got an error"


PROBES: dict[str, Probe] = {"reset": reset, "order": order}
