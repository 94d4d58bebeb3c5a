"""The closed loops of the three laws of `docs/models/tunable_potential.md` as ordinary differential equations.

Written by hand from its sections 1 to 4 and 7, with NumPy, in the paper's kilometres, and sharing nothing with
`railcosim`. `march` integrates many starts at once with classical RK4 (step 0.25 s, reported every 1 s, as the
specification's own measurements); `dop853` solves one start with SciPy's eighth-order Runge-Kutta. Load it by its path.
"""

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

POSITION = np.array([57.3e3, 49.8e3, 42.7e3, 35.3e3, 28.5e3])
SPEED = np.array([68.0, 60.0, 45.0, 49.0, 12.0])
PHASES = ((0.0, 70.0), (2000.0, 65.0), (4000.0, 70.0))
C0, C1, C2 = 0.01176, 0.00077616, 0.00016
MU = 1000.0
RANGE_KM = (6.5, 8.0)


@dataclass(frozen=True)
class Law:
    """One law with its gains; `kappa` in the units of section 2, lengths in km."""

    name: str
    k: float
    alpha: float
    kappa: float
    rho: float
    delta: float = 0.05
    w: float = 0.20
    gap_rate: float = 1.0
    limit: float = np.inf
    sigma: float = 1.0
    low: float = 0.770
    high: float = 0.422

    def pull(self, d, desired):
        """P(d) in m/s2, gaps and desired gap in km."""
        if self.name == "fixed":
            return self.kappa * MU * (d - 7.4)
        if self.name == "range":
            a, b = RANGE_KM
            above, below = np.maximum(d - (b - self.high), 0.0), np.maximum(a + self.low - d, 0.0)
            return self.kappa * (above / (b - d) - below / (d - a))
        s = self.dead_zone(d - desired)
        return self.kappa * s / np.sqrt(s**2 + self.w**2)

    def potential(self, d, desired=7.4):
        """Phi(d), with Phi' = P in km m/s2."""
        if self.name == "fixed":
            return 0.5 * self.kappa * MU * (d - 7.4) ** 2
        if self.name == "range":
            a, b = RANGE_KM
            upper, lower = np.minimum((b - d) / self.high, 1.0), np.minimum((d - a) / self.low, 1.0)
            return self.kappa * (self.high * (upper - 1.0 - np.log(upper)) + self.low * (lower - 1.0 - np.log(lower)))
        s = self.dead_zone(d - desired)
        return self.kappa * (np.sqrt(s**2 + self.w**2) - self.w)

    def dead_zone(self, e):
        return e - np.clip(e, -self.delta, self.delta)

    def demand(self, x, v, target, desired):
        """b of all trains in m/s2; x, v of shape (..., n), the leader first."""
        front, rear = slice(None, -1), slice(1, None)
        relative = self.alpha * (v[..., front] - v[..., rear])
        pull = self.pull((x[..., front] - x[..., rear]) / 1000.0, desired)
        b = self.k * (target - v)
        b[..., rear] += relative + pull
        b[..., front] -= self.rho * (relative + self.sigma * pull)
        return np.clip(b, -self.limit, self.limit)

    def acceleration(self, x, v, target, desired):
        """dv/dt: [20] compensates the resistance at the target speed, the others at their own."""
        b = self.demand(x, v, target, desired)
        return b + resistance(target) - resistance(v) if self.name == "range" else b

    def changed(self, **values):
        return replace(self, **values)


FIXED = Law("fixed", k=0.0065, alpha=0.037, kappa=7.7e-3, rho=2.0 / 3.0)
RANGE = Law("range", k=0.008, alpha=0.082, kappa=1.23, rho=1.0, sigma=0.345)
TUNABLE = Law("tunable", k=0.0094, alpha=0.035, kappa=2.3, rho=2.0 / 3.0)
COMFORT = Law("tunable", k=0.009, alpha=0.020, kappa=0.5, rho=1.0, w=0.14)
LAWS = {"FixedDistanceCruise": FIXED, "RangePotentialCruise": RANGE, "TunablePotentialCruise": TUNABLE}


class Run(NamedTuple):
    """Times (T,), and positions, speeds and accelerations (T, ..., n) in m, m/s, m/s2; desired gap (T,) in km."""

    t: np.ndarray
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    desired: np.ndarray

    @property
    def gaps(self):
        """Gaps in km, (T, ..., n - 1)."""
        return (self.x[..., :-1] - self.x[..., 1:]) / 1000.0


def resistance(v):
    return C0 + C1 * v + C2 * v**2


def moving_block(v):
    """d*(v) in km."""
    return 1.8 + 0.030 * v + v**2 / (2.0 * 0.7) / 1000.0


def target_at(t, phases=PHASES):
    return next(v for begin, v in reversed(phases) if t >= begin - 1e-9)


def march(law, x=POSITION, v=SPEED, *, stop=2000.0, step=0.25, report=1.0, phases=PHASES):
    """RK4 for one start, or for many along the leading axes; the desired gap is slewed exactly."""
    x, v = np.array(x, dtype=float), np.array(v, dtype=float)
    every = round(report / step)
    desired = moving_block(target_at(0.0, phases))
    rows = []
    for n in range(round(stop / step) + 1):
        target = target_at(n * step, phases)
        if n % every == 0:
            rows.append((n * step, x, v, law.acceleration(x, v, target, desired), desired))
        goal, reach = moving_block(target), law.gap_rate / 1000.0
        stages = [desired + np.clip(goal - desired, -reach * c * step, reach * c * step) for c in (0.0, 0.5, 1.0)]
        a1 = law.acceleration(x, v, target, stages[0])
        v2 = v + 0.5 * step * a1
        a2 = law.acceleration(x + 0.5 * step * v, v2, target, stages[1])
        v3 = v + 0.5 * step * a2
        a3 = law.acceleration(x + 0.5 * step * v2, v3, target, stages[1])
        v4 = v + step * a3
        a4 = law.acceleration(x + step * v3, v4, target, stages[2])
        x = x + step / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v = v + step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        desired = stages[2]
    return Run(*(np.array(column) for column in zip(*rows, strict=True)))


def dop853(law, x=POSITION, v=SPEED, *, stop=2000.0, report=1.0, phases=PHASES, rtol=1e-10):
    """SciPy's DOP853 for one start, interrupted where the target speed steps and where the desired gap has arrived."""
    n = len(x)
    edges = [0.0, stop]
    desired, plan = moving_block(phases[0][1]), []
    for begin, target in phases:
        arrival = begin + abs(moving_block(target) - desired) / (law.gap_rate / 1000.0)
        plan.append((begin, desired, moving_block(target)))
        desired = moving_block(target)
        edges += [edge for edge in (begin, arrival) if 0.0 < edge < stop]
    edges = sorted(set(edges))
    times = np.arange(round(stop / report) + 1) * report
    state = np.concatenate([x, v]).astype(float)
    found = np.empty((len(times), 2 * n))
    desired_at = np.empty(len(times))

    def slewed(t, plan_now):
        begin, start, goal = plan_now
        reach = law.gap_rate / 1000.0 * max(t - begin, 0.0)
        return start + float(np.clip(goal - start, -reach, reach))

    for begin, end in itertools.pairwise(edges):
        target = target_at(begin, phases)
        plan_now = next(p for p in reversed(plan) if begin >= p[0] - 1e-9)
        solution = solve_ivp(
            lambda t, y, u=target, p=plan_now: np.concatenate([y[n:], law.acceleration(y[:n], y[n:], u, slewed(t, p))]),
            (begin, end),
            state,
            method="DOP853",
            dense_output=True,
            rtol=rtol,
            atol=1e-9,
            max_step=5.0,
        )
        if not solution.success:
            raise RuntimeError(solution.message)
        here = np.flatnonzero((times >= begin - 1e-9) & (times <= end + 1e-9))
        found[here] = solution.sol(np.clip(times[here], begin, end)).T
        desired_at[here] = [slewed(t, plan_now) for t in times[here]]
        state = solution.y[:, -1]
    position, speed = found[:, :n], found[:, n:]
    net = [
        law.acceleration(p, u, target_at(t, phases), d)
        for t, p, u, d in zip(times, position, speed, desired_at, strict=True)
    ]
    return Run(times, position, speed, np.array(net), desired_at)


def indices(run, begin=0.0, end=2000.0):
    """The four indices of section 4: convergence (s), overshoots of speed (m/s) and gap (km), acceleration (m/s2)."""
    phase = (run.t >= begin - 1e-9) & (run.t < end - 1e-9)
    error = run.v[phase] - target_at(begin)
    beyond = np.flatnonzero(~(np.abs(error) <= 1.0).all(axis=-1))
    first = beyond[-1] + 1 if beyond.size else 0
    since = run.t[phase] - begin
    convergence = float(since[first]) if first < since.size else np.inf
    return convergence, float(error.max()), float(run.gaps[phase].max() - 7.4), float(np.abs(run.a[phase]).max())


def agreement(run, band=1.0):
    """First time in s from which all speeds are within a band (m/s) of one another to the end of the first phase."""
    apart = np.flatnonzero(~(np.ptp(run.v[run.t < 2000.0 - 1e-9], axis=-1) <= band))
    return float(run.t[apart[-1] + 1]) if apart.size else 0.0


def lyapunov(law, run, target=70.0, desired=7.4):
    """W of section 7 at each reported time."""
    e = run.v - target
    weights = (law.rho * law.sigma) ** np.arange(e.shape[-1])
    return 0.5 * (weights * e**2).sum(axis=-1) + MU * (weights[1:] * law.potential(run.gaps, desired)).sum(axis=-1)
