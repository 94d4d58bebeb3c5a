"""A component's methods, called, checked and integrated: what `Simulation` runs, without phases.

An exception inside an equation passes unchanged, with the author's own line at its end; what an equation returns is
checked here against the declarations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import noise
from .component import Component, ComponentError, Method, Slot, Values, evaluated, pack
from .declarations import Memory, Output, State, Tape
from .returned import check_returned, due

_KINDS = {float: "iuf", int: "iu", bool: "b", str: ""}
"""NumPy's kinds of array that hold numbers of a type without a closer look."""

_ROUNDING = 1e-6
"""Of an interval: a time that is a whole number of holds belongs to the new one whatever the rounding of k * step."""


class Methods:
    """One component's methods, with time and values in its attributes.

    Args:
        component: its present values are read and written as time goes on.
    """

    def __init__(self, component: Component) -> None:
        self.component = component
        self.name = type(component).__name__
        self.values: dict[str, Any] = component.present_values
        self.states = tuple(component.of(State))
        self.memory = tuple(component.of(Memory))
        self.tapes = tuple(component.of(Tape))
        self.outputs = tuple(component.of(Output))
        self._noises = tuple(component.noises.items())
        self._array_states = tuple(slot for slot in self.states if slot.shape)
        self._due = due(component)

    def evaluate(self) -> Values:
        """All outputs."""
        return self._cast("outputs", self._call("outputs"))

    def initial(self) -> Values:
        """The computed start values."""
        return self._cast("initial", self._call("initial"))

    def update(self, period: float) -> Values:
        """Next memory and tape row, and the states to re-initialise, of a sample of ``period`` seconds."""
        self.values["step"] = period
        try:
            return self._cast("update", self._call("update"))
        finally:
            del self.values["step"]

    def keep(self) -> Any:
        """Whether the trip that just ended is kept."""
        return evaluated(self.component, "keep")

    def integrate(self, begin: float, length: float) -> None:
        """Classical Runge-Kutta in equal sub-steps no longer than ``max_step``, inputs and memory held."""
        if not self.states:
            return
        longest = self.values["max_step"]
        count = max(1, math.ceil(length / longest - 1e-9)) if longest > 0.0 else 1
        h = length / count
        x = {slot.name: self.values[slot.name] for slot in self.states}
        for k in range(count):
            t = begin + k * h
            k1 = self._rates(t, x)
            k2 = self._rates(t + 0.5 * h, {n: x[n] + (0.5 * h) * k1[n] for n in x})
            k3 = self._rates(t + 0.5 * h, {n: x[n] + (0.5 * h) * k2[n] for n in x})
            k4 = self._rates(t + h, {n: x[n] + h * k3[n] for n in x})
            x = {n: x[n] + (h / 6.0) * (((k1[n] + 2.0 * k2[n]) + 2.0 * k3[n]) + k4[n]) for n in x}
        self.values.update(self._cast("derivatives", x))

    def draw(self) -> None:
        """The random numbers of the present time."""
        for stream, (name, declaration) in enumerate(self._noises):
            hold = self.values[declaration.hold.name]
            if not hold > 0.0:
                raise ComponentError(f"{self.name}.{declaration.hold.name} must be positive: it holds {name!r}")
            # Not the nearest interval: its edges would fall on the samples in the middle of a longer hold, and which
            # side a sample is on would depend on how its time was rounded.
            index = math.floor(self.values["time"] / hold + _ROUNDING)
            shape = np.shape(self.values[name])
            self.values[name] = noise.cells(declaration.distribution, self.values["seed"], stream, index, shape)

    def _rates(self, t: float, x: Mapping[str, Any]) -> Values:
        self.values["time"] = t
        self.values.update(x)
        rates = self._call("derivatives")
        for slot in self._array_states:
            rates[slot.name] = rate = np.asarray(rates[slot.name])
            if rate.shape != slot.shape:
                raise ComponentError(
                    f"{self.name}.derivatives: {slot.name!r} has shape {rate.shape}, declared {slot.shape}"
                )
        return rates

    def _call(self, method: Method) -> Values:
        returned: Values = evaluated(self.component, method)
        owed = self._due[method]
        if not isinstance(returned, dict) or returned.keys() != owed.must:
            check_returned(self.component, method, returned, owed)
        return returned

    def _cast(self, method: Method, returned: Values) -> Values:
        slots = self._due[method].may
        result = {}
        for name, value in returned.items():
            slot = slots[name]
            # Most values are scalars of the right type already: let them through at once.
            if type(value) is slot.type and not slot.shape and (type(value) is not float or math.isfinite(value)):
                result[name] = value
            else:
                result[name] = self._cast_one(slot, value, method)
        return result

    def _cast_one(self, slot: Slot, value: Any, method: str) -> Any:
        """A returned value in its slot's type and shape, as a copy."""
        array = np.asarray(value, dtype=None if isinstance(value, np.ndarray) else object)
        where = f"{self.name}.{method}: {slot.name!r}"
        if array.shape != slot.shape:
            raise ComponentError(f"{where} has shape {array.shape}, declared {slot.shape}")
        elements: Any = array
        if not slot.shape or array.dtype.kind not in _KINDS[slot.type]:
            try:
                elements = [_element(slot.type, cell) for cell in array.flat]
            except (TypeError, ValueError, OverflowError):
                raise ComponentError(f"{where} is declared {slot.type.__name__}, not {value!r}") from None
        result = pack(slot, elements if slot.shape else elements[0])
        if slot.type is float and not np.isfinite(result).all():
            shown = np.asarray(result).tolist()
            raise ComponentError(
                f"{where} is {shown!r} at t = {self.values['time']!r} s; guard the arguments it comes from"
            )
        return result


def _element(kind: type, value: Any) -> Any:
    """One element; a whole number may come as a real one, nothing else changes its type."""
    value = value.item() if isinstance(value, np.generic) else value
    if kind in (float, int) and isinstance(value, float | int) and not isinstance(value, bool):
        if kind is int and value != int(value):
            raise ValueError(value)
        return kind(value)
    if type(value) is not kind:
        raise TypeError(value)
    return value
