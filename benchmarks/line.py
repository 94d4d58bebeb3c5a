"""A line of trains, each with a controller, for benchmarks/ring.py."""

from __future__ import annotations

import resource
import time

from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System


def line(count: int, repetitions: int) -> None:
    """Trains, each with a controller, one behind the other: 350 s at 0.1 s, recorded each second."""
    system = System(stop_time=350.0, step=0.1, record=1.0)
    for i in range(1, count + 1):
        system.add(f"train[{i}]", "PointMassTrain", position=(count - i) * 17e3, speed=60.0)
        system.add(f"cruise[{i}]", "ComfortCruise", has_ahead=i > 1, has_behind=i < count)
    system.add("target", "Schedule", values=85.0)
    for i in range(1, count + 1):
        for name in ("position", "speed"):
            system.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
            if i > 1:
                system.connect(f"train[{i - 1}].{name}", f"cruise[{i}].ahead_{name}")
            if i < count:
                system.connect(f"train[{i + 1}].{name}", f"cruise[{i}].behind_{name}")
        system.connect("target.value", f"cruise[{i}].target_speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].force")
    run(system, kind="native", stop_time=0.1)  # the FMUs are compiled, once
    print("| instances | set-up s | stepping s | µs per FMU step | CPU s of all | MB |")
    print("| --- | --- | --- | --- | --- | --- |")
    for _ in range(repetitions):
        begin = time.process_time()
        seconds = run(system, kind="native").seconds
        cpu, memory = time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        cost = seconds["stepping"] / seconds["steps"] / len(system.instances) * 1e6
        print(
            f"| {len(system.instances)} | {seconds['setup']:.2f} | {seconds['stepping']:.2f} | {cost:.3f} | {cpu:.2f} "
            f"| {memory:.0f} |",
            flush=True,
        )
