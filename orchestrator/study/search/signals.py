"""Signals over time as something to vary: `--vary 'target.value=signal(70, 85, 10, linear, rate=0.5)'`.

A signal is a `Schedule` of the scenario: the one that is named, or one that is put in the place of what an input
receives or an output gives. Its values are what is varied, so that every run is that of an ordinary scenario. Along a
line it is the further gradients of a `Line`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import ScenarioError
from ...names import SignalName
from ...problems import Problem
from ...run import Checked, Results
from ...system import Connection, Instance, System

Array = NDArray[np.float64]

MOST_PIECES = 1000
_FORM = "signal(low, high, pieces), with linear, rate=..., from=... and to=... where wanted: signal(70, 85, 10, linear)"
_SIGNAL = re.compile(r"\s*([^=]+?)\s*=\s*signal\s*\(([^()]*)\)\s*", re.DOTALL)
_ROUNDING = 1e-9
"""What a rate limit is missed by without being missed, as a part of it."""


@dataclass(frozen=True)
class Signal:
    """A signal between two values: constant in pieces of equal length, or with straight lines over them.

    Attributes:
        name: an output or an input, as ``instance.variable``; or the ``gradients`` of a line, or of all of a group.
        low, high: between what, in its unit. pieces: how many there are.
        linear: straight lines instead of steps. rate: by how much it may change, in its unit per s; along a line per m.
        first, last: between which times in s, or places in m, its pieces lie; None for those of the run. Before and
            after, it has its first and its last value.
    """

    name: str
    low: float
    high: float
    pieces: int
    linear: bool = False
    rate: float | None = None
    first: float | None = None
    last: float | None = None

    @classmethod
    def parse(cls, text: str) -> Signal | None:
        """Read what `--vary` takes; None where it is no signal.

        Raises:
            ScenarioError: it is one that cannot be read.
        """
        match = _SIGNAL.fullmatch(text)
        if match is None:
            return None
        words = [word.strip() for word in match[2].split(",")]
        try:
            low, high, pieces = float(words[0]), float(words[1]), int(words[2])
            options = dict(word.partition("=")[::2] for word in words[3:])
            linear = options.pop("linear", None)
            numbers = [float(options.pop(word)) if word in options else None for word in ("rate", "from", "to")]
            if options or linear:
                raise ValueError(next(iter(options), "linear"))
        except (ValueError, IndexError):
            raise ScenarioError(Problem(f"--vary {text}", "it is no signal", f"write {_FORM}")) from None
        made = cls(match[1], low, high, pieces, linear is not None, *numbers)
        wrong = made._wrong()
        if wrong:
            raise ScenarioError(Problem(f"--vary {text}", wrong))
        return made

    def _wrong(self) -> str:
        if not -np.inf < self.low < self.high < np.inf:
            return "low and high of a signal are finite numbers, low < high"
        if not 1 <= self.pieces <= MOST_PIECES:
            return f"a signal has 1 to {MOST_PIECES} pieces"
        if self.rate is not None and not 0.0 < self.rate < np.inf:
            return "the rate of a signal is a positive number, in its unit per s"
        ends = [end for end in (self.first, self.last) if end is not None]
        if not all(map(np.isfinite, ends)) or (len(ends) == 2 and ends[0] >= ends[1]):
            return "from and to of a signal are finite numbers, from < to"
        return ""

    @property
    def size(self) -> int:
        """How many values it has."""
        return self.pieces + self.linear

    def between(self, first: float, last: float) -> Breakpoints:
        """Its breakpoints, where its pieces lie between given ends unless it says otherwise."""
        first = first if self.first is None else self.first
        last = last if self.last is None else self.last
        if not first < last:
            raise ScenarioError(f"it begins at {first:g} and ends at {last:g}: nothing lies between")
        places = first + (last - first) * np.arange(self.size) / self.pieces
        most = np.inf if self.rate is None else self.rate * (last - first) / self.pieces
        return Breakpoints(np.asarray(places), most)


class Breakpoints(NamedTuple):
    """Where the pieces of a signal begin, (size,) in s or m, and by how much neighbouring values may differ."""

    places: Array
    most: float


@dataclass(frozen=True)
class Placed:
    """A signal in a system.

    Attributes:
        signal: what was asked for. array: the parameter that holds its values, as ``instance.variable``.
        nominal: its nominal values, (size,). most: by how much neighbours may differ.
        shown: the output that it is, over time; empty where it is none.
    """

    signal: Signal
    array: str
    nominal: Array
    most: float
    shown: str = ""

    @property
    def keys(self) -> list[str]:
        """What changes of it are called, value by value."""
        return [f"{self.array}[{k + 1}]" for k in range(self.signal.size)]

    def values(self, shares: Array) -> list[float]:
        """Its values at shares from 0 to 1 of the way from low to high, each as near as the rate limit lets it be."""
        found: list[float] = []
        for share in shares:
            value = self.signal.low + float(share) * (self.signal.high - self.signal.low)
            if found:
                value = min(max(value, found[-1] - self.most), found[-1] + self.most)
            found.append(value)
        return found

    def keeps_rate(self, values: Sequence[float]) -> bool:
        """Whether values keep the rate limit."""
        return bool(np.all(np.abs(np.diff(values)) <= self.most * (1.0 + _ROUNDING)))


def place_signals(
    system: System, checked: Checked, results: Results, signals: Sequence[Signal]
) -> tuple[System, list[Placed]]:
    """The system with a schedule for each signal, at first with the values that the scenario has there.

    Args:
        system: the scenario.
        checked: the same, checked.
        results: of its nominal run.
        signals: what is varied.

    Raises:
        ScenarioError: something is no input and no output, or cannot be replaced.
    """
    problems: list[Problem] = []
    placed: list[Placed] = []
    for signal in signals:
        try:
            system, one = _place(system, checked, results, signal)
            placed.append(one)
        except ScenarioError as error:
            problems += error.at(f"--vary {signal.name}=signal(...)")
    if problems:
        raise ScenarioError(problems)
    return system, placed


def _place(system: System, checked: Checked, results: Results, signal: Signal) -> tuple[System, Placed]:
    name = SignalName.parse(signal.name)
    along = [x for x in system.instances.values() if name.instance in (x.name, SignalName(x.name).group)]
    if along and name.variable == "gradients" and all(one.model == "Line" for one in along):
        return _along_line(system, along, results, signal)
    model = checked.models.get(name.instance)
    variable = None if model is None else model.interface.variables.get(name.variable)
    if variable is None or variable.causality not in ("input", "output") or variable.type != "Real":
        remedy = "name one signal of one instance, such as target.value or train[1].disturbance"
        raise ScenarioError(Problem("", "a signal is an input or an output that is a real number", remedy))
    places, most = signal.between(system.stepping.start_time, system.stepping.stop_time)
    nominal = _nominal(checked, results, name, places)
    given = {"times": places.tolist(), "values": nominal.tolist(), "interpolate": signal.linear}
    own = system.instances[name.instance]
    if own.model == "Schedule":
        changed = replace(own, build={**own.build, "points": signal.size}, start={**_without(own, given), **given})
        made = system.changed(instances={**system.instances, own.name: changed}, modified=True)
        return made, Placed(signal, f"{own.name}.values", nominal, most, f"{own.name}.value")
    title = re.sub(r"\W+", "_", signal.name).strip("_")
    while title in system.instances:
        title += "_"
    new = Instance(title, "Schedule", {"points": signal.size, "unit": variable.unit or "1"}, given)
    connections = _redirected(system, checked, name, f"{title}.value", is_input=variable.causality == "input")
    order = [*system.stepping.order, title] if system.stepping.order else []
    made = system.changed(
        instances={**system.instances, title: new}, connections=connections, order=order, modified=True
    )
    return made, Placed(signal, f"{title}.values", nominal, most, f"{title}.value")


def _along_line(system: System, lines: Sequence[Instance], results: Results, signal: Signal) -> tuple[System, Placed]:
    """A signal as the further gradients of lines, which all have the same."""
    if signal.first is None or signal.last is None or signal.linear:
        remedy = f"write {signal.name}=signal(-0.01, 0.01, 10, from=0, to=50e3)"
        raise ScenarioError(Problem("", "gradients along a line need from and to, in m, and are steps", remedy))
    places, most = signal.between(signal.first, signal.last)
    found = {one.name: _gradients(one.name, results, places) for one in lines}
    nominal = found[lines[0].name]
    if any(not np.array_equal(nominal, other) for other in found.values()):
        raise ScenarioError(Problem("", "they have further gradients that differ", f"name one: {lines[0].name}"))
    # Element by element: so a change of one element of all lines reaches each.
    values: dict[str, Any] = {f"gradients[{k}]": float(value) for k, value in enumerate(nominal, 1)}
    given = {"positions": places.tolist(), **values}
    changed = {
        one.name: replace(
            one,
            build={**one.build, "points": signal.size},
            start={**_without(one, ("positions", "gradients")), **given},
        )
        for one in lines
    }
    made = system.changed(instances={**system.instances, **changed}, modified=True)
    return made, Placed(signal, signal.name, nominal, most)


def _without(instance: Instance, arrays: Collection[str]) -> dict[str, Any]:
    """The start values of an instance but for those of some arrays and their elements."""
    return {key: value for key, value in instance.start.items() if key.partition("[")[0] not in arrays}


def _gradients(line: str, results: Results, places: Array) -> Array:
    """The further gradients that a line has at given places."""
    positions, gradients = (_parameters(results, f"{line}.{name}[") for name in ("positions", "gradients"))
    reached = np.searchsorted(positions, places, side="right")
    return np.asarray(gradients[np.maximum(reached - 1, 0)])


def _parameters(results: Results, begin: str) -> Array:
    return np.array([float(value) for name, value in results.parameters.items() if name.startswith(begin)])


def _redirected(system: System, checked: Checked, name: SignalName, source: str, *, is_input: bool) -> list[Connection]:
    """The connections with a new source for an input, or for all that an output reaches."""
    ends = [link for link in checked.wiring.links if name == (link.target if is_input else link.source)]
    whole = [link.connection for link in ends if str(name) not in (link.connection.source, link.connection.target)]
    if whole:
        message = f"it is connected as a part of {whole[0].source if not is_input else whole[0].target}"
        raise ScenarioError(Problem("", message, "connect its elements singly"))
    if is_input:
        return [*(one for one in system.connections if one.target != str(name)), Connection(source, str(name))]
    if not ends:
        raise ScenarioError(Problem("", "nothing receives it", "name an input, or an output that is connected"))
    texts = {**system.judged.requirements, **system.judged.metrics}
    spoken = [key for key, text in texts.items() if re.search(rf"(?<![\w.]){re.escape(str(name))}(?!\w)", text)]
    if spoken:
        remedy = f"name the input that it reaches: {ends[0].target}"
        raise ScenarioError(Problem("", f"'{spoken[0]}' speaks of it, which would be judged as it was", remedy))
    return [replace(one, source=source) if one.source == str(name) else one for one in system.connections]


def _nominal(checked: Checked, results: Results, name: SignalName, times: Array) -> Array:
    """What a signal is in the nominal run at given times; of an input what it receives there."""
    link = next((link for link in checked.wiring.links if link.target == name), None)
    scale, offset, text = (1.0, 0.0, str(name)) if link is None else (link.scale, link.offset, str(link.source))
    if text not in results:
        starts: Mapping[str, Any] = checked.wiring.starts.get(name.instance, {})
        start = starts.get(name.variable, checked.models[name.instance].interface.variables[name.variable].start)
        return np.full(len(times), float(start or 0.0))
    reached = np.searchsorted(results.time, times + _ROUNDING * max(1.0, float(abs(times).max())), side="right")
    return np.asarray(scale * np.asarray(results[text], dtype=np.float64)[np.maximum(reached - 1, 0)] + offset)
