"""The optimal control problem on a mesh over place, by Gauss-Legendre collocation; IPOPT solves it.

The state is the kinetic energy per mass, z = v^2 / 2, because dz/dx is the train's acceleration itself, which has no
pole at low speed as dv/dx has. The running time is the integral of 1 / v (`intervals.pace`). Forces are free at
every collocation point and may jump between intervals, as optimal ones do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca
import numpy as np

from ..errors import ScenarioError
from ..problems import Problem
from .dynamics import FORCES, Dynamics, Floats
from .intervals import DEGREE, END, POINTS, SLOPES, WEIGHTS, basis, pace

_TIE = 1e-3
"""Share of the energy beside the time: which brake brakes is nothing to a running time."""
_SMOOTH = 1e-7
"""Weight of a force's changes from point to point: on a cruise the energy does not tell how a mean is made up."""
_BESIDE = 1e-3
"""m: a limit is looked up so far from a place where it may change."""
_OPTIONS: dict[str, Any] = {
    "error_on_fail": False,
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 500,
    "ipopt.tol": 1e-8,
    "ipopt.constr_viol_tol": 1e-8,
    "ipopt.acceptable_iter": 0,
}
_WARM: dict[str, Any] = {"ipopt.mu_init": 1e-4, "ipopt.bound_push": 1e-6, "ipopt.bound_frac": 1e-6}


class Guess(Protocol):
    """A driving to start from."""

    def speeds(self, places: Floats) -> Floats:
        """In m/s at places in m."""

    def force(self, name: str, places: Floats) -> Floats:
        """One of `FORCES` in N at places in m."""


@dataclass(frozen=True)
class Solution:
    """A driving on a mesh of n intervals, a guess for a finer one.

    Attributes:
        dynamics: of the case.
        nodes: of the mesh, m, shape (n + 1,). node_speeds: m/s there.
        places, inside, accelerations: m, m/s, m/s2 at the collocation points, shape (n, DEGREE).
        forces: N, shape (n, DEGREE) each, by `FORCES`.
        feasibility, optimality: largest residuals of constraints and of optimality conditions, as IPOPT scales them.
        iterations: of IPOPT.
    """

    dynamics: Dynamics
    nodes: Floats
    node_speeds: Floats
    places: Floats
    inside: Floats
    accelerations: Floats
    forces: dict[str, Floats]
    feasibility: float
    optimality: float
    iterations: int

    @property
    def time(self) -> float:
        """Running time in s."""
        return float(self.node_times[-1])

    @property
    def energy(self) -> float:
        """Drawn less given back, J."""
        costs = self.dynamics.costs.items()
        return float(np.diff(self.nodes) @ sum((cost * self.forces[name] @ WEIGHTS for name, cost in costs), start=0.0))

    @property
    def node_times(self) -> Floats:
        """At the nodes in s, shape (n + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self._times_until(1.0))])

    @property
    def times(self) -> Floats:
        """At the collocation points in s, shape (n, DEGREE)."""
        return self.node_times[:-1, None] + np.column_stack([self._times_until(float(point)) for point in POINTS])

    def _times_until(self, share: float) -> Floats:
        """From each interval's begin to a share of it in s, shape (n,)."""
        speeds = self.node_speeds
        times: Floats = np.diff(self.nodes) * pace(share, speeds[:-1], speeds[1:], list(self.inside.T))
        return times

    def speeds(self, places: Floats) -> Floats:
        """In m/s at places in m: v^2 between the points it is known at."""
        known = np.concatenate([self.nodes, self.places.ravel()])
        order = np.argsort(known)
        squares = np.concatenate([self.node_speeds, self.inside.ravel()]) ** 2
        speeds: Floats = np.sqrt(np.interp(places, known[order], squares[order]))
        return speeds

    def force(self, name: str, places: Floats) -> Floats:
        """One of `FORCES` in N at places in m: that of the nearest point of its interval."""
        row = np.clip(np.searchsorted(self.nodes, places, side="right") - 1, 0, len(self.nodes) - 2)
        share = (places - self.nodes[row]) / np.diff(self.nodes)[row]
        nearest = np.abs(share[..., None] - POINTS).argmin(axis=-1)
        found: Floats = self.forces[name][row, nearest]
        return found

    @property
    def net(self) -> Floats:
        """The force on the train in N, shape (n, DEGREE)."""
        net: Floats = self.forces["traction"] - self.forces["regeneration"] - self.forces["friction"]
        return net

    def net_at(self, share: float) -> Floats:
        """The same in N at a share of each interval, by its polynomial, shape (n,)."""
        net: Floats = self.net @ np.array(basis(share))
        return net


def solve(dynamics: Dynamics, nodes: Floats, guess: Guess, time: float | None, *, warm: bool) -> Solution:
    """The optimal driving on a mesh.

    Args:
        dynamics: of the case.
        nodes: places of the mesh in m, shape (n + 1,).
        guess: to start from.
        time: running time in s, for the least energy; the least time where it is None.
        warm: whether the guess is nearly a solution.

    Raises:
        ScenarioError: IPOPT finds no solution.
    """
    problem = _Transcription(dynamics, nodes, guess)
    problem.move()
    problem.limit()
    span = float(nodes[-1] - nodes[0])
    if time is None:
        objective = problem.duration * (dynamics.top_speed / span) + _TIE * problem.energy / (span * problem.force)
    else:
        objective = problem.energy / (span * problem.force) + _SMOOTH * problem.roughness
        problem.within(problem.duration / time, -ca.inf, 1.0)
    return problem.solve(objective, warm)


class _Transcription:
    """The nonlinear program: variables, constraints as they are collected, and what is read from a solution."""

    def __init__(self, dynamics: Dynamics, nodes: Floats, guess: Guess) -> None:
        self.dynamics, self.nodes, self.lengths = dynamics, nodes, np.diff(nodes)
        self.places = nodes[:-1, None] + self.lengths[:, None] * POINTS
        self.force = dynamics.forces["traction"]
        self.squared = dynamics.top_speed**2
        self.variables: list[Any] = []
        self.boxes: list[tuple[Floats, Floats, Floats]] = []
        self.rows: list[tuple[Any, float, float]] = []
        self.at_nodes = self._add(guess.speeds(nodes) ** 2, *self._ends(), self.squared)
        limits = dynamics.limits(self.places)
        self.inside = self._add(guess.speeds(self.places) ** 2, dynamics.slowest**2, limits**2, self.squared)
        self.forces = {}
        for name in FORCES:
            start, most = guess.force(name, self.places), dynamics.most(name, self.places)
            self.forces[name] = self._add(start, 0.0, most, self.force)
        self.speeds = ca.sqrt(self.inside)
        self.net = self.forces["traction"] - self.forces["regeneration"] - self.forces["friction"]
        speeds, net = self.speeds, self.net
        here = dynamics.here(self.places.ravel()[None, :])
        each = [dynamics.law(here[:, k], speeds[k], net[k]) for k in range(self.places.size)]
        self.accelerations = ca.vertcat(*each)
        self.roughness = ca.sumsqr((net[1:] - net[:-1]) / self.force)
        weights = ca.DM((self.lengths[:, None] * WEIGHTS).ravel())
        ends, points = ca.sqrt(self.at_nodes), [self.speeds[k::DEGREE] for k in range(DEGREE)]
        self.duration = ca.dot(ca.DM(self.lengths), pace(1.0, ends[:-1], ends[1:], points))
        self.energy = sum(cost * ca.dot(weights, self.forces[name]) for name, cost in dynamics.costs.items())

    def _ends(self) -> tuple[Floats, Floats]:
        """Bounds of v^2 at the nodes: a limit holds on both sides of where it changes, and ends are given."""
        wish = self.dynamics.case.wish
        most = np.minimum(self.dynamics.limits(self.nodes - _BESIDE), self.dynamics.limits(self.nodes + _BESIDE)) ** 2
        least = np.full_like(most, self.dynamics.slowest**2)
        for end, speed in ((0, wish.start_speed), (-1, wish.end_speed)):
            least[end] = most[end] = speed**2
        return least, most

    def _add(self, start: Floats, low: Any, high: Any, unit: float) -> Any:
        """New variables as a column, with a start and bounds, all of which are counted in a unit."""
        low, high = (np.broadcast_to(np.asarray(bound, dtype=float), start.shape) for bound in (low, high))
        self.boxes.append((np.clip(start, low, high).ravel() / unit, low.ravel() / unit, high.ravel() / unit))
        self.variables.append(ca.SX.sym(f"x{len(self.variables)}", start.size))
        return self.variables[-1] * unit

    def within(self, rows: Any, least: float, most: float) -> None:
        """Bounds of some rows."""
        self.rows.append((rows, least, most))

    def move(self) -> None:
        """The train's equations: d(v^2 / 2)/dx is its acceleration at each point."""
        count = len(self.lengths)
        inside, a = (ca.reshape(each, DEGREE, count) for each in (self.inside, self.accelerations))
        values = ca.vertcat(self.at_nodes[:-1].T, inside)
        slopes = ca.DM(SLOPES).T @ values
        scale = ca.repmat(ca.DM(0.5 / self.lengths).T, DEGREE, 1)
        self.within(ca.vec(slopes * scale - a), 0.0, 0.0)
        self.within((ca.DM(END).T @ values).T / self.squared - self.at_nodes[1:] / self.squared, 0.0, 0.0)

    def limit(self) -> None:
        """Powers, comfort and jerk."""
        dynamics, wish = self.dynamics, self.dynamics.case.wish
        for name, power in dynamics.powers.items():
            if power < dynamics.forces[name] * dynamics.top_speed:
                self.within(self.forces[name] * self.speeds / power, -ca.inf, 1.0)
        if min(dynamics.most_acceleration, dynamics.most_deceleration) < np.inf:
            self.within(self.accelerations, -dynamics.most_deceleration, dynamics.most_acceleration)
        if wish.jerk:
            ways = ca.DM(np.diff(self.places.ravel()) * wish.jerk * dynamics.case.train.mass)
            speeds = 0.5 * (self.speeds[1:] + self.speeds[:-1])
            self.within((self.net[1:] - self.net[:-1]) * speeds / ways, -1.0, 1.0)

    def solve(self, objective: Any, warm: bool) -> Solution:
        """Let IPOPT solve it, silently."""
        x = ca.vertcat(*self.variables)
        problem = {"x": x, "f": objective, "g": ca.vertcat(*(rows for rows, _, _ in self.rows))}
        solver = ca.nlpsol("driving", "ipopt", problem, _OPTIONS | (_WARM if warm else {}))
        start, low, high = (np.concatenate([box[k] for box in self.boxes]) for k in range(3))
        least, most = ([row[k] for row in self.rows for _ in range(row[0].numel())] for k in (1, 2))
        result = solver(x0=start, lbx=low, ubx=high, lbg=least, ubg=most)
        found, rows, stats = result["x"], np.array(result["g"]).ravel(), solver.stats()
        if not stats["success"]:
            found_none = f"IPOPT finds no driving that keeps all limits ({stats['return_status']})"
            remedy = "look whether the train can climb the line and brake for its limits, or give more 'intervals'"
            raise ScenarioError(Problem(self.dynamics.case.name, found_none, remedy))
        columns = [ca.sqrt(self.at_nodes), self.speeds, self.accelerations, *self.forces.values()]
        node_speeds, *rest = (np.array(each).ravel() for each in ca.Function("read", [x], columns)(found))
        speeds, accelerations, *forces = (each.reshape(self.places.shape) for each in rest)
        outside = np.maximum(np.subtract(least, rows), np.subtract(rows, most))
        return Solution(
            self.dynamics,
            self.nodes,
            node_speeds,
            self.places,
            speeds,
            accelerations,
            _netted(dict(zip(FORCES, forces, strict=True))),
            float(max(outside.max(), 0.0)),
            float(stats["iterations"]["inf_du"][-1]),
            int(stats["iter_count"]),
        )


def _netted(forces: dict[str, Floats]) -> dict[str, Floats]:
    """Without what an interior point leaves of brakes against traction: the net force stays, no energy is added."""
    left = {name: np.maximum(values, 0.0) for name, values in forces.items()}
    for brake in ("friction", "regeneration"):
        both = np.minimum(left["traction"], left[brake])
        left["traction"], left[brake] = left["traction"] - both, left[brake] - both
    return left
