"""What a master costs: N light FMUs in a ring, every output recorded to memory, beside other masters and a bare C loop.

    python benchmarks/ring.py                  # native FMUs of a component: checks every value, Runge-Kutta
    python benchmarks/ring.py --light          # the same FMU with the least library there can be: the hardest case
    python benchmarks/ring.py --whole          # `run(system)`, set-up and all, up to the arrays: 20 million FMU steps
    python benchmarks/ring.py --line 1000      # that many trains with as many controllers, 350 s

CPU time of the stepping per FMU step, all threads together, in microseconds; in parentheses the ratio to the bare C
loop over the same FMU. Every candidate lives in a process of its own and steps in turn with the others, so that a busy
machine slows all alike; medians. All take 10 000 steps, but those so slow that fewer suffice to see it (``--budget``).
That all compute the same is checked. A peer that is not installed or fails is left out with the reason.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import multiprocessing
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from line import line
from memory import forget_peak, peak, resident
from peers import PEERS, STEP, Candidate, Ring
from railcosim.fmus.build import build
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.fmi.reader import read_interface
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.loop import Master, Rows
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.run.recording import Recorder
from railcosim.orchestrator.system import System

HERE = Path(__file__).parent
PROBE = 100
"""Steps after which all candidates must agree, and from which the cost of a slow one is estimated."""
SETUP_SECONDS = 300.0
STOP = 1e6


def system_of(ring: Ring) -> System:
    system = System(stop_time=STOP, step=STEP, algorithm="jacobi")
    for k, start in enumerate(ring.starts):
        system.add(f"lag{k}", str(ring.path), x=start)
    for k in range(ring.count):
        system.connect(f"lag{ring.before(k)}.x", f"lag{k}.u")
    return system


class Ours:
    """This package: from a `System` to a `Master` and a `Recorder`."""

    def __init__(self, ring: Ring) -> None:
        system = system_of(ring)
        self.workspace = Workspace()
        checked = check(system, self.workspace)
        slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
        wiring = checked.wiring
        self.master = Master(slaves, checked.order.sequence, wiring.links, wiring.starts, system.stepping.algorithm)
        self.master.initialize(0.0, STOP)
        self.done = 0

    def run(self, steps: int) -> None:
        self._run(steps, Recorder(self.master.signals, self.master.kinds, None))

    def _run(self, steps: int, recorder: Recorder) -> None:
        def observe(_: int, rows: Rows) -> bool:
            recorder.extend(rows)
            return True

        self.master.run(self.done * STEP, STEP, steps, 1, observe)
        self.done += steps

    def values(self) -> list[float]:
        return self.master.values


class OursInPython(Ours):
    """Without the compiled step loop."""

    def __init__(self, ring: Ring) -> None:
        compiled.kernel = None
        super().__init__(ring)


class OursToDisk(Ours):
    """Rows to ``results.bin`` as they come."""

    def __init__(self, ring: Ring) -> None:
        super().__init__(ring)
        self.folder = Path(tempfile.mkdtemp(dir=self.workspace.folder))
        self.recorder: Recorder | None = None

    def run(self, steps: int) -> None:
        self.recorder = Recorder(self.master.signals, self.master.kinds, self.folder)
        self._run(steps, self.recorder)
        self.recorder.flush()

    def finish(self, _: int) -> None:
        """``results.csv`` from it, which is timed by itself."""
        assert self.recorder is not None
        self.recorder.close()


class OursWhole:
    """From a `System` to arrays: `run`, set-up and all."""

    def __init__(self, ring: Ring) -> None:
        self.ring, self.outcome, self.share = ring, None, 0.0
        run(system_of(ring), stop_time=STEP)  # what is loaded once

    def run(self, steps: int) -> None:
        self.outcome = None
        gc.collect()
        forget_peak()
        before = resident()
        outcome = run(system_of(self.ring), stop_time=steps * STEP)
        arrays = [outcome.time, *(outcome[name] for name in outcome)]
        self.share = (peak() - before) * 1024 / sum(array.nbytes for array in arrays)
        self.outcome = outcome

    def values(self) -> list[float]:
        """How much memory the run took beyond what there was, in what it has recorded."""
        return [self.share]


class BareLoop:
    """The C loop of ring.c over the same instances."""

    def __init__(self, ring: Ring) -> None:
        self.ours = Ours(ring)
        slaves = [slave for slave in self.ours.master.slaves.values() if isinstance(slave, FmuSlave)]
        references = {v.name: v.reference for v in slaves[0].interface.variables.values()}
        self.fmus = (ctypes.c_void_p * ring.count)(*(slave.pointer for slave in slaves))
        functions = [slaves[0].addresses(f"fmi2{call}")[0] for call in ("SetReal", "DoStep", "GetReal")]
        self.fixed = [*map(ctypes.c_void_p, functions), ctypes.c_uint(references["u"]), ctypes.c_uint(references["x"])]
        self.loop = ctypes.CDLL(str(compile_c(HERE / "ring.c", self.ours.workspace.folder / "ring.so"))).ring
        self.now, self.done = np.array(ring.starts), 0

    def run(self, steps: int) -> None:
        rows = np.empty((steps, len(self.now)))
        numbers = [ctypes.c_size_t(n) for n in (len(self.now), self.done, steps)]
        places = [ctypes.c_void_p(array.ctypes.data) for array in (self.now, rows)]
        self.loop(self.fmus, *self.fixed, *numbers, ctypes.c_double(STEP), *places)
        self.done += steps

    def values(self) -> list[float]:
        return list(self.now)


def compile_c(source: Path, target: Path, *flags: str) -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc") or "cc"
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", *flags, str(source), "-o", str(target)], check=True)
    return target


BARE, OURS = "bare C loop", "**railcosim**"
CANDIDATES: dict[str, type[Any]] = {BARE: BareLoop, OURS: Ours, "railcosim, no compiler": OursInPython, **PEERS}


# -------------------------------------------------------------------- one process per candidate


def serve(pipe: Any, name: str, ring: Ring) -> None:
    """Build a candidate, then obey: ("run" or "finish", steps) -> (CPU seconds, values)."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # some peers' libraries chat
    try:
        begin, before = time.process_time(), resident()
        candidate: Candidate = (CANDIDATES | {"disk": OursToDisk, "whole": OursWhole})[name](ring)
        pipe.send((time.process_time() - begin, resident() - before))
        while True:
            command, steps = pipe.recv()
            gc.collect()
            begin = time.process_time()
            getattr(candidate, command)(steps)
            pipe.send((time.process_time() - begin, list(candidate.values())))
    except EOFError:
        pass
    except BaseException as error:
        pipe.send(f"{type(error).__name__}: {error}".splitlines()[0][:150])


@dataclass
class Worker:
    """The near end of a candidate's process."""

    process: Any
    pipe: Any
    setup: float = 0.0
    memory: float = 0.0

    def ask(self, command: str, steps: int) -> tuple[float, list[float]]:
        self.pipe.send((command, steps))
        return self.receive(600.0)

    def receive(self, patience: float) -> Any:
        if not self.pipe.poll(patience):
            raise RuntimeError(f"no answer within {patience:g} s")
        try:
            answer = self.pipe.recv()
        except EOFError as error:
            self.process.join(10.0)
            raise RuntimeError(f"its process died with exit code {self.process.exitcode}") from error
        if isinstance(answer, str):
            raise RuntimeError(answer)
        return answer

    def close(self) -> None:
        self.pipe.close()
        self.process.join(20.0)
        if self.process.is_alive():
            self.process.kill()


def start(name: str, ring: Ring) -> Worker:
    context = multiprocessing.get_context("spawn")
    near, far = context.Pipe()
    process = context.Process(target=serve, args=(far, name, ring), daemon=True)
    process.start()
    far.close()
    worker = Worker(process, near)
    try:
        worker.setup, worker.memory = worker.receive(SETUP_SECONDS)
    except RuntimeError:
        process.kill()
        raise
    return worker


# -------------------------------------------------------------------- the tables


def compare(ring: Ring, names: list[str], repetitions: int, budget: float) -> dict[str, float]:
    """Microseconds per FMU step by candidate."""
    workers: dict[str, Worker] = {}
    steps: dict[str, int] = {}
    exact: list[float] = []
    try:
        for name in names:
            try:
                worker = start(name, ring)
                seconds, values = worker.ask("run", PROBE)
            except RuntimeError as error:
                note(f"N = {ring.count}: {name}: left out: {error}")
                continue
            exact = exact or values
            deviation = float(np.max(np.abs(np.subtract(values, exact))))
            if not deviation < 1e-9:
                note(f"N = {ring.count}: {name}: after {PROBE} steps it is off by {deviation:.2g}")
            workers[name] = worker
            steps[name] = max(PROBE, min(ring.steps, int(budget / max(seconds, 1e-9) * PROBE)))
        costs: dict[str, list[float]] = {name: [] for name in workers}
        for _ in range(repetitions):
            for name in list(workers):
                try:
                    seconds, _ = workers[name].ask("run", steps[name])
                except RuntimeError as error:
                    note(f"N = {ring.count}: {name}: {error}")
                    workers.pop(name).close()
                    continue
                costs[name].append(seconds / steps[name] / ring.count * 1e6)
        return {name: statistics.median(found) for name, found in costs.items() if found}
    finally:
        for worker in workers.values():
            worker.close()


def table(path: Path, counts: list[int], names: list[str], options: argparse.Namespace) -> None:
    found = {}
    for n in counts:
        begin = time.perf_counter()
        found[n] = compare(Ring(path, n, options.steps), names, options.repetitions, options.budget)
        costs = ", ".join(f"{name}: {cost:.3g}" for name, cost in found[n].items())
        note(f"N = {n}: {time.perf_counter() - begin:.0f} s; {costs}")
    print("| master | " + " | ".join(f"N = {n}" for n in counts) + " |")
    print("| --- |" + " --- |" * len(counts))
    for name in names:
        cells = []
        for n in counts:
            cost, floor = found[n].get(name), found[n].get(BARE)
            cells.append("-" if cost is None else f"{cost:.3g} ({cost / floor:.3g})" if floor else f"{cost:.3g}")
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def disk(path: Path, counts: list[int], options: argparse.Namespace) -> None:
    """Set-up, memory, and the cost of files beside that of the steps."""
    print(
        "\n| railcosim | set-up CPU s | KB per instance | steps, to memory | steps, `results.bin` flushed "
        "| `results.csv` at the end |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for n in counts:
        ring = Ring(path, n, options.steps)
        memory, stream = start(OURS, ring), start("disk", ring)
        costs: dict[str, list[float]] = {"memory": [], "stream": [], "text": []}
        for _ in range(options.repetitions):
            costs["memory"].append(memory.ask("run", ring.steps)[0])
            costs["stream"].append(stream.ask("run", ring.steps)[0])
            costs["text"].append(stream.ask("finish", 0)[0])
        cells = " | ".join(f"{statistics.median(c) / ring.steps / n * 1e6:.3g}" for c in costs.values())
        print(f"| N = {n} | {memory.setup:.3g} | {memory.memory / n:.3g} | {cells} |", flush=True)
        memory.close()
        stream.close()


def whole(path: Path, counts: list[int], options: argparse.Namespace) -> None:
    """A run from its `System` to arrays beside the bare loop, which steps instances that are there, and records."""
    print("| N | steps | bare C loop, CPU s | run(system), CPU s | ratio | memory to what is recorded |")
    print("| --- | --- | --- | --- | --- | --- |")
    for n in counts:
        ring = Ring(path, n, options.total // n)
        workers = {name: start(name, ring) for name in (BARE, "whole")}
        costs: dict[str, list[float]] = {name: [] for name in workers}
        memory = 0.0
        for _ in range(options.repetitions):
            for name, worker in workers.items():
                seconds, values = worker.ask("run", ring.steps)
                costs[name].append(seconds)
                memory = values[0] if name == "whole" else memory
        bare, mine = (statistics.median(found) for found in costs.values())
        ratio = statistics.median(b / a for a, b in zip(*costs.values(), strict=True))
        print(f"| {n} | {ring.steps} | {bare:.3f} | {mine:.3f} | {ratio:.2f} | {memory:.2f} |", flush=True)
        for worker in workers.values():
            worker.close()


def light(path: Path, folder: Path) -> Path:
    """The FMU with the library of light.c instead of its own."""
    references = {
        v.name: v.reference for v in read_interface(Path(fmpy.extract(str(path))), str(path)).variables.values()
    }
    flags = [f"-D{name.upper()}={references[name]}" for name in ("u", "x", "rate")]
    library = compile_c(HERE / "light.c", folder / "light.so", *flags).read_bytes()
    target = folder / "Light.fmu"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for entry in old.namelist():
            is_library = entry.startswith("binaries/") and not entry.endswith("/")
            new.writestr(entry, library if is_library else old.read(entry))
    return target


def note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, action="append", help="FMUs in the ring; may be given again")
    parser.add_argument("--steps", type=int, default=10_000, help="communication steps of a repetition")
    parser.add_argument("--repetitions", type=int, default=5, help="of each candidate")
    parser.add_argument("--budget", type=float, default=3.0, help="CPU seconds of a repetition of a slow candidate")
    parser.add_argument("--light", action="store_true", help="with the least FMU there can be")
    parser.add_argument("--only", action="append", help="part of a candidate's name; may be given again")
    parser.add_argument("--whole", action="store_true", help="whole runs, from a system to arrays, instead of stepping")
    parser.add_argument("--total", type=int, default=20_000_000, help="FMU steps of a whole run")
    parser.add_argument("--line", type=int, help="so many trains and controllers instead of the ring")
    options = parser.parse_args()
    if options.line:
        line(options.line, options.repetitions)
        return
    counts = options.count or [2, 8, 64, 256, 1024]
    wanted: Callable[[str], bool] = lambda name: name == BARE or any(part in name for part in options.only or [""])  # noqa: E731
    names = [name for name in CANDIDATES if wanted(name)]
    with tempfile.TemporaryDirectory() as folder:
        path = build(f"{HERE / 'lag.py'}:Lag", {}, kind="native")
        path = light(path, Path(folder)) if options.light else path
        if options.whole:
            whole(path, options.count or [8, 64, 256, 1024], options)
            return
        table(path, counts, names, options)
        disk(path, counts, options)


if __name__ == "__main__":
    main()
