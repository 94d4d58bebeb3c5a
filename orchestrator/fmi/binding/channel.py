"""Variables of an FMU, prepared for being set or read together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...errors import FmuError
from .instance import LoadedInstance


class FmuChannel:
    """Some variables of one type of an FMU: value references and a buffer, prepared once.

    ``calls`` names the functions that set and get.

    Args:
        instance: whose they are.
        kind: its variables' type, one of the instance's ``TYPES``.
        names: the variables.
    """

    def __init__(self, instance: LoadedInstance, kind: str, names: Sequence[str]) -> None:
        suffix, c_type = instance.TYPES[kind]
        count = len(names)
        self._instance, self._kind, self._names = instance, kind, names
        self.calls = f"{instance.SET}{suffix}", f"{instance.GET}{suffix}"
        self._set, self._get = (instance.functions.get(call) for call in self.calls)
        self._values = (c_type * count)()
        references = instance.references(names)
        self.references: Sequence[int] = references[:]
        more = (count,) if instance.COUNTS_VALUES else ()
        self._arguments = (instance.pointer, references, count, self._values, *more)
        self._text, self._truth = kind == "String", kind == "Boolean"
        self._limits = instance.interface.variables[names[0]].whole_range if names else None

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        if self._limits is not None:
            self._check_limits(values, *self._limits)
        self._values[:] = [v.encode() for v in values] if self._text else values
        status = (self._set or self._instance.function(self.calls[0]))(*self._arguments)
        if status:
            self._instance.check(self.calls[0], status)

    def _check_limits(self, values: Sequence[Any], low: int, high: int) -> None:
        """C would take what does not fit for another number."""
        for name, value in zip(self._names, values, strict=True):
            if not low <= value <= high:
                what = f"{name!r} cannot become {value}: its type {self._kind} holds {low} to {high}"
                raise FmuError(what, instance=self._instance.name, time=self._instance.time)

    def get(self) -> list[Any]:
        """Read all of them."""
        status = (self._get or self._instance.function(self.calls[1]))(*self._arguments)
        if status:
            self._instance.check(self.calls[1], status)
        if self._text:
            return [(v or b"").decode(errors="replace") for v in self._values]
        # A boolean is 0 or 1, whatever it is in C.
        return [int(v) for v in self._values] if self._truth else list(self._values)


class MixedChannel:
    """Variables of one type of ours that are of several types in the FMU."""

    def __init__(self, parts: Sequence[tuple[FmuChannel, Sequence[int]]], count: int) -> None:
        self._parts, self._count = parts, count

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        for channel, places in self._parts:
            channel.set([values[k] for k in places])

    def get(self) -> list[Any]:
        """Read all of them."""
        found: list[Any] = [None] * self._count
        for channel, places in self._parts:
            for place, value in zip(places, channel.get(), strict=True):
                found[place] = value
        return found
