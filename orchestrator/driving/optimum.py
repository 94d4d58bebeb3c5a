"""The optimum of a case: solved on a coarse mesh, then on finer ones from the last solution until nothing changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ScenarioError
from ..problems import Problem
from .case import Case
from .collocation import Solution, solve
from .dynamics import Dynamics, Floats

MESHES = 10
"""Meshes at most."""
_CHANGE = 0.05
"""Share of the largest traction by which it may change within an interval that stays as it is."""
_SHORTEST = 2e-5
"""Of the way: no interval is divided below it."""
_OFF = 1e-4
"""m/s: an interval over which the train's equations lead elsewhere by more is divided."""
_STEPS = 8
"""Of RK4 over an interval."""
_GENTLE = 0.2
"""m/s2: of the guess to begin with."""
_NEAR = 1.0
"""m: no two nodes of the first mesh are nearer, but for limits."""
_ENDS = np.array([3.0, 10.0, 30.0, 100.0, 300.0])
"""m from both ends: where a train is slow, its time asks for short intervals."""


@dataclass(frozen=True)
class Optimum:
    """What driving is best, and how well it is known.

    Attributes:
        case: what was asked for. solution: on the last mesh.
        mesh_error: largest deviation, in m/s, of the speed at an interval's end from one that RK4 gets to from its
            begin by the train's equations.
        change: of the objective on the last mesh, relative; None if it is the first.
        meshes: how many intervals each mesh had. iterations: of IPOPT on all of them.
    """

    case: Case
    solution: Solution
    mesh_error: float
    change: float | None
    meshes: list[int]
    iterations: int


Solved = Callable[[int, int], object]
"""Is told how many meshes are solved, and how many intervals the next one has."""


def optimise(case: Case, solved: Solved = lambda *_: None) -> Optimum:
    """The best driving of a case.

    Args:
        case: what is asked for.
        solved: is told how far it has got.

    Raises:
        ScenarioError: nothing keeps all limits; the running time is too short, and the message names the least one.
    """
    dynamics = Dynamics(case)
    nodes = _first_mesh(dynamics)
    solved(0, len(nodes) - 1)
    quick = solve(dynamics, nodes, _Gentle(dynamics), None, warm=False)
    if case.wish.minimize == "time":
        return _refined(dynamics, quick, None, solved)
    wanted, already = case.wish.time or 0.0, 1
    if wanted < quick.time * 1.01:  # the coarse mesh knows the least time to a share of that
        quickest = _refined(dynamics, quick, None, solved)
        quick, already = quickest.solution, len(quickest.meshes)
        if wanted < quick.time:
            what = f"{wanted:g} s are too short: the least running time is {quick.time:.2f} s"
            raise ScenarioError(Problem(case.name, what, "give a longer 'time' (--time)"))
    solved(already, len(quick.nodes) - 1)
    first = solve(dynamics, quick.nodes, quick, wanted, warm=False)
    return _refined(dynamics, first, wanted, solved, already)


def _refined(dynamics: Dynamics, solution: Solution, time: float | None, solved: Solved, already: int = 0) -> Optimum:
    change: float | None = None
    meshes, iterations = [len(solution.nodes) - 1], solution.iterations
    errors, divided = _judged(dynamics, solution)
    tolerance = dynamics.case.wish.tolerance
    while divided.any() and len(meshes) < MESHES and (change is None or change > tolerance):
        middles = 0.5 * (solution.nodes[:-1] + solution.nodes[1:])[divided]
        nodes = np.sort(np.concatenate([solution.nodes, middles]))
        solved(already + len(meshes), len(nodes) - 1)
        finer = solve(dynamics, nodes, solution, time, warm=True)
        before, after = (each.time if time is None else each.energy for each in (solution, finer))
        change = abs(after - before) / max(abs(after), 1e-9)
        solution = finer
        errors, divided = _judged(dynamics, solution)
        meshes.append(len(solution.nodes) - 1)
        iterations += finer.iterations
    return Optimum(dynamics.case, solution, float(errors.max()), change, meshes, iterations)


def _judged(dynamics: Dynamics, solution: Solution) -> tuple[Floats, NDArray[np.bool_]]:
    """Each interval's error in m/s, and whether it wants to be divided."""
    errors = _errors(dynamics, solution)
    return errors, (errors > _OFF) | _changing(dynamics, solution)


def _errors(dynamics: Dynamics, solution: Solution) -> Floats:
    """How far off the speed at each interval's end is from that of RK4 over it, in m/s, shape (n,)."""
    begins, lengths = solution.nodes[:-1], np.diff(solution.nodes)
    squares = solution.node_speeds[:-1] ** 2
    step = 1.0 / _STEPS

    def slope(share: float, squares: Floats) -> Floats:
        speeds = np.sqrt(np.maximum(squares, 1e-6))
        given = (begins + share * lengths, speeds, solution.net_at(share))
        gained: Floats = 2.0 * lengths * np.array(dynamics.acceleration(*(each[None, :] for each in given))).ravel()
        return gained

    for k in range(_STEPS):
        share = k * step
        k1 = slope(share, squares)
        k2 = slope(share + 0.5 * step, squares + 0.5 * step * k1)
        k3 = slope(share + 0.5 * step, squares + 0.5 * step * k2)
        k4 = slope(share + step, squares + step * k3)
        squares = squares + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    errors: Floats = np.abs(np.sqrt(np.maximum(squares, 0.0)) - solution.node_speeds[1:])
    return errors


def _changing(dynamics: Dynamics, solution: Solution) -> NDArray[np.bool_]:
    """Where the force changes much over an interval and to its neighbours, and it is not short yet."""
    net = solution.net
    around = np.column_stack([np.append(net[0, 0], net[:-1, -1]), net, np.append(net[1:, 0], net[-1, -1])])
    lengths = np.diff(solution.nodes)
    long = lengths > _SHORTEST * (solution.nodes[-1] - solution.nodes[0])
    changing: NDArray[np.bool_] = (np.ptp(around, axis=1) > _CHANGE * dynamics.forces["traction"]) & long
    return changing


def _first_mesh(dynamics: Dynamics) -> Floats:
    """Nodes where limits change and the line does, short intervals at the ends, and even ones where there is room.

    A slope that begins within an interval is no polynomial there, and halving would only slowly come near to it.
    """
    case = dynamics.case
    begin, end = case.begin, case.end
    even = np.linspace(begin, end, case.wish.intervals + 1)
    reach = 0.25 * (end - begin)
    ends = _ENDS[reach > _ENDS]
    fixed = np.array([x for x in dynamics.breaks() if begin < x < end])
    nodes = np.unique(np.concatenate([[begin, end], fixed]))
    spacing = 0.25 * (even[1] - even[0])
    for candidates, near in (((*dynamics.slopes(), *(begin + ends), *(end - ends)), _NEAR), (even, spacing)):
        for candidate in candidates:
            if begin < candidate < end and np.abs(nodes - candidate).min() >= near:
                nodes = np.sort(np.append(nodes, candidate))
    return nodes


class _Gentle:
    """A driving that no train finds hard: gently up to the limits and down from them, with a little traction."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.dynamics = dynamics

    def speeds(self, places: Floats) -> Floats:
        """In m/s at places in m."""
        case = self.dynamics.case
        way = np.minimum(places - case.begin, case.end - places)
        return np.minimum(self.dynamics.limits(places), np.sqrt(self.dynamics.slowest**2 + 2.0 * _GENTLE * way))

    def force(self, name: str, places: Floats) -> Floats:
        """One of `FORCES` in N at places in m."""
        return np.full(places.shape, 0.05 * self.dynamics.forces[name] if name == "traction" else 0.0)
