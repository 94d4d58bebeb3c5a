"""One component alone, in plain Python: for unit tests, for a debugger, and inside the Python FMU.

`Simulation` gives a component time, state and a step, with the semantics every kind of FMU shares:

* a component without Memory, Tape or Noise integrates its states over the step with its inputs held; all its outputs
  belong to the end of the step;
* a sampled one has a clock of its own (`sampling`); at a sample it first evaluates ``outputs``, then ``update``, then
  integrates; an output with direct feed-through keeps the value of the sample it was computed at, because it belongs to
  the inputs it was computed from;
* a get after a set is fresh.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .component import Component, Slot, convert, pack
from .declarations import Input, Memory, Output, Parameter, State, Tape
from .errors import ComponentError, nearest
from .methods import Methods
from .sampling import SampleClock
from .tape import TapeDeck
from .tracing import TracingError, computed_starts, feedthrough, start_name

Phase = Literal["instantiated", "initialization", "running", "terminated"]


class Simulation:
    """A component in time.

    Args:
        component: the built component; the simulation owns it from here on.

    Raises:
        ComponentError: from every method, with the component, the variable and the remedy. An exception inside an
            equation passes unchanged.
    """

    def __init__(self, component: Component) -> None:
        self.component = component
        self.name = type(component).__name__
        self.phase: Phase = "instantiated"
        self._methods = Methods(component)
        self._values = component.present_values
        self._given = {name: self._values[name] for name in component.slots if name in self._values}
        self._held_names = self._feedthrough_names() if component.is_sampled else frozenset()
        self._clock = SampleClock(component, self._methods) if component.is_sampled else None
        self._computed_starts = computed_starts(component)
        kept = [slot.name for slot in component.of(State, Memory) if slot.name not in self._computed_starts]
        self._started = {start_name(name): name for name in kept}
        self._starts = {name: self._given[name] for name in kept}
        self._deck: TapeDeck | None = None
        self._prepared = False
        self._fresh: dict[str, Any] | None = None
        self._time = 0.0

    # ---------------------------------------------------------------- life cycle

    def initialize(self, start_time: float = 0.0) -> None:
        """Enter initialization: parameters and start values are still open, outputs are already consistent."""
        self._expect("be initialized", "instantiated")
        self.phase = "initialization"
        self.time = start_time
        if self._clock is not None:
            self._clock.start(start_time)

    def start(self) -> None:
        """Leave initialization: fixed parameters are closed from here on."""
        self._expect("start", "initialization")
        for slot in self.component.of(Parameter):
            self._check_bounds(slot, self._values[slot.name])
        for name, value in self._starts.items():
            self._check_bounds(self.component.slots[name], value)
        self._prepare()
        self.phase = "running"
        self._fresh = None

    def step(self, length: float) -> None:
        """Advance by one communication step of ``length`` seconds from the current time."""
        self._expect("step", "running")
        if not 0.0 < length < math.inf:
            raise ComponentError(f"{self.name}: a communication step must be positive, not {length!r} s")
        begin = self._time
        if self._clock is not None:
            self._clock.advance(begin, length, self._sample)
        else:
            self._methods.integrate(begin, length)
            self._values["time"] = begin + length
        self._time = begin + length
        self._fresh = None
        if self._held_names and self._clock is not None:
            self._fresh = self._evaluate() | self._clock.held

    def terminate(self) -> None:
        """End the run: the tape, with the trip in progress if it is to be kept, goes to its file."""
        if self.phase == "running" and self._deck is not None and self._values["tape_file"]:
            self._deck.commit(self._methods.keep)
            self._deck.save(Path(self._values["tape_file"]))
        self.phase = "terminated"

    def reset(self) -> None:
        """Back to the state after construction; a rerun gives the same bits."""
        self._values.update(self._given)
        self._starts.update((name, self._given[name]) for name in self._starts)
        self.phase = "instantiated"
        self._deck = None
        self.time = 0.0

    # ---------------------------------------------------------------- values

    @property
    def time(self) -> float:
        """The communication point in s, as it was told; the equations see the time of the sample that is due there."""
        return self._time

    @time.setter
    def time(self, value: float) -> None:
        self._time = float(value)
        self._values["time"] = value
        self.invalidate()

    def get(self, name: str) -> Any:
        """A variable's value, outputs evaluated with the inputs as they now are.

        ``x_start`` is the start value of a state or memory ``x`` that ``initial`` does not compute.
        """
        if name in self._started:
            return self._starts[self._started[name]]
        slot = self._slot(name)
        if self.phase == "initialization":
            self._prepare()
        if isinstance(slot.declaration, Output):
            if self._fresh is None:
                self._fresh = self._evaluate()
            return self._fresh[name]
        return self._values[name]

    def set(self, name: str, value: Any) -> None:
        """Set an input or a tunable parameter at any time; a fixed parameter or a start value before the run begins.

        A start value may be called by the name of its state or memory as well.
        """
        slot = self._slot(self._started.get(name, name))
        self._check_settable(slot)
        converted = convert(slot, value, self.name)
        if self.phase == "running" and isinstance(slot.declaration, Parameter):
            self._check_bounds(slot, converted)
        self._values[slot.name] = converted
        if slot.name in self._starts:
            self._starts[slot.name] = converted
        self.invalidate()

    def settable(self, name: str) -> Any:
        """The present value of what may be set in the present phase, start values as they were given.

        Raises:
            ComponentError: it may not be set.
        """
        slot = self._slot(self._started.get(name, name))
        self._check_settable(slot)
        return self._values[slot.name]

    def _check_settable(self, slot: Slot) -> None:
        declaration = slot.declaration
        if isinstance(declaration, Output | Tape) or slot.name in self._computed_starts:
            raise ComponentError(f"{self.name}.{slot.name} is computed and cannot be set")
        if isinstance(declaration, Input) or (isinstance(declaration, Parameter) and declaration.tunable):
            return
        if self.phase not in ("instantiated", "initialization"):
            what = "a fixed parameter" if isinstance(declaration, Parameter) else "a start value"
            raise ComponentError(f"{self.name}.{slot.name} is {what}; it can only be set before the run begins")

    def invalidate(self) -> None:
        """Say that a value was changed past `set`: what follows from it is to be evaluated anew."""
        self._fresh = None
        self._prepared = False

    # ---------------------------------------------------------------- whole state

    def save(self) -> dict[str, Any]:
        """The complete state as JSON-ready values: `restore` and the same steps give the same bits."""
        return {
            "component": self.name,
            "phase": self.phase,
            "time": self.time,
            "seen": self._values["time"],
            "clock": None if self._clock is None else self._clock.state(),
            "values": {name: _plain(self._values[name]) for name in self._given},
            "starts": {name: _plain(value) for name, value in self._starts.items()},
            "fresh": None if self._fresh is None else {name: _plain(value) for name, value in self._fresh.items()},
            "tape": None if self._deck is None else self._deck.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take back what `save` gave.

        Raises:
            ComponentError: the state belongs to another component, or to one built with other arguments.
        """
        slots = self.component.slots
        try:
            if state["component"] != self.name or set(state["values"]) != set(self._given):
                raise ValueError
            values = {name: pack(slots[name], value) for name, value in state["values"].items()}
            fresh = state["fresh"] and {name: pack(slots[name], value) for name, value in state["fresh"].items()}
        except ValueError:
            raise ComponentError(f"a saved state of {state['component']} does not fit this {self.name}") from None
        self._values.update(values)
        self._starts.update((name, pack(slots[name], value)) for name, value in state["starts"].items())
        self.phase = state["phase"]
        self.time = state["time"]
        self._values["time"] = state["seen"]
        if self._clock is not None:
            self._clock.restore(state["clock"])
        self._deck = None
        if state["tape"] is not None:
            self._deck = self._make_deck()
            self._deck.restore(state["tape"])
        self._fresh = fresh

    def to_bytes(self) -> bytes:
        """The saved state, serialized; numbers survive exactly."""
        return json.dumps(self.save()).encode()

    # ---------------------------------------------------------------- inside a step

    def _sample(self, period: float, elapsed: float) -> dict[str, Any]:
        """One sample, ``elapsed`` seconds after the inputs were read; gives the outputs to be held."""
        values, deck = self._values, self._deck
        if deck is not None:
            deck.follow(values["trip"], values["trip_time"], self._methods.keep)
        outputs = self._evaluate(elapsed, at_sample=True)
        changes = self._methods.update(period)
        if deck is not None:
            deck.record(self._trip_time(elapsed), changes)
        values.update((slot.name, changes[slot.name]) for slot in self._methods.memory)
        values.update((slot.name, changes[slot.name]) for slot in self._methods.states if slot.name in changes)
        return {name: outputs[name] for name in self._held_names}

    def _evaluate(self, elapsed: float = 0.0, *, at_sample: bool = False) -> dict[str, Any]:
        self._methods.draw()
        if self._deck is not None:
            self._values.update(self._deck.read(self._trip_time(elapsed), at_sample=at_sample))
        return self._methods.evaluate()

    def _trip_time(self, elapsed: float) -> float:
        """Time along the trip: within a communication step of several samples the tape runs on; a wait stays a wait."""
        trip_time = float(self._values["trip_time"])
        waiting = self._deck is not None and self._deck.waiting(trip_time)
        return trip_time if waiting else trip_time + elapsed

    # ---------------------------------------------------------------- the initial state

    def _prepare(self) -> None:
        """Bring what follows from parameters, start values and inputs up to date with them: starts, and the tape."""
        if self._prepared:
            return
        self._values.update((name, self._given[name]) for name in self._computed_starts)
        self._methods.draw()
        self._values.update(self._methods.initial())
        if self._methods.tapes:
            self._deck = self._make_deck()
            path = self._values["tape_file"]
            if path and Path(path).exists():
                self._deck.load(Path(path))
        self._prepared = True

    def _make_deck(self) -> TapeDeck:
        values = self._values
        return TapeDeck(
            self.name,
            self._methods.tapes,
            self._given,
            sample_time=values["sample_time"],
            duration=values["tape_duration"],
            cutoff=values["tape_cutoff"],
        )

    # ---------------------------------------------------------------- checks

    def _slot(self, name: str) -> Slot:
        try:
            return self.component.slots[name]
        except KeyError:
            raise ComponentError(f"{self.name} has no variable {nearest(name, self.component.slots)}") from None

    def _expect(self, what: str, phase: Phase) -> None:
        if self.phase != phase:
            raise ComponentError(f"{self.name} cannot {what}: its phase is {self.phase!r}, not {phase!r}")

    def _feedthrough_names(self) -> frozenset[str]:
        """Outputs of a sampled block that are held because they belong to the inputs they were computed from."""
        try:
            direct = feedthrough(self.component)
        except TracingError:
            return frozenset(slot.name for slot in self._methods.outputs)
        return frozenset(s.name for s in self._methods.outputs if any(direct[scalar] for scalar in s.scalars))

    def _check_bounds(self, slot: Slot, value: Any) -> None:
        low, high = slot.declaration.minimum, slot.declaration.maximum
        array = np.asarray(value)
        if (low is not None and (array < low).any()) or (high is not None and (array > high).any()):
            limits = f"[{'-inf' if low is None else low}, {'inf' if high is None else high}]"
            raise ComponentError(f"{self.name}.{slot.name} = {array.tolist()!r} is outside {limits} {slot.unit}")


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def simulate(
    component: Component,
    stop_time: float,
    step: float,
    inputs: Callable[[float], Mapping[str, Any]] | Mapping[str, Any] | None = None,
) -> dict[str, NDArray[Any]]:
    """Run one component alone.

    Args:
        component: built, with its parameters and start values set.
        stop_time: end in s; the nearest whole number of steps is taken.
        step: communication step in s.
        inputs: values by name, or a function of time that gives them; held over each step.

    Returns:
        ``"time"``, shape (n + 1,), and every output by name, shape (n + 1, ...). The first row is the initial state.
    """
    simulation = Simulation(component)
    given = inputs if callable(inputs) else (lambda _: inputs or {})
    names = [slot.name for slot in component.output_slots]
    rows: list[list[Any]] = []

    def apply(t: float) -> None:
        for name, value in given(t).items():
            simulation.set(name, value)

    simulation.initialize(0.0)
    apply(0.0)
    rows.append([simulation.get(name) for name in names])
    simulation.start()
    count = round(stop_time / step)
    for k in range(count):
        simulation.time = k * step
        apply(k * step)
        simulation.step(step)
        rows.append([simulation.get(name) for name in names])
    simulation.terminate()
    columns = {name: np.array([row[k] for row in rows]) for k, name in enumerate(names)}
    return {"time": np.arange(count + 1) * step, **columns}
