"""What can be known to be wrong with `[[events]]` once the models are read: signals, actions, values and times."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import did_you_mean
from ..fmi import Interface, Variable
from ..system import ACTIONS, Event, System, split
from ..wiring import Wiring, bounded
from .algorithms import ALGORITHMS


def check_events(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[str]:
    """What is wrong with the events, one sentence for each that is."""
    fed = {link.target for link in wiring.links}
    return [
        f"{event.origin + ': ' if event.origin else ''}event on {event.signal!r}: {problem}"
        for event in system.events
        if (problem := next(_problems(event, system, interfaces, fed), ""))
    ]


def _problems(
    event: Event, system: System, interfaces: Mapping[str, Interface], fed: set[tuple[str, str]]
) -> Iterator[str]:
    instance, name = split(event.signal)
    if instance not in interfaces:
        yield f"there is no instance {instance!r}{did_you_mean(instance, interfaces)}"
        return
    if event.action not in ACTIONS:
        yield f"there is no action {event.action!r}{did_you_mean(event.action, ACTIONS)}"
        return
    interface = interfaces[instance]
    scalars = interface.scalars(name)
    if scalars is None:
        valid = [v.name for v in interface.of("input", "output", "parameter")]
        hint = interface.why_left_out(name) or did_you_mean(name, [*valid, *interface.arrays])
        yield f"{interface.model} has no variable {name!r}{hint}"
        return
    for scalar in scalars:
        variable = interface.variables[scalar]
        yield from _misplaced(event, variable, (instance, scalar) in fed)
        yield from _wrong_value(event, variable)
        yield from _wrong_times(event, _step(system, instance, variable))


def _misplaced(event: Event, variable: Variable, is_fed: bool) -> Iterator[str]:
    """Why such an event cannot happen to such a variable."""
    causality = variable.causality
    if event.action == "set":
        if causality == "parameter" and variable.variability != "tunable":
            yield "it is a fixed parameter: only tunable ones can change"
        elif causality not in ("input", "parameter"):
            yield f"'set' is for inputs and tunable parameters, not for a variable of causality {causality}"
        elif is_fed:
            yield "it is connected; 'override' replaces what it receives"
    elif causality == "input":
        if not is_fed:
            yield f"nothing is connected to it, so there is nothing to {event.action}; use 'set'"
    elif causality != "output":
        yield f"{event.action!r} is for outputs and connected inputs, not for causality {causality}"


def _wrong_value(event: Event, variable: Variable) -> Iterator[str]:
    if event.action in ("bias", "ramp"):
        if variable.type != "Real":
            yield f"{event.action!r} is for Real variables, not for {variable.type}"
        key = "value" if event.action == "bias" else "rate"
        if not _is_finite(getattr(event, key)):
            yield f"{key} takes a finite number, not {getattr(event, key)!r}"
    elif event.action != "freeze":
        try:
            _typed(event.value, variable)
        except ValueError as error:
            yield str(error)


def _typed(value: Any, variable: Variable) -> None:
    """Raise ValueError unless a variable can take this value."""
    if variable.type == "String":
        if not isinstance(value, str):
            raise ValueError(f"takes a text, not {value!r}")
    elif variable.type == "Boolean":
        if not isinstance(value, bool):
            raise ValueError(f"takes true or false, not {value!r}")
    elif not isinstance(value, str) or value not in dict(variable.choices):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"takes a finite number, not {value!r}")
        bounded(value, variable)


def _step(system: System, instance: str, variable: Variable) -> float:
    """Distance in s of the points at which a change of a variable is felt."""
    own = system.instances[instance].step if variable.causality == "input" else None
    return 0.0 if ALGORITHMS[system.algorithm].varies_step else own or system.step


def _wrong_times(event: Event, step: float) -> Iterator[str]:
    if not _is_finite(event.at):
        yield f"at takes a finite number, not {event.at!r}"
    for key in ("duration", "every"):
        length = getattr(event, key)
        if length is None:
            continue
        if not _is_finite(length) or length <= 0.0:
            yield f"{key} takes a number greater than 0, not {length!r}"
        elif length < step * (1.0 - 1e-6):
            yield f"{key} = {length:g} s is shorter than the step, {step:g} s: it may pass between two points unnoticed"
    if event.action == "set" and event.duration is not None:
        yield "'set' takes no duration; take 'override' for a value that lasts a while"
    if event.action != "set" and event.every is not None and not (event.duration or math.inf) <= event.every:
        yield "what begins again must end before: give a duration that is not longer than every"


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
