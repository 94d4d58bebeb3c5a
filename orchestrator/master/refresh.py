"""Feed-through at a communication point: what passes directly through FMUs is brought up to date by set and get alone.

After a step an output that depends directly on an input shows the input of the step's begin. Given the inputs of the
point, in dependency order, its FMU says what the output is there, without a step between: that is how initialization
mode works, and how OMSimulator goes on. Most FMUs allow it beyond that, though FMI 2.0 (4.2.2) does not oblige them:
no flag of an FMU says so. One that keeps its outputs until the next step loses nothing, and one that refuses when
it is asked first is left alone from then on, and told.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from ..errors import FmuError, LostError
from ..fmi import Interface
from ..wiring import Link, condensed, generations
from .exchange import Exchange

_Output: TypeAlias = tuple[str, str]
_REFUSALS = ("error", "discard")
"""Statuses by which an FMU says that it does not do this, and still lives."""


class Refresher:
    """Brings outputs with direct feed-through up to date.

    Sampled components are none: what they give belongs to the inputs of their last sample. An output of which its FMU
    lists no dependencies counts as dependent on all inputs: to refresh it in vain costs nothing but time.

    Args:
        exchange: whose values they are.
        interfaces: of the instances.
        links: scalar connections.

    Attributes:
        stages: instances in the order to visit them, and whether a stage's go round in a circle.
        refused: what instances said that refused, by name.
    """

    def __init__(self, exchange: Exchange, interfaces: Mapping[str, Interface], links: Sequence[Link]) -> None:
        self._exchange = exchange
        self.stages = _stages(interfaces, links)
        self.refused: dict[str, str] = {}
        self._willing = {name for name, interface in interfaces.items() if interface.annotation}
        """Those that have been read so, or are ours: what they fail of is no refusal."""

    @property
    def instances(self) -> set[str]:
        """Those that are refreshed."""
        return {name for stage, _ in self.stages for name in stage}

    @property
    def is_decided(self) -> bool:
        """Whether of each it is known whether it refuses."""
        return self.instances <= self._willing | self.refused.keys()

    def refresh(self, time: float) -> None:
        """Set inputs and read outputs in dependency order, at a time in s.

        Outputs that depend on each other in a circle are exchanged until they settle, as they do where lists name
        dependencies that there are none. Where they do not, there is an algebraic loop, and they stay as they were.

        Raises:
            FmuError: a value is not finite, or an FMU died.
        """
        values = self._exchange.values
        for stage, is_circle in self.stages:
            before = list(values)
            for _ in range(len(stage) + 1 if is_circle else 1):
                last = list(values)
                for name in stage:
                    self._visit(name, time)
                if not is_circle or all(map(_is_same, values, last)):
                    break
            else:
                values[:] = before
            for name in stage:
                self._exchange.check_finite(self._exchange.slaves[name])

    def _visit(self, name: str, time: float) -> None:
        if name in self.refused:
            return
        slave, kept = self._exchange.slaves[name], list(self._exchange.values)
        try:
            self._exchange.write(name, time)
            self._exchange.read(slave, time)
        except LostError:
            raise
        except FmuError as error:
            if error.status not in _REFUSALS or name in self._willing:
                raise
            self._exchange.values[:] = kept
            self.refused[name] = str(error).partition("\n")[0]
        else:
            self._willing.add(name)

    def report(self) -> dict[str, Any]:
        """Who was refreshed, and who refused, for the record of the run."""
        names = sorted(self.instances - set(self.refused))
        refused = "".join(f"; not that of {name}, which refuses ({said})" for name, said in self.refused.items())
        summary = f"feed-through of {len(names)} instance{'s' * (len(names) != 1)} refreshed at each point{refused}"
        return {"refreshed": names, "refused": dict(self.refused), "summary": summary}


def _is_same(value: Any, last: Any) -> bool:
    """Whether a value has not changed: nor has one that is no number, which settles nothing else any more."""
    if isinstance(value, float) and isinstance(last, float) and math.isnan(value):
        return math.isnan(last)
    return bool(value == last)


def _stages(interfaces: Mapping[str, Interface], links: Sequence[Link]) -> list[tuple[list[str], bool]]:
    """Instances with direct outputs in the order to visit them, and whether a stage's go round in a circle."""
    graph, rank = _graph(interfaces, links), {name: k for k, name in enumerate(interfaces)}
    found: list[tuple[list[str], bool]] = []
    for generation in generations(condensed(graph)):
        single: set[str] = set()
        for members in generation:
            names = {output[0] for output in members}
            if len(members) > 1 or any(output in graph[output] for output in members):
                found.append((sorted(names, key=rank.__getitem__), True))
            else:
                single |= names
        if single:
            found.append((sorted(single, key=rank.__getitem__), False))
    return found


def _graph(interfaces: Mapping[str, Interface], links: Sequence[Link]) -> dict[_Output, dict[_Output, None]]:
    """Outputs that may depend directly on a connected input, each before those that depend on it."""
    fed: dict[str, set[str]] = {}
    for link in links:
        fed.setdefault(link.target[0], set()).add(link.target[1])
    graph: dict[_Output, dict[_Output, None]] = {}
    receivers: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for instance in (name for name in fed if not interfaces[name].sampled):
        for output in interfaces[instance].of("output"):
            listed = output.dependencies
            on = fed[instance] if listed is None else fed[instance] & listed
            if on:
                graph[instance, output.name] = {}
            for name in on:
                receivers.setdefault((instance, name), []).append((instance, output.name))
    for link in links:
        if not link.delay and link.source in graph:
            graph[link.source].update(dict.fromkeys(receivers.get(link.target, ())))
    return graph
