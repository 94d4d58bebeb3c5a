"""The Python side of a Python FMU: pythonfmu's compiled wrapper calls this class, and this class drives a `Simulation`.

The file travels inside the FMU, with the component's own copy of the equations; it needs Python and NumPy only. The
wrapper finds its class by the name ``Fmi2Slave`` of the base, which is why the base bears it.
"""

from __future__ import annotations

import functools
import json
import traceback
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, ParamSpec, TypeVar

from ..components.component import Component, ScalarType
from ..components.simulate import Simulation
from .variables import scalar_variables

P = ParamSpec("P")
R = TypeVar("R")


class SlaveError(RuntimeError):
    """What went wrong inside the FMU, in one line: instance, component, time, cause, file and line."""


def _telling(method: Callable[P, R]) -> Callable[P, R]:
    """Turn any exception into one line: the wrapper passes on nothing but the exception's text."""

    @functools.wraps(method)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return method(*args, **kwargs)
        except Exception as error:
            slave: Any = args[0]
            frame = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{frame.filename.rpartition('/')[2]}:{frame.lineno}, in {frame.name}"
            where = f"{slave.instance_name} ({slave.component.__name__}) at t = {slave.simulation.time!r} s"
            raise SlaveError(f"{where}: {type(error).__name__}: {error} [{place}]") from None

    return wrapped


class Fmi2Slave:
    """One instance of a component behind the calls of pythonfmu's wrapper; a generated subclass names the component."""

    component: ClassVar[type[Component]]
    arguments: ClassVar[str] = "{}"

    def __init__(self, **wrapper: Any) -> None:
        self.instance_name: str = wrapper.get("instance_name", "")
        self.log_queue: list[Any] = []
        self.simulation = Simulation(self.component(**json.loads(self.arguments)))
        self._variables = scalar_variables(self.simulation.component)
        self._start_time = 0.0

    # ---------------------------------------------------------------- life cycle

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Note the start time; stop time and tolerance are not needed."""
        self._start_time = start_time

    @_telling
    def enter_initialization_mode(self) -> None:
        """FMI: fmi2EnterInitializationMode."""
        self.simulation.initialize(self._start_time)

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

    def _get(self, references: Sequence[int], kind: ScalarType) -> list[Any]:
        values = []
        for reference in references:
            variable = self._variables[reference]
            if variable.slot.type is not kind:
                raise TypeError(f"{variable.name} is not a {kind.__name__}")
            value = self.simulation.get(variable.slot.name)
            values.append(value if variable.element is None else kind(value.flat[variable.element]))
        return values

    def _set(self, references: Sequence[int], values: Sequence[Any], kind: ScalarType) -> None:
        arrays: dict[str, Any] = {}
        for reference, value in zip(references, values, strict=True):
            variable = self._variables[reference]
            name = variable.slot.name
            if variable.slot.type is not kind:
                raise TypeError(f"{variable.name} is not a {kind.__name__}")
            if variable.element is None:
                self.simulation.set(name, kind(value))
            else:
                if name not in arrays:
                    arrays[name] = self.simulation.get(name).copy()
                arrays[name].flat[variable.element] = kind(value)
        for name, array in arrays.items():
            self.simulation.set(name, array)

    @_telling
    def get_real(self, references: Sequence[int]) -> list[float]:
        """FMI: fmi2GetReal."""
        return self._get(references, float)

    @_telling
    def get_integer(self, references: Sequence[int]) -> list[int]:
        """FMI: fmi2GetInteger."""
        return self._get(references, int)

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
        self.simulation.restore(state)

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        return json.dumps(state).encode()

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        loaded: dict[str, Any] = json.loads(state)
        return loaded

    def _get_log_queue(self) -> list[Any]:
        return self.log_queue
