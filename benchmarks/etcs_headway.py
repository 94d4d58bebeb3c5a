"""What moving block and virtual coupling cost each cruise law in headway: a table, and a picture where one is named.

    python benchmarks/etcs_headway.py [PICTURE]

The scenario `virtual_coupling` with each law; its gains and its gap are chosen here: 600 m, which two laws keep
at 25 m/s and in proportion to the speed from 100 m on.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from railcosim.orchestrator import run
from railcosim.orchestrator.scenario.loading import loads

SCENARIO = Path(__file__).parents[1] / "models" / "virtual_coupling.toml"

LAWS = {
    "consensus, fixed distance": ("FixedDistanceCruise", {}),
    "tunable potential": (
        "TunablePotentialCruise",
        {"gap_base": 600.0, "gap_time": 0.0, "gap_braking": 1e9, "pull_limit": 0.5, "gap_width": 80.0,
         "gap_tolerance": 20.0, "rho": 0.0, "k": 0.02, "alpha": 0.2, "acceleration_limit": 0.6},
    ),
    "range potential": (
        "RangePotentialCruise",
        {"gap_min": 450.0, "gap_max": 750.0, "low_margin": 77.0, "high_margin": 42.0, "rho": 0.0, "k": 0.02,
         "alpha": 0.2, "acceleration_limit": 0.6},
    ),
    "comfort-aware potential": (
        "ComfortCruise",
        {"gap_min": 400.0, "gap_max": 800.0, "gamma": 5e4, "alpha": 0.02, "beta": 0.2, "acceleration_limit": 0.6},
    ),
    "constant time headway": (
        "TimeHeadwayCruise", {"standstill_gap": 100.0, "time_headway": 20.0, "k": 0.02, "acceleration_limit": 0.6},
    ),
    "predictive, without plans": (
        "DistributedMpc",
        {"standstill_gap": 100.0, "time_headway": 20.0, "gap_margin": 0.0, "braking": 0.6, "ahead_braking": 1.3},
    ),
}  # fmt: skip
PRESETS = {"the law alone": "uncoupled", "relative": None, "absolute": "absolute"}


def headway(law: str, preset: str | None) -> tuple[float, float, float, list[str]]:
    """Mean headway in s, least gap in m, seconds of intervention, and the requirements that fail."""
    component, values = LAWS[law]
    swaps = [] if component == "FixedDistanceCruise" else [f"cruise={component}"]
    text = SCENARIO.read_text(encoding="utf-8")
    if swaps:  # the desired gap of another law is one of its states
        text = text.replace("start.desired_gap", "# ")
    settings = [f"cruise.{name}={value}" for name, value in values.items()]
    result = run(loads(text, SCENARIO, preset=preset, swaps=swaps, settings=settings))
    found = {metric.name: list(metric.values.values()) for metric in result.metrics}
    braked = sum(found["service_braked"]) + sum(found["emergency_braked"])
    failed = [verdict.name for verdict in result.requirements if verdict.verdict != "pass"]
    return float(np.mean(found["headway_mean"])), min(found["gap_min"]), braked, failed


def main() -> None:
    heads = ["law", *(f"{name}: headway s, least gap m" for name in PRESETS), "costs relative, absolute s", "fails"]
    print(f"| {' | '.join(heads)} |", "| --- " * len(heads) + "|", sep="\n")
    headways = []
    for law in LAWS:
        rows = [headway(law, preset) for preset in PRESETS.values()]
        headways.append([row[0] for row in rows])
        cells = [f"{h:.1f}, {gap:.0f}" + (f" ({braked:.0f} s braked)" if braked else "") for h, gap, braked, _ in rows]
        failed = sorted({name for row in rows for name in row[3]})
        cost = f"{rows[1][0] - rows[0][0]:.1f}, {rows[2][0] - rows[0][0]:.1f}"
        print(f"| {law} | {' | '.join(cells)} | {cost} | {', '.join(failed) or 'none'} |")
    if sys.argv[1:]:
        mpl.use("Agg")
        figure, axes = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
        for k, name in enumerate(PRESETS):
            axes.bar(np.arange(len(LAWS)) + 0.27 * (k - 1), [row[k] for row in headways], 0.25, label=name)
        axes.set_xticks(range(len(LAWS)), [law.replace(" ", "\n", 1) for law in LAWS])
        axes.set(ylabel="mean headway, front to front [s]", ylim=(0.0, 60.0))
        axes.legend(loc="upper left", ncols=3)
        figure.savefig(sys.argv[1], dpi=110)


if __name__ == "__main__":
    main()
