"""The theory of the textbook cases: exact solutions, and the linear map of one communication step of two masses."""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

OSCILLATOR = {"m1": 1.0, "k1": 1.0, "d1": 0.1, "m2": 1.0, "k2": 1.0, "d2": 0.1, "kc": 2.0, "dc": 0.1}
"""Masses, springs and dampers to the walls on the left and on the right, and those between the masses; SI units."""
STIFF = OSCILLATOR | {"m1": 0.05, "kc": 10.0, "dc": 5.0}
"""A light mass on a strong damper: what it feels changes within a hundredth of a second."""

# -------------------------------------------------------------------- two masses


def motion(times, start=(1.0, 0.0, 0.0, 0.0), of=OSCILLATOR):
    """The exact course of x1, v1, x2, v2, one row for each time."""
    m1, k1, d1, m2, k2, d2, kc, dc = of.values()
    left = [-(k1 + kc) / m1, -(d1 + dc) / m1, kc / m1, dc / m1]
    right = [kc / m2, dc / m2, -(k2 + kc) / m2, -(d2 + dc) / m2]
    a = np.array([[0.0, 1.0, 0.0, 0.0], left, [0.0, 0.0, 0.0, 1.0], right])
    rates, modes = np.linalg.eig(a)
    parts = np.linalg.solve(modes, np.array(start, dtype=complex))
    return ((modes * parts) @ np.exp(np.outer(rates, times))).T.real


def _moved(a, b, h):
    """x(h) = P x(0) + G0 u + G1 u' + G2 u'' for an input that is a polynomial of time, exactly."""
    n, m = b.shape
    big = np.zeros((n + 3 * m, n + 3 * m))
    big[:n, : n + m] = np.hstack([a, b])
    big[n : n + 2 * m, n + m :] = np.eye(2 * m)
    whole = expm(big * h)[:n]
    return [whole[:, :n], *(whole[:, n + k * m : n + (k + 1) * m] for k in range(3))]


class Coupled:
    """An algorithm as a linear map of one step h: each mass moves exactly, under inputs as the algorithm gives them.

    The vector is (x1, v1, x2, v2), and the force, displacement and speed that passed at this point and the last two.
    ``order`` is that of extrapolation.
    """

    size = 13

    def __init__(self, h, algorithm, order=0, of=OSCILLATOR):
        m1, k1, d1, m2, k2, d2, kc, dc = of.values()
        self.h, self.algorithm, self.order = h, algorithm, order
        self.c = np.array([[kc, dc]])
        self.left = _moved(np.array([[0.0, 1.0], [-k1 / m1, -d1 / m1]]), np.array([[0.0], [1.0 / m1]]), h)
        whole = np.array([[0.0, 1.0], [-(k2 + kc) / m2, -(d2 + dc) / m2]])
        self.right = _moved(whole, np.vstack([[0.0, 0.0], self.c / m2]), h)

    def _move(self, which, x, past, ended=None, known=3):
        """State and input at the end: ``past`` are the last inputs, newest first, and ``ended`` those of the end."""
        points = [(-k * self.h, u) for k, u in enumerate(past[:known])]
        points = ([] if ended is None else [(self.h, ended)]) + points
        points = points[: self.order + 1]
        weights = np.linalg.inv(np.vander([t for t, _ in points], increasing=True))
        parts = [sum(w * u for w, (_, u) in zip(row, points, strict=True)) for row in weights]
        value, slope, half = (*parts, 0.0 * parts[0], 0.0 * parts[0])[:3]
        p, g0, g1, g2 = which
        return p @ x + g0 @ value + g1 @ slope + g2 @ (2.0 * half), value + self.h * slope + self.h**2 * half

    def step(self, z, ended=None, known=3):
        """The vector after a step; of many columns at once.

        ``ended`` is what an iteration takes for the force at the end; ``known`` how many points have passed.
        """
        x1, x2 = z[:2], z[2:4]
        force, moved = [z[k : k + 1] for k in (4, 7, 10)], [z[k : k + 2] for k in (5, 8, 11)]
        if self.algorithm == "iterative":
            x1, _ = self._move(self.left, x1, force, ended, known)
            x2, at_end = self._move(self.right, x2, moved, x1, known)
        else:
            x2, at_end = self._move(self.right, x2, moved, None, known)
        f = self.c @ (x2 - at_end)
        if self.algorithm != "iterative":
            x1, _ = self._move(self.left, x1, force, f if self.algorithm == "gauss-seidel" else None, known)
        return np.vstack([x1, x2, f, x1, z[4:10]])

    def matrix(self, known=3):
        """The map as a matrix."""
        unit = np.eye(self.size)
        if self.algorithm != "iterative":
            return self.step(unit, known=known)
        plain, answer = self.step(unit, np.zeros((1, self.size)), known), self._answer(known)
        return plain + answer @ plain[4:5] / (1.0 - answer[4, 0])

    def _answer(self, known=3):
        """How the end of the step answers to the force that is taken for that of its end."""
        return self.step(np.zeros((self.size, 1)), np.ones((1, 1)), known)

    def contraction(self):
        """The factor, with its sign, by which plain iteration changes the distance to the step's solution."""
        return float(self._answer()[4, 0])

    def radius(self):
        """The factor by which the part that decays slowest, or grows fastest, changes in a step."""
        return float(np.abs(np.linalg.eigvals(self.matrix())).max())

    def slowest(self):
        """(x1, v1, x2, v2) in that part."""
        values, vectors = np.linalg.eig(self.matrix())
        part = vectors[:4, np.argmax(np.abs(values))].real
        return part / np.abs(part).max()

    def run(self, start, count):
        """The course from (x1, v1, x2, v2): one row for each point."""
        u = np.concatenate([self.c @ (np.array(start[2:]) - start[:2]), start[:2]])
        z = np.concatenate([start, u, u, u])
        maps = [self.matrix(known) for known in (1, 2, 3)]
        rows = [z]
        for k in range(count):
            rows.append(maps[min(k, 2)] @ rows[-1])
        return np.array(rows)[:, :4]


def limit(algorithm, order=0, of=OSCILLATOR, low=1e-3, high=3.0):
    """The shortest step in s beyond which the coupling is unstable; infinite where it is stable up to ``high``."""

    def growth(h):
        return Coupled(h, algorithm, order, of).radius() - 1.0

    steps = np.geomspace(low, high, 60)
    grown = [growth(h) for h in steps]
    k = next((k for k in range(1, len(steps)) if grown[k] > 0.0), None)
    return np.inf if k is None else float(brentq(growth, steps[k - 1], steps[k], xtol=1e-12))


# -------------------------------------------------------------------- a ball on the ground


def bounces(count, *, stiffness=1e4, damping=20.0, mass=1.0, gravity=9.81, height=1.0):
    """Times of the first impacts, and the height that each rebound reaches, in s and m.

    The ball falls freely; on the ground it is a damped oscillator around its weight's deflection, until spring and
    damper would pull.
    """
    rate = damping / (2.0 * mass)
    frequency = np.sqrt(stiffness / mass - rate**2)
    sag = mass * gravity / stiffness
    time, speed, found = 0.0, 0.0, []
    for _ in range(count):
        fall = (speed + np.sqrt(speed**2 + 2.0 * gravity * height)) / gravity
        time, speed = time + fall, speed - gravity * fall
        impact, a, b = time, sag, (speed + rate * sag) / frequency

        def contact(t, a=a, b=b):
            wave = np.exp(-rate * t) * np.array([np.cos(frequency * t), np.sin(frequency * t)])
            return np.array([a, b]) @ wave - sag, np.array([b * frequency - rate * a, -a * frequency - rate * b]) @ wave

        def push(t, contact=contact):
            return -stiffness * contact(t)[0] - damping * contact(t)[1]

        end = brentq(push, 0.3 * np.pi / frequency, 1.1 * np.pi / frequency)
        height, speed = contact(end)
        time += end
        found.append((impact, height + speed**2 / (2.0 * gravity)))
    return np.array(found)


# -------------------------------------------------------------------- a loop


def root(time, swing=0.0):
    """x1 of 2 x1^2 + 5 x2 = 42 - swing sin(t), x1 - 6 x2 = 4: the positive one."""
    right = 42.0 - swing * np.sin(time)
    return (-5.0 / 6.0 + np.sqrt(25.0 / 36.0 + 8.0 * (10.0 / 3.0 + right))) / 4.0
