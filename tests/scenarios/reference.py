"""The closed loop of the comfort-aware cruise law as one system of ordinary differential equations.

Written by hand from `docs/models/comfort_cruise.md`, sections 1 and 2, with NumPy and in the paper's kilometres, and
solved by SciPy's eighth-order Runge-Kutta (DOP853). It shares nothing with `railcosim`, so that what the components and
the co-simulation give can be held against it. Load it by its path (see ``conftest.py`` beside it).
"""

import itertools
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

FIGURE_CONSISTENT = 4.8 / 140.0
AS_STATED = 0.01
POSITION = (51e3, 34e3, 18e3, 1e3)
SPEED = (83.0, 61.0, 65.0, 5.0)
TARGET = 85.0
GAP_MIN_KM, GAP_MAX_KM = 15.0, 20.0
GUST_WINDOW = (210.0, 240.0)


class Trajectory(NamedTuple):
    """A solution: times (n,) in s, and positions, speeds and net accelerations (n, trains) in m, m/s and m/s2.

    At the edges of the gust the acceleration is the one after the edge.
    """

    t: np.ndarray
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray

    @property
    def gaps(self):
        """Front to front, (n, trains - 1), in m."""
        return self.x[:, :-1] - self.x[:, 1:]


def slope(gap_km):
    """U'(d) of section 2 in 1/km3."""
    d = np.asarray(gap_km, dtype=float)
    return -2.0 * d / (d**2 - GAP_MIN_KM**2) ** 2 + 2.0 * d / (GAP_MAX_KM**2 - d**2) ** 2


def demand(x, v, alpha, beta, gamma_km3, *, comfort, a_max=1.0, target=TARGET):
    """Demanded accelerations of all trains in m/s2 from positions (m) and speeds (m/s), both (trains,)."""
    pull = gamma_km3 * slope((x[:-1] - x[1:]) / 1000.0)
    relative = np.diff(v)
    bottom = alpha * (target - v)
    bottom[1:] += -beta * relative + pull
    bottom[:-1] += beta * relative - pull
    return a_max * np.tanh(bottom / a_max) if comfort else bottom


def closed_loop(
    alpha=FIGURE_CONSISTENT,
    beta=FIGURE_CONSISTENT,
    gamma_km3=0.1,
    comfort=True,
    gust=0.0,
    *,
    position=POSITION,
    speed=SPEED,
    stop=350.0,
    interval=0.1,
    a_max=1.0,
    target=TARGET,
    rtol=1e-11,
):
    """Solve the loop; the resistance is compensated exactly and cancels.

    Args:
        alpha: gain on the error to the target speed, 1/s.
        beta: gain on speed differences, 1/s.
        gamma_km3: gain on the field, (m/s2) km3.
        comfort: whether the tanh layer acts.
        gust: retarding acceleration of train 1 in [210, 240) s, m/s2.
        position: start positions, m, the leader first; any number of trains from two.
        speed: start speeds, m/s.
        stop: end, s.
        interval: distance of the reported times, s.
        a_max: bound of the tanh layer, m/s2.
        target: target speed, m/s.
        rtol: relative tolerance of the solver.

    Returns:
        `Trajectory`, which unpacks to ``t, x, v, a``.
    """
    n = len(position)
    steps = round(stop / interval)
    times = np.arange(steps + 1) * interval
    edges = [0.0, *(edge for edge in GUST_WINDOW if gust and edge < stop), stop]
    state = np.concatenate([position, speed]).astype(float)
    x, v = np.empty((steps + 1, n)), np.empty((steps + 1, n))
    a = np.empty((steps + 1, n))

    def acceleration(y, disturbance):
        net = demand(y[:n], y[n:], alpha, beta, gamma_km3, comfort=comfort, a_max=a_max, target=target)
        net[0] += disturbance
        return net

    for begin, end in itertools.pairwise(edges):
        disturbance = -gust if begin == GUST_WINDOW[0] else 0.0
        solution = solve_ivp(
            lambda _, y, w=disturbance: np.concatenate([y[n:], acceleration(y, w)]),
            (begin, end),
            state,
            method="DOP853",
            dense_output=True,
            rtol=rtol,
            atol=1e-9,
        )
        if not solution.success:
            raise RuntimeError(solution.message)
        here = np.flatnonzero((times >= begin - 1e-9) & (times <= end + 1e-9))
        for k, y in zip(here, solution.sol(np.clip(times[here], begin, end)).T, strict=True):
            x[k], v[k], a[k] = y[:n], y[n:], acceleration(y, disturbance)
        state = solution.y[:, -1]
    return Trajectory(times, x, v, a)


def settling_time(t, deviation, band=1.0):
    """First time from which the worst deviation stays within the band to the end; infinity where it never does."""
    outside = np.flatnonzero(np.abs(deviation).max(axis=-1) > band)
    if outside.size == 0:
        return float(t[0])
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else float("inf")


def lyapunov(trajectory, gamma_km3=0.1, target=TARGET):
    """W of section 5: half the squared speed errors plus 1000 gamma sum U, at each reported time."""
    d = trajectory.gaps / 1000.0
    potential = 1.0 / (d**2 - GAP_MIN_KM**2) + 1.0 / (GAP_MAX_KM**2 - d**2)
    return 0.5 * ((trajectory.v - target) ** 2).sum(axis=1) + 1000.0 * gamma_km3 * potential.sum(axis=1)
