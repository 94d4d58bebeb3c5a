"""Many trains in one platoon: what setting up and stepping cost, with native FMUs and the compiled step loop.

    python benchmarks/platoon_200.py                     # 200 trains, 1000 s at 0.1 s, recorded each second
    python benchmarks/platoon_200.py --trains 50 --law FixedDistanceCruise

The first of the trains is braked for a minute; every train has a controller that hears both neighbours. A first short
run, not counted, compiles the FMUs. The CPU time of the steps is that of a run less that of one with a single step;
the loop is one thread, so on an idle machine it is the wall time. The exit code is 1 when the median is 2 s or more.
"""

import argparse
import sys
import time

import numpy as np
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

GOAL = 2.0
"""s of stepping, for 200 trains."""
GAP = 7400.0
SPEED = 70.0
GENTLE = {"rho": 1.0, "k": 0.009, "alpha": 0.020, "pull_limit": 0.5, "gap_width": 140.0}
"""Gains of models/braking_wave.toml, with which the wave dies out."""


def platoon(count: int, law: str, stop_time: float = 1000.0) -> System:
    """The braking wave of models/braking_wave.toml, with ``count`` trains."""
    gains = GENTLE if law == "TunablePotentialCruise" else {}
    system = System(stop_time=stop_time, step=0.1, record=1.0)
    for i in range(1, count + 1):
        system.add(f"train[{i}]", "PointMassTrain", position=(count - i) * GAP, speed=SPEED)
        system.add(f"cruise[{i}]", law, has_ahead=i > 1, has_behind=i < count, **gains)
    system.add("target", "Schedule", values=SPEED)
    system.add("gust", "Gust", size=0.5, start_time=100.0, stop_time=160.0)
    system.connect("gust.acceleration", "train[1].disturbance")
    for i in range(1, count + 1):
        for name in ("position", "speed"):
            system.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
            if i > 1:
                system.connect(f"train[{i - 1}].{name}", f"cruise[{i}].ahead_{name}")
            if i < count:
                system.connect(f"train[{i + 1}].{name}", f"cruise[{i}].behind_{name}")
        system.connect("target.value", f"cruise[{i}].target_speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].force")
    return system


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trains", type=int, default=200)
    parser.add_argument("--law", default="TunablePotentialCruise", help="controller of every train")
    parser.add_argument("--repetitions", type=int, default=5)
    options = parser.parse_args()
    if compiled.kernel is None:
        print("the compiled step loop is not installed: the steps are taken in Python", file=sys.stderr)
    system = platoon(options.trains, options.law)
    run(system, kind="native", stop_time=0.1)  # the FMUs are compiled, once
    print("| trains | FMUs | steps | set-up s | stepping s | stepping s, CPU | ns CPU per FMU step |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    stepping = []
    for _ in range(options.repetitions):
        begin = time.process_time()
        run(system, kind="native", stop_time=system.stepping.step)
        between = time.process_time()
        result = run(system, kind="native")
        stepping.append((time.process_time() - between) - (between - begin))
        seconds, fmus = result.seconds, len(system.instances)
        print(
            f"| {options.trains} | {fmus} | {seconds['steps']:.0f} "
            f"| {seconds['setup']:.2f} | {seconds['stepping']:.2f} | {stepping[-1]:.2f} "
            f"| {stepping[-1] / seconds['steps'] / fmus * 1e9:.0f} |",
            flush=True,
        )
    speeds = np.array([result[f"train[{i}].speed"] for i in range(1, options.trains + 1)])
    print(f"\nmedian CPU time of the steps {np.median(stepping):.2f} s; {len(result.time)} recorded points;")
    print(f"lowest speed of train 1 {speeds[0].min():.2f} m/s, of train {options.trains} {speeds[-1].min():.2f} m/s")
    return int(np.median(stepping) >= GOAL)


if __name__ == "__main__":
    sys.exit(main())
