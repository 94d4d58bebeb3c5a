"""The clock of a sampled block: when its samples are due, and how its states get from one to the next.

A sample is due at ``start + k * sample_time``, whatever the communication steps are: it is taken at the communication
point that is nearest but for rounding, or within the step that it falls into, with the inputs of that step. Between
samples everything but the states is held. fmus/runtime/advance.c does the same, in the same order of operations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .component import Component, Values, pack
from .declarations import Input, Parameter, State, Tape
from .errors import ComponentError
from .methods import Methods

_NEAR = 1e-3
"""How far, of a sample or of a communication step, whichever is shorter, a communication point may miss a sample: what
a time that was summed up gathers in roundings."""


class SampleClock:
    """When a component samples.

    Args:
        component: a sampled block; its present values are read and written as time goes on.
        methods: its methods.
    """

    def __init__(self, component: Component, methods: Methods) -> None:
        self._values = component.present_values
        self._slots = component.slots
        self._methods = methods
        self._name = type(component).__name__
        self._given = tuple(slot.name for slot in component.of(Input, Parameter))
        self._drawn = (*(slot.name for slot in component.of(Tape)), *component.noises)
        self._states = tuple(slot.name for slot in component.of(State))
        self.start(0.0)

    def start(self, time: float) -> None:
        """The first sample is due at this time in s."""
        self._start = time
        self._taken = 0
        self._reached = time
        """The time to which the states belong."""
        self._base: tuple[float, Values] | None = None
        """From where integration began that stopped between two samples, and the values there."""
        self._held: Values = {}

    @property
    def held(self) -> Values:
        """The outputs of the last sample that hold until the next."""
        return self._held

    def advance(self, begin: float, length: float, sample: Callable[[float, float], Values]) -> None:
        """Take a communication step; afterwards time is the end of it, or the sample that is due there.

        Args:
            begin: where it begins, in s.
            length: in s.
            sample: takes a sample; given its period and how long ago the inputs were read, both in s, it gives the
                outputs to be held.

        Raises:
            ComponentError: a step of more samples than can be counted.
        """
        values, end = self._values, begin + length
        period = values["sample_time"]
        if period == 0.0:
            values["time"] = begin
            self._held = sample(length, 0.0)
            self._methods.integrate(begin, length)
            values["time"] = end
            return
        near = _NEAR * min(length, period)
        due = self._due(self._taken)
        if not (end - due) / period < 2.0**31 - 1.0:
            raise ComponentError(
                f"{self._name}: sample_time = {period!r} s is too short for a communication step of {length!r} s"
            )
        base = self._resume()
        while due < end - near:
            self._move(base, due)
            values["time"] = base = due
            self._held = sample(period, due - begin if due > begin + near else 0.0)
            self._taken += 1
            due = self._due(self._taken)
        reached = due if due <= end + near else max(end, base)
        if self._states and reached != due:
            self._base = base, {name: values[name] for name in (*self._given, *self._drawn, *self._states)}
        self._move(base, reached)
        values["time"] = self._reached = reached

    def _due(self, number: int) -> float:
        """When the sample of this number is due: counted, never summed up."""
        return float(self._start + number * self._values["sample_time"])

    def _resume(self) -> float:
        """Where integration goes on.

        Between samples it begins anew from where it began, unless something was set since, so that it does not matter
        in how many parts it is asked for; tape and random numbers are those of the sample under way.
        """
        if self._base is None:
            return self._reached
        (time, then), self._base = self._base, None
        self._values.update((name, then[name]) for name in self._drawn)
        if not all(np.array_equal(then[name], self._values[name]) for name in self._given):
            return self._reached
        self._values.update((name, then[name]) for name in self._states)
        return time

    def _move(self, begin: float, end: float) -> None:
        """The states from one time to another; from sample to sample that is the period, whatever their roundings."""
        whole = begin == self._due(self._taken - 1) and end == self._due(self._taken)
        length = self._values["sample_time"] if whole else end - begin
        if length > 0.0:
            self._methods.integrate(begin, length)

    # ---------------------------------------------------------------- whole state

    def state(self) -> dict[str, Any]:
        """Everything a restore needs, as JSON-ready values."""
        base = None if self._base is None else [self._base[0], _plain(self._base[1])]
        return {
            "start": self._start,
            "taken": self._taken,
            "reached": self._reached,
            "base": base,
            "held": _plain(self._held),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take back what `state` gave."""
        self._start, self._taken, self._reached = state["start"], state["taken"], state["reached"]
        self._held = self._packed(state["held"])
        self._base = None if state["base"] is None else (state["base"][0], self._packed(state["base"][1]))

    def _packed(self, values: Mapping[str, Any]) -> Values:
        return {n: pack(self._slots[n], v) if n in self._slots else _cells(v) for n, v in values.items()}


def _plain(values: Values) -> Values:
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}


def _cells(value: Any) -> Any:
    """Random numbers, which have no slot."""
    return np.array(value) if isinstance(value, list) else value
