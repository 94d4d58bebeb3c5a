"""A system against the interfaces of its FMUs: start values and connections as single scalars, or what is wrong."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .errors import ExpressionError, did_you_mean
from .expressions import evaluate_constant
from .interface import Interface, Type, Unit, Variable
from .system import Connection, Instance, System, split

_NUMERIC = ("Real", "Integer", "Enumeration")
_COMPATIBLE: dict[Type, tuple[Type, ...]] = {
    "Real": ("Real", "Integer"),
    "Integer": ("Integer", "Enumeration"),
    "Enumeration": ("Enumeration", "Integer"),
    "Boolean": ("Boolean",),
    "String": ("String",),
}
"""For an input's type, the output types it may follow without losing anything."""


@dataclass(frozen=True)
class Link:
    """One scalar connection: target = scale * source + offset, ``delay`` communication points late.

    Attributes:
        source, target: (instance, scalar variable).
        direct: whether the source output depends directly on an input of its FMU.
        connection: what it was made from.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    scale: float
    offset: float
    delay: int
    direct: bool
    connection: Connection


@dataclass
class Wiring:
    """The resolved system.

    Attributes:
        starts: start values by instance and scalar variable. links: scalar connections.
        problems, notes: sentences; with a problem the system cannot run.
    """

    starts: dict[str, dict[str, Any]] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def wire(system: System, interfaces: Mapping[str, Interface]) -> Wiring:
    """Resolve every start value and connection; all problems are collected, none raised."""
    wiring = Wiring()
    for instance in system.instances.values():
        wiring.starts[instance.name] = _starts(system, instance, interfaces[instance.name], wiring)
    for connection in system.connections:
        wiring.links.extend(_links(connection, interfaces, wiring))
    _check_inputs(system, interfaces, wiring)
    _check_sampling(system, interfaces, wiring)
    return wiring


# -------------------------------------------------------------------- start values


def _starts(system: System, instance: Instance, interface: Interface, wiring: Wiring) -> dict[str, Any]:
    values: dict[str, Any] = {}
    dropped = []
    for name, given in instance.start.items():
        scalars = interface.scalars(name)
        where = f"{_place(system.origins.get(f'{instance.name}.{name}', instance.origin))}{instance.name}.{name}"
        if scalars is None and instance.swapped:
            dropped.append(name)
        elif scalars is None:
            valid = [v.name for v in interface.variables.values() if v.settable] + list(interface.arrays)
            wiring.problems.append(f"{where}: {interface.model} has no such variable{did_you_mean(name, valid)}")
        else:
            try:
                values.update(_elements(instance, interface, name, scalars, given))
            except (ValueError, ExpressionError) as error:
                wiring.problems.append(f"{where}: {error}")
    if dropped:
        wiring.notes.append(f"{instance.name}: {interface.model} has no {', '.join(dropped)}; dropped with the swap")
    _set_runtime(system, instance, interface, values)
    return values


def _elements(
    instance: Instance, interface: Interface, name: str, scalars: tuple[str, ...], given: Any
) -> dict[str, Any]:
    """Start values by scalar; a single value is given to every element of an array.

    Raises:
        ValueError: what is wrong with it.
    """
    fixed = [s for s in scalars if not interface.variables[s].settable]
    if fixed:
        raise ValueError(f"it is computed (causality {interface.variables[fixed[0]].causality}) and cannot be set")
    elements = _flatten(given)
    if isinstance(given, list | tuple | np.ndarray):
        if name in interface.variables:
            raise ValueError(f"takes a single value, not the list {given!r}")
        if len(elements) != len(scalars):
            raise ValueError(f"takes {len(scalars)} value{'s' * (len(scalars) > 1)}, {len(elements)} given")
    return {
        scalar: _typed(elements[k % len(elements)], interface.variables[scalar], instance)
        for k, scalar in enumerate(scalars)
    }


def _flatten(given: Any) -> list[Any]:
    if not isinstance(given, list | tuple | np.ndarray):
        return [given]
    return [element for part in given for element in _flatten(part)]


def _typed(given: Any, variable: Variable, instance: Instance) -> Any:
    """A start value as the variable's type; text is an expression of ``i`` and ``count``, but for a text variable."""
    if variable.type == "String":
        if not isinstance(given, str):
            raise ValueError(f"takes text, not {given!r}")
        return given
    if isinstance(given, str):
        constants = (
            {"count": instance.count} if instance.index is None else {"i": instance.index, "count": instance.count}
        )
        given = evaluate_constant(given, **constants)
    is_truth = isinstance(given, bool | np.bool_)
    if variable.type == "Boolean":
        if not is_truth:
            raise ValueError(f"takes true or false, not {given!r}")
        return int(given)
    if is_truth or not isinstance(given, float | int | np.floating | np.integer):
        raise ValueError(f"takes a number, not {given!r}")
    return _bounded(given, variable)


def _bounded(given: Any, variable: Variable) -> float | int:
    if not abs(given) < math.inf:
        raise ValueError(f"takes a finite number, not {given!r}")
    if variable.type != "Real" and given != int(given):
        raise ValueError(f"takes a whole number, not {given!r}")
    low, high = variable.minimum, variable.maximum
    if low is not None and given < low:
        raise ValueError(f"{given} is below the limit {low:g} {variable.unit or ''}".rstrip())
    if high is not None and given > high:
        raise ValueError(f"{given} is above the limit {high:g} {variable.unit or ''}".rstrip())
    return float(given) if variable.type == "Real" else int(given)


def _set_runtime(system: System, instance: Instance, interface: Interface, values: dict[str, Any]) -> None:
    """What the orchestrator sets by itself in our FMUs: the seed, and sample times that follow a changed step."""
    if not interface.vendor:
        return
    if "seed" in interface.variables and "seed" not in values:
        values["seed"] = instance_seed(system.seed, instance.name)
    # A sample time that was given has been rescaled where the step was changed; this is about the FMU's own.
    own = interface.variables.get("sample_time")
    if own is not None and "sample_time" not in values and own.start == system.rescaled_from:
        values["sample_time"] = system.step


def instance_seed(seed: int, name: str) -> int:
    """The seed of one instance: 31 bits of a hash of the scenario's seed and the instance's name."""
    return int.from_bytes(hashlib.sha256(f"{seed}:{name}".encode()).digest()[:4], "big") >> 1


# -------------------------------------------------------------------- connections


def _links(connection: Connection, interfaces: Mapping[str, Interface], wiring: Wiring) -> Iterable[Link]:
    where = f"{_place(connection.origin)}{connection.target!r} = {connection.source!r}"
    ends = []
    for reference, direction in ((connection.source, "output"), (connection.target, "input")):
        problem, scalars = _end(reference, direction, interfaces)
        if problem:
            wiring.problems.append(f"{where}: {problem}")
        ends.append(scalars)
    sources, targets = ends
    if isinstance(connection.delay, bool) or not isinstance(connection.delay, int) or connection.delay < 0:
        wiring.problems.append(f"{where}: delay counts communication points: 0, 1, 2, ..., not {connection.delay!r}")
        return []
    if not sources or not targets:
        return []
    if len(sources) != len(targets):
        wiring.problems.append(f"{where}: the output has {len(sources)} elements, the input {len(targets)}")
        return []
    source_instance, target_instance = split(connection.source)[0], split(connection.target)[0]
    links = []
    for source, target in zip(sources, targets, strict=True):
        a = interfaces[source_instance].variables[source]
        b = interfaces[target_instance].variables[target]
        problem, scale, offset = _conversion(a, interfaces[source_instance], b, interfaces[target_instance], connection)
        if problem:
            wiring.problems.append(f"{where}: {problem}")
            return []
        direct = is_direct(interfaces[source_instance], a)
        links.append(
            Link(
                (source_instance, source),
                (target_instance, target),
                scale,
                offset,
                connection.delay,
                direct,
                connection,
            )
        )
    return links


def _end(reference: str, direction: str, interfaces: Mapping[str, Interface]) -> tuple[str, tuple[str, ...]]:
    instance, name = split(reference)
    if instance not in interfaces:
        return f"there is no instance {instance!r}{did_you_mean(instance, interfaces)}", ()
    interface = interfaces[instance]
    allowed = ("input",) if direction == "input" else ("output", "local", "parameter", "calculatedParameter")
    scalars = interface.scalars(name)
    if scalars is None:
        valid = [v.name for v in interface.of("input" if direction == "input" else "output")]
        listed = valid if len(valid) <= 12 else [*valid[:12], "..."]
        hint = (
            did_you_mean(name, [*valid, *interface.arrays]) or f"; its {direction}s are {', '.join(listed) or 'none'}"
        )
        return f"{interface.model} ({instance}) has no variable {name!r}{hint}", ()
    wrong = [s for s in scalars if interface.variables[s].causality not in allowed]
    if wrong:
        return f"{instance}.{wrong[0]} is not an {direction} but {interface.variables[wrong[0]].causality}", ()
    return "", scalars


def is_direct(interface: Interface, output: Variable) -> bool:
    """Whether an output depends directly on an input of its FMU.

    An FMU that lists no dependencies is taken to have none, except one of ours: ours list them unless they cannot be
    traced.
    """
    if output.causality != "output":
        return False
    if output.dependencies is None:
        return bool(interface.vendor)
    inputs = {v.name for v in interface.of("input")}
    return bool(output.dependencies & inputs)


def _conversion(
    a: Variable, of_a: Interface, b: Variable, of_b: Interface, connection: Connection
) -> tuple[str, float, float]:
    """Problem, scale and offset of output ``a`` feeding input ``b``."""
    if a.type not in _COMPATIBLE[b.type]:
        return f"a {a.type} output cannot feed a {b.type} input", 1.0, 0.0
    if b.type != "Real":
        if (connection.scale, connection.offset) != (1.0, 0.0):
            return f"scale and offset apply to Real inputs, not to {b.type}", 1.0, 0.0
        return "", 1.0, 0.0
    scale, offset = 1.0, 0.0
    if a.unit is not None and b.unit is not None and a.unit != b.unit:
        ua, ub = of_a.units.get(a.unit), of_b.units.get(b.unit)
        if ua is None or ub is None or ua.exponents is None or ub.exponents is None:
            unknown = a.unit if ua is None or ua.exponents is None else b.unit
            return (
                f"unit {a.unit!r} cannot be converted to {b.unit!r}: {unknown!r} is not defined in SI units",
                1.0,
                0.0,
            )
        if ua.exponents != ub.exponents:
            return f"unit {a.unit!r} does not convert to {b.unit!r}", 1.0, 0.0
        scale, offset = convert(ua, ub)
    return "", connection.scale * scale, connection.scale * offset + connection.offset


def convert(a: Unit, b: Unit) -> tuple[float, float]:
    """Scale and offset that turn a value in unit ``a`` into unit ``b``; both of the same dimension."""
    return a.factor / b.factor, (a.offset - b.offset) / b.factor


# -------------------------------------------------------------------- what else can be known


def _check_inputs(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    fed: dict[tuple[str, str], Connection] = {}
    for link in wiring.links:
        if link.target in fed:
            first = fed[link.target]
            wiring.problems.append(
                f"{_place(link.connection.origin)}{'.'.join(link.target)} is fed twice: by {first.source!r} and by "
                f"{link.connection.source!r}"
            )
        fed[link.target] = link.connection
    # Of an input that something is meant to feed, nothing more is said than what is wrong with its connection.
    broken = {c.target for c in system.connections} if wiring.problems else set()
    for instance, interface in interfaces.items():
        given = wiring.starts[instance]
        for variable in interface.of("input"):
            key = (instance, variable.name)
            if key in fed or variable.name in given or variable.name in interface.optional_inputs:
                continue
            if not broken.isdisjoint((".".join(key), f"{instance}.{variable.name.rpartition('[')[0]}")):
                continue
            if interface.vendor:
                wiring.problems.append(
                    f"{_place(system.instances[instance].origin)}{instance}.{variable.name} is a required input and "
                    "nothing feeds it: connect it, or give it a start value to hold it constant"
                )
            else:
                wiring.notes.append(f"{instance}.{variable.name} is not connected; it keeps {variable.start!r}")


def _check_sampling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    told = set()
    for name, interface in interfaces.items():
        place = _place(system.instances[name].origin)
        sample = wiring.starts[name].get("sample_time")
        if sample is None and interface.vendor.get("sampled"):
            sample = interface.variables["sample_time"].start
        if interface.vendor and sample:
            count = round(system.step / sample)
            if count < 1 or abs(count * sample - system.step) > 1e-6 * sample:
                wiring.problems.append(
                    f"{place}{name}: the communication step {system.step:g} s is not a whole multiple of its "
                    f"sample_time {sample:g} s: set step or {name}.sample_time"
                )
        longest = interface.vendor.get("recommended_step")
        if longest and system.step > longest * (1 + 1e-9) and interface.model not in told:
            told.add(interface.model)
            wiring.notes.append(
                f"{interface.model} is advised to step at {longest:g} s or faster; this run steps at {system.step:g} s"
            )


def _place(origin: str) -> str:
    return f"{origin}: " if origin else ""
