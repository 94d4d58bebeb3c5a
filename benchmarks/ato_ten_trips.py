"""Stepping time of ten learning trips and of the fault-tolerant cruise, and the whole command.

    python benchmarks/ato_ten_trips.py                    # prints a markdown table
    python benchmarks/ato_ten_trips.py --repetitions 1 --no-whole

Native FMUs, each scenario with its own step and record. ``ten trips`` is ``cailc`` with timetable, line, ATO,
protection and train alone, ten trips of 190 s at 10 ms; the line is the train's own and a flat `Line` beside it.
Stepping is that of the step loop, wall and CPU time; the whole command is `orchestrate run` in a process of its own,
with results and figures written, and FMUs taken from the cache. Medians.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from railcosim.orchestrator import System, load
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.binding.libraries import forget_paths
from railcosim.orchestrator.master.loop import Master, Rows
from railcosim.orchestrator.run.checking import Checked, check
from railcosim.orchestrator.run.results import Recorder
from railcosim.orchestrator.system import Judged

GOALS = {
    "ten trips": 2.0,
    "cailc": None,
    "cailc_coupled": None,
    "fault_tolerant_cruise": 5.0,
    "fault_tolerant_eight": 20.0,
}
"""s of stepping."""
KEPT = {"timetable", "ato", "protection", "train"}


def ten_trips() -> System:
    """The five FMUs of the goal: ``cailc`` without its monitors, with a flat `Line` as an FMU."""
    system = load("cailc")
    for name in system.instances.keys() - KEPT:
        del system.instances[name]
    system.connections = [c for c in system.connections if c.target.split(".")[0] in KEPT]
    system.judged = Judged()
    system.add("line", "Line")
    system.connect("train.position", "line.position")
    system.connect("line.line_resistance", "train.line_resistance")
    return system


def stepped(system: System, checked: Checked) -> tuple[float, float, int]:
    """Wall and CPU seconds of all steps, recorded to memory as the scenario asks, and how many they are."""
    slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
    master = Master(
        slaves, checked.order.sequence, checked.wiring.links, checked.wiring.starts, system.stepping.algorithm
    )
    master.initialize(0.0, system.stepping.stop_time)
    recorder = Recorder(master.signals, master.kinds, None)

    def observe(_: int, rows: Rows) -> bool:
        recorder.extend(rows)
        return True

    every = 1 if system.stepping.record is None else round(system.stepping.record / system.stepping.step)
    count = round(system.stepping.stop_time / system.stepping.step)
    wall, cpu = time.perf_counter(), time.process_time()
    master.run(0.0, system.stepping.step, count, every, observe)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    for slave in slaves.values():
        slave.free()
    return wall, cpu, count


def measured(name: str, repetitions: int) -> str:
    """One row of the table."""
    system = ten_trips() if name == "ten trips" else load(name)
    stepping = system.stepping
    with Workspace() as workspace:
        checked = check(system, workspace, "native")
        walls, cpus, counts = zip(*(stepped(checked.system, checked) for _ in range(repetitions)), strict=True)
        forget_paths(workspace.folder)
    count, wall, goal = len(checked.models), statistics.median(walls), GOALS[name]
    cells = [
        name, count, f"{stepping.stop_time:g} s at {stepping.step:g} s", f"{stepping.record or stepping.step:g} s",
        f"{wall:.2f}", f"{min(walls):.2f} to {max(walls):.2f}", f"{statistics.median(cpus):.2f}",
        "" if goal is None else f"{goal:g}", f"{statistics.median(cpus) / counts[0] / count * 1e6:.2f}",
    ]  # fmt: skip
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def whole(name: str, repetitions: int) -> str:
    """Wall and CPU time of ``orchestrate run NAME``, files written."""
    code = "from railcosim.orchestrator.cli.app import main; main()"
    walls, cpus = [], []
    for _ in range(repetitions):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-c", code, "run", name, "--kind", "native", "-o", str(Path(folder) / "results")]
            before, begin = os.times(), time.perf_counter()
            subprocess.run(command, check=False, capture_output=True)
            walls.append(time.perf_counter() - begin)
            after = os.times()
            cpus.append(
                after.children_user - before.children_user + after.children_system - before.children_system,
            )
    return f"| {name} | {statistics.median(walls):.2f} | {statistics.median(cpus):.2f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=5, help="of each measurement")
    parser.add_argument("--only", action="append", choices=list(GOALS), help="one of them; may be given again")
    parser.add_argument("--no-whole", action="store_true", help="leave out the whole command")
    options = parser.parse_args()
    print("| scenario | FMUs | run | recorded every | stepping s | spread | CPU s | goal s | CPU µs per FMU step |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in options.only or GOALS:
        print(measured(name, options.repetitions), flush=True)
    if not options.no_whole:
        print("\n| command | wall s | CPU s |\n| --- | --- | --- |")
        for name in ("cailc", "fault_tolerant_cruise"):
            print(whole(name, options.repetitions).replace(f"| {name}", f"| `orchestrate run {name}`", 1), flush=True)
    sys.stdout.flush()
    os._exit(0)  # pythonfmu 0.7 may crash while C++ is torn down; see the command line's own end


if __name__ == "__main__":
    main()
