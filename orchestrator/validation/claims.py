"""Probes of what a description claims: on which inputs outputs depend, which steps are taken, which derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from ctypes import c_double, c_int
from typing import TYPE_CHECKING, Any

from ..errors import FmuError
from ..times import digits
from .agreement import typical_deviation
from .probes import HALF, NotedError, Probe, Task, Tried, instances

if TYPE_CHECKING:
    from ..fmi import Variable

_MOST_INPUTS = 200
"""Inputs that are varied, so that an FMU of thousands takes seconds."""
_FAR = 0.25
"""How far results may be apart, as a part of their range, when steps are half as long."""
_NAMED = 5
_STEPPING = "reading outputs after setting an input without a step between"
"""Which tells what depends directly on what: in no time no state moves. Importers must not do it (FMI 2.0, 4.2.4), so
that an FMU may refuse it, or end."""


def dependencies(task: Task) -> str:
    """Vary each input and see which outputs react: those that say on what they depend must name it."""
    record, interface = task.record, task.interface
    varied = [v for v in interface.of("input") if v.type != "String"][:_MOST_INPUTS]
    told = [v for v in interface.of("output") if v.dependencies is not None]
    if not (varied and told):
        return "skipped: there are no inputs, or no output says on what it depends"
    if _STEPPING not in record.deaths():
        if not interface.single_instance:
            with instances(task) as (it,):
                _note(it.begin(), varied, directly=False)
        with instances(task) as (it,):
            it.initialize().run(HALF)
            record.trying(_STEPPING)
            continuous = [v for v in varied if not interface.event_mode or v.variability == "continuous"]
            _note(it, continuous, directly=True)
    found = [entry for entry in record.entries() if "reacting" in entry]
    direct = {(y, entry["input"]) for entry in found if entry["directly"] for y in entry["reacting"]}
    seen = {(y, entry["input"]) for entry in found for y in entry["reacting"]}
    missing = [f"{v.name} on {u}" for v in told for u in _names(varied) if (v.name, u) in direct and not _lists(v, u)]
    if missing:
        raise FmuError(f"outputs react to inputs that their dependencies leave out: {_some(missing)}")
    idle = [f"{v.name} on {u}" for v in told for u in _names(varied) if _lists(v, u) and (v.name, u) not in seen]
    if idle:
        raise NotedError(f"dependencies that were never seen to act directly: {_some(idle)}")
    return f"{len(told)} outputs react to those of {len(varied)} inputs that they list, as far as can be seen"


def _lists(output: Variable, name: str) -> bool:
    return name in (output.dependencies or ())


def _names(variables: Sequence[Variable]) -> list[str]:
    return [v.name for v in variables]


def _some(things: Sequence[str]) -> str:
    more = f" and {len(things) - _NAMED} more" if len(things) > _NAMED else ""
    return ", ".join(things[:_NAMED]) + more


def _note(it: Tried, varied: Sequence[Variable], *, directly: bool) -> None:
    """Write down which outputs react to which inputs: from where they are, and from where all are others.

    Nothing more is to be had of an FMU that refuses a call.
    """
    with suppress(FmuError):
        for _ in range(2):
            for variable in varied:
                it.record.add(input=variable.name, reacting=_reacting(it, variable), directly=directly)
            for variable in varied:
                channel = it.slave.channel(variable.type, [variable.name])
                channel.set(_others(variable, channel.get()[0])[-1:] or channel.get())


def _reacting(it: Tried, variable: Variable) -> list[str]:
    """The outputs that differ with other values of an input, and do not differ without."""
    channel = it.slave.channel(variable.type, [variable.name])
    value = channel.get()
    channel.set(value)  # what is computed anew whenever something is set shows here
    before = it.read()
    restless = _differing(it, before)
    reacting: set[str] = set()
    for other in _others(variable, value[0]):
        channel.set([other])
        reacting |= _differing(it, before)
    channel.set(value)
    return sorted(reacting - restless - _differing(it, before))


def _differing(it: Tried, before: Sequence[Any]) -> set[str]:
    return {name for name, a, b in zip(it.names, before, it.read(), strict=True) if a != b}


def _others(variable: Variable, value: Any) -> list[Any]:
    """Other values of a variable, within its bounds: one close by, one further away."""
    if variable.type == "Boolean":
        return [1 - int(value)]
    if variable.type == "Enumeration":
        return [number for _, number in variable.choices if number != value][:2]
    low = float("-inf") if variable.minimum is None else variable.minimum
    high = float("inf") if variable.maximum is None else variable.maximum
    if variable.type == "Integer":
        return [x for x in (value + 1, value - 1) if low <= x <= high][:1]
    size = max(abs(value), abs(variable.nominal or 1.0))
    near = [x for x in (value + 1e-3 * size, value - 1e-3 * size) if low <= x <= high][:1]
    return near + [x for x in (value + size, value - size) if low <= x <= high][:1]


def steps(task: Task) -> str:
    """Steps half as long, where the description says that they may vary: taken, and to the same end."""
    interface = task.interface
    if not interface.variable_step:
        return "skipped: takes steps of one length only"
    if interface.single_instance:
        return "skipped: can be instantiated only once per process"
    with instances(task) as (it,):
        expected = it.initialize().run(HALF)
    finer = 0.5 * task.step
    try:
        with instances(task) as (it,):
            found = Tried(it.slave, task, finer).initialize().run(2 * HALF)[1::2]
    except FmuError as error:
        if interface.sampled:
            raise NotedError(f"a sampled block, which does not take steps of {digits(finer)} s") from error
        told = f"says that it takes steps of any length, but not of {digits(finer)} s: {error.args[0]}"
        raise FmuError(told, time=error.time, status=error.status, log=error.log) from error
    away = typical_deviation(expected, found)
    if away > _FAR:
        told = (
            f"with steps of {digits(finer)} s instead of {digits(task.step)} s outputs are "
            f"others, by {away:.0%} of their range"
        )
        if interface.sampled:
            raise NotedError(f"a sampled block: {told}")
        raise FmuError(f"says that it takes steps of any length, but {told}")
    return f"steps of {digits(finer)} s give what steps of {digits(task.step)} s give, but for {away:.1g} of the range"


def derivatives(task: Task) -> str:
    """Derivatives of inputs are taken, those of outputs given, as far as the description says."""
    interface = task.interface
    inputs = [v.name for v in interface.of("input") if v.type == "Real" and v.variability == "continuous"]
    outputs = [v.name for v in interface.of("output") if v.type == "Real" and v.variability == "continuous"]
    takes = interface.interpolates_inputs and bool(inputs)
    highest = interface.output_derivatives if outputs and interface.version != "1.0" else 0
    if not takes and not highest:
        return "skipped: does not say that it takes derivatives of inputs or gives those of outputs"
    told = []
    with instances(task) as (it,):
        it.initialize().run(2)
        if takes:
            it.trying("interpolate")
            it.slave.interpolate(inputs, [1] * len(inputs), [0.0] * len(inputs))
            it.run(1)
            told.append("takes derivatives of inputs")
        for degree in range(1, highest + 1):
            _output_derivatives(it, outputs, degree)
        if highest:
            told.append(f"gives derivatives of outputs up to order {highest}")
    return " and ".join(told)


def _output_derivatives(it: Tried, names: Sequence[str], degree: int) -> None:
    slave, count = it.slave, len(names)
    call = "fmi3GetOutputDerivatives" if slave.COUNTS_VALUES else "fmi2GetRealOutputDerivatives"
    found = (c_double * count)()
    more = (count,) if slave.COUNTS_VALUES else ()
    slave.call(call, slave.references(names), count, (c_int * count)(*[degree] * count), found, *more)


PROBES: dict[str, Probe] = {"dependencies": dependencies, "steps": steps, "derivatives": derivatives}
