"""What starting costs: the commands of ``orchestrate`` from an empty shell to their end, beside importing NumPy.

    python benchmarks/startup.py

CPU time of the whole command (Python's own start, all its processes), FMUs in the cache, as a multiple of that of
``python -c "import numpy"``. The candidates take turns, so that a busy machine slows all alike; medians, and the
medians of the wall time for what it is worth on a machine that does other work. The exit code is 1 when a command
costs more than its bound.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time

ORCHESTRATE = "from railcosim.orchestrator.cli import main; main()"
BARE = ("-c", "import numpy")
RUN = ("run", "comfort_cruise", "-o", "results")
COMMANDS = {
    "--help": (2.0, ("--help",)),
    "list": (4.0, ("list",)),
    "run comfort_cruise --no-figures": (6.0, (*RUN, "--no-figures")),
    "run comfort_cruise": (12.0, RUN),
}
"""Bound, as a multiple of importing NumPy, and arguments."""


ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""With modules compiled, as those of an installed package are."""


def cost(arguments: tuple[str, ...], folder: str) -> tuple[float, float]:
    """CPU and wall time in s of one process of Python and all that it waits for."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        (sys.executable, *arguments), cwd=folder, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{arguments} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime, wall


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=15, help="of each candidate")
    repetitions = parser.parse_args().repetitions
    candidates = {"import numpy": BARE} | {name: ("-c", ORCHESTRATE, *rest) for name, (_, rest) in COMMANDS.items()}
    costs: dict[str, list[tuple[float, float]]] = {name: [] for name in candidates}
    with tempfile.TemporaryDirectory() as folder:
        for arguments in candidates.values():  # caches of FMUs, of fonts, of compiled Python
            cost(arguments, folder)
        for _ in range(repetitions):
            for name, arguments in candidates.items():
                costs[name].append(cost(arguments, folder))
    print("| command | CPU s | to `import numpy` | bound | wall s |\n| --- | --- | --- | --- | --- |")
    unit, slow = statistics.median(cpu for cpu, _ in costs["import numpy"]), False
    for name, measured in costs.items():
        cpu, wall = (statistics.median(column) for column in zip(*measured, strict=True))
        bound = COMMANDS[name][0] if name in COMMANDS else 1.0
        slow = slow or cpu > bound * unit
        print(f"| `{name}` | {cpu:.3f} | {cpu / unit:.2f} | {bound:g} | {wall:.3f} |")
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
