"""What threads gain or lose: N trains in one `jacobi` run, stepped by one thread or several, light and heavy.

    python benchmarks/threads.py

Microseconds of wall time per FMU step, and the ratio to one thread; all step in turn, so that a busy machine slows all
alike; medians. A train is made heavy by more Runge-Kutta steps inside. That all compute the same bits is checked.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time

from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.master.loop import Master, Rows
from railcosim.orchestrator.master.settings import Settings
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.system import System

STEP, STOP = 0.1, 1e6
INNER = {"light": 1, "4 inner steps": 4, "32 inner steps": 32, "256 inner steps": 256}


class Candidate:
    """A line of trains, each pushed a little by the acceleration of the one ahead."""

    def __init__(self, count: int, inner: int, threads: int, workspace: Workspace) -> None:
        system = System(stop_time=STOP, step=STEP, algorithm="jacobi")
        for k in range(count):
            system.add(f"train{k}", "PointMassTrain", speed=80.0 + k / count, max_step=STEP / inner, force=5e4)
            if k:
                system.connect(f"train{k - 1}.acceleration", f"train{k}.disturbance", scale=0.1)
        checked = check(system, workspace, "native")
        self.slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
        self.master = Master(
            self.slaves,
            checked.order.sequence,
            checked.wiring.links,
            checked.wiring.starts,
            "jacobi",
            settings=Settings(threads=threads),
        )
        self.master.initialize(0.0, STOP)
        self.done = 0

    def run(self, steps: int) -> float:
        """Seconds of wall time."""

        def observe(_: int, __: Rows) -> bool:
            return True

        begin = time.perf_counter()
        self.master.run(self.done * STEP, STEP, steps, steps, observe)
        self.done += steps
        return time.perf_counter() - begin

    def close(self) -> None:
        for slave in self.slaves.values():
            slave.free()


def measure(count: int, inner: int, threads: list[int], *, seconds: float, repetitions: int) -> list[float]:
    """Wall time per FMU step in microseconds for each number of threads."""
    with Workspace() as workspace:
        candidates = [Candidate(count, inner, n, workspace) for n in threads]
        steps = max(20, round(20 * seconds / candidates[0].run(20)))
        for other in candidates[1:]:
            other.run(20)
        times = [[candidate.run(steps) for candidate in candidates] for _ in range(repetitions)]
        values = [candidate.master.values for candidate in candidates]
        assert all(other == values[0] for other in values), "threads changed the results"
        for candidate in candidates:
            candidate.close()
    return [1e6 * statistics.median(column) / (steps * count) for column in zip(*times, strict=True)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, action="append", help="trains; may be given again")
    parser.add_argument("--threads", type=int, action="append", help="threads beside one; may be given again")
    parser.add_argument("--seconds", type=float, default=0.5, help="of a repetition with one thread")
    parser.add_argument("--repetitions", type=int, default=5)
    given = parser.parse_args()
    threads = [1, *(given.threads or [os.cpu_count() or 2])]
    print("| trains | each | " + " | ".join(f"{n} thread{'s' * (n > 1)}" for n in threads) + " |")
    print("| --- " * (2 + len(threads)) + "|")
    for count in given.count or [8, 64, 256]:
        for name, inner in INNER.items():
            found = measure(count, inner, threads, seconds=given.seconds, repetitions=given.repetitions)
            cells = [f"{x:.3g} ({x / found[0]:.2g})" for x in found]
            print(f"| {count} | {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
