"""The published case of the comfort-aware cruise law as a `System` by hand, for the tests that hold it against SciPy.

Load it by its path; it needs no scenario file, so that what is tested is the master.
"""

import numpy as np
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System


def comfort_system(reference, *, comfort=True, gust=0.0, step=0.1, stop=350.0, algorithm="gauss-seidel"):
    """Trains, controllers, target and gust, with the starts of the reference solution."""
    system = System(stop_time=stop, step=step, algorithm=algorithm)
    n = len(reference.POSITION)
    for i, (x, v) in enumerate(zip(reference.POSITION, reference.SPEED, strict=True), 1):
        system.add(f"train[{i}]", "PointMassTrain", position=x, speed=v)
        gains = {"alpha": reference.FIGURE_CONSISTENT, "beta": reference.FIGURE_CONSISTENT, "gamma": 1e8}
        system.add(f"cruise[{i}]", "ComfortCruise", comfort_layer=comfort, has_ahead=i > 1, has_behind=i < n, **gains)
    system.add("target", "Schedule", values=reference.TARGET)
    begin, end = reference.GUST_WINDOW
    system.add("gust", "Gust", size=gust, start_time=begin, stop_time=end)
    system.connect("gust.acceleration", "train[1].disturbance")
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


def deviation(reference, *, comfort=True, gust=0.0, step=0.1, stop=350.0, algorithm="gauss-seidel", kind="auto"):
    """Worst deviations of the co-simulation from the continuous loop at its points: of speeds, m/s, and gaps, m.

    The metres of the specification's section 6 are those of the gaps (positions deviate more, all in one direction).
    """
    system = comfort_system(reference, comfort=comfort, gust=gust, step=step, stop=stop, algorithm=algorithm)
    result = run(system, kind=kind)
    exact = reference.closed_loop(comfort=comfort, gust=gust, stop=stop, interval=step)
    assert np.abs(result.time - exact.t).max() < 1e-9

    x, v = (
        np.column_stack([result[f"train[{i}].{name}"] for i in range(1, exact.x.shape[1] + 1)])
        for name in ("position", "speed")
    )
    return float(np.abs(v - exact.v).max()), float(np.abs(x[:, :-1] - x[:, 1:] - exact.gaps).max())
