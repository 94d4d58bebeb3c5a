"""A system against the interfaces of its FMUs: start values and connections as single scalars, or what is wrong."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from ..errors import ExpressionError, did_you_mean
from ..evaluation import evaluate_constant
from ..fmi import Interface, Variable
from ..system import Connection, Instance, System, split
from .conversion import fit

_MOST_COMPARED = 50_000
"""How many names wrong ones are compared with to find the nearest: with thousands of both that would take minutes."""
_LISTED = 4
"""How many inputs of an instance are named that nothing feeds."""


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
        told: what a note has said of some connection, and need not of others. compared: names that wrong ones were
            compared with.
    """

    starts: dict[str, dict[str, Any]] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    told: set[str] = field(default_factory=set, repr=False)
    compared: int = field(default=0, repr=False)

    def near(self, name: str, valid: Iterable[str]) -> str:
        """The nearest right name, as a clause; not for ever."""
        if self.compared > _MOST_COMPARED:
            return ""
        names = list(valid)
        self.compared += len(names)
        return did_you_mean(name, names)


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
            valid = (v.name for v in interface.variables.values() if v.settable)
            hint = interface.why_left_out(name) or wiring.near(name, chain(valid, interface.arrays))
            wiring.problems.append(f"{where}: {interface.model} has no such variable{hint}")
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
    fixed = next((interface.variables[s] for s in scalars if not interface.variables[s].settable), None)
    if fixed is not None and fixed.variability == "constant":
        raise ValueError("it is a constant of the model and cannot be set")
    if fixed is not None:
        raise ValueError(f"it is computed (causality {fixed.causality}) and cannot be set")
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
    choices = dict(variable.choices)
    if isinstance(given, str) and given in choices:
        return choices[given]
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
    return bounded(given, variable)


def bounded(given: Any, variable: Variable) -> float | int:
    """A number that a variable can take, as its type.

    Raises:
        ValueError: what is wrong with it.
    """
    try:
        finite = math.isfinite(given)
    except OverflowError:  # a whole number beyond all others
        finite = False
    if not finite:
        raise ValueError(f"takes a finite number, not {given!r}")
    if variable.type != "Real" and given != int(given):
        raise ValueError(f"takes a whole number, not {given!r}")
    if variable.choices and given not in dict(variable.choices).values():
        valid = ", ".join(f"{name} ({value})" for name, value in variable.choices)
        raise ValueError(f"takes one of {valid}, not {given!r}")
    whole = variable.whole_range
    if whole is not None and not whole[0] <= given <= whole[1]:
        raise ValueError(f"takes a whole number from {whole[0]} to {whole[1]}, not {given!r}")
    low, high = variable.minimum, variable.maximum
    if low is not None and given < low:
        raise ValueError(f"{given} is below the limit {low:g} {variable.unit or ''}".rstrip())
    if high is not None and given > high:
        raise ValueError(f"{given} is above the limit {high:g} {variable.unit or ''}".rstrip())
    return float(given) if variable.type == "Real" else int(given)


def _set_runtime(system: System, instance: Instance, interface: Interface, values: dict[str, Any]) -> None:
    """What the orchestrator sets by itself in our FMUs: the seed, and sample times that follow a changed step."""
    if not interface.annotation:
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
        problem, scalars = _end(reference, direction, interfaces, wiring)
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
        conversion = fit(a, interfaces[source_instance], b, interfaces[target_instance], connection)
        if conversion.problem:
            wiring.problems.append(f"{where}: {conversion.problem}")
            return []
        if conversion.note and conversion.note not in wiring.told:
            wiring.told.add(conversion.note)
            wiring.notes.append(f"{where}: {conversion.note}")
        direct = is_direct(interfaces[source_instance], a)
        links.append(
            Link(
                (source_instance, source),
                (target_instance, target),
                conversion.scale,
                conversion.offset,
                connection.delay,
                direct,
                connection,
            )
        )
    return links


def _end(
    reference: str, direction: str, interfaces: Mapping[str, Interface], wiring: Wiring
) -> tuple[str, tuple[str, ...]]:
    instance, name = split(reference)
    if instance not in interfaces:
        return f"there is no instance {instance!r}{wiring.near(instance, interfaces)}", ()
    interface = interfaces[instance]
    allowed = ("input",) if direction == "input" else ("output", "local", "parameter", "calculatedParameter")
    scalars = interface.scalars(name)
    if scalars is None:
        hint = interface.why_left_out(name) or _hint(interface, name, direction, wiring)
        return f"{interface.model} ({instance}) has no variable {name!r}{hint}", ()
    wrong = [s for s in scalars if interface.variables[s].causality not in allowed]
    if wrong:
        return f"{instance}.{wrong[0]} is not an {direction} but {interface.variables[wrong[0]].causality}", ()
    return "", scalars


def _hint(interface: Interface, name: str, direction: str, wiring: Wiring) -> str:
    """The nearest input or output, or a list of them; nothing any more where thousands of names are wrong."""
    if wiring.compared > _MOST_COMPARED:
        return ""
    valid = [v.name for v in interface.of("input" if direction == "input" else "output")]
    listed = valid if len(valid) <= 12 else [*valid[:12], "..."]
    near = wiring.near(name, [*valid, *interface.arrays])
    return near or f"; its {direction}s are {', '.join(listed) or 'none'}"


def is_direct(interface: Interface, output: Variable) -> bool:
    """Whether an output depends directly on an input of its FMU.

    An FMU that lists no dependencies is taken to have none, except one of ours: ours list them unless they cannot be
    traced.
    """
    if output.causality != "output":
        return False
    if output.dependencies is None:
        return interface.annotation is not None
    return not output.dependencies.isdisjoint(interface.inputs)


# -------------------------------------------------------------------- what else can be known


def _check_inputs(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    fed = _fed(interfaces, wiring)
    # Of an input that something is meant to feed, nothing more is said than what is wrong with its connection.
    broken = {c.target for c in system.connections} if wiring.problems else set()
    for instance, interface in interfaces.items():
        given = wiring.starts[instance]
        open_inputs = [
            variable
            for variable in interface.of("input")
            if _slot(instance, variable) not in fed
            and variable.name not in given
            and variable.name not in interface.optional_inputs
            and broken.isdisjoint((f"{instance}.{variable.name}", f"{instance}.{variable.name.rpartition('[')[0]}"))
        ]
        if interface.annotation:
            wiring.problems += [
                f"{_place(system.instances[instance].origin)}{instance}.{variable.name} is a required input and "
                "nothing feeds it: connect it, or give it a start value to hold it constant"
                for variable in open_inputs
            ]
        else:
            wiring.notes += _kept(instance, open_inputs)


def _slot(instance: str, variable: Variable) -> tuple[str, str, int]:
    """What a variable stands for in its FMU: those that share it are one (FMI 2.0, 2.2.7)."""
    kind = "Integer" if variable.type == "Enumeration" else variable.type
    return instance, variable.fmi_type or kind, variable.reference


def _fed(interfaces: Mapping[str, Interface], wiring: Wiring) -> set[tuple[str, str, int]]:
    """Inputs that a connection feeds."""
    fed: dict[tuple[str, str, int], Link] = {}
    for link in wiring.links:
        slot = _slot(link.target[0], interfaces[link.target[0]].variables[link.target[1]])
        first = fed.setdefault(slot, link)
        if first is link:
            continue
        sources = f"by {first.connection.source!r} and by {link.connection.source!r}"
        target = ".".join(link.target)
        if first.target == link.target:
            wiring.problems.append(f"{_place(link.connection.origin)}{target} is fed twice: {sources}")
        elif first.source != link.source:
            wiring.problems.append(
                f"{_place(link.connection.origin)}{target} is another name of {'.'.join(first.target)}, and they are "
                f"fed {sources}: connect one of them"
            )
    return set(fed)


def _kept(instance: str, inputs: Sequence[Variable]) -> list[str]:
    """What an FMU of another maker does with inputs that nothing feeds."""
    if len(inputs) > _LISTED:
        names = ", ".join(v.name for v in inputs[:_LISTED])
        return [f"{instance}: {len(inputs)} inputs are not connected ({names}, ...); they keep their start values"]
    return [
        f"{instance}.{v.name} is not connected; it keeps {'its start value' if v.start is None else repr(v.start)}"
        for v in inputs
    ]


def _check_sampling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    told = set()
    for name, interface in interfaces.items():
        place = _place(system.instances[name].origin)
        sample = wiring.starts[name].get("sample_time")
        if sample is None and interface.sampled and "sample_time" in interface.variables:
            sample = interface.variables["sample_time"].start
        if interface.annotation and sample and isinstance(sample, int | float):
            own_step = system.instances[name].step or system.step
            if not _is_multiple(own_step, sample):
                wiring.problems.append(
                    f"{place}{name}: the communication step {own_step:g} s is not a whole multiple of its "
                    f"sample_time {sample:g} s: set step or {name}.sample_time"
                )
        own, step = interface.default_step, system.instances[name].step or system.step
        if own and not interface.variable_step and not interface.annotation and interface.model not in told:
            told.add(interface.model)
            if not _is_multiple(step, own):
                wiring.notes.append(
                    f"{interface.model} cannot vary its step and is made for {own:g} s; it is stepped at {step:g} s"
                )
        longest = interface.recommended_step
        if longest and system.step > longest * (1 + 1e-9) and interface.model not in told:
            told.add(interface.model)
            wiring.notes.append(
                f"{interface.model} is advised to step at {longest:g} s or faster; this run steps at {system.step:g} s"
            )


def _is_multiple(length: float, part: float) -> bool:
    count = length / part
    return math.isfinite(count) and round(count) >= 1 and abs(round(count) * part - length) <= 1e-6 * part


def _place(origin: str) -> str:
    return f"{origin}: " if origin else ""
