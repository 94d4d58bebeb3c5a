"""A component as Python objects in this process, behind the face of an instance."""

from __future__ import annotations

import functools
import inspect
import json
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from ...components.simulate import Simulation
from ...components.tracing import start_name
from ..errors import FmuError
from .interface import Interface, Type
from .slave import Channel

P = ParamSpec("P")
R = TypeVar("R")

_RUNTIME = (Path(__file__).parent, Path(inspect.getfile(Simulation)).parent)


def _telling(method: Callable[P, R]) -> Callable[P, R]:
    """Turn any exception of a component into an `FmuError` with instance, time, file and line; it stays the cause."""

    @functools.wraps(method)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return method(*args, **kwargs)
        except Exception as error:
            plain: Any = args[0]
            frames = traceback.extract_tb(error.__traceback__)
            authors = [f for f in frames if Path(f.filename).parent not in _RUNTIME]
            frame = (authors or frames)[-1]
            place = f"{Path(frame.filename).name}:{frame.lineno}, in {frame.name}"
            message = f"{type(error).__name__}: {error} [{place}]"
            raise FmuError(message, instance=plain.name, time=plain.time, status="error") from error

    return wrapped


class PlainSlave:
    """A component as Python objects in this process: easy to debug, the same numbers."""

    def __init__(self, name: str, interface: Interface, simulation: Simulation) -> None:
        self.name = name
        self.interface = interface
        self.time = 0.0
        self.disturbed: dict[str, None] = {}
        self.simulation = simulation

    def setup(self, start_time: float, stop_time: float) -> None:
        """Announce the experiment; a component does not care when it ends."""
        self.time = start_time

    @_telling
    def enter_initialization(self) -> None:
        """Enter initialization mode."""
        self.simulation.initialize(self.time)

    @_telling
    def exit_initialization(self) -> None:
        """Leave initialization mode."""
        self.simulation.start()

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables for being set or read together."""
        return _PlainChannel(self, names)

    @_telling
    def step(self, time: float, length: float, *, final: bool = True) -> None:
        """Advance from ``time`` by ``length``, both in s."""
        self.time = time
        if self.simulation.time != time:
            self.simulation.time = time
        self.simulation.step(length)
        self.time = time + length

    def save(self) -> tuple[float, dict[str, Any]]:
        """The present state."""
        return self.time, self.simulation.save()

    def restore(self, state: tuple[float, dict[str, Any]]) -> None:
        """Come back to a saved state."""
        self.time = state[0]
        self.simulation.restore(state[1])

    def forget(self, state: tuple[float, dict[str, Any]]) -> None:
        """Nothing to give back."""

    def serialize(self, state: tuple[float, dict[str, Any]]) -> bytes:
        """A saved state as JSON."""
        return json.dumps(state).encode()

    @_telling
    def deserialize(self, content: bytes) -> tuple[float, dict[str, Any]]:
        """A saved state, out of its JSON."""
        time, state = json.loads(content)
        return time, state

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """Not given by a component in this process: its interface says so."""
        raise FmuError("gives no directional derivatives", instance=self.name, time=self.time)

    def interpolate(self, names: Sequence[str], orders: Sequence[int], values: Sequence[float]) -> None:
        """Not done by a component in this process: its interface says so."""
        raise FmuError("does not interpolate its inputs", instance=self.name, time=self.time)

    @_telling
    def terminate(self) -> None:
        """End the run."""
        self.simulation.terminate()

    @_telling
    def reset(self) -> None:
        """Come back to where it was when it was instantiated."""
        self.simulation.reset()
        self.time = 0.0

    def free(self) -> None:
        """Nothing to give back."""


class _PlainChannel:
    def __init__(self, slave: PlainSlave, names: Sequence[str]) -> None:
        self._slave = slave
        self._places = [_place(slave.simulation, name) for name in names]

    @property
    def name(self) -> str:
        return self._slave.name

    @property
    def time(self) -> float:
        return self._slave.time

    @_telling
    def set(self, values: Sequence[Any]) -> None:
        simulation = self._slave.simulation
        arrays: dict[str, Any] = {}
        for (name, element, kind), value in zip(self._places, values, strict=True):
            if element is None:
                simulation.set(name, kind(value))
            else:
                if name not in arrays:
                    arrays[name] = simulation.get(name).copy()
                arrays[name].flat[element] = kind(value)
        for name, array in arrays.items():
            simulation.set(name, array)

    @_telling
    def get(self) -> list[Any]:
        found = [(self._slave.simulation.get(name), element, kind) for name, element, kind in self._places]
        # A boolean is 0 or 1 here, as it comes from an FMU.
        return [
            (int if kind is bool else kind)(value if element is None else value.flat[element])
            for value, element, kind in found
        ]


def _place(simulation: Simulation, scalar: str) -> tuple[str, int | None, Any]:
    for slot in simulation.component.slots.values():
        if scalar in slot.scalars:
            return slot.name, slot.scalars.index(scalar) if slot.shape else None, slot.type
        start = start_name(slot.name)
        if scalar.partition("[")[0] == start:
            own = slot.name + scalar.removeprefix(start)
            return start, slot.scalars.index(own) if slot.shape else None, slot.type
    raise KeyError(scalar)
