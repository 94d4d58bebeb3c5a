"""What repeated steps cost: a ring by `iterative`, beside a bare C program that does the same, and Python.

    python benchmarks/iterations.py

CPU time of the stepping per FMU step (each of those that are repeated counts), in microseconds; in parentheses the
ratio to the bare C program. All in one process, in turn, so that a busy machine slows all alike; medians. That
both take as many sweeps and end at the same values is checked.
"""

from __future__ import annotations

import argparse
import ctypes
import statistics
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from peers import Ring
from railcosim.fmus.build import build
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.loop import Master
from railcosim.orchestrator.master.settings import Settings
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.system import System
from ring import HERE, compile_c

STEP, TOLERANCE = 0.2, 1e-8


class Ours:
    """Instances in a ring, and the master of the package."""

    def __init__(self, ring: Ring, acceleration: str) -> None:
        system = System(stop_time=1e6, step=STEP, algorithm="iterative", tolerance=TOLERANCE, acceleration=acceleration)
        for k, start in enumerate(ring.starts):
            system.add(f"lag{k}", str(ring.path), x=start)
        for k in range(ring.count):
            system.connect(f"lag{ring.before(k)}.x", f"lag{k}.u")
        self.workspace = Workspace()
        checked = check(system, self.workspace)
        slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
        wiring, settings = checked.wiring, Settings.of(system, checked.wiring)
        self.master = Master(
            slaves, checked.order.sequence, wiring.links, wiring.starts, "iterative", settings=settings
        )
        self.master.initialize(0.0, 1e6)
        self.done = 0

    def run(self, steps: int) -> None:
        self.master.run(0.0, STEP, self.done + steps, 1, lambda *_: True, first=self.done)
        self.done += steps

    @property
    def values(self) -> list[float]:
        return list(self.master.values)


@contextmanager
def without_kernel() -> Iterator[None]:
    kernel, compiled.kernel = compiled.kernel, None
    yield
    compiled.kernel = kernel


class InPython(Ours):
    """Without the compiled step loop."""

    def __init__(self, ring: Ring, acceleration: str) -> None:
        with without_kernel():
            super().__init__(ring, acceleration)

    def run(self, steps: int) -> None:
        with without_kernel():
            super().run(steps)


class Bare(Ours):
    """The C program of iterations.c over instances of its own."""

    def __init__(self, ring: Ring, acceleration: str) -> None:
        super().__init__(ring, acceleration)
        slaves = [slave for slave in self.master.slaves.values() if isinstance(slave, FmuSlave)]
        references = {v.name: v.reference for v in slaves[0].interface.variables.values()}
        calls = "fmi2SetReal", "fmi2DoStep", "fmi2GetReal", *FmuSlave.STATE[:3]
        self.functions = (ctypes.c_void_p * len(calls))(*(slaves[0].addresses(call)[0] for call in calls))
        self.fmus = (ctypes.c_void_p * ring.count)(*(slave.pointer for slave in slaves))
        self.states = (ctypes.c_void_p * ring.count)()
        self.references = ctypes.c_uint(references["u"]), ctypes.c_uint(references["x"])
        self.iterate = ctypes.CDLL(str(compile_c(HERE / "iterations.c", self.workspace.folder / "i.so", "-lm"))).iterate
        self.iterate.restype = ctypes.c_size_t
        self.now, self.guess, self.sweeps = np.array(ring.starts), np.zeros(ring.count), 0

    def run(self, steps: int) -> None:
        rows = np.empty((steps, len(self.now)))
        numbers = [ctypes.c_size_t(n) for n in (len(self.now), self.done, steps)]
        sizes = ctypes.c_double(STEP), ctypes.c_double(TOLERANCE)
        now, guess, into = (ctypes.c_void_p(array.ctypes.data) for array in (self.now, self.guess, rows))
        places = now, guess, self.states, into
        self.sweeps += self.iterate(self.fmus, self.functions, *self.references, *numbers, *sizes, *places)
        self.done += steps

    @property
    def values(self) -> list[float]:
        return list(self.now)


def timed(one: Any, steps: int) -> float:
    begin = time.process_time()
    one.run(steps)
    return time.process_time() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, action="append", help="FMUs in the ring; may be given again")
    parser.add_argument("--repetitions", type=int, default=7)
    options = parser.parse_args()
    path = Path(build(f"{HERE / 'lag.py'}:DrivenLag", {}, kind="native"))
    print("| N | sweeps per step | bare C program | railcosim | with Anderson's method | in Python |")
    print("| --- | --- | --- | --- | --- | --- |")
    for count in options.count or [2, 8, 64, 256]:
        row(Ring(path, count, 200_000 // count), options.repetitions)


def row(ring: Ring, repetitions: int) -> None:
    all_of = Bare(ring, "aitken"), Ours(ring, "aitken"), Ours(ring, "anderson"), InPython(ring, "aitken")
    costs: list[list[float]] = [[] for _ in all_of]
    for _ in range(repetitions):
        for one, found in zip(all_of, costs, strict=True):
            steps = ring.steps if one is not all_of[3] else max(1, ring.steps // 100)
            found.append(timed(one, steps) / steps / ring.count * 1e6)
    bare, ours = all_of[0], all_of[1]
    assert isinstance(bare, Bare)
    told = ours.master.algorithm.report()
    sweeps = bare.sweeps / bare.done
    assert abs(sweeps - told["iterations_per_step"]) < 1e-9 * sweeps, (sweeps, told)
    assert np.allclose(bare.values, ours.values, rtol=1e-12)
    cells = [f"{statistics.median(costs[0]) / sweeps:.3g} (1)"]
    for one, found in zip(all_of[1:], costs[1:], strict=True):
        own = one.master.algorithm.report()["iterations_per_step"]
        ratio = statistics.median(a / b for a, b in zip(found, costs[0], strict=True)) * sweeps / own
        cells.append(f"{statistics.median(found) / own:.3g} ({ratio:.3g})")
    print(f"| {ring.count} | {sweeps:.3g} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
