"""One component alone, in plain Python: for unit tests, for a debugger, and inside the Python FMU.

`Simulation` gives a component time, state and a step, with the semantics every kind of FMU shares:

* a component without Memory, Tape or Noise integrates its states over the step with its inputs held; all its outputs
  belong to the end of the step;
* a sampled one first evaluates ``outputs``, then ``update``, then integrates; an output with direct feed-through keeps
  the value of the sample it was computed at, because it belongs to the inputs it was computed from;
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

from . import noise
from .component import Component, ComponentError, Slot, convert
from .declarations import Input, Memory, Output, Parameter, State, Tape
from .tape import TapeDeck
from .tracing import TracingError, feedthrough

Phase = Literal["instantiated", "initialization", "running", "terminated"]
_DRAW = {"normal": noise.normal, "uniform": noise.uniform}
_GRID_TOLERANCE = 1e-6
"""How far, relative to a sample, a communication step may miss a whole number of samples (rounding, h = 1/3)."""


class Simulation:
    """A component in time.

    Args:
        component: the built component; the simulation owns it from here on.

    Raises:
        ComponentError: from every method, with the component, the variable and the remedy.
    """

    def __init__(self, component: Component) -> None:
        self.component = component
        self.name = type(component).__name__
        self.phase: Phase = "instantiated"
        self._values = component.__dict__
        self._states = tuple(component.of(State))
        self._outputs = tuple(component.of(Output))
        self._kept = tuple(component.of(Memory))
        self._tapes = tuple(component.of(Tape))
        self._output_names = {slot.name for slot in self._outputs}
        self._state_names = {slot.name for slot in self._states}
        self._kept_names = {slot.name for slot in self._kept}
        self._returned = {
            "outputs": self._output_names,
            "initial": self._state_names | self._kept_names,
            "update": self._state_names | self._kept_names | {slot.name for slot in self._tapes},
        }
        self._held_names: frozenset[str] = self._feedthrough_names() if component.is_sampled else frozenset()
        self._deck: TapeDeck | None = None
        self._fresh: dict[str, Any] | None = None
        self._computed_starts: frozenset[str] = frozenset()
        self._given = {slot.name: self._values[slot.name] for slot in component.slots.values()}

    # ---------------------------------------------------------------- life cycle

    def initialize(self, start_time: float = 0.0) -> None:
        """Enter initialization: parameters and start values are still open, outputs are already consistent."""
        if self.phase != "instantiated":
            raise ComponentError(f"{self.name} is already initialized; reset it first")
        self._values["time"] = start_time
        self.phase = "initialization"
        self._fresh = None

    def start(self) -> None:
        """Leave initialization: fixed parameters are closed from here on, the tape file is read."""
        self._check_parameters()
        self._apply_initial()
        if self._tapes:
            self._deck = self._make_deck()
        self.phase = "running"
        self._fresh = None

    def step(self, length: float) -> None:
        """Advance by one communication step of ``length`` seconds from the current time."""
        if self.phase != "running":
            raise ComponentError(f"{self.name} cannot step: it is {self.phase}")
        if not length > 0.0:
            raise ComponentError(f"{self.name}: a communication step must be positive, not {length!r} s")
        begin = self._values["time"]
        held: dict[str, Any] = {}
        if self.component.is_sampled:
            count, sample = self.samples(length)
            for k in range(count):
                self._values["time"] = begin + k * sample
                held = self._sample(sample)
                self._integrate(begin + k * sample, sample)
        elif self._states:
            self._integrate(begin, length)
        self._values["time"] = begin + length
        self._fresh = None
        if held:
            self._fresh = self._evaluate_outputs() | held

    def terminate(self) -> None:
        """End the run: the tape, with the trip in progress if it is to be kept, goes to its file."""
        if self._deck is not None and self._values["tape_file"]:
            self._deck.commit(self.component.keep)
            self._deck.save(Path(self._values["tape_file"]))
        self.phase = "terminated"

    def reset(self) -> None:
        """Back to the state after construction; a rerun gives the same bits."""
        self._values.update(self._given)
        self._values["time"] = 0.0
        self.phase = "instantiated"
        self._deck = None
        self._fresh = None

    # ---------------------------------------------------------------- values

    @property
    def time(self) -> float:
        """Current time in s."""
        return float(self._values["time"])

    @time.setter
    def time(self, value: float) -> None:
        self._values["time"] = value
        self._fresh = None

    def get(self, name: str) -> Any:
        """A variable's value, outputs evaluated with the inputs as they now are."""
        slot = self._slot(name)
        if isinstance(slot.declaration, Output):
            if self._fresh is None:
                if self.phase == "initialization":
                    self._apply_initial()
                self._fresh = self._evaluate_outputs()
            return self._fresh[name]
        if self.phase == "initialization" and isinstance(slot.declaration, State | Memory):
            self._apply_initial()
        return self._values[name]

    def set(self, name: str, value: Any) -> None:
        """Set an input or a tunable parameter at any time; a fixed parameter or a start value before the run begins."""
        slot = self._slot(name)
        self.check_settable(slot)
        self._values[name] = convert(slot, value, self.name)
        self._fresh = None

    def check_settable(self, slot: Slot) -> None:
        """Raise unless the variable may be set in the present phase."""
        declaration = slot.declaration
        if isinstance(declaration, Output | Tape) or slot.name in self._computed_starts:
            raise ComponentError(f"{self.name}.{slot.name} is computed and cannot be set")
        if isinstance(declaration, Input) or (isinstance(declaration, Parameter) and declaration.tunable):
            return
        if self.phase not in ("instantiated", "initialization"):
            what = "a fixed parameter" if isinstance(declaration, Parameter) else "a start value"
            raise ComponentError(f"{self.name}.{slot.name} is {what}; it can only be set before the run begins")

    def invalidate(self) -> None:
        """Say that a value was changed in place, past `set`: outputs are to be evaluated anew."""
        self._fresh = None

    # ---------------------------------------------------------------- whole state

    def save(self) -> dict[str, Any]:
        """The complete state as JSON-ready values: `restore` and the same steps give the same bits."""
        values = {slot.name: _plain(self._values[slot.name]) for slot in self.component.slots.values()}
        held = None if self._fresh is None else {name: _plain(value) for name, value in self._fresh.items()}
        return {
            "component": self.name,
            "phase": self.phase,
            "time": self.time,
            "values": values,
            "fresh": held,
            "tape": None if self._deck is None else self._deck.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take back what `save` gave.

        Raises:
            ComponentError: the state belongs to another component.
        """
        if state["component"] != self.name or set(state["values"]) != set(self.component.slots):
            raise ComponentError(f"a saved state of {state['component']} does not fit {self.name}")
        for name, value in state["values"].items():
            slot = self.component.slots[name]
            self._values[name] = np.array(value, dtype=slot.type) if slot.shape else value
        self._values["time"] = state["time"]
        self.phase = state["phase"]
        slots = self.component.slots
        fresh = state["fresh"]
        self._fresh = None if fresh is None else {n: np.array(v) if slots[n].shape else v for n, v in fresh.items()}
        self._deck = None
        if state["tape"] is not None:
            self._deck = self._make_deck(load=False)
            self._deck.restore(state["tape"])

    def to_bytes(self) -> bytes:
        """The saved state, serialized; numbers survive exactly."""
        return json.dumps(self.save()).encode()

    # ---------------------------------------------------------------- inside a step

    def samples(self, length: float) -> tuple[int, float]:
        """How many samples of which period make a communication step."""
        period = self._values["sample_time"]
        if period == 0.0:
            return 1, length
        count = round(length / period)
        if count < 1 or abs(count * period - length) > _GRID_TOLERANCE * period:
            raise ComponentError(
                f"{self.name}: the communication step {length!r} s is not a whole multiple of "
                f"sample_time = {period!r} s"
            )
        return count, length / count

    def _sample(self, period: float) -> dict[str, Any]:
        component, values = self.component, self._values
        self._follow_trip()
        outputs = self._evaluate_outputs()
        component._step = period
        try:
            changes = self._checked("update", component.update())
        finally:
            component._step = None
        missing = self._kept_names - set(changes)
        if missing:
            raise ComponentError(f"{self.name}.update returns no next value of {sorted(missing)}")
        if self._deck is not None:
            self._deck.record(values["trip_time"], _row(self._tapes, changes, self.name))
        for slot in (*self._kept, *self._states):
            if slot.name in changes:
                values[slot.name] = self._cast(slot, changes[slot.name], "update")
        return {name: outputs[name] for name in self._held_names}

    def _integrate(self, begin: float, length: float) -> None:
        """Classical Runge-Kutta in equal sub-steps no longer than ``max_step``, inputs and memory held."""
        if not self._states:
            return
        longest = self._values["max_step"]
        count = max(1, math.ceil(length / longest - 1e-9)) if longest > 0.0 else 1
        h = length / count
        values, names = self._values, [slot.name for slot in self._states]
        x = {name: values[name] for name in names}
        for k in range(count):
            t = begin + k * h
            k1 = self._rates(t, x)
            k2 = self._rates(t + 0.5 * h, {n: x[n] + (0.5 * h) * k1[n] for n in names})
            k3 = self._rates(t + 0.5 * h, {n: x[n] + (0.5 * h) * k2[n] for n in names})
            k4 = self._rates(t + h, {n: x[n] + h * k3[n] for n in names})
            x = {n: x[n] + (h / 6.0) * (((k1[n] + 2.0 * k2[n]) + 2.0 * k3[n]) + k4[n]) for n in names}
        for slot in self._states:
            values[slot.name] = self._cast(slot, x[slot.name], "derivatives")

    def _rates(self, t: float, x: Mapping[str, Any]) -> dict[str, Any]:
        self._values["time"] = t
        self._values.update(x)
        rates = self.component.derivatives()
        if rates.keys() != x.keys():
            raise ComponentError(f"{self.name}.derivatives returns {sorted(rates)}, but the states are {sorted(x)}")
        return rates

    def _evaluate_outputs(self) -> dict[str, Any]:
        self._refresh_noise()
        if self._tapes:
            self._read_tape()
        returned = self._checked("outputs", self.component.outputs())
        missing = self._output_names - set(returned)
        if missing:
            raise ComponentError(f"{self.name}.outputs returns no value of {sorted(missing)}")
        return {slot.name: self._cast(slot, returned[slot.name], "outputs") for slot in self._outputs}

    def _apply_initial(self) -> None:
        self._refresh_noise()
        slots = {slot.name: slot for slot in (*self._states, *self._kept)}
        computed = self._checked("initial", self.component.initial())
        for name, value in computed.items():
            self._values[name] = self._cast(slots[name], value, "initial")
        self._computed_starts = frozenset(computed)

    def _refresh_noise(self) -> None:
        for stream, (name, declaration) in enumerate(self.component.noises.items()):
            hold = self._values[declaration.hold.name]
            if not hold > 0.0:
                raise ComponentError(f"{self.name}.{declaration.hold.name} must be positive: it holds {name!r}")
            index, seed = round(self._values["time"] / hold), self._values["seed"]
            draw = _DRAW[declaration.distribution]
            shape = np.shape(self._values[name])
            if shape:
                # The element's number goes into the upper half of the stream, so that no two streams meet.
                cells = [draw(seed, stream + (k << 32), index) for k in range(math.prod(shape))]
                self._values[name] = np.array(cells).reshape(shape)
            else:
                self._values[name] = draw(seed, stream, index)

    # ---------------------------------------------------------------- tape

    def _make_deck(self, load: bool = True) -> TapeDeck:
        values = self._values
        start = np.concatenate([np.ravel(self._given[slot.name]) for slot in self._tapes]).astype(np.float64)
        deck = TapeDeck(self.name, start, values["sample_time"], values["tape_duration"], values["tape_cutoff"])
        path = Path(values["tape_file"]) if values["tape_file"] else None
        if load and path is not None and path.exists():
            deck.load(path)
        return deck

    def _follow_trip(self) -> None:
        if self._deck is not None:
            self._deck.follow(self._values["trip"], self._values["trip_time"], self.component.keep)

    def _read_tape(self) -> None:
        if self._deck is None:
            return
        row = self._deck.read(self._values["trip_time"])
        at = 0
        for slot in self._tapes:
            size = len(slot.scalars)
            self._values[slot.name] = row[at : at + size].reshape(slot.shape).copy() if slot.shape else float(row[at])
            at += size

    # ---------------------------------------------------------------- checks

    def _slot(self, name: str) -> Slot:
        try:
            return self.component.slots[name]
        except KeyError:
            raise ComponentError(f"{self.name} has no variable {name!r}") from None

    def _feedthrough_names(self) -> frozenset[str]:
        """Outputs of a sampled block that are held because they belong to the inputs they were computed from."""
        try:
            direct = feedthrough(self.component)
        except TracingError:
            return frozenset(slot.name for slot in self._outputs)
        return frozenset(s.name for s in self._outputs if any(direct[scalar] for scalar in s.scalars))

    def _check_parameters(self) -> None:
        for slot in self.component.of(Parameter):
            low, high = slot.declaration.minimum, slot.declaration.maximum
            value = np.asarray(self._values[slot.name])
            if (low is not None and (value < low).any()) or (high is not None and (value > high).any()):
                limits = f"[{'-inf' if low is None else low}, {'inf' if high is None else high}]"
                raise ComponentError(f"{self.name}.{slot.name} = {value.tolist()!r} is outside {limits} {slot.unit}")

    def _checked(self, method: str, returned: dict[str, Any]) -> dict[str, Any]:
        known = self._returned[method]
        if not returned.keys() <= known:
            unknown = sorted(returned.keys() - known)
            raise ComponentError(f"{self.name}.{method} returns {unknown}; it may return {sorted(known)}")
        return returned

    def _cast(self, slot: Slot, value: Any, method: str) -> Any:
        array: Any
        if slot.shape:
            array = np.asarray(value, dtype=slot.type if slot.type is not str else object)
            if array.shape != slot.shape:
                shapes = f"{array.shape}, declared {slot.shape}"
                raise ComponentError(f"{self.name}.{method}: {slot.name!r} has shape {shapes}")
            finite = slot.type is not float or bool(np.isfinite(array).all())
        else:
            array = slot.type(value)
            finite = slot.type is not float or math.isfinite(array)
        if not finite:
            raise ComponentError(f"{self.name}.{method}: {slot.name!r} is {_plain(array)!r} at t = {self.time!r} s")
        return array


def _row(tapes: tuple[Slot, ...], changes: Mapping[str, Any], owner: str) -> NDArray[np.float64]:
    missing = [slot.name for slot in tapes if slot.name not in changes]
    if missing:
        raise ComponentError(f"{owner}.update returns no tape row of {missing}")
    return np.concatenate([np.ravel(changes[slot.name]) for slot in tapes]).astype(np.float64)


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
