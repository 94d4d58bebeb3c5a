"""What else can be known of a resolved system: inputs that nothing feeds, or two do, and steps that meet no sample."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ..fmi import Interface, Variable
from ..names import SignalName
from ..problems import Problem
from ..system import System
from ..times import digits
from .links import Link, Wiring

_COUNTABLE = 2.0**31 - 1.0
"""Samples that a step may have."""

_LISTED = 4
"""How many inputs of an instance are named that nothing feeds."""


def check_inputs(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    """Note inputs that are fed twice, ours that nothing feeds though they need it, and what others' then keep."""
    fed = check_fed_once(interfaces, wiring)
    # Of an input that something is meant to feed, nothing more is said than what is wrong with its connection.
    broken = set(_targets(system, interfaces)) if wiring.problems else set()
    for instance, interface in interfaces.items():
        given = wiring.starts[instance]
        open_inputs = [
            variable
            for variable in interface.of("input")
            if _slot(instance, variable) not in fed
            and variable.name not in given
            and variable.name not in interface.optional_inputs
            and (instance, variable.name) not in broken
        ]
        if interface.annotation:
            origin = system.instances[instance].origin
            flagged = _flagged(instance, interface, fed, wiring)
            wiring.problems += [problem.at(origin) for problem in flagged if problem.names[0] not in broken]
            wiring.problems += [_unfed(SignalName(instance, variable.name)).at(origin) for variable in open_inputs]
        else:
            wiring.notes += _kept(instance, open_inputs)


def _flagged(
    instance: str, interface: Interface, fed: Container[tuple[str, str, int, int]], wiring: Wiring
) -> Iterator[Problem]:
    """Inputs that a flag makes matter though nothing feeds them, and fed ones whose flag nobody thought of."""
    given, variables = wiring.starts[instance], interface.variables
    for name, flag in interface.flags.items():
        if name in interface.unused_inputs or not {name, flag} <= variables.keys():
            continue
        signal, driver = SignalName(instance, name), SignalName(instance, flag)
        is_fed, is_driven = (_slot(instance, variables[one]) in fed for one in (name, flag))
        is_set = is_driven or bool(given.get(flag, variables[flag].start))
        if is_set and not is_fed and name not in given:
            what = "is connected" if is_driven else "is true"
            way_out = f"leave {driver} unconnected" if is_driven else f"set {driver} = false"
            message = f"{signal} is read, because {driver} {what}, and nothing feeds it"
            yield Problem("", message, f"connect it, or {way_out}", (signal, driver))
        elif is_fed and not is_set and flag not in given:
            message = f"{signal} is connected, but {driver} is false by itself, so that it is not read"
            yield Problem("", message, f"set {driver} = true, or = false if that is meant", (signal, driver))


def _targets(system: System, interfaces: Mapping[str, Interface]) -> Iterable[SignalName]:
    """The inputs that connections name, whether or not they can be made."""
    for connection in system.connections:
        instance, name = SignalName.parse(connection.target)
        scalars = interfaces[instance].scalars(name) if instance in interfaces else None
        yield from (SignalName(instance, scalar) for scalar in scalars or ())


def _unfed(signal: SignalName) -> Problem:
    what = "is a required input and nothing feeds it: connect it, or give it a start value to hold it constant"
    return Problem("", f"{signal} {what}", names=(signal,))


def _slot(instance: str, variable: Variable) -> tuple[str, str, int, int]:
    """What a variable stands for in its FMU: those that share it are one (FMI 2.0, 2.2.7)."""
    kind = "Integer" if variable.type == "Enumeration" else variable.type
    return instance, variable.fmi_type or kind, variable.reference, variable.element[1] if variable.element else 0


def check_fed_once(interfaces: Mapping[str, Interface], wiring: Wiring) -> set[tuple[str, str, int, int]]:
    """Inputs that a connection feeds; those that two do are noted."""
    fed: dict[tuple[str, str, int, int], Link] = {}
    for link in wiring.links:
        slot = _slot(link.target[0], interfaces[link.target[0]].variables[link.target[1]])
        first = fed.setdefault(slot, link)
        if first is link:
            continue
        sources = f"by {first.connection.source!r} and by {link.connection.source!r}"
        if first.target == link.target:
            message = f"{link.target} is fed twice: {sources}"
        elif first.source != link.source:
            message = (
                f"{link.target} is another name of {first.target}, and they are fed {sources}: connect one of them"
            )
        else:
            continue
        ends = (SignalName.parse(text) for text in (first.connection.source, link.connection.source))
        problem = Problem("", message, names=(link.target, first.target, *ends))
        wiring.problems.append(problem.at(link.connection.origin))
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


class Unmet(NamedTuple):
    """An instance of ours that does not take a sample, or several, in each communication step.

    Attributes:
        problem: says so.
        countable: whether it can take as many samples as there are in a step.
        between: whether it samples between communication points.
    """

    problem: Problem
    countable: bool
    between: bool


def unmet_samples(
    system: System, interfaces: Mapping[str, Interface], starts: Mapping[str, Mapping[str, Any]]
) -> Iterator[Unmet]:
    """Instances of ours whose communication step is no whole multiple of their sample time."""
    for name, interface in interfaces.items():
        sample = starts[name].get("sample_time")
        if sample is None and interface.sampled and "sample_time" in interface.variables:
            sample = interface.variables["sample_time"].start
        if not interface.annotation or not sample or not isinstance(sample, int | float):
            continue
        step = system.instances[name].step or system.stepping.step
        countable = step / sample < _COUNTABLE
        if not countable or not _is_multiple(step, sample):
            not_met = "not a whole multiple" if countable else "too great a multiple"
            what = f"step {digits(step)} s is {not_met} of its sample_time {digits(sample)} s"
            remedy = f"set step or {name}.sample_time"
            problem = Problem(name, f"the communication {what}", remedy, (SignalName(name),))
            yield Unmet(problem.at(system.instances[name].origin), countable, not _is_multiple(sample, step))


def check_sampling(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> None:
    """Note steps that meet no sample, or are not those an FMU is made for."""
    told = set()
    for problem, countable, between in unmet_samples(system, interfaces, wiring.starts):
        if not countable:
            wiring.problems.append(problem)
        elif between:
            wiring.notes.append(f"{problem.place}: {problem.message}: it samples by a clock of its own")
    for name, interface in interfaces.items():
        own, step = interface.default_step, system.instances[name].step or system.stepping.step
        if own and not interface.variable_step and not interface.annotation and interface.model not in told:
            told.add(interface.model)
            if not _is_multiple(step, own):
                wiring.notes.append(
                    f"{interface.model} cannot vary its step and is made for {digits(own)} s; it is "
                    f"stepped at {digits(step)} s"
                )
        longest = interface.annotation and interface.annotation.recommended_step
        if longest and system.stepping.step > longest * (1 + 1e-9) and interface.model not in told:
            told.add(interface.model)
            wiring.notes.append(
                f"{interface.model} is advised to step at {digits(longest)} s or faster; this run steps at "
                f"{digits(system.stepping.step)} s"
            )


def _is_multiple(length: float, part: float) -> bool:
    count = length / part
    return math.isfinite(count) and round(count) >= 1 and abs(round(count) * part - length) <= 1e-6 * part
