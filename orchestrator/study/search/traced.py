"""The closed loop of a system as one traced function of a communication step, whose derivatives are exact.

Values of all instances stand in one vector, parameters among them. A step leads from the values at a communication
point to those at the next, in the master's own order. The gradient of a value at a point with respect to the values
that the run began with is pulled back through the steps, one transposed Jacobian each (reverse mode); it is that of the
discrete run itself, with what switches held.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ....components.errors import ComponentError
from ....fmus.native.stepping import Steps, replaced
from ....fmus.native.trace import simplification
from ....fmus.references import build_with, resolve
from ...errors import ScenarioError
from ...master import ALGORITHMS, Explicit, Settings
from ...problems import Problem
from ...run import Checked
from ...times import count_steps

Array = NDArray[np.float64]

_CHUNK = 100
"""So many steps are taken by one call; the values between them are computed again when a gradient is pulled through."""
_REMEDY = "choose another --method"


@dataclass(frozen=True)
class Flight:
    """A run of the traced loop.

    Attributes:
        given: the values it was given, (size,). settling: those at each sweep before the first step.
        stops: those at each `_CHUNK`-th communication point, (size,) each. columns: signals by name, and ``time``.
    """

    given: Array
    settling: list[Array]
    stops: list[Array]
    columns: Mapping[str, Array]


class TracedLoop:
    """A closed loop of components whose equations are known.

    Args:
        checked: the system; values may be others when it is flown.

    Attributes:
        places: where each variable stands among the values, by full name. parameters: which of them are parameters.

    Raises:
        ScenarioError: with everything that has no gradient, and the remedy.
    """

    def __init__(self, checked: Checked) -> None:
        problems = [*_of_stepping(checked)]
        self._steps: dict[str, Steps] = {}
        shared: dict[str, Steps] = {}
        for name, instance in checked.system.instances.items():
            key = f"{instance.model} {sorted(instance.build.items())}"
            if checked.models[name].kind == "fmu":
                problems.append(_problem(name, f"{instance.model} is an FMU whose equations are not known"))
                continue
            try:
                if key not in shared:
                    shared[key] = Steps(build_with(resolve(instance.model), instance.build))
                self._steps[name] = shared[key]
            except ComponentError as error:
                problems.append(_problem(name, str(error)))
        if problems:
            raise ScenarioError(list(dict.fromkeys(problems)))
        self._stepping = checked.system.stepping
        self._first: dict[str, int] = {}
        size = 0
        for name, steps in self._steps.items():
            self._first[name] = size
            size += steps.size
        named = {name: steps.places for name, steps in self._steps.items()}
        self.places = {
            f"{name}.{v}": self._first[name] + k for name, places in named.items() for v, k in places.items()
        }
        self.parameters = tuple(f"{name}.{v}" for name, steps in self._steps.items() for v in steps.parameters)
        self._make(checked, size)

    def _make(self, checked: Checked, size: int) -> None:
        values, time, seed = ca.SX.sym("values", size), ca.SX.sym("time"), ca.SX.sym("seed", size)
        given = self.values(checked)
        with simplification(True):
            after, settled = self._swept(checked, values, time, given), self._settled(checked, values)
            step = ca.Function("step", [values, time], [after])
            back = ca.Function("back", [seed, values, time], [ca.jtimes(after, values, seed, True)])
            self._sweep = ca.Function("sweep", [values], [settled])
            self._sweep_back = ca.Function("sweep_back", [seed, values], [ca.jtimes(settled, values, seed, True)])
        self._step, self._back = {1: step}, {1: back}
        self._step[_CHUNK], self._back[_CHUNK] = step.mapaccum(_CHUNK), back.mapaccum(_CHUNK)

    def _swept(self, checked: Checked, values: Any, time: Any, given: Array) -> Any:
        """The values a communication step later."""
        length = self._stepping.step
        cells = before = self._parts(values)
        sweeping = ALGORITHMS[self._stepping.algorithm].is_sweeping
        for name in checked.order.sequence:
            steps = self._steps[name]
            most = given[self.places[f"{name}.max_step"]] if f"{name}.max_step" in self.places else 0.0
            parts = max(1, int(np.ceil(length / most - 1e-9))) if most > 0.0 else 1
            own = self._fed(checked, name, cells if sweeping else before)
            cells = cells | {name: steps.step(own, time, length, parts)}
        return ca.vertcat(*cells.values())

    def _settled(self, checked: Checked, values: Any) -> Any:
        """The values after another sweep in initialization mode."""
        cells = self._parts(values)
        for name in checked.order.sequence:
            cells[name] = self._steps[name].start(self._fed(checked, name, cells), self._stepping.start_time)
        return ca.vertcat(*cells.values())

    def _parts(self, values: Any) -> dict[str, Any]:
        return {name: values[first : first + self._steps[name].size] for name, first in self._first.items()}

    def _fed(self, checked: Checked, name: str, cells: Mapping[str, Any]) -> Any:
        """The values of an instance with its inputs set."""
        own, places, inputs = self._steps[name], [], []
        for link in checked.wiring.links:
            if link.target[0] == name:
                source = cells[link.source[0]][self._steps[link.source[0]].places[link.source[1]]]
                places.append(own.places[link.target[1]])
                inputs.append(link.scale * source + link.offset)
        return replaced(cells[name], places, inputs)

    def values(self, checked: Checked) -> Array:
        """What a run is given: parameters, starts and inputs, (size,)."""
        found = np.zeros(sum(steps.size for steps in self._steps.values()))
        for name, model in checked.models.items():
            starts = checked.wiring.starts[name]
            for variable, place in self._steps[name].places.items():
                start = starts.get(variable)
                if start is None and variable in model.interface.variables:
                    start = model.interface.variables[variable].start
                if start is not None and not isinstance(start, str):
                    found[self._first[name] + place] = float(start)
        return found

    def fly(self, given: Array, names: Collection[str]) -> Flight:
        """A run with given values, keeping signals by name."""
        settling = [given]
        for _ in self._steps:
            settling.append(_array(self._sweep(settling[-1])))
            if np.array_equal(settling[-1], settling[-2]):
                break
        rows = [self.places[name] for name in names]
        stops, kept = [settling[-1]], [settling[-1][rows, None]]
        count = count_steps(self._stepping.start_time, self._stepping.stop_time, self._stepping.step) or 0
        for begin in range(0, count, _CHUNK):
            values = self._forward(stops[-1], begin, min(_CHUNK, count - begin))
            kept.append(values[rows, :].full())
            stops.append(_array(values[:, -1]))
        signals = np.concatenate(kept, axis=1)
        return Flight(
            given, settling, stops, {"time": self._times(0, count + 1), **dict(zip(names, signals, strict=True))}
        )

    def _times(self, begin: int, count: int) -> Array:
        return np.asarray(self._stepping.start_time + self._stepping.step * np.arange(begin, begin + count))

    def _forward(self, values: Array, begin: int, count: int) -> Any:
        """The values after each of some steps, (size, count)."""
        if count in self._step:
            return self._step[count](values, self._times(begin, count))
        found = [values]
        for time in self._times(begin, count):
            found.append(self._step[1](found[-1], time))
        return ca.horzcat(*found[1:])

    def pull(self, flight: Flight, weights: Mapping[str, float], place: int) -> Array:
        """The gradient of a weighted sum of signals at a communication point by its number.

        Returns:
            With respect to the values that the run was given, (size,).
        """
        seed = np.zeros(len(flight.given))
        for name, weight in weights.items():
            seed[self.places[name]] = weight
        for chunk in range((place - 1) // _CHUNK, -1, -1):
            begin = chunk * _CHUNK
            count, values = min(_CHUNK, place - begin), flight.stops[chunk]
            passed = ca.horzcat(values, self._forward(values, begin, count))[:, count - 1 :: -1]
            seed = self._pulled(seed, passed, self._times(begin, count)[::-1])
        for values in reversed(flight.settling[:-1]):
            seed = _array(self._sweep_back(seed, values))
        return seed

    def _pulled(self, seed: Array, passed: Any, times: Array) -> Array:
        """A gradient with respect to what was some steps before; the values there are given, the last first."""
        count = len(times)
        if count in self._back:
            return _array(self._back[count](seed, passed, times)[:, -1])
        for k, time in enumerate(times):
            seed = _array(self._back[1](seed, passed[:, k], time))
        return seed


def _array(column: Any) -> Array:
    """A column of CasADi's."""
    return np.asarray(column.full()).ravel()


def _problem(name: str, message: str) -> Problem:
    return Problem(f"--method gradient: instance '{name}'", message, _REMEDY)


def _of_stepping(checked: Checked) -> Iterator[Problem]:
    """What stands between a system and its gradients, apart from its equations."""
    system, stepping = checked.system, checked.system.stepping
    found = {
        f"algorithm '{stepping.algorithm}' takes no fixed sequence of steps": not issubclass(
            ALGORITHMS[stepping.algorithm], Explicit
        ),
        "inputs are extrapolated": stepping.extrapolation,
        "outputs are refreshed at each communication point": stepping.refresh,
        "algebraic loops are solved at each communication point": stepping.algebraic_loops != "delay",
        "events act on the way": system.events,
    }
    for message, applies in found.items():
        if applies:
            yield Problem("--method gradient", message, _REMEDY)
    for name in Settings.of(checked.system, checked.wiring).rates:
        yield _problem(name, "it takes steps of its own")
    for link in checked.wiring.links:
        if link.delay or not link.is_linear:
            what = "is delayed" if link.delay else "turns a number into another type"
            yield _problem(link.target[0], f"the connection to {link.target} {what}")
    for name, model in checked.models.items():
        sample = model.interface.variables.get("sample_time")
        period = 0.0 if sample is None else float(checked.wiring.starts[name].get("sample_time", sample.start) or 0.0)
        if period and abs(period - stepping.step) > 1e-9 * stepping.step:
            yield _problem(name, f"it samples every {period:g} s, not at each step of {stepping.step:g} s")
