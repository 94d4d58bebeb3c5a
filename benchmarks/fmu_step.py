"""What one step of one FMU costs: set, doStep, get. Native against Python FMU, and against C by hand.

    python benchmarks/fmu_step.py

Two tables, CPU time, medians of interleaved repetitions. The first steps each component through the same raw ctypes
calls in both kinds; most of a native step is ctypes there. The second steps the point-mass train from a C program: the
native FMU, and the same equations written by hand behind the same three calls, without a check.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import fmpy
from railcosim.components import CATALOGUE
from railcosim.fmus.build import build
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.fmi.binding.libraries import library
from railcosim.orchestrator.fmi.models import load_fmu

HERE = Path(__file__).parent
HEADERS = Path(fmpy.__file__).parent / "c-code"
STEP = 0.1
C_STEPS = 3_000_000


class Stepper:
    """One FMU with its real inputs and outputs prepared for raw calls."""

    def __init__(self, path: Path, workspace: Workspace) -> None:
        model = load_fmu(path, workspace)
        self.slave = FmuSlave(path.stem, model.interface, model.folder)
        variables = model.interface.variables
        starts = {"sample_time": STEP} if "sample_time" in variables else {}
        if "tape_duration" in variables:
            starts["tape_duration"] = 1e4
        self.slave.setup(0.0, 1e9)
        for name, value in starts.items():
            self.slave.channel("Real", [name]).set([value])
        self.slave.enter_initialization()
        self.slave.exit_initialization()
        inputs = [v for v in model.interface.of("input") if v.type == "Real" and v.name != "trip_time"]
        outputs = [v for v in model.interface.of("output") if v.type == "Real"]
        self.set = self.slave.channel("Real", [v.name for v in inputs]) if inputs else None
        self.get = self.slave.channel("Real", [v.name for v in outputs])
        self.values = [v.start for v in inputs]
        self.trip_time = self.slave.channel("Real", ["trip_time"]) if "trip_time" in variables else None

    def run(self, steps: int) -> float:
        """CPU microseconds per step; the instance is freed after them."""
        begin = time.process_time()
        for k in range(steps):
            if self.set is not None:
                self.set.set(self.values)
            if self.trip_time is not None and self.slave.interface.variables["trip_time"].causality == "input":
                self.trip_time.set([k * STEP])
            self.slave.step(k * STEP, STEP)
            self.get.get()
        cost = 1e6 * (time.process_time() - begin) / steps
        self.slave.free()
        return cost


def components(repetitions: int, steps: int) -> None:
    """The first table."""
    print("| component | native, us | Python FMU, us | Python / native |\n| --- | --- | --- | --- |")
    with Workspace() as workspace:
        for name in CATALOGUE:
            paths = {"native": build(name, kind="native"), "python": build(name, kind="python")}
            times: dict[str, list[float]] = {kind: [] for kind in paths}
            for _ in range(repetitions):
                for kind, path in paths.items():
                    times[kind].append(Stepper(path, workspace).run(steps))
            native, python = (statistics.median(times[kind]) for kind in ("native", "python"))
            print(f"| {name} | {native:.2f} | {python:.1f} | {python / native:.0f} |", flush=True)


def against_c(repetitions: int) -> None:
    """The second table."""
    with Workspace() as workspace, tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        flags = ["-O2", "-ffp-contract=off", "-I", str(HEADERS)]
        subprocess.run(["cc", *flags, str(HERE / "bare_calls.c"), "-o", str(folder / "bare"), "-ldl"], check=True)
        by_hand = folder / "hand_written.so"
        subprocess.run(["cc", *flags, "-shared", "-fPIC", str(HERE / "hand_written.c"), "-o", str(by_hand)], check=True)
        model = load_fmu(build("PointMassTrain", kind="native"), workspace)
        variables = model.interface.variables
        names = ("force", "position", "speed", "acceleration")
        native = library(model.folder, model.interface, "PointMassTrain")
        commands = {
            "native FMU": [str(native), model.interface.guid, *(str(variables[n].reference) for n in names)],
            "C by hand": [str(by_hand), "-", "0", "1", "2", "3"],
        }
        times: dict[str, list[float]] = {name: [] for name in commands}
        speeds = {}
        for _ in range(repetitions):
            for name, (path, guid, *references) in commands.items():
                command = [str(folder / "bare"), path, guid, str(C_STEPS), *references]
                done = subprocess.run(command, check=True, capture_output=True, text=True)
                cost, speeds[name] = map(float, done.stdout.split())
                times[name].append(cost)
        assert abs(speeds["native FMU"] - speeds["C by hand"]) < 1e-6, speeds
    base = statistics.median(times["C by hand"])
    print("\n| bare C calls, point-mass train | us per step | ratio |\n| --- | --- | --- |")
    for name, costs in times.items():
        print(f"| {name} | {statistics.median(costs):.4f} | {statistics.median(costs) / base:.2f} |")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--steps", type=int, default=1000, help="steps in one repetition")
    arguments = parser.parse_args()
    components(arguments.repetitions, arguments.steps)
    against_c(arguments.repetitions)


if __name__ == "__main__":
    main()
