"""The published case of the laws of Huang et al. 2022 as a `System` by hand, held against the reference solution."""

import numpy as np
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System


def platoon_system(reference, law, *, step=0.1, stop=2000.0, algorithm="gauss-seidel", record=None, **gains):
    """Trains, controllers and target, with the starts of the reference solution."""
    system = System(stop_time=stop, step=step, algorithm=algorithm, record=record)
    n = len(reference.POSITION)
    for i, (x, v) in enumerate(zip(reference.POSITION, reference.SPEED, strict=True), 1):
        system.add(f"train[{i}]", "PointMassTrain", position=float(x), speed=float(v))
        system.add(f"cruise[{i}]", law, has_ahead=i > 1, has_behind=i < n, **gains)
    times, values = zip(*reference.PHASES, strict=True)
    system.add("target", "Schedule", {"points": len(times)}, times=list(times), values=list(values))
    for i in range(1, n + 1):
        for name in ("position", "speed"):
            system.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
            if i > 1:
                system.connect(f"train[{i - 1}].{name}", f"cruise[{i}].ahead_{name}")
            if i < n:
                system.connect(f"train[{i + 1}].{name}", f"cruise[{i}].behind_{name}")
        system.connect("target.value", f"cruise[{i}].target_speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].force")
    return system


def trajectories(result, n=5):
    """Positions, speeds and accelerations, (T, n) each."""
    return tuple(
        np.column_stack([result[f"train[{i}].{name}"] for i in range(1, n + 1)])
        for name in ("position", "speed", "acceleration")
    )


def deviation(reference, law, exact, *, step, algorithm, kind="auto"):
    """Worst deviations from the continuous loop before 2000 s, of speeds (m/s) and gaps (m); the speed overshoot."""
    system = platoon_system(reference, law, step=step, algorithm=algorithm, record=1.0)
    x, v, _ = trajectories(run(system, kind=kind))
    before = exact.t < 2000.0
    gaps = (x[:, :-1] - x[:, 1:])[before] - 1000.0 * exact.gaps[before]
    return float(np.abs(v - exact.v)[before].max()), float(np.abs(gaps).max()), float(v[before].max() - 70.0)
