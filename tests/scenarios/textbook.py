"""The theory of the textbook cases: exact solutions, and the linear map of one communication step of two masses."""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

OSCILLATOR = {"m1": 1.0, "k1": 1.0, "d1": 0.1, "m2": 1.0, "k2": 1.0, "d2": 0.1, "kc": 2.0, "dc": 0.1}
"""Masses, springs and dampers to the wall on the left and on the right, and those between the two; SI units."""

# -------------------------------------------------------------------- two masses


def matrix(m1, k1, d1, m2, k2, d2, kc, dc):
    """z' = A z of the whole, z = (x1, v1, x2, v2)."""
    left = [-(k1 + kc) / m1, -(d1 + dc) / m1, kc / m1, dc / m1]
    right = [kc / m2, dc / m2, -(k2 + kc) / m2, -(d2 + dc) / m2]
    return np.array([[0.0, 1.0, 0.0, 0.0], left, [0.0, 0.0, 0.0, 1.0], right])


def motion(times, start=(1.0, 0.0, 0.0, 0.0), **of):
    """The exact course of x1, v1, x2, v2, one row for each time."""
    a = matrix(**OSCILLATOR | of)
    return np.array([expm(a * t) @ np.array(start) for t in times])


def _moved(a, b, h):
    """x(h) = P x(0) + G0 u + G1 u' + G2 u'' for an input that is a polynomial of time, exactly."""
    n, m = b.shape
    big = np.zeros((n + 3 * m, n + 3 * m))
    big[:n, : n + m] = np.hstack([a, b])
    big[n : n + 2 * m, n + m :] = np.eye(2 * m)
    whole = expm(big * h)[:n]
    return [whole[:, :n], *(whole[:, n + k * m : n + (k + 1) * m] for k in range(3))]


def _course(points, h):
    """Value and two derivatives at time 0 of the polynomial through values at times 0, -h, ... or h, 0, -h, ..."""
    times = np.array([t for t, _ in points])
    weights = np.linalg.inv(np.vander(times, 3, increasing=True)[:, : len(points)])
    rows = [sum(w * u for w, (_, u) in zip(row, points, strict=True)) for row in weights]
    rows += [0.0 * rows[0]] * (3 - len(rows))
    return rows[0], rows[1], 2.0 * rows[2]


class Coupled:
    """The algorithms as linear maps of one step h: each mass moves exactly, under inputs as the algorithm gives them.

    The vector is (x1, v1, x2, v2) and the force, displacement and speed that passed at this point and the last two.
    """

    size = 13

    def __init__(self, h, algorithm, order=0, **of):
        p = OSCILLATOR | of
        self.h, self.algorithm, self.order = h, algorithm, order
        self.left = _moved(np.array([[0.0, 1.0], [-p["k1"] / p["m1"], -p["d1"] / p["m1"]]]), np.array([[0], [1 / p["m1"]]]), h)
        whole = np.array([[0.0, 1.0], [-(p["k2"] + p["kc"]) / p["m2"], -(p["d2"] + p["dc"]) / p["m2"]]])
        self.c = np.array([[p["kc"], p["dc"]]])
        self.right = _moved(whole, np.vstack([[0.0, 0.0], self.c / p["m2"]]), h)

    def start(self, z):
        """The vector at the beginning: nothing has passed before."""
        u = np.concatenate([self.c @ (np.array(z[2:]) - z[:2]), z[:2]])
        return np.concatenate([z, u, u, u])

    def _inputs(self, past, now, ahead):
        """Value and derivatives at the begin of the step, and the value at its end."""
        last = [now, *past] if ahead else past
        times = [self.h * (ahead - k) for k in range(len(last))]
        value, slope, bend = _course(list(zip(times, last, strict=True))[: self.order + 1], self.h)
        return value, slope, bend, value + self.h * slope + 0.5 * self.h**2 * bend

    def _move(self, which, x, inputs):
        p, *g = which
        return p @ x + sum(part @ u for part, u in zip(g, inputs[:3], strict=True))

    def step(self, z, ended=None):
        """The vector after a step; of columns all at once. ``ended``: what the iteration takes for the end's values."""
        x1, x2 = z[:2], z[2:4]
        force, moved = [z[k : k + 1] for k in (4, 7, 10)], [z[k : k + 2] for k in (5, 8, 11)]
        if self.algorithm == "iterative":
            x1 = self._move(self.left, x1, self._inputs(force, ended[:1], ahead=True))
            other = self._inputs(moved, x1, ahead=True)
        else:
            other = self._inputs(moved, None, ahead=False)
        x2 = self._move(self.right, x2, other)
        f = self.c @ (x2 - other[3])
        if self.algorithm == "gauss-seidel":
            x1 = self._move(self.left, x1, self._inputs(force, f, ahead=True))
        elif self.algorithm == "jacobi":
            x1 = self._move(self.left, x1, self._inputs(force, None, ahead=False))
        return np.vstack([x1, x2, f, x1, z[4:10]])

    def matrix(self):
        """The map as a matrix."""
        unit = np.eye(self.size)
        if self.algorithm != "iterative":
            return self.step(unit)
        nothing = self.step(unit, np.zeros((3, self.size)))
        return nothing + self._answer()[:, :1] @ np.linalg.solve(np.eye(1) - self._answer()[4:5, :1], nothing[4:5])

    def _answer(self):
        """How the end of the step answers to the force, displacement and speed that are taken for its end's."""
        return self.step(np.zeros((self.size, 3)), np.eye(3))

    def contraction(self):
        """The factor by which plain iteration reduces the distance to the step's solution, with its sign."""
        return float(self._answer()[4, 0])

    def radius(self):
        """The factor by which the slowest decaying or fastest growing part changes in a step."""
        return float(np.abs(np.linalg.eigvals(self.matrix())).max())


def limit(algorithm, order=0, low=0.01, high=3.0, **of):
    """The shortest step between the bounds in s beyond which the coupling is unstable; None where it is stable."""

    def growth(h):
        return Coupled(h, algorithm, order, **of).radius() - 1.0

    steps = np.geomspace(low, high, 200)
    grown = [growth(h) for h in steps]
    k = next((k for k in range(1, len(steps)) if grown[k] > 0.0), None)
    return None if k is None else brentq(growth, steps[k - 1], steps[k], xtol=1e-12)
