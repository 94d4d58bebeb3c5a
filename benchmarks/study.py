"""What many runs of one scenario cost: a `Batch`, a study on Dask, and the same study over FMPy in a process pool.

    python benchmarks/study.py
    python benchmarks/study.py --runs 200 --peer-runs 4

1. One process: CPU time of a run of `comfort_cruise` (3500 steps of 10 FMUs) whose gain and seed are changed, of its
   communication steps alone, and what lies between them; without metrics and requirements, and with them. The
   candidates take turns, so that a busy machine slows all alike, and the least of each counts; then 256 platoons as a
   whole. Of one process on an idle machine CPU time is wall time.
2. The study on one local worker, and on two: metrics and requirements judged, nothing recorded, rows written to
   Parquet, after a warm-up. With the CPU time of workers and client, which a busy machine blurs less than wall time.
3. The same study over FMPy: the same FMUs, connections and order, in a pool of two processes, each FMU loaded once and
   reset for every run, set, doStep and get by FMPy's calls, nothing recorded and nothing judged.

In the end all that is bounded, beside its bound; the bounds are meant for a machine with two idle cores.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import fmpy
import psutil
from fmpy.fmi2 import FMU2Slave
from railcosim.orchestrator import Batch, load, world
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.run import Repeater, Revision, check, listening
from railcosim.orchestrator.study.campaign import Dataset, Entry, packed, pool_for

SCENARIO, WORKERS, PLATOONS, TURN = "comfort_cruise", 2, 256, 16
KEPT: dict[str, object] = {}
"""What a worker process keeps from task to task."""


def changes(number: int) -> dict[str, float | int]:
    """What a run changes."""
    draw = random.Random(number)
    return {"cruise.alpha": draw.uniform(0.01, 0.05), "simulation.seed": draw.randrange(2**31)}


class Alone(NamedTuple):
    """Of runs in this process: CPU time of the fastest in s, and of 256 by the kernel and by a batch."""

    stepping: float
    bare: float
    judged: float
    kernel_of_all: float
    batch_of_all: float


@contextmanager
def kernel() -> Iterator[Callable[[int], list[float]]]:
    """What makes so many runs, and tells how long the steps of each took, in s."""
    with Workspace() as workspace, listening() as nobody:
        checked = check(load(SCENARIO), workspace)
        repeater = Repeater(checked, [])

        def step(runs: int) -> list[float]:
            flights = (repeater.fly(checked, nobody) for _ in range(runs))
            return [flown.stepping for flown in flights if flown is not None]

        yield step
        repeater.crew.dismiss()


def alone() -> Alone:
    """What a run costs in this process."""
    world.perf_counter = time.process_time  # by which a run is timed
    found: dict[str, list[float]] = {"stepping": [], "bare": [], "judged": []}
    system, of_all = load(SCENARIO), 0.0
    with Batch(system, evaluate=False) as bare, Batch(system) as judged, kernel() as step:
        for batch in (bare, judged):
            batch.run_all(map(changes, range(2)))
        for first in range(0, PLATOONS, TURN):
            runs = list(map(changes, range(first, first + TURN)))
            found["stepping"] += step(TURN)
            begin = time.process_time()
            found["bare"] += [row.seconds for row in bare.run_all(runs).rows]
            of_all += time.process_time() - begin
            rows = judged.run_all(runs).rows
            found["judged"] += [row.seconds for row in rows]
    stepping, without, with_all = (min(found[name]) for name in ("stepping", "bare", "judged"))
    print("| one run | ms | beyond its steps, ms | to its steps alone |\n| --- | --- | --- | --- |")
    for name, seconds in (("its steps alone", stepping), ("a batch", without), ("a batch that judges", with_all)):
        print(f"| {name} | {1e3 * seconds:.2f} | {1e3 * (seconds - stepping):.2f} | {seconds / stepping:.2f} |")
    steps, kernel_of_all = PLATOONS * rows[0].steps, sum(found["stepping"])
    print(f"\n| {PLATOONS} platoons | s | steps per s | ratio |\n| --- | --- | --- | --- |")
    print(f"| by the kernel | {kernel_of_all:.2f} | {steps / kernel_of_all:.3g} | 1 |")
    print(f"| by a batch | {of_all:.2f} | {steps / of_all:.3g} | {of_all / kernel_of_all:.2f} |\n")
    return Alone(stepping, without, with_all, kernel_of_all, of_all)


# -------------------------------------------------------------------- on workers


class Studied(NamedTuple):
    """Of a study: wall time, and CPU time of workers and client, in s."""

    wall: float
    workers: float
    client: float


def cpu() -> tuple[float, float]:
    """CPU time of the processes below this one, and of this one, in s."""
    below = psutil.Process().children(recursive=True)
    return sum(sum(process.cpu_times()[:2]) for process in below), time.process_time()


def studied(workers: int, runs: int) -> Studied:
    """A study on local workers that have been warmed up."""
    system = load(SCENARIO)
    points = [(number, changes(number)) for number in range(runs)]
    with (
        TemporaryDirectory() as folder,
        pool_for(packed({"scenario": SCENARIO}, [system], "auto"), None, workers) as pool,
    ):
        list(pool.rows(iter(points[:100]), len(points[:100])))
        dataset = Dataset(Path(folder), ["cruise.alpha"], [*system.judged.metrics, *system.judged.requirements], 0)
        before, begin = cpu(), time.perf_counter()
        for (number, changed), row in pool.rows(iter(points), runs):
            dataset.add(Entry(number, changed, row))
        dataset.flush()
        wall, after = time.perf_counter() - begin, cpu()
    return Studied(wall, after[0] - before[0], after[1] - before[1])


# -------------------------------------------------------------------- over FMPy


class Peer:
    """The system over FMPy, loaded once."""

    def __init__(self) -> None:
        self.held = ExitStack()
        self.workspace = self.held.enter_context(Workspace())
        self.revision = Revision(load(SCENARIO), self.workspace, "native")
        checked, self.stepping = self.revision.checked, self.revision.checked.system.stepping
        self.order, self.links = checked.order.sequence, checked.wiring.links
        self.slaves, self.variables = {}, {}
        folders: dict[str, str] = {}
        for name, model in checked.models.items():
            folder = folders.setdefault(str(model.path), fmpy.extract(str(model.path)))
            description = fmpy.read_model_description(folder, validate=False)
            self.variables[name] = model.interface.variables
            self.slaves[name] = FMU2Slave(
                guid=description.guid,
                unzipDirectory=folder,
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=name,
            )
            self.slaves[name].instantiate()
        sources: dict[str, dict[str, None]] = {name: {} for name in checked.models}
        for link in self.links:
            sources[link.source.instance][link.source.variable] = None
        self.reads = {name: self._by_type(name, list(wanted)) for name, wanted in sources.items()}
        self.feeds = {
            name: [
                (kind, references, [own[target] for target in targets])
                for own in [{x.target.variable: tuple(x.source) for x in self.links if x.target.instance == name}]
                for kind, targets, references in self._by_type(name, list(own))
            ]
            for name in checked.models
        }
        self.values: dict[tuple[str, str], float] = {}

    def _by_type(self, name: str, wanted: list[str]) -> list[tuple[str, list[str], list[int]]]:
        kinds: dict[str, list[str]] = {}
        for each in wanted:
            kinds.setdefault(self.variables[name][each].type, []).append(each)
        return [
            (kind, names, [self.variables[name][each].reference for each in names]) for kind, names in kinds.items()
        ]

    def read(self, name: str) -> None:
        for kind, names, references in self.reads[name]:
            for each, value in zip(names, getattr(self.slaves[name], f"get{kind}")(references), strict=True):
                self.values[name, each] = value

    def feed(self, name: str) -> None:
        for kind, references, sources in self.feeds[name]:
            getattr(self.slaves[name], f"set{kind}")(references, [self.values[source] for source in sources])

    def run(self, number: int) -> None:
        """One run; nothing of it is kept."""
        starts_of = self.revision.of(changes(number)).wiring.starts
        begin, step = self.stepping.start_time, self.stepping.step
        for name, slave in self.slaves.items():
            slave.reset()
            slave.setupExperiment(startTime=begin)
            starts = starts_of[name]
            for kind, names, references in self._by_type(name, list(starts)):
                getattr(slave, f"set{kind}")(references, [starts[each] for each in names])
            slave.enterInitializationMode()
        for _ in range(4):
            for name in self.order:
                self.read(name)
            for name in self.order:
                self.feed(name)
        for slave in self.slaves.values():
            slave.exitInitializationMode()
        for name in self.order:
            self.read(name)
        for k in range(round((self.stepping.stop_time - begin) / step)):
            for name in self.order:
                self.feed(name)
                self.slaves[name].doStep(begin + k * step, step)
                self.read(name)
        for slave in self.slaves.values():
            slave.terminate()


def peers_of(numbers: list[int]) -> None:
    """Runs over FMPy; where start values belong is found as fast as in a batch."""
    if "peer" not in KEPT:
        KEPT["peer"] = Peer()
    peer = KEPT["peer"]
    assert isinstance(peer, Peer)
    for number in numbers:
        peer.run(number)


def pooled(runs: int) -> float:
    """Wall time in s of so many runs over FMPy in a process pool after a warm-up."""
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        list(pool.map(peers_of, [[k] for k in range(2 * WORKERS)]))
        begin = time.perf_counter()
        list(pool.map(peers_of, [[k] for k in range(runs)]))
        return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="of the study")
    parser.add_argument("--peer-runs", type=int, default=8, help="of the study over FMPy, which is slower")
    given = parser.parse_args()
    runs, peers = given.runs, given.peer_runs
    here = alone()
    one, two, theirs = studied(1, runs), studied(WORKERS, runs), pooled(peers)
    mine, other = two.wall / runs, theirs / peers
    print("| study | runs | s | ms per run | CPU ms per run: workers | client | ratio |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, it in (("1 worker", one), (f"{WORKERS} workers", two)):
        shares = " | ".join(f"{1e3 * seconds / runs:.2f}" for seconds in it)
        print(f"| {name}, judged | {runs} | {it.wall:.2f} | {shares} | {it.wall / two.wall:.2f} |")
    peer = f"{theirs:.2f} | {1e3 * other:.2f} | | | {other / mine:.0f}"
    print(f"| FMPy, {WORKERS} processes, nothing judged | {peers} | {peer} |")
    print("\n| bounded | measured | bound |\n| --- | --- | --- |")
    beyond, slower = here.judged - here.stepping, here.batch_of_all / here.kernel_of_all
    print(f"| 1000 runs on {WORKERS} workers, judged | {1e3 * mine:.2f} s | 5 s |")
    print(f"| a run beyond its steps, judged | {1e3 * beyond:.2f} ms | 5 ms |")
    print(f"| {WORKERS} workers to one | {one.wall / two.wall:.2f} times | 1.8 times |")
    print(f"| {PLATOONS} platoons to the kernel's steps | {slower:.2f} times | 1.5 times |")


if __name__ == "__main__":
    main()
