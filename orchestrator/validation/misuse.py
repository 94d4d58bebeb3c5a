"""The probe of calls that importers must not make: in a wrong state, with wrong arguments."""

from __future__ import annotations

from collections.abc import Iterator
from ctypes import byref, c_bool, c_double, c_uint
from typing import Any, Literal, NamedTuple

from ..errors import FmuError
from ..fmi.binding import LoadedSlave
from .probes import STEPS, DoubtfulError, Probe, Task

State = Literal["instantiated", "running", "terminated"]
_UNKNOWN_REFERENCE = 4_000_000_000
_COMING = "instantiation"


class Wrong(NamedTuple):
    """A wrong call: what it is, the state it is made in, the function and what comes after the instance."""

    what: str
    state: State
    name: str
    arguments: tuple[Any, ...] = ()


def _of_fmi2(task: Task) -> Iterator[Wrong]:
    unknown, value = (c_uint * 1)(_UNKNOWN_REFERENCE), (c_double * 1)()
    yield Wrong("fmi2DoStep before initialization", "instantiated", "fmi2DoStep", (0.0, task.step, True))
    yield Wrong("fmi2ExitInitializationMode out of turn", "instantiated", "fmi2ExitInitializationMode")
    yield Wrong("fmi2EnterInitializationMode while running", "running", "fmi2EnterInitializationMode")
    yield Wrong("fmi2DoStep with a negative step", "running", "fmi2DoStep", (0.0, -task.step, True))
    for name in ("fmi2GetReal", "fmi2SetReal"):
        yield Wrong(f"{name} of a value reference that is not there", "running", name, (unknown, 1, value))
    yield Wrong("fmi2DoStep after fmi2Terminate", "terminated", "fmi2DoStep", (0.0, task.step, True))


def _of_fmi3(task: Task) -> Iterator[Wrong]:
    """What the state machine of co-simulation (FMI 3.0, 4.2.1) has no arrow for, and arguments that cannot be."""
    unknown, two = (c_uint * 1)(_UNKNOWN_REFERENCE), (c_double * 2)()
    told = *(byref(c_bool()) for _ in range(3)), byref(c_double())
    events = *(byref(c_bool()) for _ in range(5)), byref(c_double())
    begin = False, 0.0, 0.0, True, STEPS * task.step
    yield Wrong("fmi3DoStep before initialization", "instantiated", "fmi3DoStep", (0.0, task.step, True, *told))
    yield Wrong("fmi3ExitInitializationMode out of turn", "instantiated", "fmi3ExitInitializationMode")
    yield Wrong("fmi3EnterStepMode before initialization", "instantiated", "fmi3EnterStepMode")
    yield Wrong("fmi3EnterInitializationMode while running", "running", "fmi3EnterInitializationMode", begin)
    # In step mode it is reconfiguration mode, which one with tunable structural parameters has.
    if not any(v.variability == "tunable" for v in task.interface.of("structuralParameter")):
        yield Wrong("fmi3EnterConfigurationMode while running", "running", "fmi3EnterConfigurationMode")
    yield Wrong("fmi3UpdateDiscreteStates outside of event mode", "running", "fmi3UpdateDiscreteStates", events)
    yield Wrong("fmi3EnterStepMode outside of event mode", "running", "fmi3EnterStepMode")
    if not task.interface.event_mode:
        yield Wrong("fmi3EnterEventMode, which it says it does not have", "running", "fmi3EnterEventMode")
    yield Wrong("fmi3DoStep with a negative step", "running", "fmi3DoStep", (0.0, -task.step, True, *told))
    for name in ("fmi3GetFloat64", "fmi3SetFloat64"):
        yield Wrong(f"{name} of a value reference that is not there", "running", name, (unknown, 1, two, 1))
    reals = [v for v in task.interface.of("output") if v.fmi_type == "Float64" and v.element is None]
    for variable in reals[:1]:
        one = (c_uint * 1)(variable.reference)
        yield Wrong("fmi3GetFloat64 of more values than there are", "running", "fmi3GetFloat64", (one, 1, two, 2))
    yield Wrong("fmi3DoStep after fmi3Terminate", "terminated", "fmi3DoStep", (0.0, task.step, True, *told))


_WRONG = {"2.0": _of_fmi2, "3.0": _of_fmi3}


def _brought(task: Task, state: State) -> LoadedSlave:
    slave = task.make("probe")
    if state != "instantiated":
        slave.setup(0.0, STEPS * task.step)
        slave.enter_initialization()
        slave.exit_initialization()
    if state == "terminated":
        slave.terminate()
    return slave


def _accepts(slave: LoadedSlave, wrong: Wrong) -> bool:
    """Whether a call gets no error; a discard is one, too. What a library does not have is refused."""
    try:
        slave.check(wrong.name, slave.function(wrong.name)(slave.pointer, *wrong.arguments))
    except FmuError:
        return False
    return True


def order(task: Task) -> str:
    """Calls in a wrong order or with wrong arguments get an error.

    The standard forbids an importer to make them, and does not say what an FMU does then; it may also end. What was
    tried by a process before is not tried again.
    """
    if task.interface.version not in _WRONG:
        return f"skipped: tried with FMI {' and '.join(_WRONG)} only"
    calls = list(_WRONG[task.interface.version](task))
    tried = {entry["trying"] for entry in task.record.entries() if "trying" in entry}
    for wrong in calls:
        if wrong.what in tried:
            continue
        task.record.trying(_COMING)  # what ends the process there is none of the wrong calls
        slave = _brought(task, wrong.state)
        task.record.trying(wrong.what)
        task.record.add(call=wrong.what, accepted=_accepts(slave, wrong))
        slave.free()
    accepted = [entry["call"] for entry in task.record.entries() if entry.get("accepted")]
    deaths = [f"{what} ({how})" for what, how in task.record.deaths().items()]
    told = [f"accepted without an error: {', '.join(accepted)}"] if accepted else []
    told += [f"took the process down: {', '.join(deaths)}"] if deaths else []
    if told:
        raise DoubtfulError("\n".join([*told, "the standard forbids importers to make these calls"]))
    return f"{len(calls)} wrong calls got an error"


PROBES: dict[str, Probe] = {"order": order}
