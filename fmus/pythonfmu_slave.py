"""The Python side of a Python FMU: pythonfmu's compiled wrapper calls this class, and this class drives a `Simulation`.

The file travels inside the FMU, with the component's own copy of the equations; it needs Python and NumPy only. The
wrapper finds its class by the name ``Fmi2Slave`` of the base, which is why the base bears it.
"""

from __future__ import annotations

import ctypes
import functools
import json
import math
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, ParamSpec, TypeVar

from ..components.component import Component
from ..components.declarations import Input, ScalarType
from ..components.errors import ComponentError
from ..components.simulate import Simulation
from ..components.tracing import start_name
from .variables import scalar_variables

P = ParamSpec("P")
R = TypeVar("R")
_COPY = Path(__file__).parents[1]
_RUNTIME = (_COPY / "components", _COPY / "fmus")


class SlaveError(RuntimeError):
    """What went wrong inside the FMU, in one line: instance, component, time, cause, file and line."""


def _telling(method: Callable[P, R]) -> Callable[P, R]:
    """Turn any exception into one line: the wrapper passes on nothing but the exception's text.

    The wrapper (pythonfmu 0.7) then drops its references to instance, class and log queue, and drops them once more
    when the instance is freed, which would crash the process. It is therefore given one more of each.
    """

    @functools.wraps(method)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return method(*args, **kwargs)
        except BaseException as error:  # an interrupt too: the wrapper makes the same of it
            slave: Any = args[0]
            for dropped in (slave, type(slave), slave.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(dropped))
            where = f"{slave.instance_name} ({slave.component.__name__}) at t = {slave.simulation.time!r} s"
            raise SlaveError(f"{where}: {type(error).__name__}: {error} [{_place(error.__traceback__)}]") from None

    return wrapped


def _place(trace: TracebackType | None) -> str:
    """Where an exception arose: the innermost line of the component's author, or else the innermost line."""
    frames = traceback.extract_tb(trace)
    paths = [Path(frame.filename) for frame in frames]
    authors = [k for k, path in enumerate(paths) if path.is_relative_to(_COPY) and path.parent not in _RUNTIME]
    k = authors[-1] if authors else -1
    return f"{paths[k].name}:{frames[k].lineno}, in {frames[k].name}"


class Fmi2Slave:
    """One instance of a component behind the calls of pythonfmu's wrapper; a generated subclass names the component."""

    component: ClassVar[type[Component]]
    arguments: ClassVar[str] = "{}"

    def __init__(self, **wrapper: Any) -> None:
        self.instance_name: str = wrapper.get("instance_name", "")
        self.log_queue: list[Any] = []
        self.simulation = Simulation(self.component(**json.loads(self.arguments)))
        self.simulation.time = 0.0
        self._places: dict[ScalarType, dict[int, tuple[str, int | None]]] = {float: {}, int: {}, bool: {}, str: {}}
        self._real_inputs: dict[int, str] = {}
        self._kept: set[int] = set()
        for variable in scalar_variables(self.simulation.component):
            slot = variable.slot
            name = start_name(slot.name) if variable.is_start else slot.name
            self._places[slot.type][variable.reference] = name, variable.element
            if variable.is_kept:
                self._kept.add(variable.reference)
            if slot.type is float and variable.element is None and isinstance(slot.declaration, Input):
                self._real_inputs[variable.reference] = slot.name

    # ---------------------------------------------------------------- life cycle

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Note the start time; stop time and tolerance are not needed."""
        self.simulation.time = start_time

    @_telling
    def enter_initialization_mode(self) -> None:
        """FMI: fmi2EnterInitializationMode."""
        self.simulation.initialize(self.simulation.time)

    @_telling
    def exit_initialization_mode(self) -> None:
        """FMI: fmi2ExitInitializationMode."""
        self.simulation.start()

    @_telling
    def do_step(self, current_time: float, step_size: float) -> bool:
        """FMI: fmi2DoStep. The communication point must continue the last one, up to rounding."""
        simulation = self.simulation
        gap = current_time - simulation.time
        if gap != 0.0:
            if abs(gap) > 1e-6 * step_size:
                raise ValueError(f"the communication point {current_time!r} s does not continue the last one")
            simulation.time = current_time
        simulation.step(step_size)
        return True

    @_telling
    def terminate(self) -> None:
        """FMI: fmi2Terminate."""
        self.simulation.terminate()

    # ---------------------------------------------------------------- values

    def _place(self, reference: int, kind: ScalarType) -> tuple[str, int | None]:
        """Name of a variable, and which element of it."""
        try:
            return self._places[kind][reference]
        except KeyError:
            found = [places[reference][0] for places in self._places.values() if reference in places]
            what = f"{found[0]} is not a {kind.__name__}" if found else f"no variable has value reference {reference}"
            raise TypeError(what) from None

    def _get(self, references: Sequence[int], kind: ScalarType) -> list[Any]:
        values = []
        for reference in references:
            name, element = self._place(reference, kind)
            value = self.simulation.get(name)
            values.append(value if element is None else kind(value.flat[element]))
        return values

    def _set(self, references: Sequence[int], values: Sequence[Any], kind: ScalarType) -> None:
        arrays: dict[str, Any] = {}
        for reference, value in zip(references, values, strict=True):
            name, element = self._place(reference, kind)
            if reference in self._kept:
                raise ComponentError(f"{self.component.__name__}.{name} is computed and cannot be set")
            if element is None:
                self.simulation.set(name, kind(value))
            else:
                if name not in arrays:
                    arrays[name] = self.simulation.settable(name).copy()
                arrays[name].flat[element] = kind(value)
        for name, array in arrays.items():
            self.simulation.set(name, array)

    @_telling
    def get_real(self, references: Sequence[int]) -> list[float]:
        """FMI: fmi2GetReal."""
        return self._get(references, float)

    @_telling
    def get_integer(self, references: Sequence[int]) -> list[int]:
        """FMI: fmi2GetInteger. The wrapper would cut a larger number to 32 bits without a word."""
        values = self._get(references, int)
        for reference, value in zip(references, values, strict=True):
            if not -(2**31) <= value < 2**31:
                raise OverflowError(f"{self._place(reference, int)[0]} = {value} does not fit FMI's 32-bit integers")
        return values

    @_telling
    def get_boolean(self, references: Sequence[int]) -> list[bool]:
        """FMI: fmi2GetBoolean."""
        return self._get(references, bool)

    @_telling
    def get_string(self, references: Sequence[int]) -> list[str]:
        """FMI: fmi2GetString."""
        return self._get(references, str)

    @_telling
    def set_real(self, references: Sequence[int], values: Sequence[float]) -> None:
        """FMI: fmi2SetReal."""
        names = self._real_inputs
        if all(map(names.__contains__, references)) and all(map(math.isfinite, values)):
            # Nearly every call of a run: scalar inputs, which `Simulation.set` would check one by one to no effect.
            place = self.simulation.component.present_values
            for reference, value in zip(references, values, strict=True):
                place[names[reference]] = value
            self.simulation.invalidate()
        else:
            self._set(references, values, float)

    @_telling
    def set_integer(self, references: Sequence[int], values: Sequence[int]) -> None:
        """FMI: fmi2SetInteger."""
        self._set(references, values, int)

    @_telling
    def set_boolean(self, references: Sequence[int], values: Sequence[bool]) -> None:
        """FMI: fmi2SetBoolean."""
        self._set(references, values, bool)

    @_telling
    def set_string(self, references: Sequence[int], values: Sequence[str]) -> None:
        """FMI: fmi2SetString."""
        self._set(references, values, str)

    # ---------------------------------------------------------------- state and log

    @_telling
    def _get_fmu_state(self) -> dict[str, Any]:
        return self.simulation.save()

    @_telling
    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if not state:
            raise ValueError("the serialized state is corrupt")
        self.simulation.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return json.dumps(state).encode()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        # The wrapper asks the class, so that a failure could not be told here: `_set_fmu_state` refuses what is empty.
        try:
            loaded: dict[str, Any] = json.loads(state)
        except ValueError:
            return {}
        return loaded

    def _get_log_queue(self) -> list[Any]:
        return self.log_queue
