"""The solver against IPOPT, on random samples of a train behind another, and on problems without a solution."""

import numpy as np
import pytest
from railcosim.components import DistributedMpc
from railcosim.components.cruise.predictive.interior_point import solved

ca = pytest.importorskip("casadi")
STAGES, STEPS = 10, 20


def drawn(rng, **changes):
    """The problem of one sample: within 200 m of the wanted gap, before a train that may brake hard."""
    speed = rng.uniform(5.0, 80.0)
    ahead = float(np.clip(speed + rng.uniform(-6.0, 6.0), 0.0, 90.0))
    plan = np.clip(rng.uniform(-0.9, 0.5) + np.linspace(0.0, 1.0, STAGES + 1) * rng.uniform(-0.2, 0.5), -0.9, 0.6)
    values = {
        "speed": speed,
        "has_ahead": bool(rng.random() < 0.85),
        "has_plan": bool(rng.random() < 0.7),
        "ahead_speed": ahead,
        "ahead_position": 270.0 + 20.0 * speed + rng.uniform(-200.0, 200.0),
        "ahead_age": rng.uniform(0.0, 2.0),
        "ahead_average": ahead + rng.uniform(-0.5, 0.5),
        "ahead_plan": plan if ahead > 25.0 else 0.0,
        "target_speed": speed + rng.uniform(-10.0, 10.0),
        "planned_demand": rng.uniform(-0.5, 0.5),
        "line_resistance": rng.uniform(-0.1, 0.1),
    }
    component = DistributedMpc(**(values | changes))
    problem = component._problem(*component._ahead())
    return problem._replace(**{name: np.array(getattr(problem, name)) for name in ("wanted", "ahead_speed", "stop")})


def by_ipopt(problem):
    """Jerks and cost of the same problem, written anew; None where IPOPT finds that nothing keeps everything."""
    jerks = ca.SX.sym("jerks", STAGES)
    p, v, a, t = problem.position, problem.speed, problem.acceleration, problem.interval
    cost, kept = 0.0, []
    for k in range(STAGES):
        j = jerks[k]
        p, v, a = p + t * v + t**2 / 2 * a + t**3 / 6 * j, v + t * a + t**2 / 2 * j, a + t * j
        cost += problem.gap_weight * (problem.wanted[k] - p - problem.headway * v) ** 2 / 2
        cost += problem.follow_weight * (problem.ahead_speed[k] - v) ** 2 / 2
        cost += problem.speed_weight * (problem.target_speed - v) ** 2 / 2
        cost += problem.acceleration_weight * a**2 / 2 + problem.jerk_weight * j**2 / 2
        kept += [
            (p + problem.reaction * v + v**2 / (2 * problem.braking) - problem.stop[k]) / 100.0,
            -v / 10.0, (v - problem.fastest) / 10.0, -a - problem.braking, a - problem.most,
            a + problem.slope * v - problem.pull, j / problem.jerk_limit - 1.0, -j / problem.jerk_limit - 1.0,
        ]  # fmt: skip
    quiet = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-9}
    solver = ca.nlpsol("it", "ipopt", {"x": jerks, "f": cost, "g": ca.vertcat(*kept)}, quiet)
    found = solver(x0=0.0, lbg=-ca.inf, ubg=0.0)
    if not solver.stats()["success"]:
        return None
    return np.array(found["x"]).ravel(), float(found["f"])


def compared(seed, warm=False):
    """Excess of the cost over IPOPT's, relative, and the largest violation by its range; None without a solution."""
    rng = np.random.default_rng([17, seed])
    problem = drawn(rng)
    found = by_ipopt(problem)
    if found is None:
        return None
    begun = found[0] + rng.normal(0.0, 0.1, STAGES) if warm else np.zeros(STAGES)
    jerks = solved(problem, begun, STEPS)
    motion = problem.motion(jerks)
    return problem.cost(motion, jerks) / max(found[1], 1e-6) - 1.0, problem.excess(motion, jerks).max()


@pytest.mark.parametrize("warm", [False, True], ids=["cold", "warm"])
@pytest.mark.parametrize(
    "seeds", [range(12), pytest.param(range(12, 1000), marks=pytest.mark.campaign)], ids=["few", "many"]
)
def test_it_finds_what_ipopt_finds(seeds, warm):
    found = [result for seed in seeds if (result := compared(seed, warm)) is not None]
    assert len(found) > 0.7 * len(seeds)
    assert max(abs(cost) for cost, _ in found) < 0.01
    assert max(excess for _, excess in found) < 1e-3
    assert sum(excess > -1e-3 for _, excess in found) > 0.2 * len(found)


def test_where_nothing_keeps_everything_it_brakes():
    late = {"speed": 40.0, "planned_demand": 0.0, "has_ahead": True, "ahead_position": 300.0, "ahead_speed": 0.0}
    problem = drawn(np.random.default_rng(0), **late, has_plan=False, ahead_average=0.0, guard=False)
    assert by_ipopt(problem) is None
    jerks = solved(problem, np.zeros(STAGES), STEPS)
    motion = problem.motion(jerks)
    assert motion.acceleration.max() < -0.75
