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
from .component import Component, Method, Slot, Values, evaluated, pack
from .declarations import Memory, Output, State, Tape
from .errors import ComponentError
from .maths import where
from .returned import check_returned, due

_KINDS = {float: "iuf", int: "iu", bool: "b", str: ""}
"""NumPy's kinds of array that hold numbers of a type without a closer look."""

_HALVINGS = 40
"""How finely a standstill is located: what is left of a step of 0.1 s is then 1e-13 s."""
_NEAR = 1e-300
"""What stands for just before a standstill: it has a sign, and no size."""

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
        stopping = [slot for slot in self.states if isinstance(slot.declaration, State) and slot.declaration.standstill]
        self._stopping = tuple(slot.name for slot in stopping)
        self._most_stops = 2 * sum(len(slot.scalars) for slot in stopping)

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
        """Classical Runge-Kutta in equal sub-steps no longer than ``max_step``, inputs and memory held.

        A sub-step in which a state passes its standstill ends there, and the rest of it begins there.
        """
        if not self.states:
            return
        longest = self.values["max_step"]
        count = max(1, math.ceil(length / longest - 1e-9)) if longest > 0.0 else 1
        h = length / count
        x = {slot.name: self.values[slot.name] for slot in self.states}
        for k in range(count):
            t = begin + k * h
            end = self._runge_kutta(t, x, h)
            x = self._to_standstill(t, x, h) if self._stopping and self._passing(x, end) else end
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

    def _runge_kutta(self, t: float, x: Values, h: float) -> Values:
        """The states at the end of one step."""
        k1 = self._rates(t, x)
        k2 = self._rates(t + 0.5 * h, self._near(x, {n: x[n] + (0.5 * h) * k1[n] for n in x}))
        k3 = self._rates(t + 0.5 * h, self._near(x, {n: x[n] + (0.5 * h) * k2[n] for n in x}))
        k4 = self._rates(t + h, self._near(x, {n: x[n] + h * k3[n] for n in x}))
        return {n: x[n] + (h / 6.0) * (((k1[n] + 2.0 * k2[n]) + 2.0 * k3[n]) + k4[n]) for n in x}

    def _near(self, x: Values, stage: Values) -> Values:
        """The states at a stage of a step from ``x``: not beyond a standstill but just before it.

        The rates beyond would be those of another motion, and the step would be wrong by more than its end can show.
        """
        for name in self._stopping:
            beyond = _passes(x[name], stage[name])
            if np.any(beyond):
                stage[name] = where(beyond, where(x[name] > 0.0, _NEAR, -_NEAR), stage[name])
        return stage

    def _to_standstill(self, t: float, x: Values, h: float) -> Values:
        """The states at the end of a step that is taken in parts, each up to where a state comes to a standstill.

        A state that stands when a part begins is free in it. The parts are counted: states that keep one another
        moving could go on for ever; what would pass in the last one stands at its end.
        """
        done = 0.0
        for _ in range(self._most_stops):
            end = self._runge_kutta(t + done, x, h - done)
            if not self._passing(x, end):
                return end
            low, high, before, after = 0.0, h - done, x, end
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                end = self._runge_kutta(t + done, x, middle)
                if self._passing(x, end):
                    high, after = middle, end
                else:
                    low, before = middle, end
            x = self._stopped(x, before, after)
            done = done + low
        end = self._runge_kutta(t + done, x, h - done)
        return self._stopped(x, end, end)

    def _passing(self, x: Values, end: Values) -> bool:
        """Whether a state passes its standstill in a step from ``x``."""
        return any(np.any(_passes(x[name], end[name])) for name in self._stopping)

    def _stopped(self, x: Values, before: Values, after: Values) -> Values:
        """The states ``before``, with those at rest that pass their standstill from ``x`` to ``after``."""
        stands = {name: where(_passes(x[name], after[name]), 0.0, before[name]) for name in self._stopping}
        return before | stands

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
        place = f"{self.name}.{method}: {slot.name!r}"
        if array.shape != slot.shape:
            raise ComponentError(f"{place} has shape {array.shape}, declared {slot.shape}")
        elements: Any = array
        if not slot.shape or array.dtype.kind not in _KINDS[slot.type]:
            try:
                elements = [_element(slot.type, cell) for cell in array.flat]
            except (TypeError, ValueError, OverflowError):
                raise ComponentError(f"{place} is declared {slot.type.__name__}, not {value!r}") from None
        result = pack(slot, elements if slot.shape else elements[0])
        if slot.type is float and not np.isfinite(result).all():
            shown = np.asarray(result).tolist()
            raise ComponentError(
                f"{place} is {shown!r} at t = {self.values['time']!r} s; guard the arguments it comes from"
            )
        return result


def _passes(start: Any, end: Any) -> Any:
    """Whether a state that does not stand reaches or passes zero, element by element."""
    if isinstance(start, np.ndarray):
        return ((start > 0.0) & (end <= 0.0)) | ((start < 0.0) & (end >= 0.0))
    return end <= 0.0 < start or start < 0.0 <= end


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
