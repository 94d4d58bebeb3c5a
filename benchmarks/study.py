"""What many runs of one scenario cost: a `Batch`, beside the kernel's own stepping and beside FMPy in a process pool.

    python benchmarks/study.py
    python benchmarks/study.py --runs 100 --peer-runs 4

1. One process: wall time of a run of `comfort_cruise` (3500 steps of 10 FMUs) whose gain and seed are changed, of its
   communication steps alone, and what lies between them; without metrics and requirements, and with them.
2. Two processes, each with a batch of its own: the whole study, metrics and requirements judged, nothing recorded.
3. The same study over FMPy: the same FMUs, connections, order and process pool, each FMU loaded once and reset for
   every run, set, doStep and get by FMPy's calls, nothing recorded and nothing judged.

The candidates of 1 take turns, so that a busy machine slows all alike, and the least of each counts.
"""

from __future__ import annotations

import argparse
import random
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from multiprocessing import get_context

import fmpy
from fmpy.fmi2 import FMU2Slave
from railcosim.orchestrator import Batch, load
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.run import Repeater, Revision, check, listening

SCENARIO, WORKERS = "comfort_cruise", 2
KEPT: dict[str, object] = {}
"""What a worker process keeps from task to task."""


def changes(number: int) -> dict[str, float | int]:
    """What a run changes."""
    draw = random.Random(number)
    return {"cruise.alpha": draw.uniform(0.01, 0.05), "simulation.seed": draw.randrange(2**31)}


def alone(runs: int) -> None:
    """Print what a run costs in this process, least of all."""
    system = load(SCENARIO)
    least = {False: float("inf"), True: float("inf")}
    with Batch(system, evaluate=False) as bare, Batch(system) as judged:
        for number in range(runs):
            for batch in (bare, judged):
                begin = time.perf_counter()
                row = batch.run(changes(number))
                seconds = time.perf_counter() - begin
                least[batch is judged] = min(least[batch is judged], seconds if number else float("inf"))
    stepping = min(stepped(runs))
    print("| one run | ms | beyond its steps, ms | to its steps alone |\n| --- | --- | --- | --- |")
    for name, seconds in (
        ("its steps alone", stepping),
        ("a batch", least[False]),
        ("a batch that judges", least[True]),
    ):
        print(f"| {name} | {1e3 * seconds:.2f} | {1e3 * (seconds - stepping):.2f} | {seconds / stepping:.2f} |")
    print(f"\n{row.steps / stepping:.3g} steps per second by the kernel, {row.steps / least[False]:.3g} by a batch\n")


def stepped(runs: int) -> list[float]:
    """Wall time in s of the steps of each run alone."""
    with Workspace() as workspace, listening() as nobody:
        checked = check(load(SCENARIO), workspace)
        repeater = Repeater(checked, [])
        found = [flown.stepping for _ in range(runs) if (flown := repeater.fly(checked, nobody)) is not None]
        repeater.crew.dismiss()
    return found


# -------------------------------------------------------------------- in processes


def batch_of(numbers: list[int]) -> int:
    """Runs of a batch that this process keeps; how many met every requirement."""
    if "batch" not in KEPT:
        KEPT["batch"] = Batch(load(SCENARIO))
    batch = KEPT["batch"]
    assert isinstance(batch, Batch)
    return sum(row.passed for row in batch.run_all(map(changes, numbers)).rows)


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


def pooled(work: object, runs: int, chunk: int) -> float:
    """Wall time in s of so many runs in a process pool after a warm-up."""
    with ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) as pool:
        list(pool.map(work, [[k, k + 1] for k in range(4 * WORKERS)]))  # type: ignore[arg-type]
        chunks = [list(range(k, min(k + chunk, runs))) for k in range(0, runs, chunk)]
        begin = time.perf_counter()
        list(pool.map(work, chunks))  # type: ignore[arg-type]
        return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="of the study")
    parser.add_argument("--peer-runs", type=int, default=8, help="of the study over FMPy, which is slower")
    given = parser.parse_args()
    alone(min(given.runs, 100))
    ours = pooled(batch_of, given.runs, max(1, given.runs // (10 * WORKERS)))
    theirs = pooled(peers_of, given.peer_runs, max(1, given.peer_runs // WORKERS))
    mine, other = ours / given.runs, theirs / given.peer_runs
    print(f"| {WORKERS} processes | runs | s | ms per run | ratio |\n| --- | --- | --- | --- | --- |")
    print(f"| batches, judged | {given.runs} | {ours:.2f} | {1e3 * mine:.2f} | 1 |")
    print(f"| FMPy, nothing judged | {given.peer_runs} | {theirs:.2f} | {1e3 * other:.2f} | {other / mine:.0f} |")


if __name__ == "__main__":
    main()
