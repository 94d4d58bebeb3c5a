"""The whole state of an instance at one point, to come back to with single values changed.

FMI lets nobody set a state once the run has begun. A saved state, though, can be given back, and ours can be read:
a Python FMU serializes to JSON, a native one to a block in which the values stand by value reference. Where the values
are is found by comparing with what fmi2GetReal says, and a change is read back before it is trusted.
"""

from __future__ import annotations

import json
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from ..errors import FmuError
from .binding.loaded import STATE_HEAD
from .interface import Interface
from .plain import PlainSlave
from .slave import Slave

_NUMBER = struct.Struct("=d")


class Snapshot(Protocol):
    """A saved state. ``values`` are the real states and memory in it, by scalar name."""

    values: dict[str, float]

    def restore(self, changes: Mapping[str, float]) -> None:
        """Bring the instance back to it, with other values for some states."""

    def free(self) -> None:
        """Give the saved state back."""


def take_snapshot(slave: Slave, states: Sequence[str]) -> Snapshot:
    """Save the present state of an instance.

    Args:
        slave: an instance between two steps.
        states: scalar names of its states and memory.

    Raises:
        FmuError: it does not save its state, or the values in it cannot be found.
    """
    if isinstance(slave, PlainSlave):
        return PlainSnapshot(slave, states)
    if not slave.interface.can_save_state:
        raise FmuError("it cannot save its state", instance=slave.name, time=slave.time)
    kinds: dict[str, Callable[[Slave, Sequence[str]], Snapshot]] = {
        "native": NativeSnapshot,
        "python": PythonSnapshot,
    }
    return kinds.get(slave.interface.own_kind or "", ForeignSnapshot)(slave, states)


def state_names(slave: Slave) -> list[str]:
    """Scalar names of the real memory of one of our sampled or Python blocks, and of its states.

    Our sampled blocks mark memory as discrete; Python FMUs do not mark states, but save nothing else beside inputs and
    parameters.
    """
    interface = slave.interface
    kept = [v.name for v in interface.variables.values() if v.type == "Real" and v.causality in ("local", "output")]
    if not isinstance(slave, PlainSlave) and interface.own_kind == "native":
        return [name for name in kept if interface.variables[name].variability == "discrete"]
    saved = slave.simulation.save() if isinstance(slave, PlainSlave) else _read_json(slave)
    return [name for name in kept if name.partition("[")[0] in saved["values"]]


def _read_json(slave: Slave) -> dict[str, Any]:
    state = slave.save()
    try:
        return _content(slave.serialize(state))
    finally:
        slave.forget(state)


def _content(serialized: bytes) -> dict[str, Any]:
    """What stands in a Python FMU's saved state."""
    content: dict[str, Any] = json.loads(serialized[STATE_HEAD:].rstrip(b"\0"))
    return content


# -------------------------------------------------------------------- components as Python objects, and Python FMUs


def _changed(saved: Mapping[str, Any], interface: Interface, changes: Mapping[str, float]) -> dict[str, Any]:
    """A saved `Simulation` with other values, to be evaluated anew."""
    values = dict(saved["values"])
    for scalar, value in changes.items():
        name = scalar if scalar in values else scalar.partition("[")[0]
        if name == scalar:
            values[name] = value
        else:
            array = np.array(values[name], dtype=np.float64)
            array.flat[interface.arrays[name].index(scalar)] = value
            values[name] = array.tolist()
    return {**saved, "values": values, "fresh": None if changes else saved["fresh"]}


def _scalars(saved: Mapping[str, Any], interface: Interface, states: Sequence[str]) -> dict[str, float]:
    found = {}
    for scalar in states:
        name = scalar.partition("[")[0]
        value = np.ravel(saved["values"][name])
        found[scalar] = float(value[interface.arrays[name].index(scalar) if name != scalar else 0])
    return found


class PlainSnapshot:
    """Of a component as Python objects."""

    def __init__(self, slave: PlainSlave, states: Sequence[str]) -> None:
        self._slave = slave
        self._saved = slave.simulation.save()
        self._time = slave.time
        self.values = _scalars(self._saved, slave.interface, states)

    def restore(self, changes: Mapping[str, float]) -> None:
        """Bring the instance back to it, with other values for some states."""
        self._slave.simulation.restore(_changed(self._saved, self._slave.interface, changes))
        self._slave.time = self._time

    def free(self) -> None:
        """Nothing to give back."""


class _FmuSnapshot(ABC):
    """What snapshots of FMUs share: the state that the FMU saves."""

    def __init__(self, slave: Slave, states: Sequence[str]) -> None:
        self._slave = slave
        self._state = slave.save()

    def _restore_bytes(self, content: bytes) -> None:
        state = self._slave.deserialize(content)
        try:
            self._slave.restore(state)
        finally:
            self._slave.forget(state)

    @abstractmethod
    def restore(self, changes: Mapping[str, float]) -> None:
        """Bring the instance back to it, with other values for some states."""

    def free(self) -> None:
        """Give the saved state back."""
        self._slave.forget(self._state)


class PythonSnapshot(_FmuSnapshot):
    """Of a Python FMU of ours: JSON."""

    def __init__(self, slave: Slave, states: Sequence[str]) -> None:
        super().__init__(slave, states)
        self._serialized = slave.serialize(self._state)
        self._saved = _content(self._serialized)
        self.values = _scalars(self._saved, slave.interface, states)

    def restore(self, changes: Mapping[str, float]) -> None:
        """Bring the instance back to it, with other values for some states."""
        if changes:
            content = json.dumps(_changed(self._saved, self._slave.interface, changes)).encode()
            self._restore_bytes(self._serialized[:STATE_HEAD] + content)
        else:
            self._slave.restore(self._state)


class NativeSnapshot(_FmuSnapshot):
    """Of a native FMU of ours: a flat block, in which a double stands for every variable, by value reference."""

    def __init__(self, slave: Slave, states: Sequence[str]) -> None:
        known = _numbers(slave)  # read first: it brings the outputs in the block up to date
        super().__init__(slave, states)
        self._block = slave.serialize(self._state)
        self._place = _place_of_values(self._block, known)
        if self._place is None and states:
            raise FmuError("the values in its saved state are not found", instance=slave.name, time=slave.time)
        self._references = {name: slave.interface.variables[name].reference for name in states}
        self.values = {name: known[reference] for name, reference in self._references.items()}
        self._trusted = False

    def restore(self, changes: Mapping[str, float]) -> None:
        """Bring the instance back to it, with other values for some states."""
        if not changes:
            self._slave.restore(self._state)
            return
        block = bytearray(self._block)
        for name, value in changes.items():
            _NUMBER.pack_into(block, (self._place or 0) + 8 * self._references[name], value)
        self._restore_bytes(bytes(block))
        if not self._trusted:
            found = self._slave.channel("Real", list(changes)).get()
            if found != list(changes.values()):
                raise FmuError("its saved state does not take values", instance=self._slave.name, time=self._slave.time)
            self._trusted = True


def _numbers(slave: Slave) -> dict[int, float]:
    """The values of all numbers by value reference."""
    found: dict[int, float] = {}
    for kind in ("Real", "Integer", "Boolean"):
        named = [v for v in slave.interface.variables.values() if v.type == kind and not v.name.startswith("der(")]
        channel = slave.channel(kind, [v.name for v in named])
        found |= {v.reference: float(x) for v, x in zip(named, channel.get(), strict=True)}
    return found


def _place_of_values(block: bytes, known: Mapping[int, float]) -> int | None:
    """Where the double of value reference 0 stands; None unless one place alone fits all values."""
    words = np.frombuffer(block[: len(block) // 8 * 8], dtype=np.uint64)
    bits = {reference: np.float64(value).view(np.uint64) for reference, value in known.items()}
    starts = np.arange(len(words) - max(bits, default=0))
    for reference, wanted in bits.items():
        starts = starts[words[starts + reference] == wanted]
    return 8 * int(starts[0]) if len(starts) == 1 else None


class ForeignSnapshot(_FmuSnapshot):
    """Of another maker's FMU: a handle; states are set like inputs, where the FMU lets us."""

    def __init__(self, slave: Slave, states: Sequence[str]) -> None:
        super().__init__(slave, states)
        self._channel = slave.channel("Real", states)
        self.values = dict(zip(states, self._channel.get(), strict=True))

    def restore(self, changes: Mapping[str, float]) -> None:
        """Bring the instance back to it, with other values for some states."""
        self._slave.restore(self._state)
        if changes:
            self._channel.set(list({**self.values, **changes}.values()))
