"""Reference signals of an FMU: what goes in, and what must come out, for whoever imports it to compare with.

The files have the names and the format of the FMI cross-check (``<Model>_in.csv``, ``_ref.csv``, ``_ref.opt``). The
cross-check keeps them beside an FMU; inside one they stand in ``documentation/``, as in the Reference FMUs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...components.component import Component, Slot
from ...components.declarations import Input, Output, State
from ...components.simulate import simulate
from ..description import default_step

STEPS = 50
"""So many communication steps; `steps_of` those of large components."""
_FEWEST, _WORK = 12, 2000
EXCITATION = (
    "every real input swings about its start value as a sine of 1 to 5 periods (amplitude 100 kN, 100 m, 10 m/s, "
    "0.1 m/s2 or 0.01 N/kg, 1 in any other unit), a boolean is the opposite of its start value in the second third, "
    "an integer is one more in the second half; trip_time is the time, trip and texts keep their start values"
)
"""What the inputs do: it moves all of them and is no realistic case."""
_AMPLITUDES = {"N": 1e5, "m": 100.0, "m/s": 10.0, "m/s2": 0.1, "N/kg": 0.01}


def steps_of(component: Component) -> int:
    """How many communication steps the signals of a component last.

    Fewer for one of many states: a hundred wagons in plain Python take a second for each. Twelve still show all periods
    of the inputs.
    """
    states = sum(math.prod(slot.shape) for slot in component.of(State))
    return max(_FEWEST, min(STEPS, _WORK // max(states, 1)))


def reference_signals(component: Component) -> dict[str, str]:
    """The files by name: input, result, settings. No input file without inputs; nothing if the equations refuse.

    The result is that of plain Python: both kinds of FMU agree with it to rounding error.

    Args:
        component: built; its values are the start values. It is not changed.
    """
    step, count = default_step(component), steps_of(component)
    inputs = [slot for slot in component.of(Input) if slot.type is not str]
    rows = [_excitation(component, inputs, k * step, count * step) for k in range(count + 1)]
    try:
        # A value outside what the equations can take is theirs to refuse, by whatever exception.
        result = simulate(_fresh(component), count * step, step, lambda t: rows[round(t / step)])
    except Exception:
        return {}
    name, times = type(component).__name__, result["time"].tolist()
    outputs = [slot for slot in component.output_slots if slot.type is not str]
    settings = f"StartTime, 0.0\nStopTime, {times[-1]!r}\nStepSize, {step!r}\nRelTol, 1e-09\n"
    files = {
        f"{name}_ref.csv": _table(times, outputs, {slot.name: result[slot.name] for slot in outputs}),
        f"{name}_ref.opt": settings,
    }
    if inputs:
        given = {slot.name: np.array([row[slot.name] for row in rows]) for slot in inputs}
        files[f"{name}_in.csv"] = _table(times, inputs, given)
    return files


def _fresh(component: Component) -> Component:
    """Another of the same build arguments and values; it reads and writes no tape."""
    computed = [slot.name for slot in component.of(Output)]
    values = {name: component.present_values[name] for name in component.slots if name not in computed}
    if "tape_file" in values:
        values["tape_file"] = ""
    return type(component)(**component.build_arguments, **values)


def _excitation(component: Component, inputs: list[Slot], time: float, duration: float) -> dict[str, Any]:
    values, count = {}, 0
    for slot in inputs:
        start = component.present_values[slot.name]
        cells = [_excited(slot, x, time, duration, count + k) for k, x in enumerate(np.ravel(start).tolist())]
        values[slot.name] = np.array(cells).reshape(slot.shape) if slot.shape else cells[0]
        count += len(cells)
    return values


def _excited(slot: Slot, start: Any, time: float, duration: float, number: int) -> Any:
    if slot.name == "trip_time":
        return time
    if slot.name == "trip":
        return start
    part = time / duration
    if slot.type is bool:
        return start != (1 / 3 <= part < 2 / 3)
    value = start + 1 if slot.type is int and part >= 0.5 else start
    if slot.type is float:
        periods = 1 + number % 5
        swing = round(math.sin(2.0 * math.pi * periods * part), 6)  # the same on every machine
        value = float(f"{start + _AMPLITUDES.get(slot.unit, 1.0) * swing:.9g}")
    low, high = slot.declaration.minimum, slot.declaration.maximum
    value = value if low is None else max(value, low)
    return slot.type(value if high is None else min(value, high))


def _table(times: list[float], slots: list[Slot], values: Mapping[str, Any]) -> str:
    """Comma-separated values as the FMI cross-check wants them: quoted names, numbers that survive exactly."""
    names = ["time", *(name for slot in slots for name in slot.scalars)]
    columns = [np.reshape(values[slot.name], (len(times), -1)) for slot in slots]
    lines = [",".join(f'"{name}"' for name in names)]
    for time, *cells in zip(times, *columns, strict=True):
        row = [_written(slot, x) for slot, array in zip(slots, cells, strict=True) for x in array]
        lines.append(",".join([repr(float(time)), *row]))
    return "\n".join(lines) + "\n"


def _written(slot: Slot, value: Any) -> str:
    """A number; of a boolean 0 or 1, for whole numbers are read as such."""
    return repr(float(value)) if slot.type is float else str(int(value))
