"""What isolation costs: N light FMUs in a ring, in N processes or together in one, and here, through the same loop.

    python benchmarks/isolation.py             # the compiled loop: a step is a hand-over through shared memory
    python benchmarks/isolation.py --python    # the loop in Python: a step is a message

Microseconds per FMU step, wall time and CPU time of all processes together, and the ratio to the ring without
isolation; both are driven from this process and step in turn, so that a busy machine slows both alike; medians. Then
one component as an FMU of either version of FMI, the FMUs of a platoon, each in a process of its own and those of one
kind together, and FMUs that are heavy (many Runge-Kutta steps inside), which isolation lets compute at the same time
with ``jacobi``. That both compute the same is checked. The last column is the wall time in which the processes start
and are initialized.
CPU time of other processes is told by Linux.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from railcosim.fmus.build import build
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.isolation.choice import instantiate
from railcosim.orchestrator.isolation.proxy import IsolatedSlave
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.loop import Master
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.system import TOGETHER, System, Together
from ring import HERE, light

STEP, STOP = 1e-3, 1e6
Isolated = bool | Together
"""Whether instances are in processes of their own, or together in one."""


def ring_of(path: Path, count: int, algorithm: str, **start: float) -> System:
    """FMUs in a ring."""
    system = System(stop_time=STOP, step=STEP, algorithm=algorithm)
    for k in range(count):
        system.add(f"lag{k}", str(path), x=(k + 1) / count, **start)
        system.connect(f"lag{k - 1 if k else count - 1}.x", f"lag{k}.u")
    return system


class Candidate:
    """A system with all of its instances isolated, or none; or those of one FMU together in one process."""

    def __init__(self, system: System, workspace: Workspace, isolated: Isolated):
        begin = time.perf_counter()
        checked = check(system, workspace)
        instances = {name: replace(x, isolate=isolated) for name, x in system.instances.items()}
        self.slaves = dict(instantiate(checked.models, instances))
        wiring, algorithm, self.step = checked.wiring, system.stepping.algorithm, system.stepping.step
        self.master = Master(self.slaves, checked.order.sequence, wiring.links, wiring.starts, algorithm)
        self.master.initialize(0.0, STOP)
        self.setup = time.perf_counter() - begin
        self.done = 0

    def run(self, steps: int) -> tuple[float, float]:
        """Seconds of wall time and of CPU time."""
        wall, cpu = time.perf_counter(), self._cpu()
        self.master.run(self.done * self.step, self.step, steps, 1, lambda *_: True)
        self.done += steps
        return time.perf_counter() - wall, self._cpu() - cpu

    def _cpu(self) -> float:
        processes = {slave.pid for slave in self.slaves.values() if isinstance(slave, IsolatedSlave)}
        return time.process_time() + sum(map(cpu_of, processes))

    def close(self) -> None:
        for slave in self.slaves.values():
            slave.free()


def cpu_of(process: int) -> float:
    """CPU time of another process so far in s; 0 where the system does not tell."""
    file = Path(f"/proc/{process}/schedstat")
    return int(file.read_text().split()[0]) * 1e-9 if file.exists() else 0.0


def compare(system: System, steps: int, repetitions: int, isolated: Isolated = True) -> str:
    """One row of the table."""
    with Workspace() as workspace:
        both = [Candidate(system, workspace, how) for how in (False, isolated)]
        costs: list[list[Sequence[float]]] = [[], []]
        try:
            for _ in range(repetitions):
                for candidate, found in zip(both, costs, strict=True):
                    found.append(candidate.run(steps))
            assert both[0].master.values == both[1].master.values, "not the same values"
        finally:
            for candidate in both:
                candidate.close()
    count = len(system.instances)
    processes = len({slave.pid for slave in both[1].slaves.values() if isinstance(slave, IsolatedSlave)})
    cells = [f"{count}", f"{processes}", system.stepping.algorithm]
    for which in (0, 1):
        here, apart = ([seconds[which] / steps / count * 1e6 for seconds in found] for found in costs)
        ratio = statistics.median(b / a for a, b in zip(here, apart, strict=True))
        cells += [f"{statistics.median(here):.3g}", f"{statistics.median(apart):.3g}", f"{ratio:.2g}"]
    return f"| {' | '.join(cells)} | {both[1].setup:.2f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=10_000, help="communication steps of a repetition")
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--python", action="store_true", help="without the compiled loop")
    options = parser.parse_args()
    if options.python:
        compiled.kernel = None
    own = build(f"{HERE / 'lag.py'}:Lag", {}, kind="native")
    print("| N | processes | algorithm | wall, here | isolated | ratio | CPU, here | isolated | ratio | set-up s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        least = light(own, Path(folder))
        rows: tuple[tuple[int, Isolated], ...] = (1, True), (2, True), (2, TOGETHER), (8, True), (8, TOGETHER)
        how = options.steps, options.repetitions
        for count, isolated in rows:
            for algorithm in ("gauss-seidel", "jacobi"):
                print(compare(ring_of(least, count, algorithm), *how, isolated), flush=True)
    print("\nA component in FMI 2.0 and in FMI 3.0:\n")
    for path in (own, build(f"{HERE / 'lag.py'}:Lag", {}, kind="native", fmi="3")):
        print(compare(ring_of(path, 8, "gauss-seidel"), *how, TOGETHER), flush=True)
    print("\nThe trains of comfort_cruise:\n")
    for isolated in (True, TOGETHER):
        print(compare(load("comfort_cruise"), *how, isolated), flush=True)
    print("\nHeavy FMUs:\n")
    for count in (2, 8):
        ring = ring_of(own, count, "jacobi", max_step=STEP / 30_000)
        print(compare(ring, max(1, options.steps // 50), options.repetitions), flush=True)


if __name__ == "__main__":
    main()
