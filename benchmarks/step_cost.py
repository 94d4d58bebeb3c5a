"""Microseconds per FMU step: this master beside a plain FMPy loop on the same FMUs; and whole runs of the command.

    python benchmarks/step_cost.py            # step cost, prints a markdown table
    python benchmarks/step_cost.py --whole    # 'orchestrate run comfort_cruise', cold and warm

Both loops step the ten FMUs of ``comfort_cruise`` in the same order, with the same connections and step; that they end
at the same values is checked. The plain loop is FMPy's ``FMU2Slave`` as its examples use it: setReal, doStep, getReal
per FMU. CPU time of the process, set-up excluded; repetitions of all candidates are interleaved, so that a busy machine
slows all alike; medians.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from fmpy.fmi2 import FMU2Slave
from railcosim.orchestrator import load
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.binding.libraries import forget_paths
from railcosim.orchestrator.master.loop import Master, Rows
from railcosim.orchestrator.run.checking import Checked, check
from railcosim.orchestrator.run.recording import Recorder
from railcosim.orchestrator.system import System

SCENARIO = "comfort_cruise"
Measured = tuple[float, list[float]]
"""CPU seconds of the steps, and the position of every train at the end."""


def ours(system: System, checked: Checked, steps: int, *, record: bool) -> Measured:
    """The step loop of this package, with every output recorded at every step or with none."""
    slaves = {name: model.instantiate(name) for name, model in checked.models.items()}
    master = Master(
        slaves, checked.order.sequence, checked.wiring.links, checked.wiring.starts, system.stepping.algorithm
    )
    master.initialize(0.0, system.stepping.stop_time)
    recorder = Recorder(master.signals, master.kinds, None)

    def observe(_: int, rows: Rows) -> bool:
        recorder.extend(rows)
        return True

    begin = time.process_time()
    master.run(0.0, system.stepping.step, steps, 1 if record else steps, observe)
    seconds = time.process_time() - begin
    ends = [v for n, v in zip(master.signals, master.values, strict=True) if n.startswith("train") and "position" in n]
    for slave in slaves.values():
        slave.free()
    return seconds, ends


def plain(system: System, checked: Checked, steps: int) -> Measured:
    """The loop that everybody writes with FMPy. Only connected outputs are read; nothing is recorded."""
    fmus, inputs, outputs = {}, {}, {}
    values: dict[tuple[str, str], float] = {}
    for name, model in checked.models.items():
        face = model.interface
        fmu = FMU2Slave(
            guid=face.guid, unzipDirectory=str(model.folder), modelIdentifier=face.identifier, instanceName=name
        )
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0, stopTime=system.stepping.stop_time)
        for variable, value in checked.wiring.starts[name].items():
            setter = fmu.setReal if face.variables[variable].type == "Real" else fmu.setBoolean
            setter([face.variables[variable].reference], [value])
        fmu.enterInitializationMode()
        links = [link for link in checked.wiring.links if link.target[0] == name]
        inputs[name] = [face.variables[link.target[1]].reference for link in links], [link.source for link in links]
        read = sorted({link.source[1] for link in checked.wiring.links if link.source[0] == name})
        outputs[name] = [face.variables[n].reference for n in read], [(name, n) for n in read]
        fmus[name] = fmu

    def get(name: str) -> None:
        references, keys = outputs[name]
        if references:
            values.update(zip(keys, fmus[name].getReal(references), strict=True))

    def put(name: str) -> None:
        references, keys = inputs[name]
        if references:
            fmus[name].setReal(references, [values[key] for key in keys])

    order = checked.order.sequence
    for name in order:
        get(name)
    for name in order * 3:  # initial values travel through the connections
        put(name)
        get(name)
    for fmu in fmus.values():
        fmu.exitInitializationMode()
    begin = time.process_time()
    for k in range(steps):
        now = k * system.stepping.step
        for name in order:
            put(name)
            fmus[name].doStep(currentCommunicationPoint=now, communicationStepSize=system.stepping.step)
            get(name)
    seconds = time.process_time() - begin
    ends = [
        value for (name, variable), value in sorted(values.items()) if name[:5] == "train" and variable == "position"
    ]
    for fmu in fmus.values():
        fmu.terminate()
        fmu.freeInstance()
    return seconds, ends


def step_cost(steps: int, repetitions: int, kinds: list[str]) -> None:
    """Print the table of microseconds per FMU step."""
    print("| FMUs | loop | µs per FMU step | spread | to the plain loop |")
    print("| --- | --- | --- | --- | --- |")
    for kind in kinds:
        system = load(SCENARIO, stop_time=steps * 0.1)
        with Workspace() as workspace:
            checked = check(system, workspace, kind)  # type: ignore[arg-type]
            candidates: dict[str, Callable[[], Measured]] = {
                "plain FMPy loop, nothing recorded": lambda: plain(system, checked, steps),  # noqa: B023
                "ours, nothing recorded": lambda: ours(system, checked, steps, record=False),  # noqa: B023
                "ours, every output recorded": lambda: ours(system, checked, steps, record=True),  # noqa: B023
            }
            costs: dict[str, list[float]] = {name: [] for name in candidates}
            ends = {}
            for _ in range(repetitions):
                for name, candidate in candidates.items():
                    seconds, ends[name] = candidate()
                    costs[name].append(seconds / steps / len(system.instances) * 1e6)
            first, *others = ends.values()
            if any(other != first for other in others):
                raise SystemExit(f"the loops disagree, so the comparison is worth nothing: {ends}")
            base = statistics.median(next(iter(costs.values())))
            for name, cost in costs.items():
                median = statistics.median(cost)
                spread = f"{min(cost):.2f} to {max(cost):.2f}"
                print(f"| {kind} | {name} | {median:.2f} | {spread} | {median / base:.2f} |")
            forget_paths(workspace.folder)


def whole(repetitions: int, kinds: list[str]) -> None:
    """Print the table of whole runs: a new process, FMUs built or taken from the cache, results and figures written."""
    print("| FMUs | cache | wall s | CPU s |")
    print("| --- | --- | --- | --- |")
    for kind in kinds:
        seconds: dict[str, list[tuple[float, float]]] = {"cold": [], "warm": []}
        for _ in range(repetitions):
            with tempfile.TemporaryDirectory() as folder:
                for measured in seconds.values():  # the first run in a new cache is the cold one
                    measured.append(_run(kind, Path(folder)))
        for cache, pairs in seconds.items():
            wall, cpu = (statistics.median(column) for column in zip(*pairs, strict=True))
            print(f"| {kind} | {cache} | {wall:.2f} | {cpu:.2f} |")


def _run(kind: str, folder: Path) -> tuple[float, float]:
    code = "from railcosim.orchestrator.cli.app import main; main()"
    command = [sys.executable, "-c", code, "run", SCENARIO, "--kind", kind, "-o", str(folder / "results")]
    environment = os.environ | {"RAILCOSIM_CACHE": str(folder / "cache")}
    before, begin = os.times(), time.perf_counter()
    subprocess.run(command, env=environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - begin, os.times()
    return wall, after.children_user - before.children_user + after.children_system - before.children_system


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--whole", action="store_true", help="time the command instead of the step loop")
    parser.add_argument("--steps", type=int, default=3500, help="communication steps of a repetition")
    parser.add_argument("--repetitions", type=int, default=7, help="of each candidate")
    parser.add_argument("--kind", action="append", help="kind of FMUs, such as python; may be given again")
    options = parser.parse_args()
    kinds = options.kind or ["python"]
    if options.whole:
        whole(options.repetitions, kinds)
    else:
        step_cost(options.steps, options.repetitions, kinds)
    sys.stdout.flush()
    os._exit(0)  # pythonfmu 0.7 may crash while C++ is torn down; see the command line's own end


if __name__ == "__main__":
    main()
