"""How often, and after how many runs, each method breaks a requirement of chasing cars: the ARCH competition's problem.

    python benchmarks/falsify.py [--seeds 10] [--budget 300] [cc1 cc2 cc4 ccx]

Each search begins from another seed. The median is over all of them; of one that did not break the requirement, all its
runs count, and "> 300" is a median of those.
"""

import argparse
import statistics
import tempfile
from functools import partial
from pathlib import Path

from railcosim.orchestrator import load
from railcosim.orchestrator.study.search import METHODS
from railcosim.orchestrator.study.search.falsification import search
from railcosim.orchestrator.study.search.preparation import prepared

SCENARIO = Path(__file__).with_name("chasing_cars.toml")
VARIED = ["throttle.value=signal(0, 1, 20)", "brake.value=signal(0, 1, 20)"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("requirements", nargs="*")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--budget", type=int, default=300)
    given = parser.parse_args()
    system = load(SCENARIO)
    names = given.requirements or list(system.judged.requirements)
    print("| requirement | " + " | ".join(METHODS) + " |")
    print("| --- |" + " --- |" * len(METHODS))
    for name in names:
        cells = []
        for method in METHODS:
            found = [one(system, name, method, seed, given.budget) for seed in range(given.seeds)]
            broken = sum(runs is not None for runs in found)
            median = statistics.median(given.budget + 1 if runs is None else runs for runs in found)
            shown = f"> {given.budget}" if median > given.budget else f"{median:g}"
            cells.append(f"{broken} of {given.seeds}, {shown}")
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def one(system, requirement, method, seed, budget):
    """After how many runs a search breaks the requirement, the nominal one not counted; None where it does not."""
    with tempfile.TemporaryDirectory() as folder, prepared(system, VARIED, folder, {}, workers=0) as ready:
        found = search(
            ready.space,
            ready.evaluations,
            requirement,
            budget=budget + 1,
            method=method,
            seed=seed,
            shrinking=0,
            slope=partial(ready.slopes.at, requirement),
        )
    return found.runs - 1 if found.found else None


if __name__ == "__main__":
    main()
