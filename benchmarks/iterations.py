"""What repeated steps cost: a ring by `iterative` and `adaptive`, and one whose algebraic loop is solved, beside bare C
programs that do the same, and Python.

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
ERROR = 1e-5
"""Tolerance of the error of a step."""


VARYING: dict[str, Any] = {"algorithm": "adaptive", "tolerance": ERROR}


class Ours:
    """Instances in a ring, and the master of the package."""

    source, target = "x", "u"

    def __init__(self, ring: Ring, **how: Any) -> None:
        system = System(**{"stop_time": 1e6, "step": STEP, "algorithm": "iterative", "tolerance": TOLERANCE} | how)
        for k, start in enumerate(ring.starts):
            system.add(f"lag{k}", str(ring.path), **{self.source: start} if self.source == "x" else {})
        for k in range(ring.count):
            system.connect(f"lag{ring.before(k)}.{self.source}", f"lag{k}.{self.target}")
        self.workspace = Workspace()
        checked = check(system, self.workspace)
        slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
        wiring, settings = checked.wiring, Settings.of(system, checked.wiring)
        self.sequence = checked.order.sequence
        self.every = 0.0 if system.stepping.algorithm == "adaptive" else 1
        algorithm = system.stepping.algorithm
        self.master = Master(slaves, self.sequence, wiring.links, wiring.starts, algorithm, settings=settings)
        self.master.initialize(0.0, 1e6)
        self.done = 0

    def run(self, steps: int) -> None:
        until = self.done + steps
        self.master.run(0.0, STEP, 5_000_000, self.every, lambda *_: True, first=self.done, until=until)
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

    def __init__(self, ring: Ring, **how: Any) -> None:
        with without_kernel():
            super().__init__(ring, **how)

    def run(self, steps: int) -> None:
        with without_kernel():
            super().run(steps)


class Bare(Ours):
    """The C program of iterations.c or adaptive.c over instances of its own."""

    def __init__(self, ring: Ring, **how: Any) -> None:
        super().__init__(ring, **how)
        slaves = [slave for slave in self.master.slaves.values() if isinstance(slave, FmuSlave)]
        references = {v.name: v.reference for v in slaves[0].interface.variables.values()}
        calls = "fmi2SetReal", "fmi2DoStep", "fmi2GetReal", *FmuSlave.STATE[:3]
        self.functions = (ctypes.c_void_p * len(calls))(*(slaves[0].addresses(call)[0] for call in calls))
        self.fmus = (ctypes.c_void_p * ring.count)(*(slave.pointer for slave in slaves))
        self.states = (ctypes.c_void_p * (2 * ring.count))()
        self.references = ctypes.c_uint(references["u"]), ctypes.c_uint(references["x"])
        program = "adaptive" if "algorithm" in how else "iterations"
        library = ctypes.CDLL(str(compile_c(HERE / f"{program}.c", self.workspace.folder / f"{program}.so", "-lm")))
        self.iterate = library.adapt if "algorithm" in how else library.iterate
        self.iterate.restype = ctypes.c_size_t
        self.now, self.guess, self.sweeps = np.array(ring.starts), np.zeros(3 * ring.count), 0
        self.time, self.wanted, self.taken = ctypes.c_double(), ctypes.c_double(STEP), 0

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


class BareAdaptive(Bare):
    """The C program of adaptive.c."""

    def __init__(self, ring: Ring) -> None:
        super().__init__(ring, **VARYING)

    def run(self, steps: int) -> None:
        """Take steps up to so many of the longest ones."""
        self.done += steps
        count = len(self.now)
        rows, sweeps = np.empty((100 * steps, count)), ctypes.c_size_t()
        index = {f"lag{k}": k for k in range(count)}
        sequence = (ctypes.c_size_t * count)(*(index[name] for name in self.sequence))
        now, room, into = (ctypes.c_void_p(array.ctypes.data) for array in (self.now, self.guess, rows))
        self.taken += self.iterate(
            *(self.fmus, self.functions, *self.references, ctypes.c_size_t(count), sequence),
            *(
                ctypes.byref(self.time),
                ctypes.byref(self.wanted),
                *map(ctypes.c_double, (self.done * STEP, 1e6, STEP)),
            ),
            *(ctypes.c_double(ERROR), now, self.states, room, into, ctypes.byref(sweeps)),
        )
        self.sweeps += sweeps.value


EXACT = ("-ffp-contract=off",)
"""As the kernel is compiled."""


def names_of(ring: Ring) -> list[str]:
    return [f"lag{k}" for k in range(ring.count)]


class OursSolved(Ours):
    """A ring of components that pass on at once, in the sequence in which the bare program has them."""

    source, target = "y", "u"

    def __init__(self, ring: Ring) -> None:
        super().__init__(ring, algorithm="gauss-seidel", algebraic_loops="solve", order=names_of(ring))


class InPythonSolved(InPython):
    """The same without the compiled step loop."""

    source, target = "y", "u"

    def __init__(self, ring: Ring) -> None:
        super().__init__(ring, algorithm="gauss-seidel", algebraic_loops="solve", order=names_of(ring))


class BareSolved(OursSolved):
    """The C program of instants.c."""

    def __init__(self, ring: Ring) -> None:
        super().__init__(ring)
        slaves = [slave for slave in self.master.slaves.values() if isinstance(slave, FmuSlave)]
        references = {v.name: v.reference for v in slaves[0].interface.variables.values()}
        calls = "fmi2SetReal", "fmi2DoStep", "fmi2GetReal", FmuSlave.DERIVE
        self.functions = (ctypes.c_void_p * len(calls))(*(slaves[0].addresses(call)[0] for call in calls))
        self.fmus = (ctypes.c_void_p * ring.count)(*(slave.pointer for slave in slaves))
        self.references = ctypes.c_uint(references["u"]), ctypes.c_uint(references["y"])
        library = ctypes.CDLL(str(compile_c(HERE / "instants.c", self.workspace.folder / "instants.so", *EXACT, "-lm")))
        self.solve, library.room_of_ring.restype = library.solve_ring, ctypes.c_size_t
        self.solve.restype = ctypes.c_size_t
        self.room = np.zeros(library.room_of_ring(ctypes.c_size_t(ring.count)))
        self.now, self.evaluations = np.array(self.master.values), 0

    def run(self, steps: int) -> None:
        rows = np.empty((steps, len(self.now)))
        numbers = [ctypes.c_size_t(n) for n in (len(self.now), self.done, steps)]
        places = (ctypes.c_void_p(array.ctypes.data) for array in (self.now, self.room, rows))
        found = self.solve(self.fmus, self.functions, *self.references, *numbers, ctypes.c_double(STEP), *places)
        self.evaluations += found
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
    counts = options.count or [2, 8, 64, 256]
    for count in counts:
        row(Ring(path, count, 200_000 // count), options.repetitions)
    print("\n| N | steps that were taken | bare C program | railcosim | in Python |\n| --- | --- | --- | --- | --- |")
    for count in counts:
        varying(Ring(path, count, 10_000 // count), options.repetitions)
    path = Path(build(f"{HERE / 'lag.py'}:Bend", {}, kind="native"))
    print("\n| N | evaluations per step | bare C program | railcosim | in Python |\n| --- | --- | --- | --- | --- |")
    for count in options.count or [2, 8, 32]:
        solved(Ring(path, count, 40_000 // count), options.repetitions)


def row(ring: Ring, repetitions: int) -> None:
    all_of = Bare(ring), Ours(ring), Ours(ring, acceleration="anderson"), InPython(ring)
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


def varying(ring: Ring, repetitions: int) -> None:
    all_of = BareAdaptive(ring), Ours(ring, **VARYING), InPython(ring, **VARYING)
    costs: list[list[float]] = [[] for _ in all_of]
    for _ in range(repetitions):
        for one, found in zip(all_of, costs, strict=True):
            before = taken(one)
            cost = timed(one, ring.steps if one is not all_of[2] else max(1, ring.steps // 50))
            found.append(cost / (taken(one) - before) / ring.count * 1e6)
    bare, ours = all_of[0], all_of[1]
    assert bare.taken == taken(ours), (bare.taken, taken(ours))
    assert np.allclose(bare.values, ours.values, rtol=1e-12)
    tell(ring, f"{bare.taken}", costs)


def solved(ring: Ring, repetitions: int) -> None:
    all_of = BareSolved(ring), OursSolved(ring), InPythonSolved(ring)
    costs: list[list[float]] = [[] for _ in all_of]
    for _ in range(repetitions):
        for one, found in zip(all_of, costs, strict=True):
            steps = ring.steps if one is not all_of[2] else max(1, ring.steps // 100)
            found.append(timed(one, steps) / steps / ring.count * 1e6)
    bare, ours = all_of[0], all_of[1]
    assert bare.done == ours.done
    assert bare.values == ours.values, (bare.values, ours.values)
    tell(ring, f"{bare.evaluations / bare.done:.3g}", costs)


def tell(ring: Ring, what: str, costs: list[list[float]]) -> None:
    """A row of a table: medians, and in parentheses those of the ratios to what was measured first, pair by pair."""
    ratios = [statistics.median(a / b for a, b in zip(found, costs[0], strict=True)) for found in costs]
    cells = [f"{statistics.median(found):.3g} ({ratio:.3g})" for found, ratio in zip(costs, ratios, strict=True)]
    print(f"| {ring.count} | {what} | " + " | ".join(cells) + " |", flush=True)


def taken(one: Any) -> int:
    """How many steps of varying length were taken."""
    return one.taken if isinstance(one, BareAdaptive) else int(one.master.algorithm.report()["accepted"])


if __name__ == "__main__":
    main()
