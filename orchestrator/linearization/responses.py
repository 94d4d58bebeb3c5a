"""How a linear model answers: over frequency, to a step, and from train to train (string stability)."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

from ..names import SignalName
from .blocks import Array, held
from .closed_loop import Linearization
from .modes import NEUTRAL, stability

Complex = NDArray[np.complex128]

_STRING_SLACK = 1e-5
_CLEAR = 1e-9


class FrequencyResponse:
    """G(jw) of a model; ``response(frequencies, input)`` has shape (outputs, frequencies), frequencies in rad/s."""

    def __init__(self, model: Linearization) -> None:
        self._model = model
        self._triangle, basis = linalg.schur(model.a, output="complex")
        self._b, self._c = basis.conj().T @ model.b, model.c @ basis

    def __call__(self, frequencies: Array, input_index: int) -> Complex:
        """From one input to every output."""
        model, eye = self._model, np.eye(len(self._triangle))
        result = np.zeros((len(model.outputs), len(frequencies)), dtype=np.complex128)
        for k, w in enumerate(frequencies if len(eye) else ()):
            point = 1j * w if model.step is None else np.exp(1j * w * model.step)
            solved = linalg.solve_triangular(point * eye - self._triangle, self._b[:, input_index], check_finite=False)
            result[:, k] = self._c @ solved
        return np.asarray(result + model.d[:, input_index, None])


def default_frequencies(model: Linearization, points: int = 500) -> Array:
    """Angular frequencies in rad/s around the seen modes, at most seven decades."""
    found = [m.frequency for m in stability(model).modes if m.seen and m.frequency > NEUTRAL]
    limit = np.inf if model.step is None else np.pi / model.step
    found = [w for w in found if w < limit] or [min(1.0, 0.1 * limit)]
    highest = min(10.0 * max(found), limit)
    return np.geomspace(max(0.03 * min(found), 1e-7 * highest), highest, points)


def step_response(model: Linearization, input_index: int, duration: float, points: int = 500) -> tuple[Array, Array]:
    """Times in s (T,), and every output (outputs, T), after a step of 1 at one input, from rest."""
    if model.step is None:
        length = duration / points
        phi, gamma = held(model.a, model.b[:, [input_index]], length)
    else:
        length, points = model.step, max(1, round(duration / model.step))
        phi, gamma = model.a, model.b[:, [input_index]]
    x, states = np.zeros(len(model.states)), []
    for _ in range(points + 1):
        states.append(x)
        x = phi @ x + gamma[:, 0]
    found = model.c @ np.array(states).T + model.d[:, [input_index]]
    times: Array = np.arange(points + 1, dtype=np.float64) * length
    return times, np.asarray(found)


def default_duration(model: Linearization) -> float:
    """How long a step response should be, s: five time constants of the slowest mode a user would wait for.

    Modes a thousand times slower than the middle one (gaps that creep for a day) are left to the table.
    """
    modes = [m for m in stability(model).modes if m.seen and 0.0 < m.time_constant < np.inf]
    constants = [m.time_constant for m in modes for _ in range(m.count)]
    if not constants:
        return 100.0 if model.step is None else 1000.0 * model.step
    middle = float(np.median(constants))
    return 5.0 * max(t for t in constants if t <= 1000.0 * middle)


# -------------------------------------------------------------------- string stability


@dataclass(frozen=True)
class Passing:
    """How a deviation is passed on from one train (or gap) to the next, under one input.

    ``size`` is |T(jw)| over ``frequencies``; ``peak`` its largest value, at ``at`` in rad/s.
    """

    quantity: str
    pair: str
    frequencies: Array
    size: Array
    peak: float
    at: float

    @property
    def holds(self) -> bool:
        """Whether no frequency is amplified."""
        return self.peak <= 1.0 + _STRING_SLACK


def default_input(model: Linearization) -> int:
    """The input that string stability is judged under: the first disturbance, else the first."""
    return next((k for k, name in enumerate(model.inputs) if re.search(r"\.disturbance(\[1\])?$", name)), 0)


def string_stability(model: Linearization, input_index: int | None = None) -> list[Passing]:
    """|T_i+1,i(jw)| between the speeds of successive trains, and between successive gaps.

    T_i+1,i is the ratio of the two frequency responses to one input. Families ``NAME[i].speed`` and
    ``NAME[i].position`` among the outputs are judged (of a train of carriages the first one); trains that the input
    does not reach are left out.
    """
    if not model.inputs:
        return []
    index = default_input(model) if input_index is None else input_index
    respond, frequencies = FrequencyResponse(model), default_frequencies(model)
    found = respond(frequencies, index)
    passings = []
    for quantity, links in _chains(model, _reached(model, index)).items():
        for (first, a), (second, b) in itertools.pairwise(links):
            pair = np.array([a, b])
            ahead, behind = np.abs(pair @ found)
            # Where next to nothing arrives, the ratio is one of rounding errors.
            clear = (ahead > _CLEAR * ahead.max()) & (behind > _CLEAR * behind.max())
            if not clear.any():
                continue
            size = np.divide(behind, ahead, out=np.full_like(ahead, np.nan), where=clear)

            def ratio(w: float, pair: Array = pair) -> float:
                one, other = np.abs(pair @ respond(np.array([w]), index))[:, 0]
                return float(other / one)

            peak, at = _peak(ratio, frequencies, size)
            passings.append(Passing(quantity, f"{second} to {first}", frequencies, size, peak, at))
    return passings


def _reached(model: Linearization, input_index: int) -> set[int]:
    """The outputs that an input acts on."""
    graph = nx.DiGraph()
    graph.add_nodes_from(["input", *range(len(model.states))])
    graph.add_edges_from((int(j), int(i)) for i, j in np.argwhere(model.a))
    graph.add_edges_from(("input", int(i)) for (i,) in np.argwhere(model.b[:, input_index]))
    graph.add_edges_from((int(j), ("output", int(i))) for i, j in np.argwhere(model.c))
    graph.add_edges_from(("input", ("output", int(i))) for (i,) in np.argwhere(model.d[:, input_index]))
    return {node[1] for node in nx.descendants(graph, "input") if isinstance(node, tuple)}


def _chains(model: Linearization, reached: Collection[int]) -> dict[str, list[tuple[str, Array]]]:
    """Rows that pick successive speeds and gaps out of the outputs, by quantity, with what they belong to."""
    families: dict[tuple[str, str], dict[int, Array]] = {}
    for k, name in enumerate(model.outputs):
        signal = SignalName.parse(name)
        is_first = signal.array in ("speed", "position") and signal.element in ((), (1,))
        if is_first and signal.number is not None and k in reached:
            row = np.eye(len(model.outputs))[k]
            families.setdefault((signal.group, signal.array), {})[signal.number] = row
    chains: dict[str, list[tuple[str, Array]]] = {}
    for (family, variable), members in families.items():
        numbers = [i for i in sorted(members) if {i - 1, i + 1} & members.keys()]
        if variable == "speed":
            chains[f"{family} speed"] = [(str(i), members[i]) for i in numbers]
        else:
            ends = [(i, j) for i, j in itertools.pairwise(numbers) if j == i + 1]
            chains[f"{family} gap"] = [(f"{i}–{j}", members[i] - members[j]) for i, j in ends]
    return chains


def _peak(ratio: Callable[[float], float], frequencies: Array, size: Array) -> tuple[float, float]:
    """The largest ratio and where it is, refined between the grid's points."""
    k = int(np.nanargmax(size))
    around = size[max(k - 1, 0) : k + 2]
    if len(around) == 3 and np.isfinite(around).all():
        ends = float(np.log(frequencies[k - 1])), float(np.log(frequencies[k + 1]))
        found = optimize.minimize_scalar(lambda x: -ratio(float(np.exp(x))), bounds=ends, method="bounded")
        if -found.fun > size[k]:
            return float(-found.fun), float(np.exp(found.x))
    return float(size[k]), float(frequencies[k])
