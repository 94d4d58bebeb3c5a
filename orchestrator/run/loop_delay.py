"""How late a controller's force acts by the way instances exchange values, and whether the controller knows.

What the train does follows from the position a controller has read; the communication steps in between are counted
along the connections. Where all instances step at once, each feed-through output costs one: a protection between
controller and train doubles the delay of the loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ..fmi import Interface
from ..master import ALGORITHMS, Explicit
from ..names import SignalName
from ..system import System
from ..wiring import Control, Link, Wiring, find_controls, find_trains

_DELAY, _LATE, _PREVIEW = "delay", "late_action", "preview"
"""Parameters: the delay of a controller's loop in samples; whether there is one; the delay a timetable previews."""


@dataclass(frozen=True)
class LoopDelay:
    """How late a force acts.

    Attributes:
        control: which controller's force, on which train.
        steps: communication steps.
        samples: the same in samples of the controller.
        through: the outputs that come late.
        said: what the parameters say that are about it, by their names.
        wanted: what they should say, where they do not. limits: the largest values they take, where there are any.
    """

    control: Control
    steps: int
    samples: int
    through: tuple[SignalName, ...]
    said: Mapping[str, Any]
    wanted: Mapping[str, Any]
    limits: Mapping[str, float]

    def __str__(self) -> str:
        force = next(x.source for x in self.control.links if x.source.instance == self.control.controller)
        late = f"{self.steps} communication step{'s' * (self.steps != 1)} late" if self.steps else "at once"
        way = f" ({', '.join(map(str, self.through))} come late)" if len(self.through) > 1 else ""
        line = f"{SignalName(force.instance, force.array)} acts on {self.control.train} {late}{way}"
        if not self.wanted:
            return f"{line}, as {_listed(self.said)} has it"
        return f"{line}, which {_listed(self.said)} does not have so: set {_listed(self.wanted, self.limits)}"


def loop_delays(
    system: System, interfaces: Mapping[str, Interface], wiring: Wiring, sequence: Sequence[str]
) -> list[LoopDelay]:
    """Of each controller with a parameter for it, under algorithms that take a step in one go.

    Args:
        system: what runs.
        interfaces: of its instances.
        wiring: its connections.
        sequence: in which a sweep steps the instances.
    """
    if not issubclass(ALGORITHMS[system.stepping.algorithm], Explicit):
        return []
    trains = {train.name for train in find_trains(interfaces, wiring)}
    found = []
    for control in find_controls(interfaces, wiring, trains):
        parameters = dict(_parameters(control.controller, interfaces, wiring))
        own_steps = {system.instances[name].step for link in control.links for name in _ends(link)}
        if parameters and own_steps <= {None, system.stepping.step}:
            maxima = {str(name): interfaces[name.instance].variables[name.variable].maximum for name in parameters}
            limits = {name: value for name, value in maxima.items() if value is not None}
            delay = _loop_delay(system, control, parameters, limits, wiring, sequence)
            found += [delay] if delay.said else []
    return found


def _ends(link: Link) -> tuple[str, str]:
    return link.source.instance, link.target.instance


def _parameters(name: str, interfaces: Mapping[str, Interface], wiring: Wiring) -> Iterator[tuple[SignalName, Any]]:
    """The parameters that are about the delay of a controller's loop, its reference's among them, with their values."""
    asked = [(name, _DELAY), (name, _LATE)]
    for link in wiring.links:
        if link.target == SignalName(name, "reference_acceleration"):
            asked.append((link.source.instance, _PREVIEW))
    for instance, parameter in asked:
        variable = interfaces[instance].variables.get(parameter)
        if variable is None or interfaces[instance].annotation is None:  # another maker may mean something else
            continue
        kind, wanted = (bool, "Boolean") if parameter == _LATE else (int, "Integer")
        if variable.causality == "parameter" and variable.type == wanted:
            yield SignalName(instance, parameter), kind(wiring.starts[instance].get(parameter, variable.start))


def _loop_delay(  # noqa: PLR0917
    system: System,
    control: Control,
    parameters: Mapping[SignalName, Any],
    limits: Mapping[str, float],
    wiring: Wiring,
    sequence: Sequence[str],
) -> LoopDelay:
    sweeps = ALGORITHMS[system.stepping.algorithm].is_sweeping
    place = {name: k for k, name in enumerate(sequence)} if sweeps else dict.fromkeys(sequence, 0)
    costs = {link.source: _cost(link, place, sweeps) + link.delay for link in control.links}
    steps = sum(costs.values())
    sample = wiring.starts[control.controller].get("sample_time") or system.stepping.step
    samples = round(steps * system.stepping.step / sample)
    # A drive on the way may be late by a lag of its own, which is no step; who previews more means that.
    is_led = not {link.source.instance for link in control.links} <= {control.controller, control.train}
    parameters = {n: x for n, x in parameters.items() if n.variable != _PREVIEW or x <= samples or not is_led}
    right = {str(name): bool(samples) if name.variable == _LATE else samples for name in parameters}
    said = {str(name): value for name, value in parameters.items()}
    wanted = {name: value for name, value in right.items() if value != said[name]}
    through = tuple(source for source, cost in costs.items() if cost > 0)
    return LoopDelay(control, steps, samples, through, said, wanted, limits)


def _cost(link: Link, place: Mapping[str, int], sweeps: bool) -> int:
    """By how many communication steps a connection is late; -1 where it brings a step's end instead of its begin."""
    earlier = sweeps and place[link.source.instance] < place[link.target.instance]
    return int(not earlier) if link.direct else -int(earlier)


def _listed(values: Mapping[str, Any], limits: Mapping[str, float] = MappingProxyType({})) -> str:
    told = []
    for name, value in values.items():
        beyond = value > limits.get(name, value)
        told.append(f"{name} = {str(value).lower()}" + (f" (which takes {limits[name]:g} at most)" if beyond else ""))
    return " with ".join(told)
