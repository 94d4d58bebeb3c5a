"""`Slopes`: the gradient of a requirement's scaled margin in the cube that a search moves in.

Almost everywhere a margin has the gradient of the comparison that decides it, at the instant that does. How it changes
with the signals there is found by moving each of them a little in the judged run; how these change with all that the
run was given, by pulling back through the traced loop; and how that changes with a point of the cube, by moving it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ScenarioError
from ...evaluation import Judge, Signals, Verdict
from ...problems import Problem
from ...run import Checked, Results
from ...scenario import is_structural
from .space import Space

if TYPE_CHECKING:  # CasADi is an extra, and slow to import
    from .traced import Flight, TracedLoop

Array = NDArray[np.float64]
Changes = Mapping[str, Any]

_STEP = 1e-6
"""By how much signals and points are moved, relative to what they are above 1."""


def traced(checked: Checked) -> TracedLoop:
    """The traced loop of a system.

    Raises:
        ScenarioError: it has none; what stands against it, and the remedy.
    """
    try:
        from .traced import TracedLoop  # noqa: PLC0415
    except ImportError:
        remedy = "pip install 'railcosim[native]', or choose another --method"
        raise ScenarioError(Problem("--method gradient", "casadi is not installed", remedy)) from None
    return TracedLoop(checked)


class Slopes:
    """Gradients of a system's margins, scaled as runs are judged by.

    Args:
        checked: the system with changes. space: what is varied.
    """

    def __init__(self, checked: Callable[[Changes], Checked], space: Space) -> None:
        self._checked, self._space = checked, space
        self._loops: dict[str, TracedLoop] = {}

    def at(self, requirement: str, point: Array) -> Array:
        """The gradient of a requirement's scaled margin at a point of the cube, (size,); zero where it has none.

        Raises:
            ScenarioError: the system has no gradients; what stands against it, and the remedy.
        """
        checked = self._checked(self._space.changes(point))
        loop = self._loop(checked)
        given = loop.values(checked)
        text = checked.system.judged.requirements[requirement]
        left = checked.wiring.left  # of what a model was swapped for: values that it does not have
        judge = Judge({}, {requirement: text}, [*loop.places, *left], [*loop.parameters, *left])
        looked = judge.needed_signals & loop.places.keys()
        moving = looked - set(loop.parameters)
        flight = loop.fly(given, moving)
        run = _Run(loop, checked, flight)
        verdict = judge.verdicts(run.results({}), scaled=True)[0]
        if verdict.margin is None or verdict.time is None:
            return np.zeros(self._space.size)
        pulled = self._pulled(run, judge, verdict, text.count("at_sample("))
        return self._through_space(loop, pulled, point)

    def _loop(self, checked: Checked) -> TracedLoop:
        """The traced loop of a structure; values may be others."""
        made = [f"{x.name} {x.model} {sorted(x.build.items())}" for x in checked.system.instances.values()]
        links = [(x.source, x.target, x.scale, x.offset) for x in checked.wiring.links]
        sub_steps = [starts.get("max_step") for starts in checked.wiring.starts.values()]
        key = repr((checked.system.stepping, checked.order.sequence, made, links, sub_steps))
        if key not in self._loops:
            self._loops[key] = traced(checked)
        return self._loops[key]

    def _pulled(self, run: _Run, judge: Judge, verdict: Verdict, ahead: int) -> Array:
        """The gradient of a margin with respect to all that the run was given."""
        loop, time = run.loop, run.flight.columns["time"]
        first = int(np.argmin(np.abs(time - float(verdict.time or 0.0))))
        found = np.zeros(len(run.flight.given))

        def slope(name: str, place: int) -> float:
            return _steepest(judge, run, float(verdict.margin or 0.0), name, place)

        for name in judge.needed_signals & set(loop.parameters):
            found[loop.places[name]] = slope(name, first)
        moving = [name for name in verdict.blame if name in run.flight.columns]
        for place in range(first, min(first + ahead + 1, len(time))):
            found += loop.pull(run.flight, {name: slope(name, place) for name in moving}, place)
        return found

    def _through_space(self, loop: TracedLoop, pulled: Array, point: Array) -> Array:
        found = np.zeros(self._space.size)
        for axis, (key, choices) in enumerate(zip(self._space.keys, self._space.choices, strict=True)):
            ends = np.array([point, point])
            ends[:, axis] = np.clip(point[axis] + np.array([-_STEP, _STEP]), 0.0, 1.0)
            if pulled.any() and not choices and not is_structural(key):
                low, high = (loop.values(self._checked(self._space.changes(end))) for end in ends)
                found[axis] = pulled @ (high - low) / (ends[1, axis] - ends[0, axis])
        return found


class _Run:
    """A flight as requirements look at it."""

    def __init__(self, loop: TracedLoop, checked: Checked, flight: Flight) -> None:
        self.loop, self.flight, self._checked = loop, flight, checked
        given = {name: float(flight.given[loop.places[name]]) for name in loop.parameters}
        self.parameters: dict[str, Any] = {**checked.wiring.left, **given}

    def value(self, name: str, place: int) -> float:
        """Of a parameter, or of a signal at a point."""
        return float(self.parameters[name] if name in self.parameters else self.flight.columns[name][place])

    def results(self, columns: Mapping[str, Array], parameters: Mapping[str, float] | None = None) -> Signals:
        """The run, with some other columns or parameters."""
        stepping = self._checked.system.stepping
        return Results(
            {**self.flight.columns, **columns},
            None,
            units=self._checked.units,
            parameters={**self.parameters, **(parameters or {})},
            step=stepping.step,
            stop_time=stepping.stop_time,
            completed=True,
        )


def _steepest(judge: Judge, run: _Run, margin: float, name: str, place: int) -> float:
    """The slope of a margin along a parameter, or along a signal at a point: on that side on which this one decides."""
    value = run.value(name, place)
    slopes = []
    for step in (-_STEP * max(1.0, abs(value)), _STEP * max(1.0, abs(value))):
        if name in run.parameters:
            moved = run.results({}, {name: value + step})
        else:
            column = np.array(run.flight.columns[name])
            column[place] += step
            moved = run.results({name: column})
        found = judge.verdicts(moved, scaled=True)[0].margin
        slopes.append(0.0 if found is None else (found - margin) / step)
    return max(slopes, key=abs)
