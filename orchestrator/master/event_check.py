"""What can be known to be wrong with `[[events]]` once the models are read: signals, actions, values and times."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from ..errors import ScenarioError
from ..fmi import Interface, Variable
from ..names import SignalName
from ..problems import Problem, suggestion
from ..system import ACTIONS, Event, System
from ..times import digits
from ..wiring import Wiring, as_text, bounded
from .algorithms import ALGORITHMS


def check_events(system: System, interfaces: Mapping[str, Interface], wiring: Wiring) -> list[Problem]:
    """What is wrong with the events, the first thing of each."""
    fed = {link.target for link in wiring.links}
    problems = []
    for event in system.events:
        signal = SignalName.parse(event.signal)
        for problem in islice(_problems(event, signal, system, interfaces, fed), 1):
            problems.append(problem.at(f"event on {event.signal!r}", signal).at(event.origin))
    return problems


def _problems(
    event: Event, signal: SignalName, system: System, interfaces: Mapping[str, Interface], fed: set[SignalName]
) -> Iterator[Problem]:
    instance, name = signal
    if instance not in interfaces:
        yield Problem("", f"there is no instance {instance!r}", suggestion(instance, interfaces))
        return
    if event.action not in ACTIONS:
        yield Problem("", f"there is no action {event.action!r}", suggestion(event.action, ACTIONS))
        return
    interface = interfaces[instance]
    scalars = interface.scalars(name)
    if scalars is None:
        valid = [v.name for v in interface.of("input", "output", "parameter")]
        why = interface.why_left_out(name)
        near = "" if why else interface.elements_beside(name) or suggestion(name, [*valid, *interface.arrays])
        yield Problem("", f"{interface.model} has no variable {name!r}{why}", near)
        return
    for scalar in scalars:
        variable = interface.variables[scalar]
        yield from _misplaced(event, variable, SignalName(instance, scalar) in fed)
        yield from _wrong_value(event, variable)
        yield from _wrong_times(event, _step(system, instance, variable))


def _misplaced(event: Event, variable: Variable, is_fed: bool) -> Iterator[Problem]:
    """Why such an event cannot happen to such a variable."""
    causality = variable.causality
    if event.action == "connect":
        if causality != "input":
            yield Problem("", f"'connect' is for inputs, not for causality {causality}")
        elif not is_fed:
            yield Problem("", "it follows nothing before", "connect it to something in [connections]")
    elif event.action == "set":
        if causality == "parameter" and variable.variability != "tunable":
            yield Problem("", "it is a fixed parameter: only tunable ones can change")
        elif causality not in ("input", "parameter"):
            wrong = f"'set' is for inputs and tunable parameters, not for a variable of causality {causality}"
            yield Problem("", wrong)
        elif is_fed:
            yield Problem("", "it is connected", "'override' replaces what it receives")
    elif causality == "input":
        if not is_fed:
            wrong = f"nothing is connected to it, so there is nothing to {event.action}"
            yield Problem("", wrong, "use 'set'")
    elif causality != "output":
        yield Problem("", f"{event.action!r} is for outputs and connected inputs, not for causality {causality}")


def _wrong_value(event: Event, variable: Variable) -> Iterator[Problem]:
    if event.action in ("bias", "ramp"):
        if variable.type != "Real":
            yield Problem("", f"{event.action!r} is for Real variables, not for {variable.type}")
        key = "value" if event.action == "bias" else "rate"
        if not _is_finite(getattr(event, key)):
            yield Problem("", f"{key} takes a finite number, not {getattr(event, key)!r}")
    elif event.action == "connect":
        if event.source is None:
            yield Problem("", "no source is given", "say what the input follows")
        if event.fade is not None and variable.type != "Real":
            yield Problem("", f"fade is for Real variables, not for {variable.type}")
    elif event.action != "freeze":
        try:
            _typed(event.value, variable)
        except ScenarioError as error:
            yield from error.problems


def _typed(value: Any, variable: Variable) -> None:
    """Raise ScenarioError unless a variable can take this value."""
    if variable.type == "String":
        as_text(value, variable)
    elif variable.type == "Boolean":
        if not isinstance(value, bool):
            raise ScenarioError(f"takes true or false, not {value!r}")
    elif not isinstance(value, str) or value not in dict(variable.choices):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ScenarioError(f"takes a finite number, not {value!r}")
        bounded(value, variable)


def _step(system: System, instance: str, variable: Variable) -> float:
    """Distance in s of the points at which a change of a variable is felt."""
    own = system.instances[instance].step if variable.causality == "input" else None
    return 0.0 if ALGORITHMS[system.stepping.algorithm].varies_step else own or system.stepping.step


def _wrong_times(event: Event, step: float) -> Iterator[Problem]:
    if not _is_finite(event.at):
        yield Problem("", f"at takes a finite number, not {event.at!r}")
    for key in ("duration", "every", "fade"):
        length = getattr(event, key)
        if length is None:
            continue
        if not _is_finite(length) or length <= 0.0:
            yield Problem("", f"{key} takes a number greater than 0, not {length!r}")
        elif length < step * (1.0 - 1e-6):
            shorter = f"{key} = {digits(length)} s is shorter than the step, {digits(step)} s"
            yield Problem("", f"{shorter}: it may pass between two points unnoticed")
    if event.action == "set" and event.duration is not None:
        yield Problem("", "'set' takes no duration", "take 'override' for a value that lasts a while")
    if event.action != "set" and event.every is not None and not (event.duration or math.inf) <= event.every:
        yield Problem("", "what begins again must end before: give a duration that is not longer than every")


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
